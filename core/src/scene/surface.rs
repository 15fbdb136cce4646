//! Points on surfaces.

use glam::Vec3;

use crate::geometry::offset_origin;
use crate::math::{Frame, Ray};
use crate::measure::End;

/// Marks [`SurfacePoint::emitter`] of surfaces that do not emit.
pub const NO_EMITTER: u32 = u32::MAX;

/// A point on a surface with all that scattering and emission need to know of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Position in the normalised scene.
    pub p: Vec3,
    /// Geometric normal n_g, unit length.
    pub n_g: Vec3,
    /// Shading frame; its `n` is n_s.
    pub frame: Frame,
    /// Bound on the distance between `p` and the exact surface.
    pub error: f32,
    /// Index of the shape.
    pub shape: u32,
    /// Index of the primitive.
    pub prim: u32,
    /// Index of the scattering model.
    pub material: u32,
    /// Index of the area emitter or [`NO_EMITTER`].
    pub emitter: u32,
}

impl SurfacePoint {
    /// The point as the end of an edge.
    #[inline]
    pub fn end(&self) -> End {
        End::Surface { p: self.p, n: self.n_g }
    }

    /// Index of the area emitter, if the surface emits.
    #[inline]
    pub fn emitter(&self) -> Option<u32> {
        (self.emitter != NO_EMITTER).then_some(self.emitter)
    }

    /// The unbounded ray that leaves in direction `d`, its origin moved off the surface to the side of `d` by the
    /// error bound of the position.
    #[inline]
    pub fn spawn(&self, d: Vec3) -> Ray {
        Ray::new(offset_origin(self.p, self.n_g, self.error, d), d)
    }
}
