//! The library of scenes: our own, as Mitsuba 3 XML with generated meshes.
//!
//! The XML is part of the binary; every mesh is computed when asked for, by the generators of
//! [`mesh`], [`revolve`] and [`heightfield`], so that what is rendered from memory and what
//! [`LibraryScene::export`] writes are the same bytes.
//!
//! ```
//! let scene = pathspace_scenes::library::find("ring-caustic").unwrap();
//! let files = scene.files();
//! assert_eq!(files[0].path, "scene.xml");
//! assert_eq!(files[1].path, "models/ring.obj");
//! ```

mod catalogue;
mod export;
pub mod heightfield;
pub mod mesh;
mod models;
pub mod revolve;
#[cfg(test)]
mod tests;

pub use export::LibraryError;

use std::path::Path;

use mesh::Mesh;

use crate::source::Memory;
use crate::{LoadedScene, SceneFileError};

/// A scene of the library.
///
/// All scenes take the parameters `res` (pixels a side), `spp`, `max_depth` (Mitsuba's meaning:
/// 1 = emission only, −1 = unlimited) and `integrator`; some take more, named at the top of
/// their XML.
#[derive(Debug)]
pub struct LibraryScene {
    /// Name on the command line.
    pub name: &'static str,
    /// What the scene shows and what is hard about it, one sentence.
    pub summary: &'static str,
    xml: &'static str,
    meshes: &'static [MeshFile],
}

/// A mesh file that is generated when asked for.
#[derive(Debug)]
struct MeshFile {
    path: &'static str,
    generate: fn() -> Mesh,
}

/// A file of a scene, in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneFile {
    /// Path relative to the scene's directory, with `/` between its parts.
    pub path: String,
    /// Content.
    pub bytes: Vec<u8>,
}

/// All scenes of the library, the one that `pathspace` shows first in front.
pub fn all() -> &'static [LibraryScene] {
    catalogue::SCENES
}

/// The scene called `name`, if there is one.
pub fn find(name: &str) -> Option<&'static LibraryScene> {
    all().iter().find(|scene| scene.name == name)
}

impl LibraryScene {
    /// The scene as Mitsuba 3 XML; it refers to its meshes by paths relative to itself.
    pub fn xml(&self) -> &'static str {
        self.xml
    }

    /// The meshes with the paths by which the XML refers to them.
    pub fn meshes(&self) -> impl Iterator<Item = (&'static str, Mesh)> {
        self.meshes.iter().map(|file| (file.path, (file.generate)()))
    }

    /// Reads the scene from memory, with `params` for its `default`s, as [`crate::load`] reads
    /// the exported files.
    ///
    /// # Errors
    /// A parameter whose value does not fit where it is used.
    pub fn load(&self, params: &[(String, String)]) -> Result<LoadedScene, SceneFileError> {
        let mut source = Memory::new();
        for file in self.files() {
            source.insert(Path::new(self.name).join(file.path), file.bytes);
        }
        crate::load_from(&source, &Path::new(self.name).join("scene.xml"), params)
    }

    /// All files of the scene: `scene.xml`, then its meshes as OBJ.
    pub fn files(&self) -> Vec<SceneFile> {
        let xml = SceneFile { path: "scene.xml".into(), bytes: self.xml.as_bytes().to_vec() };
        let meshes = self
            .meshes()
            .map(|(path, mesh)| SceneFile { path: path.into(), bytes: mesh.to_obj().into_bytes() });
        std::iter::once(xml).chain(meshes).collect()
    }
}
