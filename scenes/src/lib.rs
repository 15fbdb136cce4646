//! Scenes of pathspace: a reader of Mitsuba 3 scene files and the scenes that come with the
//! program.
//!
//! ```
//! use pathspace_scenes::{load_str, source::Memory};
//!
//! let text = r#"<scene version="3.0.0">
//!     <default name="depth" value="4"/>
//!     <integrator type="path"><integer name="max_depth" value="$depth"/></integrator>
//!     <shape type="sphere"><emitter type="area"/></shape>
//! </scene>"#;
//! let params = [("depth".to_string(), "8".to_string())];
//! let scene = load_str(text, "one-sphere.xml", &Memory::new(), &params)?;
//! assert_eq!(scene.defaults.max_depth, Some(8));
//! assert_eq!(scene.description.shapes.len(), 1);
//!
//! let error = load_str("<scene version=\"3.0.0\">\n<lamp/></scene>", "a.xml", &Memory::new(), &[]);
//! assert!(error.unwrap_err().to_string().starts_with("a.xml:2: element <lamp> is not understood"));
//! # Ok::<(), pathspace_scenes::SceneFileError>(())
//! ```
//!
//! `scenes/README.md` lists what is understood and which facts about Mitsuba 3.9.1 it follows.
#![warn(missing_docs)]

mod bitmap;
pub mod error;
pub mod floats;
pub mod library;
mod load;
mod mesh;
mod note;
mod numbers;
mod place;
mod plugins;
pub mod source;
mod spectrum;
mod xml;

pub use error::SceneFileError;
pub use load::{LoadOptions, LoadedScene, load, load_from, load_str, load_with};
pub use note::{Note, NoteKind};
pub use plugins::RenderDefaults;
