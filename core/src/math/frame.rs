//! Orthonormal frames.

use glam::Vec3;

/// Right-handed orthonormal frame: `s` × `t` = `n`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub s: Vec3,
    /// Second tangent.
    pub t: Vec3,
    /// Normal.
    pub n: Vec3,
}

impl Frame {
    /// Frame about a unit normal with arbitrary, continuous tangents (Duff et al. 2017,
    /// "Building an Orthonormal Basis, Revisited", listing 3).
    pub fn from_normal(n: Vec3) -> Self {
        let sign = 1.0_f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Frame {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// Frame about a unit normal with `s` along the part of `dp_du` across `n`; falls back to
    /// [`Frame::from_normal`] where that part vanishes.
    pub fn from_normal_and_tangent(n: Vec3, dp_du: Vec3) -> Self {
        let s = dp_du - n * n.dot(dp_du);
        let len2 = s.length_squared();
        if len2 > 1e-12 * dp_du.length_squared() && len2 > 0.0 {
            let s = s / len2.sqrt();
            Frame { s, t: n.cross(s), n }
        } else {
            Frame::from_normal(n)
        }
    }

    /// World → local.
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.s.dot(v), self.t.dot(v), self.n.dot(v))
    }

    /// Local → world.
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}
