//! Spheres seen from outside.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::math::Frame;
use crate::measure::{Density, SolidAngle};

/// The cone under which a sphere is seen from outside.
pub(super) struct Cone {
    reference: DVec3,
    center: DVec3,
    radius: f64,
    /// 1 − cos θ_max, without cancellation.
    one_minus_cos: f64,
}

impl Cone {
    /// `None` from inside or on the sphere.
    pub(super) fn new(reference: Vec3, center: DVec3, radius: f64) -> Option<Self> {
        let reference = reference.as_dvec3();
        let sin2 = radius * radius / (center - reference).length_squared();
        // Close to the surface the cone covers half the sphere: area sampling is no worse there,
        // and stable.
        if sin2 >= 0.999_999 {
            return None;
        }
        let one_minus_cos = sin2 / (1.0 + (1.0 - sin2).sqrt());
        Some(Cone { reference, center, radius, one_minus_cos })
    }

    pub(super) fn pdf(&self) -> Density<SolidAngle> {
        Density::new(1.0 / (2.0 * PI * self.one_minus_cos))
    }

    /// The point of the sphere in a direction uniform in the cone.
    pub(super) fn sample(&self, u: [f32; 2]) -> Vec3 {
        let to_center = self.center - self.reference;
        let distance2 = to_center.length_squared();
        let distance = distance2.sqrt();
        let one_minus_cos = u[0] as f64 * self.one_minus_cos;
        let cos = 1.0 - one_minus_cos;
        let sin2 = one_minus_cos * (2.0 - one_minus_cos);
        // Nearer of the two intersections along the sampled direction.
        let t = distance * cos - (self.radius * self.radius - distance2 * sin2).max(0.0).sqrt();
        let frame = Frame::from_normal((to_center / distance).as_vec3());
        let phi = 2.0 * PI * u[1] as f64;
        let sin = sin2.sqrt();
        let d = frame.s.as_dvec3() * (phi.cos() * sin)
            + frame.t.as_dvec3() * (phi.sin() * sin)
            + to_center / distance * cos;
        let p = self.reference + d * t;
        (self.center + (p - self.center).normalize() * self.radius).as_vec3()
    }

    /// Inverse of [`Cone::sample`] for a point of the near side.
    pub(super) fn invert(&self, p: Vec3) -> [f32; 2] {
        let to_center = (self.center - self.reference).normalize();
        let d = (p.as_dvec3() - self.reference).normalize();
        let frame = Frame::from_normal(to_center.as_vec3());
        let (x, y) = (frame.s.as_dvec3().dot(d), frame.t.as_dvec3().dot(d));
        // 1 − cos θ = sin²θ/(1 + cos θ), sin θ from the cross product: no digit is lost in narrow
        // cones.
        let sin2 = to_center.cross(d).length_squared();
        let one_minus_cos = sin2 / (1.0 + to_center.dot(d));
        let turn = y.atan2(x) / (2.0 * PI);
        let turn = if turn < 0.0 { turn + 1.0 } else { turn };
        [(one_minus_cos / self.one_minus_cos) as f32, turn as f32]
    }
}
