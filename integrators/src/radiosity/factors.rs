//! Form factors A_i F_ij = ∬ G V/π dA dA (Goral et al. 1984).
//!
//! The inner integral over a flat element is Lambert's closed form, clipped at the horizon; over a
//! curved one the mean of its samples. The outer integral is the mean over samples, more of them
//! where two elements are near. Each outer sample looks at one inner sample, another one each,
//! which estimates the visible share. Only j ≥ i is computed; A_j F_ji = A_i F_ij by construction.

use std::f64::consts::PI;

use glam::DVec3;
use pathspace_core::Scene;
use pathspace_core::path::Vertex;
use pathspace_core::scene::SurfacePoint;
use rayon::prelude::*;

use super::elements::{Element, FLAT, Mesh};

/// Elements nearer than this many times the sum of their radii are integrated with the fine sets;
/// so are flat ones of which one emits.
const NEAR: f64 = 2.0;
/// Inner samples that each outer one of near elements looks at.
const NEAR_LOOKS: usize = 4;

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
    // The closed form takes edges of the inner element exactly, so the larger one is inner: in the
    // gap over a lamp samples of the ceiling would see its edges as steps. Of an element that is
    // partly closed it does not know the edge, so that one is outer.
    let whole = |e: &Element| e.cover.is_empty();
    let swap = whole(a) && (!whole(b) || b.area < a.area * (1.0 - 1e-9));
    let (a, b) = if swap { (b, a) } else { (a, b) };
    let near = a.center.distance(b.center) < NEAR * (a.radius + b.radius);
    // Shadows of lamps are what images show most of; lamps are small.
    let lamp = (a.emission.is_some() || b.emission.is_some())
        && !(a.polygon.is_empty() || b.polygon.is_empty());
    let looks = if near { NEAR_LOOKS } else { 1 };
    if near || lamp {
        let fine = |e: &Element, set: usize| -> Vec<(SurfacePoint, bool)> {
            let open = |k| e.fine[set].is_empty() || e.fine[set][k];
            let points = mesh.fine(scene, e, set).into_iter().enumerate();
            points.map(|(k, p)| (p, open(k))).collect()
        };
        let p = fine(a, 0);
        if p.iter().any(|(_, open)| *open) {
            return mean(scene, (a, &p), (b, &fine(b, 1)), &[], looks);
        }
    }
    let coarse = |e: &Element| -> Vec<(SurfacePoint, bool)> {
        e.points.iter().map(|p| (*p, true)).collect()
    };
    mean(scene, (a, &coarse(a)), (b, &coarse(b)), &b.cover, looks)
}

/// An element and samples of it, each with whether light can reach it.
type Samples<'a> = (&'a Element, &'a [(SurfacePoint, bool)]);

/// The mean over open samples x of `a` of ∫ G V/π over `b`, times the open area of `a`. Where the
/// samples of `b` are of its open part alone, `cover` is of all of it.
fn mean(
    scene: &Scene,
    (a, p): Samples<'_>,
    (b, q): Samples<'_>,
    cover: &[(SurfacePoint, bool)],
    looks: usize,
) -> f64 {
    // A stride prime to the number of samples takes each inner sample once, far from where its
    // neighbour is taken.
    let stride = stride(p.len());
    let (mut sum, mut count) = (0.0, 0_u32);
    for (k, (x, _)) in p.iter().enumerate().filter(|(_, (_, open))| *open) {
        count += 1;
        let factor = point_factor(a, x, b, q);
        if factor > 0.0 {
            let first = k * stride + q.len() / 3;
            sum += factor
                * open_share(a, x, b, cover)
                * visible_share(scene, (a, x), (b, q), first, looks);
        }
    }
    if count == 0 { 0.0 } else { a.open_area() * sum / f64::from(count) }
}

/// How much of what faces x is open: the closed form has nothing of what is turned away, be it open
/// or not.
fn open_share(a: &Element, x: &SurfacePoint, b: &Element, cover: &[(SurfacePoint, bool)]) -> f64 {
    let (mut open, mut all) = (0_u32, 0_u32);
    for (_, is_open) in cover.iter().filter(|(y, _)| a.faces(x, b, y)) {
        all += 1;
        open += u32::from(*is_open);
    }
    if all == 0 { 1.0 } else { f64::from(open) / f64::from(all) }
}

/// The share of ∫ G dA over `b` that is open and visible from x, from `looks` samples of those that
/// face x: the closed form has nothing of what is turned away.
fn visible_share(
    scene: &Scene,
    (a, x): (&Element, &SurfacePoint),
    (b, q): Samples<'_>,
    first: usize,
    looks: usize,
) -> f64 {
    let (mut seen, mut all) = (0.0, 0.0);
    for look in 0..looks {
        let from = first + look * q.len() / looks;
        let inner = (0..q.len()).map(|l| &q[(from + l) % q.len()]).find(|y| a.faces(x, b, &y.0));
        let Some((y, open)) = inner else { break };
        let weight = if looks == 1 { 1.0 } else { kernel(a, x, b, y) };
        all += weight;
        if *open && scene.visible(&Vertex::Surface(*x), &Vertex::Surface(*y)) {
            seen += weight;
        }
    }
    if all > 0.0 { seen / all } else { 0.0 }
}

/// G of two samples, 0 where one is turned away from the other.
fn kernel(a: &Element, x: &SurfacePoint, b: &Element, y: &SurfacePoint) -> f64 {
    let d = y.p.as_dvec3() - x.p.as_dvec3();
    let r2 = d.length_squared();
    let (cos_x, cos_y) = (d.dot(a.normal(x)).max(0.0), (-d.dot(b.normal(y))).max(0.0));
    if r2 > 0.0 { cos_x * cos_y / (r2 * r2) } else { 0.0 }
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
    if a.polygon.is_empty() {
        return true;
    }
    let x = &a.points[0];
    let (o, n) = (x.p.as_dvec3(), a.normal(x));
    if b.polygon.is_empty() {
        return (b.center - o).dot(n) > -2.0 * b.radius;
    }
    b.polygon.iter().any(|p| (*p - o).dot(n) > FLAT)
}

/// ∫_b G/π dA seen from x of `a`, without visibility.
fn point_factor(a: &Element, x: &SurfacePoint, b: &Element, q: &[(SurfacePoint, bool)]) -> f64 {
    let p = x.p.as_dvec3();
    if !b.polygon.is_empty() {
        // One-sided: from behind an element is not seen.
        let y = &b.points[0];
        if (p - y.p.as_dvec3()).dot(b.normal(y)) <= 0.0 {
            return 0.0;
        }
        return polygon_factor(p, a.normal(x), &b.polygon);
    }
    let sum: f64 = q.iter().map(|(y, _)| kernel(a, x, b, y)).sum();
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
