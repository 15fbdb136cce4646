//! χ² tests of samplers against their densities: any sampler, any domain that a chart covers.
//!
//! The unit square of a [`Chart`] is cut into cells; the density is integrated over each by
//! adaptive quadrature, samples are counted. What is not in the chart, samples that are `None`
//! included, is one more cell with the probability 1 − ∫ density, so that a lost or an invented
//! part of the mass is caught as well. Cells that expect fewer than 5 samples are pooled.

use glam::{DVec3, Vec3};
use pathspace_core::math::Frame;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Coordinates in the unit square → point and measure per unit of area of the square.
type Point<P> = Box<dyn Fn([f64; 2]) -> (P, f64)>;
/// Point → coordinates; `None` outside.
type Coordinates<P> = Box<dyn Fn(&P) -> Option<[f64; 2]>>;

/// A map of the unit square onto a part of a domain with points `P`.
pub struct Chart<P> {
    pub point: Point<P>,
    pub coordinates: Coordinates<P>,
}

/// Directions with z in [z0, z1] by height and azimuth, in solid angle.
pub fn zone(z0: f64, z1: f64) -> Chart<Vec3> {
    use std::f64::consts::TAU;
    Chart {
        point: Box::new(move |[a, b]| {
            let z = z0 + (z1 - z0) * a;
            let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
            let (sin, cos) = (TAU * b).sin_cos();
            (DVec3::new(r * cos, r * sin, z).as_vec3(), TAU * (z1 - z0))
        }),
        coordinates: Box::new(move |w| {
            let a = (f64::from(w.z) - z0) / (z1 - z0);
            let b = f64::from(w.y).atan2(f64::from(w.x)) / TAU;
            (0.0..=1.0).contains(&a).then_some([a, b.rem_euclid(1.0)])
        }),
    }
}

/// Directions about an axis by central projection: axis + half_width·(x s + y t) for x, y in [−1,
/// 1], in solid angle. For lobes too narrow for [`zone`].
pub fn gnomonic(axis: Vec3, half_width: f64) -> Chart<Vec3> {
    let axis = axis.as_dvec3().normalize();
    let frame = Frame::from_normal(axis.as_vec3());
    let s = (frame.s.as_dvec3() - axis * axis.dot(frame.s.as_dvec3())).normalize();
    let t = axis.cross(s);
    Chart {
        point: Box::new(move |[a, b]| {
            let (x, y) = (half_width * (2.0 * a - 1.0), half_width * (2.0 * b - 1.0));
            let area = 4.0 * half_width * half_width;
            let cos = 1.0 / (1.0 + x * x + y * y).sqrt();
            (((axis + s * x + t * y) * cos).as_vec3(), area * cos.powi(3))
        }),
        coordinates: Box::new(move |w| {
            let w = w.as_dvec3();
            let c = w.dot(axis);
            let to_unit = |d: f64| 0.5 * (d / (c * half_width) + 1.0);
            let p = [to_unit(w.dot(s)), to_unit(w.dot(t))];
            (c > 0.0 && p.iter().all(|x| (0.0..=1.0).contains(x))).then_some(p)
        }),
    }
}

/// Random numbers of a seed.
pub fn rng(seed: u64) -> Pcg64Mcg {
    Pcg64Mcg::seed_from_u64(seed)
}

/// What a χ² test found.
#[derive(Debug)]
pub struct Outcome {
    pub name: String,
    pub statistic: f64,
    pub degrees_of_freedom: usize,
    /// Probability of a statistic as large under the density.
    pub p: f64,
    /// ∫ density over the chart.
    pub integral: f64,
    /// Fraction of samples outside the chart.
    pub outside: f64,
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Outcome { name, statistic, degrees_of_freedom, p, integral, outside } = self;
        write!(f, "{name}: χ² = {statistic:.1} on {degrees_of_freedom} degrees of freedom, ")?;
        write!(f, "p = {p:.2e}, integral {integral:.7}, outside {outside:.7}")
    }
}

/// Samples `samples` points with the seed `seed` and compares their counts in
/// `resolution[0]` × `resolution[1]` cells with the density.
pub fn test<P>(
    name: impl Into<String>,
    chart: &Chart<P>,
    resolution: [usize; 2],
    samples: usize,
    seed: u64,
    sample: impl FnMut(&mut Pcg64Mcg) -> Option<P>,
    density: impl Fn(&P) -> f64,
) -> Outcome {
    test_by(name, chart, resolution, (samples, seed), sample, density, Quadrature::Adaptive)
}

/// [`test`] for densities with edges in arbitrary places.
pub fn test_with_edges<P>(
    name: impl Into<String>,
    chart: &Chart<P>,
    resolution: [usize; 2],
    samples: usize,
    seed: u64,
    sample: impl FnMut(&mut Pcg64Mcg) -> Option<P>,
    density: impl Fn(&P) -> f64,
) -> Outcome {
    test_by(name, chart, resolution, (samples, seed), sample, density, Quadrature::Midpoints)
}

/// How the density is integrated over a cell.
#[derive(Clone, Copy, PartialEq)]
enum Quadrature {
    /// Gauss–Legendre, refined where the integrand needs it.
    Adaptive,
    /// 48 × 48 midpoints: a sliver of the support cannot hide between the nodes.
    Midpoints,
}

fn test_by<P>(
    name: impl Into<String>,
    chart: &Chart<P>,
    resolution: [usize; 2],
    (samples, seed): (usize, u64),
    mut sample: impl FnMut(&mut Pcg64Mcg) -> Option<P>,
    density: impl Fn(&P) -> f64,
    quadrature: Quadrature,
) -> Outcome {
    let [nu, nv] = resolution;
    let mut observed = vec![0_u64; nu * nv + 1];
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    for _ in 0..samples {
        let cell = sample(&mut rng).and_then(|p| (chart.coordinates)(&p)).map(|[a, b]| {
            let index = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
            index(a, nu) * nv + index(b, nv)
        });
        observed[cell.unwrap_or(nu * nv)] += 1;
    }

    let integrand = |p: [f64; 2]| {
        let (point, measure) = (chart.point)(p);
        density(&point) * measure
    };
    let mut expected: Vec<f64> = (0..nu * nv)
        .map(|cell| {
            let size = [1.0 / nu as f64, 1.0 / nv as f64];
            let corner = [(cell / nv) as f64 * size[0], (cell % nv) as f64 * size[1]];
            match quadrature {
                Quadrature::Adaptive => integrate(&integrand, corner, size),
                Quadrature::Midpoints => midpoints(&integrand, corner, size),
            }
        })
        .collect();
    let integral: f64 = expected.iter().sum();
    let rest = 1.0 - integral;
    expected.push(rest.max(0.0));
    let total: f64 = expected.iter().sum();
    for e in &mut expected {
        *e *= samples as f64 / total;
    }

    let outside = observed[nu * nv] as f64 / samples as f64;
    let (statistic, degrees_of_freedom) = pooled_statistic(&observed, &expected);
    // A density that does not fit into 1 is wrong whatever the counts say, and so are samples where
    // it is 0. Quadrature and f32 densities leave some 10⁻⁶ of a whole; rounding at the border of a
    // cell moves a sample or two.
    let (few, slack) = match quadrature {
        Quadrature::Adaptive => (2, 1e-4),
        Quadrature::Midpoints => (6, 2e-3),
    };
    let strays = observed.iter().zip(&expected).take(nu * nv).any(|(&o, &e)| o > few && e < 1e-6);
    let p = if !strays && rest > -slack {
        ChiSquared::new(degrees_of_freedom as f64).unwrap().sf(statistic)
    } else {
        0.0
    };
    Outcome { name: name.into(), statistic, degrees_of_freedom, p, integral, outside }
}

/// Σ (observed − expected)²/expected and its degrees of freedom, after pooling.
fn pooled_statistic(observed: &[u64], expected: &[f64]) -> (f64, usize) {
    let mut order: Vec<usize> = (0..expected.len()).collect();
    order.sort_by(|&a, &b| expected[a].total_cmp(&expected[b]));
    let mut cells: Vec<(f64, f64)> = Vec::new();
    let (mut o, mut e) = (0.0, 0.0);
    for i in order {
        o += observed[i] as f64;
        e += expected[i];
        if e >= 5.0 {
            cells.push((o, e));
            (o, e) = (0.0, 0.0);
        }
    }
    // Ascending order leaves a remainder only where all cells together expect fewer than 5.
    assert!(e == 0.0 && cells.len() > 8, "too few samples for a χ² test");
    let statistic = cells.iter().map(|(o, e)| (o - e) * (o - e) / e).sum();
    (statistic, cells.len() - 1)
}

/// Gauss–Legendre on 5 nodes, nodes on [0,1].
const NODES: [(f64, f64); 5] = [
    (0.046910077030668, 0.118463442528095),
    (0.230765344947158, 0.239314335249683),
    (0.5, 0.284444444444444),
    (0.769234655052842, 0.239314335249683),
    (0.953089922969332, 0.118463442528095),
];

fn gauss(f: &impl Fn([f64; 2]) -> f64, corner: [f64; 2], size: [f64; 2]) -> f64 {
    let mut sum = 0.0;
    for (x, wx) in NODES {
        for (y, wy) in NODES {
            sum += wx * wy * f([corner[0] + size[0] * x, corner[1] + size[1] * y]);
        }
    }
    sum * size[0] * size[1]
}

fn midpoints(f: &impl Fn([f64; 2]) -> f64, corner: [f64; 2], size: [f64; 2]) -> f64 {
    const N: usize = 48;
    let at = |i: usize, axis: usize| corner[axis] + size[axis] * (i as f64 + 0.5) / N as f64;
    let sum: f64 = (0..N)
        .flat_map(|i| (0..N).map(move |j| (i, j)))
        .map(|(i, j)| f([at(i, 0), at(j, 1)]))
        .sum();
    sum * size[0] * size[1] / (N * N) as f64
}

/// ∫ f over a box, to about 10⁻⁸ of a unit of probability.
pub fn integrate(f: &impl Fn([f64; 2]) -> f64, corner: [f64; 2], size: [f64; 2]) -> f64 {
    fn refine(
        f: &impl Fn([f64; 2]) -> f64,
        corner: [f64; 2],
        size: [f64; 2],
        whole: f64,
        depth: u32,
    ) -> f64 {
        let half = [0.5 * size[0], 0.5 * size[1]];
        let corners = [[0.0, 0.0], [0.0, half[1]], [half[0], 0.0], [half[0], half[1]]];
        let quarters = corners.map(|c| {
            let at = [corner[0] + c[0], corner[1] + c[1]];
            (at, gauss(f, at, half))
        });
        let sum: f64 = quarters.iter().map(|q| q.1).sum();
        if depth == 0 || (sum - whole).abs() <= 1e-8 + 1e-6 * sum.abs() {
            return sum;
        }
        quarters.iter().map(|&(at, part)| refine(f, at, half, part, depth - 1)).sum()
    }
    refine(f, corner, size, gauss(f, corner, size), 10)
}

/// Fails where Holm's procedure rejects one of the tests at the family level `alpha`.
pub fn assert_none_rejected(mut outcomes: Vec<Outcome>, alpha: f64) {
    outcomes.sort_by(|a, b| a.p.total_cmp(&b.p));
    let m = outcomes.len();
    let rejected: Vec<_> = outcomes
        .iter()
        .enumerate()
        .take_while(|(i, o)| o.p.is_nan() || o.p < alpha / (m - i) as f64)
        .map(|(_, o)| o.to_string())
        .collect();
    assert!(rejected.is_empty(), "{} of {m} rejected:\n{}", rejected.len(), rejected.join("\n"));
}

mod tests {
    use super::*;
    use pathspace_core::math::warp;
    use rand::RngExt;

    fn cosine_against(density: impl Fn(&Vec3) -> f64, chart: &Chart<Vec3>) -> Outcome {
        let sample = |r: &mut Pcg64Mcg| Some(warp::cosine_hemisphere([r.random(), r.random()]));
        test("cosine", chart, [16, 16], 200_000, 7, sample, density)
    }

    #[test]
    fn right_density_passes() {
        let density = |w: &Vec3| warp::cosine_hemisphere_pdf(w.z).value();
        let whole = cosine_against(density, &zone(0.0, 1.0));
        assert!(whole.p > 1e-4 && (whole.integral - 1.0).abs() < 1e-6, "{whole}");
        let part = cosine_against(density, &gnomonic(Vec3::new(0.3, 0.1, 0.9), 0.2));
        assert!(part.p > 1e-4 && (part.integral + part.outside - 1.0).abs() < 0.01, "{part}");
    }

    #[test]
    fn density_off_by_two_percent_somewhere_is_rejected() {
        let density = |w: &Vec3| {
            warp::cosine_hemisphere_pdf(w.z).value() * (1.0 + 0.02 * f64::from(w.x.signum()))
        };
        let outcome = cosine_against(density, &zone(0.0, 1.0));
        assert!(outcome.p < 1e-4, "{outcome}");
    }

    #[test]
    fn density_with_missing_mass_is_rejected() {
        let density = |w: &Vec3| 0.99 * warp::cosine_hemisphere_pdf(w.z).value();
        let outcome = cosine_against(density, &zone(0.0, 1.0));
        assert!(outcome.p < 1e-4, "{outcome}");
    }

    #[test]
    fn samples_where_the_density_is_zero_are_rejected() {
        let density =
            |w: &Vec3| warp::uniform_sphere_pdf().value() * if w.z > 0.0 { 2.0 } else { 0.0 };
        let sample = |r: &mut Pcg64Mcg| {
            let w = warp::uniform_sphere([r.random(), r.random()]);
            let up = glam::Vec3::new(w.x, w.y, w.z.abs());
            Some(if r.random::<f32>() < 1e-3 { -up } else { up })
        };
        let outcome = test("leak", &zone(-1.0, 1.0), [16, 16], 100_000, 3, sample, density);
        assert!(outcome.p < 1e-4, "{outcome}");
    }
}
