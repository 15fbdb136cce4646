//! pathspace: a framework for research in bidirectional and Metropolis light transport.
//!
//! This crate is the front door: it hands on the crates of the workspace, and holds the command.
//!
//! | Room | What is in it |
//! | --- | --- |
//! | [`core`] | light transport itself: measures, geometry, scattering, paths, film |
//! | [`integrators`] | the algorithms, each readable alone |
//! | [`scenes`] | the reader of Mitsuba scenes and the library of scenes |
//! | [`validation`] | statistics that tell whether integrators agree, scenes with exact answers |
//! | [`benches`] | budgets, replicates, comparisons, image files |
//!
//! A render from Rust:
//!
//! ```
//! use std::ops::ControlFlow;
//! use std::sync::Arc;
//!
//! use pathspace::benches::{Budget, expose};
//! use pathspace::core::{Scene, film::Layers};
//! use pathspace::integrators::{Defaults, Registry};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let furnace = pathspace::scenes::library::find("furnace").ok_or("no such scene")?;
//! let loaded = furnace.load(&[("res".into(), "8".into())])?;
//! let scene = Arc::new(Scene::new(&loaded.description)?);
//! let integrator = Registry::builtin().create(&"pt:max_depth=3".parse()?, &Defaults::default())?;
//! let budget = Budget::Samples(4);
//! let exposed =
//!     expose(&*integrator, &scene, Layers::NONE, 1, budget, &mut |_| ControlFlow::Continue(()))?;
//! assert!(exposed.film.mean()[0] > 0.0);
//! # Ok(())
//! # }
//! ```
//!
//! The command with an integrator of your own is one line, because everything in it takes a
//! [`Registry`](integrators::Registry):
//!
//! ```no_run
//! use pathspace::integrators::Registry;
//!
//! fn main() -> std::process::ExitCode {
//!     pathspace::cli::run(Registry::builtin()) // .with("mine", "what it does", |spec, defaults| …)
//! }
//! ```

pub use pathspace_benches as benches;
pub use pathspace_core as core;
pub use pathspace_integrators as integrators;
pub use pathspace_scenes as scenes;
pub use pathspace_validation as validation;

pub mod cli;
