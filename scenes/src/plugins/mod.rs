//! From the objects of a file to the plain data of [`pathspace_core::description`]; one file for
//! each class of plug-ins.

mod bsdf;
mod emitter;
mod film;
mod group;
mod integrator;
mod ior;
mod medium;
mod metals;
mod props;
mod scene;
mod sensor;
mod shape;
mod sky;
mod spectrum;
mod support;
mod texture;
mod tube;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use integrator::RenderDefaults;
pub(crate) use scene::read_scene;

use pathspace_core::texture::Bitmap;

use crate::bitmap;
use crate::error::{Place, Result, SceneFileError};
use crate::mesh::RawMesh;
use crate::note::{NoteKind, Notes};
use crate::xml::{Files, Graph};

/// What the readers of plug-ins share.
pub(crate) struct Context<'a> {
    pub(crate) graph: &'a Graph,
    pub(crate) files: Files<'a>,
    pub(crate) notes: Notes,
    /// Mesh files that were read already.
    pub(crate) meshes: HashMap<(PathBuf, u32), Arc<RawMesh>>,
    /// Files of which several objects take a part.
    shared: HashMap<PathBuf, Arc<Vec<u8>>>,
    /// Images by path and rawness.
    bitmaps: HashMap<(PathBuf, bool), Arc<Bitmap>>,
    /// Triangles so far, copies counted.
    pub(crate) triangles: u64,
}

impl<'a> Context<'a> {
    pub(crate) fn new(graph: &'a Graph, files: Files<'a>, notes: Notes) -> Self {
        let (meshes, shared, bitmaps) = (HashMap::new(), HashMap::new(), HashMap::new());
        Context { graph, files, notes, meshes, shared, bitmaps, triangles: 0 }
    }

    /// Contents of a file that is read once for all objects that name it.
    fn shared_file(&mut self, path: &Path, place: &Place) -> Result<Arc<Vec<u8>>> {
        if let Some(bytes) = self.shared.get(path) {
            return Ok(bytes.clone());
        }
        let bytes = Arc::new(self.files.read(path, place)?);
        self.files.hash(&bytes);
        self.shared.insert(path.into(), bytes.clone());
        Ok(bytes)
    }

    /// The image of this name; see [`bitmap::decode`].
    fn bitmap(&mut self, name: &str, raw: bool, place: &Place) -> Result<Arc<Bitmap>> {
        let path = self.files.resolve(name);
        if let Some(bitmap) = self.bitmaps.get(&(path.clone(), raw)) {
            return Ok(bitmap.clone());
        }
        let bytes = self.files.read(&path, place)?;
        self.files.hash(&bytes);
        let bitmap = bitmap::decode(&bytes, name, raw).map_err(|reason| SceneFileError::Image {
            place: place.clone(),
            file: path.display().to_string(),
            reason,
        })?;
        let bitmap = Arc::new(bitmap);
        self.bitmaps.insert((path, raw), bitmap.clone());
        Ok(bitmap)
    }

    /// Adds a note; the same text is kept once, with the first place and a count.
    pub(crate) fn note(&mut self, kind: NoteKind, text: impl Into<String>, place: &Place) {
        self.notes.add(kind, text, place);
    }
}
