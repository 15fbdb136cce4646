//! The path-space core: light transport itself, without algorithms and file formats.
//!
//! A path x̄ = x₀x₁…x_k starts on an emitter and ends on the sensor; a pixel is I_j = ∫_Ω f_j(x̄)
//! dμ(x̄) over the space of all paths with the product area measure. This crate holds the terms of
//! that integral: measures ([`measure`]), geometry and visibility ([`geometry`], [`scene`]),
//! scattering ([`bsdf`], [`medium`]), [`texture`]s, emission ([`emitter`]), the sensor
//! ([`sensor`]), densities and weights ([`path`], [`mis`]) and the [`film`]; and the seams that
//! algorithms plug into ([`integrator`]).

pub mod bsdf;
pub mod color;
pub mod description;
pub mod driver;
pub mod emitter;
mod error;
pub mod film;
pub mod geometry;
pub mod integrator;
pub mod math;
pub mod measure;
pub mod medium;
pub mod mis;
mod normalisation;
pub mod path;
pub mod random;
mod rays;
pub mod scene;
pub mod sensor;
pub mod texture;
mod vertex;
pub mod walk;

pub use color::Rgb;
/// Vectors of the public items, re-exported so that a plug-in need not name their version.
pub use glam;
pub use scene::{Scene, SceneError};
