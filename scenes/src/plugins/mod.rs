//! From the objects of a file to the plain data of [`pathspace_core::description`]; one file for
//! each class of plug-ins.

mod bsdf;
mod emitter;
mod film;
mod integrator;
mod ior;
mod metals;
mod props;
mod scene;
mod sensor;
mod shape;
mod spectrum;
mod support;
mod tube;

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

pub use integrator::RenderDefaults;
pub(crate) use scene::read_scene;

use crate::error::Place;
use crate::mesh::RawMesh;
use crate::note::{NoteKind, Notes};
use crate::xml::{Files, Graph};

/// What the readers of plug-ins share.
pub(crate) struct Context<'a> {
    pub(crate) graph: &'a Graph,
    pub(crate) files: Files<'a>,
    pub(crate) notes: Notes,
    /// Mesh files that were read already.
    pub(crate) meshes: HashMap<PathBuf, Arc<RawMesh>>,
}

impl<'a> Context<'a> {
    pub(crate) fn new(graph: &'a Graph, files: Files<'a>, notes: Notes) -> Self {
        Context { graph, files, notes, meshes: HashMap::new() }
    }

    /// Adds a note; the same text is kept once, with the first place and a count.
    pub(crate) fn note(&mut self, kind: NoteKind, text: impl Into<String>, place: &Place) {
        self.notes.add(kind, text, place);
    }
}
