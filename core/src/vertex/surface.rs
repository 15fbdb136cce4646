//! Points on surfaces.

use glam::Vec3;

use crate::geometry::offset_origin;
use crate::math::{Frame, Ray};
use crate::measure::End;
use crate::medium::MediumIndex;
use crate::vertex::Vertex;

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
    /// Bound on the distance between `p` and the exact surface; it depends on the coordinates of
    /// `p` and the size of the primitive alone, not on what else is in the scene.
    pub error: f32,
    /// Index of the shape.
    pub shape: u32,
    /// Index of the primitive.
    pub prim: u32,
    /// Index of the scattering model.
    pub material: u32,
    /// Index of the area emitter or [`NO_EMITTER`].
    pub emitter: u32,
    /// The media on the side of n_g and behind.
    pub media: [MediumIndex; 2],
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

    /// The unbounded ray that leaves in direction `d`, its origin moved off the surface to the side
    /// of `d` by the error bound of the position. It does not meet its own triangle again.
    #[inline]
    pub fn spawn(&self, d: Vec3) -> Ray {
        Ray { from: self.prim, ..Ray::new(offset_origin(self.p, self.n_g, self.error, d), d) }
    }

    /// The unit direction in which [`SurfacePoint::spawn`] meets `next`: not quite the edge's own,
    /// because the ray starts beside the point. Without that, walks laid along a given path would
    /// miss its vertices by the offset, always to the same side.
    pub fn aim(&self, next: &Vertex) -> Vec3 {
        let d = next.direction_from(self.p);
        match next.position() {
            Some(p) => (p - offset_origin(self.p, self.n_g, self.error, d)).normalize_or(d),
            None => d,
        }
    }
}
