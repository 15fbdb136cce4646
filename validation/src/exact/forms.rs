//! Closed forms: view factors (Howell, "A Catalog of Radiation Heat Transfer Configuration
//! Factors") and irradiance.

use std::f64::consts::PI;

use glam::DVec3;

/// View factor between two equal, directly opposed rectangles a × b at distance c (Howell C-11).
pub fn parallel_rectangles(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (sx, sy) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    let logarithm = (sx * sx * sy * sy / (1.0 + x * x + y * y)).ln();
    2.0 / (PI * x * y)
        * (0.5 * logarithm + x * sy * (x / sy).atan() + y * sx * (y / sx).atan()
            - x * x.atan()
            - y * y.atan())
}

/// View factor from a rectangle of width `w` to a perpendicular one of height `h`, both of length
/// `l` along their common edge (Howell C-14).
pub fn perpendicular_rectangles(w: f64, h: f64, l: f64) -> f64 {
    let (w, h) = (w / l, h / l);
    let (w2, h2) = (w * w, h * h);
    let s = w2 + h2;
    let logarithm = ((1.0 + w2) * (1.0 + h2) / (1.0 + s)).ln()
        + w2 * (w2 * (1.0 + s) / ((1.0 + w2) * s)).ln()
        + h2 * (h2 * (1.0 + s) / ((1.0 + h2) * s)).ln();
    let root = s.sqrt();
    (w * (1.0 / w).atan() + h * (1.0 / h).atan() - root * (1.0 / root).atan() + 0.25 * logarithm)
        / (PI * w)
}

/// View factor from a disk of radius `r1` to a coaxial parallel one of radius `r2` at distance h
/// (Howell C-41).
pub fn coaxial_disks(r1: f64, r2: f64, h: f64) -> f64 {
    let (a, b) = (r1 / h, r2 / h);
    let x = 1.0 + (1.0 + b * b) / (a * a);
    0.5 * (x - (x * x - 4.0 * (r2 / r1).powi(2)).sqrt())
}

/// Irradiance at `p` with unit normal `n` by a polygon of radiance `l`, wholly above the horizon
/// (Lambert 1760): (L/2) |Σ Θ_i Γ_i·n|, Θ_i the angle of edge i seen from p and Γ_i the unit normal
/// of its plane with p.
pub fn polygon_irradiance(p: DVec3, n: DVec3, polygon: &[DVec3], l: f64) -> f64 {
    let sum: f64 = (0..polygon.len())
        .map(|i| {
            let a = polygon[i] - p;
            let b = polygon[(i + 1) % polygon.len()] - p;
            let cross = a.cross(b);
            cross.length().atan2(a.dot(b)) * cross.normalize().dot(n)
        })
        .sum();
    0.5 * l * sum.abs()
}

/// Irradiance by a sphere of radiance `l` and radius `r`, wholly above the horizon, whose centre is
/// at distance `d` and angle θ from the normal: πL (R/d)² cos θ.
pub fn sphere_irradiance(r: f64, d: f64, cos: f64, l: f64) -> f64 {
    PI * l * (r / d).powi(2) * cos
}

/// Irradiance by a parallel disk of radiance `l` and radius `r` in height `h`, at lateral distance
/// `x` from its axis: (πL/2) [1 − (h²+x²−r²)/√((h²+x²+r²)²−4r²x²)] (Howell B-13); on the axis
/// πLr²/(r²+h²).
pub fn disk_irradiance(r: f64, h: f64, x: f64, l: f64) -> f64 {
    let (r2, h2, x2) = (r * r, h * h, x * x);
    let root = ((h2 + x2 + r2).powi(2) - 4.0 * r2 * x2).sqrt();
    0.5 * PI * l * (1.0 - (h2 + x2 - r2) / root)
}

/// Reflectance of a smooth boundary for unpolarised light (Fresnel), indices `n1` on the side of
/// the light and `n2`; 1 at total internal reflection.
pub fn fresnel(n1: f64, n2: f64, cos1: f64) -> f64 {
    let sin2 = n1 / n2 * (1.0 - cos1 * cos1).max(0.0).sqrt();
    if sin2 >= 1.0 {
        return 1.0;
    }
    let cos2 = (1.0 - sin2 * sin2).sqrt();
    let s = (n1 * cos1 - n2 * cos2) / (n1 * cos1 + n2 * cos2);
    let p = (n2 * cos1 - n1 * cos2) / (n2 * cos1 + n1 * cos2);
    0.5 * (s * s + p * p)
}

#[cfg(test)]
mod tests {
    use super::super::quadrature;
    use super::*;

    fn close(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() < tolerance, "{a} against {b}");
    }

    /// Mean over [0,w]×[0,l] of the irradiance by a polygon of radiance 1/π.
    fn factor(w: f64, l: f64, polygon: &[DVec3]) -> f64 {
        let at = |x, y| polygon_irradiance(DVec3::new(x, y, 0.0), DVec3::Z, polygon, 1.0 / PI);
        quadrature::mean([0.0, w], [0.0, l], at)
    }

    #[test]
    fn catalogue_gives_the_known_digits_for_units() {
        close(parallel_rectangles(1.0, 1.0, 1.0), 0.1998249, 5e-8);
        close(perpendicular_rectangles(1.0, 1.0, 1.0), 0.2000438, 5e-8);
        close(coaxial_disks(1.0, 1.0, 1.0), 0.3819660, 5e-8);
    }

    #[test]
    fn view_factors_are_means_of_lamberts_formula() {
        let corner = |x, y, z| DVec3::new(x, y, z);
        let above = [
            corner(0.0, 0.0, 0.7),
            corner(1.5, 0.0, 0.7),
            corner(1.5, 0.8, 0.7),
            corner(0.0, 0.8, 0.7),
        ];
        close(factor(1.5, 0.8, &above), parallel_rectangles(1.5, 0.8, 0.7), 1e-9);
        let wall = [
            corner(0.0, 0.0, 0.0),
            corner(0.0, 0.8, 0.0),
            corner(0.0, 0.8, 0.6),
            corner(0.0, 0.0, 0.6),
        ];
        close(factor(1.5, 0.8, &wall), perpendicular_rectangles(1.5, 0.6, 0.8), 1e-5);
    }

    #[test]
    fn disk_irradiance_averages_to_the_view_factor_of_disks() {
        let (r1, r2, h) = (1.2, 0.7, 0.9);
        let mean = quadrature::interval(0.0, r1, 64, |x| x * disk_irradiance(r2, h, x, 1.0 / PI));
        close(2.0 * mean / (r1 * r1), coaxial_disks(r1, r2, h), 1e-10);
        close(disk_irradiance(r2, h, 0.0, 1.0), PI * r2 * r2 / (r2 * r2 + h * h), 1e-12);
    }

    #[test]
    fn reflectance_is_symmetric_and_total_beyond_the_critical_angle() {
        close(fresnel(1.0, 1.5, 1.0), 0.04, 1e-12);
        let cos1 = 0.6_f64;
        let cos2 = (1.0 - (1.0 - cos1 * cos1) / 2.25_f64).sqrt();
        close(fresnel(1.0, 1.5, cos1), fresnel(1.5, 1.0, cos2), 1e-12);
        assert_eq!(fresnel(1.5, 1.0, 0.7), 1.0);
    }
}
