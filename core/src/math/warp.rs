//! Warps: maps of the unit square onto disks, spheres and flat shapes, each with its density and,
//! where it is simple, its inverse (path → numbers).
//!
//! Every warp is a bijection up to null sets, continuous but for the seam of an azimuth, and takes
//! `u` in \[0, 1)².

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, TAU};

use glam::{Vec2, Vec3};

use crate::measure::{Area, Density, SolidAngle};

/// 1 − cos θ from sin²θ and cos θ ≥ 0 without cancellation: sin²θ / (1 + cos θ).
#[inline]
pub fn one_minus_cos(sin2: f32, cos: f32) -> f32 {
    sin2 / (1.0 + cos)
}

/// The unit disk, concentric and of constant density 1/π (Shirley and Chiu 1997, "A Low Distortion
/// Map Between Disk and Square").
#[inline]
pub fn concentric_disk(u: [f32; 2]) -> Vec2 {
    concentric_disk_polar(u).0
}

/// [`concentric_disk`] with its radius, which is exact: a multiple of 2⁻²³.
#[inline]
fn concentric_disk_polar(u: [f32; 2]) -> (Vec2, f32) {
    let a = 2.0 * u[0] - 1.0;
    let b = 2.0 * u[1] - 1.0;
    if a == 0.0 && b == 0.0 {
        return (Vec2::ZERO, 0.0);
    }
    let (r, phi) = if a.abs() > b.abs() {
        (a, FRAC_PI_4 * (b / a))
    } else {
        (b, FRAC_PI_2 - FRAC_PI_4 * (a / b))
    };
    let (sin, cos) = phi.sin_cos();
    (Vec2::new(r * cos, r * sin), r.abs())
}

/// Density of [`concentric_disk`] on the unit disk: 1/π.
#[inline]
pub fn concentric_disk_pdf() -> Density<Area> {
    Density::new(std::f64::consts::FRAC_1_PI)
}

/// Inverse of [`concentric_disk`].
#[inline]
pub fn concentric_disk_inverse(p: Vec2) -> [f32; 2] {
    let r = p.length();
    if r == 0.0 {
        return [0.5, 0.5];
    }
    let (a, b) = if p.x.abs() > p.y.abs() {
        let a = r.copysign(p.x);
        (a, a * (p.y / p.x).atan() / FRAC_PI_4)
    } else {
        let b = r.copysign(p.y);
        (b * (p.x / p.y).atan() / FRAC_PI_4, b)
    };
    [0.5 * a + 0.5, 0.5 * b + 0.5]
}

/// The upper hemisphere with density cos θ/π (Malley's method: a disk lifted onto the sphere).
#[inline]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let (p, r) = concentric_disk_polar(u);
    // 1 − r² as a product keeps its digits at grazing angles.
    p.extend(((1.0 - r) * (1.0 + r)).sqrt())
}

/// Density of [`cosine_hemisphere`]: cos θ/π above the horizon, 0 below.
#[inline]
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> Density<SolidAngle> {
    Density::new(f64::from(cos_theta.max(0.0) * FRAC_1_PI))
}

/// Inverse of [`cosine_hemisphere`].
#[inline]
pub fn cosine_hemisphere_inverse(w: Vec3) -> [f32; 2] {
    concentric_disk_inverse(w.truncate())
}

/// Unit vector with the given 1 − cos θ and azimuth 2π·`u1`; sin θ without cancellation.
#[inline]
fn from_height(one_minus_cos: f32, u1: f32) -> Vec3 {
    let sin = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
    let (s, c) = (TAU * u1).sin_cos();
    Vec3::new(sin * c, sin * s, 1.0 - one_minus_cos)
}

/// 1 − cos θ of a unit vector without cancellation near the pole.
#[inline]
fn height(w: Vec3) -> f32 {
    if w.z > 0.0 { one_minus_cos(w.x * w.x + w.y * w.y, w.z) } else { 1.0 - w.z }
}

/// Azimuth of a direction as a fraction of the circle, in \[0, 1).
#[inline]
fn azimuth(w: Vec3) -> f32 {
    let a = w.y.atan2(w.x) / TAU;
    let a = if a < 0.0 { a + 1.0 } else { a };
    if a < 1.0 { a } else { 0.0 }
}

/// The unit sphere with constant density 1/4π (Archimedes).
#[inline]
pub fn uniform_sphere(u: [f32; 2]) -> Vec3 {
    from_height(2.0 * u[0], u[1])
}

/// Density of [`uniform_sphere`]: 1/4π.
#[inline]
pub fn uniform_sphere_pdf() -> Density<SolidAngle> {
    Density::new(0.25 * std::f64::consts::FRAC_1_PI)
}

/// Inverse of [`uniform_sphere`].
#[inline]
pub fn uniform_sphere_inverse(w: Vec3) -> [f32; 2] {
    [0.5 * height(w), azimuth(w)]
}

/// Barycentric weights [b₀, b₁, b₂] of a uniform point of a triangle: b₀ = 1 − √u₀, b₁ = u₁√u₀
/// (Turk 1990, "Generating Random Points in Triangles").
#[inline]
pub fn uniform_triangle(u: [f32; 2]) -> [f32; 3] {
    let r = u[0].sqrt();
    let b1 = u[1] * r;
    [1.0 - r, b1, r - b1]
}

/// Inverse of [`uniform_triangle`].
#[inline]
pub fn uniform_triangle_inverse(b: [f32; 3]) -> [f32; 2] {
    let r = b[1] + b[2];
    [r * r, if r > 0.0 { b[1] / r } else { 0.5 }]
}

/// Density of a uniform point of the triangle with the edges `e1`, `e2`: 2/‖e₁ × e₂‖.
#[inline]
pub fn uniform_triangle_pdf(e1: Vec3, e2: Vec3) -> Density<Area> {
    Density::new(2.0 / f64::from(e1.cross(e2).length()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of the open unit square, on a grid without symmetric positions.
    fn grid() -> impl Iterator<Item = [f32; 2]> {
        (0..32).flat_map(|i| {
            (0..32).map(move |j| [(i as f32 + 0.37) / 32.0, (j as f32 + 0.61) / 32.0])
        })
    }

    fn assert_near(a: [f32; 2], b: [f32; 2], tolerance: f32) {
        let error = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
        assert!(error < tolerance, "{a:?} and {b:?} differ by {error}");
    }

    /// Mean density of a warp by its Jacobian: ‖∂w/∂u₀ × ∂w/∂u₁‖ = 1/pdf.
    fn jacobian(warp: impl Fn([f32; 2]) -> Vec3, u: [f32; 2]) -> f64 {
        let h = 2.0_f32.powi(-9);
        let d0 = warp([u[0] + h, u[1]]).as_dvec3() - warp([u[0] - h, u[1]]).as_dvec3();
        let d1 = warp([u[0], u[1] + h]).as_dvec3() - warp([u[0], u[1] - h]).as_dvec3();
        let h = f64::from(2.0 * h);
        (d0 / h).cross(d1 / h).length()
    }

    /// Checks pdf · |Jacobian| = 1 away from kinks and poles.
    fn assert_density(
        name: &str,
        warp: impl Fn([f32; 2]) -> Vec3 + Copy,
        pdf: impl Fn(Vec3) -> f64,
        keep: impl Fn([f32; 2]) -> bool,
    ) {
        let mut tested = 0;
        for u in grid().filter(|&u| keep(u)) {
            let product = pdf(warp(u)) * jacobian(warp, u);
            assert!((product - 1.0).abs() < 0.01, "{name} at {u:?}: pdf·J = {product}");
            tested += 1;
        }
        assert!(tested > 200, "{name}: only {tested} points");
    }

    /// Away from the borders and from the diagonals, where the concentric map has its kinks.
    fn smooth(u: [f32; 2]) -> bool {
        let [a, b] = [2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0];
        (a.abs() - b.abs()).abs() > 0.05 && a.abs().max(b.abs()) < 0.9
    }

    fn inside(u: [f32; 2]) -> bool {
        u.iter().all(|&x| x > 0.08 && x < 0.92)
    }

    #[test]
    fn disk_density_matches_jacobian() {
        let pdf = concentric_disk_pdf().value();
        assert_density("disk", |u| concentric_disk(u).extend(0.0), |_| pdf, smooth);
    }

    #[test]
    fn cosine_hemisphere_density_matches_jacobian() {
        let pdf = |w: Vec3| cosine_hemisphere_pdf(w.z).value();
        assert_density("cosine", cosine_hemisphere, pdf, smooth);
    }

    #[test]
    fn sphere_density_matches_jacobian() {
        let pdf = uniform_sphere_pdf().value();
        assert_density("sphere", uniform_sphere, |_| pdf, inside);
    }

    #[test]
    fn triangle_density_matches_jacobian() {
        let (e1, e2) = (Vec3::new(1.0, 0.5, 0.0), Vec3::new(-0.3, 0.8, 2.0));
        let pdf = uniform_triangle_pdf(e1, e2).value();
        let warp = |u| {
            let b = uniform_triangle(u);
            b[1] * e1 + b[2] * e2
        };
        assert_density("triangle", warp, |_| pdf, inside);
    }

    #[test]
    fn directions_have_unit_length() {
        for u in grid().chain([[0.0, 0.0], [0.0, 1.0 - 1e-7], [1.0 - 1e-7, 0.0]]) {
            for w in [cosine_hemisphere(u), uniform_sphere(u)] {
                assert!((w.as_dvec3().length() - 1.0).abs() < 3e-7, "{u:?}: {w}");
            }
        }
    }

    #[test]
    fn inverses_return_the_numbers() {
        for u in grid() {
            assert_near(concentric_disk_inverse(concentric_disk(u)), u, 1e-6);
            assert_near(cosine_hemisphere_inverse(cosine_hemisphere(u)), u, 1e-6);
            assert_near(uniform_sphere_inverse(uniform_sphere(u)), u, 1e-6);
            assert_near(uniform_triangle_inverse(uniform_triangle(u)), u, 2e-6);
        }
    }

    #[test]
    fn cosine_hemisphere_stays_above_the_horizon() {
        let edge = 1.0 - f32::EPSILON / 2.0;
        for u in [[edge, 0.5], [edge, edge], [0.5, edge]] {
            let w = cosine_hemisphere(u);
            assert!(w.z > 0.0, "{u:?}: {w}");
        }
    }
}
