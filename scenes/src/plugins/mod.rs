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

use std::collections::{BTreeSet, HashMap};
use std::path::PathBuf;
use std::sync::Arc;

pub use integrator::RenderDefaults;
pub(crate) use scene::read_scene;

use crate::error::{Known, Place, SceneFileError};
use crate::mesh::RawMesh;
use crate::xml::{Files, Graph, Object};

/// What the readers of plug-ins share.
pub(crate) struct Context<'a> {
    pub(crate) graph: &'a Graph,
    pub(crate) files: Files<'a>,
    pub(crate) warnings: Vec<String>,
    warned: BTreeSet<String>,
    /// Mesh files that were read already.
    pub(crate) meshes: HashMap<PathBuf, Arc<RawMesh>>,
}

impl<'a> Context<'a> {
    pub(crate) fn new(graph: &'a Graph, files: Files<'a>) -> Self {
        let warnings = graph.notes.clone();
        let (warned, meshes) = (BTreeSet::new(), HashMap::new());
        Context { graph, files, warnings, warned, meshes }
    }

    /// Adds a warning with the place where it arises.
    pub(crate) fn warn(&mut self, text: &str, place: &Place) {
        self.warnings.push(format!("{place}: {text}"));
    }

    /// The same, but only for the first place.
    pub(crate) fn warn_once(&mut self, text: &str, place: &Place) {
        if self.warned.insert(text.into()) {
            self.warn(text, place);
        }
    }
}

/// A plug-in type that is not understood.
fn unknown_plugin(object: &Object, known: &[&str]) -> SceneFileError {
    SceneFileError::Plugin {
        place: object.place.clone(),
        class: object.class.into(),
        plugin: object.plugin.clone(),
        known: Known::new(known.iter().copied()),
    }
}
