//! Where the built scene lies in the world, and how far it reaches.

use glam::{DVec3, Vec3};

/// World → normalised: x' = (x − center)·scale. Radiance, irradiance and angles do not change;
/// radiant intensity scales by scale².
///
/// Both steps are exact for coordinates that are f32: the scale is a power of two, and the shift is
/// 0 along each axis on which the surfaces are not farther from the origin than from each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normalisation {
    /// World coordinates of the normalised scene's origin.
    pub center: DVec3,
    /// Power of two that brings the radius of the surfaces to between ½ and 1.
    pub scale: f64,
}

/// A ball that holds every surface and the lens, if it has an area: what beams from infinity cover.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Centre in the normalised scene.
    pub center: Vec3,
    /// Radius in the normalised scene, with room for rounding.
    pub radius: f32,
}

impl Default for Normalisation {
    fn default() -> Self {
        Normalisation { center: DVec3::ZERO, scale: 1.0 }
    }
}

impl Default for Ball {
    fn default() -> Self {
        Ball { center: Vec3::ZERO, radius: 1.0 }
    }
}
