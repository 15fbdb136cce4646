//! Form factors A_i F_ij = ∬ G V/π dA dA (Goral et al. 1984).
//!
//! The inner integral over a flat element is Lambert's closed form, clipped at the horizon; over a curved one the mean of
//! its samples. The outer integral is the mean over samples, more of them where two elements are near. Each outer sample
//! looks at one inner sample, another one each, which estimates the visible share.
//! Only j ≥ i is computed; A_j F_ji = A_i F_ij by construction.

use std::f64::consts::PI;

use glam::DVec3;
use pathspace_core::Scene;
use pathspace_core::path::Vertex;
use pathspace_core::scene::SurfacePoint;
use rayon::prelude::*;

use super::elements::{Element, Mesh};

/// Elements nearer than this many times the sum of their radii are integrated with [`FINE`]² samples; so are flat ones of which
/// one emits.
const NEAR: f64 = 2.0;
/// Samples along the edge of near elements.
const FINE: u32 = 8;

/// The symmetric matrix A_i F_ij over the open parts, row by row.
pub(super) fn matrix(scene: &Scene, mesh: &Mesh) -> Vec<f64> {
    let n = mesh.elements.len();
    let mut s = vec![0.0; n * n];
    s.par_chunks_mut(n.max(1)).enumerate().for_each(|(i, row)| {
        for (j, entry) in row.iter_mut().enumerate().skip(i) {
            *entry = exchange(scene, mesh, i, j);
        }
    });
    for i in 0..n {
        for j in 0..i {
            s[i * n + j] = s[j * n + i];
        }
    }
    s
}

/// A_i F_ij of two elements: ∬ G V/π over their open parts.
pub fn exchange(scene: &Scene, mesh: &Mesh, i: usize, j: usize) -> f64 {
    let (a, b) = (&mesh.elements[i], &mesh.elements[j]);
    if !may_face(a, b) || !may_face(b, a) {
        return 0.0;
    }
    let near = a.center.distance(b.center) < NEAR * (a.radius + b.radius);
    // Shadows of lamps are what images show most of; lamps are small.
    let lamp = (a.emission.is_some() || b.emission.is_some())
        && !(a.polygon.is_empty() || b.polygon.is_empty());
    if near || lamp {
        // Different counts, so that samples of an element and itself never coincide.
        let (p, q) = (mesh.finer(scene, a, FINE), mesh.finer(scene, b, FINE + 1));
        return mean(scene, (a, &p), (b, &q));
    }
    let coarse = |e: &Element| -> Vec<(SurfacePoint, usize)> {
        e.points.iter().copied().enumerate().map(|(k, p)| (p, k)).collect()
    };
    mean(scene, (a, &coarse(a)), (b, &coarse(b)))
}

type Samples<'a> = (&'a Element, &'a [(SurfacePoint, usize)]);

fn mean(scene: &Scene, (a, p): Samples<'_>, (b, q): Samples<'_>) -> f64 {
    let count = p.len();
    // A stride prime to the number of samples takes each inner sample once, far from where its neighbour is taken.
    let stride = stride(count);
    let mut sum = 0.0;
    for (k, (x, coarse)) in p.iter().enumerate() {
        if !a.open[*coarse] {
            continue;
        }
        let factor = point_factor(x, a.normal(x), b, q);
        if factor <= 0.0 {
            continue;
        }
        let first = k * stride + count / 3;
        let faces = |(y, _): &&(SurfacePoint, usize)| {
            let d = y.p.as_dvec3() - x.p.as_dvec3();
            d.dot(a.normal(x)) > 0.0 && d.dot(b.normal(y)) < 0.0
        };
        // Of an inner element that is partly turned away, the factor has only what is not.
        let inner = (0..q.len()).map(|l| &q[(first + l) % q.len()]).find(faces);
        let Some((y, other)) = inner else { continue };
        if b.open[*other] && scene.visible(&Vertex::Surface(*x), &Vertex::Surface(*y)) {
            sum += factor;
        }
    }
    a.area * sum / count as f64
}

/// Some number near the golden section of `count` and prime to it.
fn stride(count: usize) -> usize {
    let gcd = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let from = (0.618 * count as f64).round().max(1.0) as usize;
    (from..from + count).find(|s| gcd(*s, count) == 1).unwrap_or(1)
}

/// Whether anything of `b` lies in front of anything of `a`.
fn may_face(a: &Element, b: &Element) -> bool {
    let tolerance = 1e-7 * (1.0 + a.center.length());
    if a.polygon.is_empty() {
        return true;
    }
    let x = &a.points[0];
    let (o, n) = (x.p.as_dvec3(), a.normal(x));
    if b.polygon.is_empty() {
        return (b.center - o).dot(n) > -2.0 * b.radius;
    }
    b.polygon.iter().any(|p| (*p - o).dot(n) > tolerance)
}

/// ∫_b G/π dA seen from x with normal n, without visibility.
fn point_factor(x: &SurfacePoint, n: DVec3, b: &Element, q: &[(SurfacePoint, usize)]) -> f64 {
    let p = x.p.as_dvec3();
    if !b.polygon.is_empty() {
        // One-sided: from behind an element is not seen.
        let y = &b.points[0];
        if (p - y.p.as_dvec3()).dot(b.normal(y)) <= 0.0 {
            return 0.0;
        }
        return polygon_factor(p, n, &b.polygon);
    }
    let sum: f64 = q
        .iter()
        .map(|(y, _)| {
            let d = y.p.as_dvec3() - p;
            let r2 = d.length_squared();
            let (cos_x, cos_y) = (d.dot(n).max(0.0), (-d.dot(b.normal(y))).max(0.0));
            if r2 > 0.0 { cos_x * cos_y / (r2 * r2) } else { 0.0 }
        })
        .sum();
    sum * b.area / (q.len() as f64 * PI)
}

/// View factor from a point with unit normal `n` to a flat convex polygon: Lambert's formula
/// (1/2π) |Σ Θ_i Γ_i·n| of the part above the horizon.
pub fn polygon_factor(p: DVec3, n: DVec3, polygon: &[DVec3]) -> f64 {
    // A convex polygon of k corners has at most k + 1 above a plane.
    let mut above = [DVec3::ZERO; 8];
    let mut len = 0;
    for k in 0..polygon.len() {
        let (a, b) = (polygon[k] - p, polygon[(k + 1) % polygon.len()] - p);
        let (ha, hb) = (a.dot(n), b.dot(n));
        if ha >= 0.0 {
            above[len] = a;
            len += 1;
        }
        if (ha < 0.0) != (hb < 0.0) {
            above[len] = a + (b - a) * (ha / (ha - hb));
            len += 1;
        }
        if len + 2 > above.len() {
            break;
        }
    }
    let mut sum = 0.0;
    for k in 0..len {
        let (a, b) = (above[k], above[(k + 1) % len]);
        let cross = a.cross(b);
        let length = cross.length();
        if length > 0.0 {
            sum += length.atan2(a.dot(b)) * cross.dot(n) / length;
        }
    }
    (0.5 / PI * sum).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_that_fills_the_sky_has_factor_one() {
        let far = 1e6;
        let sky = [(-far, -far), (far, -far), (far, far), (-far, far)];
        let sky = sky.map(|(x, y)| DVec3::new(x, y, 1.0));
        assert!((polygon_factor(DVec3::ZERO, DVec3::Z, &sky) - 1.0).abs() < 1e-5);
    }

    /// A wall from the horizon up to infinity on one side fills half of the projected hemisphere.
    #[test]
    fn what_is_below_the_horizon_does_not_count() {
        let far = 1e6;
        let wall = [(-far, -far), (far, -far), (far, far), (-far, far)];
        let wall = wall.map(|(y, z)| DVec3::new(1.0, y, z));
        assert!((polygon_factor(DVec3::ZERO, DVec3::Z, &wall) - 0.5).abs() < 1e-5);
        let triangle = [DVec3::X, DVec3::Y, -DVec3::Z];
        assert_eq!(polygon_factor(DVec3::Z, DVec3::Z, &triangle), 0.0);
    }

    #[test]
    fn a_stride_takes_every_sample_once() {
        for count in [1, 4, 9, 16, 25, 64] {
            let mut seen: Vec<_> = (0..count).map(|k| k * stride(count) % count).collect();
            seen.sort_unstable();
            assert_eq!(seen, (0..count).collect::<Vec<_>>());
        }
    }
}
