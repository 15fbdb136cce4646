//! Rays in the normalised scene.

use glam::Vec3;

/// Marks [`Ray::from`] of rays that start on no triangle.
pub const NO_PRIM: u32 = u32::MAX;

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
    /// The triangle that the ray starts on, which it does not meet again; [`NO_PRIM`] where it
    /// starts on none.
    pub from: u32,
}

impl Ray {
    /// Unbounded ray (0, ∞).
    pub fn new(o: Vec3, d: Vec3) -> Self {
        Ray { o, d, tmin: 0.0, tmax: f32::INFINITY, from: NO_PRIM }
    }

    /// Point at parameter `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.o + self.d * t
    }
}
