//! Rays in the normalised scene.

use glam::Vec3;

/// Half-line o + t·d for t in (`tmin`, `tmax`); `d` need not have unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin.
    pub o: Vec3,
    /// Direction.
    pub d: Vec3,
    /// Hits at t ≤ `tmin` do not count.
    pub tmin: f32,
    /// Hits at t ≥ `tmax` do not count.
    pub tmax: f32,
}

impl Ray {
    /// Unbounded ray (0, ∞).
    pub fn new(o: Vec3, d: Vec3) -> Self {
        Ray { o, d, tmin: 0.0, tmax: f32::INFINITY }
    }

    /// Point at parameter `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.o + self.d * t
    }
}
