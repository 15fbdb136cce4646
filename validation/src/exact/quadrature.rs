//! Gauss–Legendre quadrature over intervals, squares and films.

use glam::DVec3;

/// Nodes and weights on [0, 1].
const NODES: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_5, 0.239_314_335_249_683_2),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_2),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

/// ∫ f over [a, b] with `panels` panels of five nodes.
pub(super) fn interval(a: f64, b: f64, panels: usize, f: impl Fn(f64) -> f64) -> f64 {
    let h = (b - a) / panels as f64;
    let panel = |i: usize| NODES.iter().map(|(x, w)| w * f(a + (i as f64 + x) * h)).sum::<f64>();
    (0..panels).map(panel).sum::<f64>() * h
}

/// Mean of f over the rectangle [x0, x1] × [y0, y1].
pub(super) fn mean([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], f: impl Fn(f64, f64) -> f64) -> f64 {
    const PANELS: usize = 48;
    let inner = |x: f64| interval(y0, y1, PANELS, |y| f(x, y));
    interval(x0, x1, PANELS, inner) / ((x1 - x0) * (y1 - y0))
}

/// Mean over a square film of f(unit direction in camera space); full angle of view in degrees.
pub(super) fn film_mean(fov_degrees: f64, f: impl Fn(DVec3) -> f64) -> f64 {
    let half = (0.5 * fov_degrees.to_radians()).tan();
    mean([-half, half], [-half, half], |x, y| f(DVec3::new(x, y, 1.0).normalize()))
}
