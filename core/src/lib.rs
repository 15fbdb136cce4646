//! The path-space core: light transport itself, without algorithms and file formats.
#![warn(missing_docs)]

pub mod bsdf;
pub mod color;
pub mod description;
pub mod geometry;
pub mod math;
pub mod measure;

pub use color::Rgb;
