//! Scenes of pathspace: a reader of Mitsuba 3 scene files and the scenes that come with the program.
#![warn(missing_docs)]

pub mod error;
mod load;
mod mesh;
mod plugins;
pub mod source;
mod xml;

pub use error::SceneFileError;
pub use load::{LoadedScene, load, load_from, load_str};
pub use plugins::RenderDefaults;
