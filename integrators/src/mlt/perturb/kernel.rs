//! Distances of perturbations: uniform in the logarithm, so that small and large ones are equally
//! likely (Veach 1997, §11.4.3).

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec2, Vec3};
use pathspace_core::math::Frame;
use pathspace_core::random::{PrimarySample, RandomStream};

/// A distance r in [`min`, `max`] with density 1/(r ln(max/min)): r = max·(min/max)^u.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogUniform {
    /// Smallest distance, positive.
    pub min: f64,
    /// Largest distance.
    pub max: f64,
}

impl LogUniform {
    /// Both bounds times `factor`.
    pub fn scaled(self, factor: f64) -> Self {
        LogUniform { min: self.min * factor, max: self.max * factor }
    }

    /// For angles: nothing beyond a right angle.
    pub fn within_right_angle(self) -> Self {
        let max = 0.5 * PI;
        if self.max > max { self.scaled(max / self.max) } else { self }
    }

    fn sample(self, u: f32) -> f64 {
        self.max * (self.min / self.max).powf(f64::from(u))
    }

    fn density(self, r: f64) -> f64 {
        let inside = r >= self.min && r <= self.max;
        if inside { 1.0 / (r * (self.max / self.min).ln()) } else { 0.0 }
    }

    /// An offset in the plane: distance r, any azimuth.
    pub fn sample_plane(self, u: &mut RandomStream) -> Vec2 {
        let r = self.sample(u.next());
        let (sin, cos) = (TAU * f64::from(u.next())).sin_cos();
        Vec2::new((r * cos) as f32, (r * sin) as f32)
    }

    /// Density of an offset of length r per area of the plane: p(r)/(2πr).
    pub fn plane_density(self, r: f64) -> f64 {
        self.density(r) / (TAU * r)
    }

    /// A direction at angle r from `axis`, any azimuth.
    pub fn sample_direction(self, axis: Vec3, u: &mut RandomStream) -> Vec3 {
        let (sin, cos) = self.sample(u.next()).sin_cos();
        let (s, c) = (TAU * f64::from(u.next())).sin_cos();
        let frame = Frame::from_normal(axis);
        let d =
            frame.s.as_dvec3() * (sin * c) + frame.t.as_dvec3() * (sin * s) + axis.as_dvec3() * cos;
        d.normalize().as_vec3()
    }

    /// Density of a direction at angle r per solid angle: p(r)/(2π sin r).
    pub fn direction_density(self, axis: Vec3, d: Vec3) -> f64 {
        let r = angle(axis, d);
        self.density(r) / (TAU * r.sin())
    }
}

/// Angle between unit vectors, exact for small ones.
fn angle(a: Vec3, b: Vec3) -> f64 {
    let (a, b): (DVec3, DVec3) = (a.as_dvec3(), b.as_dvec3());
    a.cross(b).length().atan2(a.dot(b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pathspace_core::random::Address;

    const KERNEL: LogUniform = LogUniform { min: 0.01, max: 0.8 };

    /// Monte Carlo over the kernel of 1/density over an annulus gives its area.
    #[test]
    fn densities_are_those_of_the_samples() {
        let mut u = RandomStream::new(Address { seed: 1, step: 0, item: 0 });
        let axis = Vec3::new(0.6, 0.0, 0.8);
        let (n, inner, outer) = (200_000, 0.02, 0.5);
        let (mut plane, mut sphere) = (0.0, 0.0);
        for _ in 0..n {
            let p = KERNEL.sample_plane(&mut u);
            let r = f64::from(p.length());
            if (inner..outer).contains(&r) && p.x > 0.0 {
                plane += 1.0 / KERNEL.plane_density(r);
            }
            let d = KERNEL.sample_direction(axis, &mut u);
            let r = angle(axis, d);
            if (inner..outer).contains(&r) && d.y > 0.0 {
                sphere += 1.0 / KERNEL.direction_density(axis, d);
            }
        }
        let (plane, sphere) = (plane / n as f64, sphere / n as f64);
        let half_annulus = 0.5 * PI * (outer * outer - inner * inner);
        let half_zone = PI * (inner.cos() - outer.cos());
        assert!((plane / half_annulus - 1.0).abs() < 0.02, "{plane} {half_annulus}");
        assert!((sphere / half_zone - 1.0).abs() < 0.02, "{sphere} {half_zone}");
    }

    #[test]
    fn angles_are_exact_where_they_are_small() {
        let a = angle(Vec3::Z, Vec3::new(1e-5, 0.0, 1.0));
        assert!((a / 1e-5 - 1.0).abs() < 1e-6);
    }
}
