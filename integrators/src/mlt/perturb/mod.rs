//! Perturbations: small moves of a part of the path, with everything specular followed (Veach 1997,
//! §11.4.3).

mod caustic;
mod kernel;
mod sensor_side;
mod walk;

pub use caustic::Caustic;
pub use kernel::LogUniform;
pub use sensor_side::{Lens, MultiChain};
pub(in crate::mlt) use sensor_side::{Plan, SensorSide};
pub(in crate::mlt) use walk::same_kind;

use std::f64::consts::PI;

use pathspace_core::Scene;

/// How far perturbations go on the film (Veach 1997, §11.4.3.1: 0.1 pixels to a disk of 5 % of the
/// film).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes {
    /// Smallest distance in pixels.
    pub smallest: f64,
    /// Area of the disk of the largest distance over the area of the film.
    pub area: f64,
}

impl Default for Sizes {
    fn default() -> Self {
        Sizes { smallest: 0.1, area: 0.05 }
    }
}

impl Sizes {
    /// Distances on this scene's film, in pixels.
    pub fn on_film(&self, scene: &Scene) -> LogUniform {
        let crop = scene.sensor().crop();
        let max = (self.area * f64::from(crop.width) * f64::from(crop.height) / PI).sqrt();
        LogUniform { min: self.smallest.min(0.01 * max), max }
    }
}
