//! Densities and weights of all techniques of a whole path: every factor written out, nothing
//! carried along.

use pathspace::core::Scene;
use pathspace::core::bsdf::TransportMode;
use pathspace::core::path::{Path, Technique, WalkRules, ln_density, samplable};

use crate::Vcm;

/// How a path can be made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Way {
    /// s light vertices, connected (s ≥ 1) or hit (s = 0).
    Connect { s: usize },
    /// Merged at x_i.
    Merge { i: usize },
}

/// Roulette plays at every surface.
pub const RULES: WalkRules = WalkRules { max_length: None, rr_depth: 1 };

/// ln of the number of samples times the density of every way that can make the path.
pub fn ln_densities(scene: &Scene, vcm: &Vcm, eta: f64, path: &Path) -> Vec<(Way, f64)> {
    let (k, v) = (path.length(), &path.vertices);
    let light = light_factors(scene, path);
    let sensor = sensor_factors(scene, path);
    let product = |factors: &[f64]| factors.iter().map(|p| p.ln()).sum::<f64>();
    let mut ways = Vec::new();
    // The lens is not hit: t ≥ 1.
    for s in 0..=k {
        let technique = Technique::new(s, k + 1 - s);
        if (s >= 1 && !vcm.connect) || !samplable(scene, path, technique, &RULES) {
            continue;
        }
        let ln = if s == 1 && technique.t >= 2 {
            let p = v[1].position().unwrap();
            scene.pdf_direct(p, &v[0]).value().ln() + product(&sensor[1..])
        } else {
            product(&light[..s]) + product(&sensor[s..])
        };
        if ln.is_finite() {
            ways.push((Way::Connect { s }, ln));
        }
        // The core has the same in its own words.
        let core = ln_density(scene, path, technique, &RULES);
        let same = core.map_or(!ln.is_finite(), |core| (core - ln).abs() < 1e-9);
        assert!(same, "({s}, {}): {ln} and {core:?}", technique.t);
    }
    for i in 1..k {
        let non_specular = !path.is_specular(i);
        let ln = eta.ln() + product(&light[..=i]) + product(&sensor[i..]);
        if vcm.merge && non_specular && ln.is_finite() {
            ways.push((Way::Merge { i }, ln));
        }
    }
    ways
}

/// w of each way for the exponent β.
pub fn weights(ways: &[(Way, f64)], beta: f64) -> Vec<(Way, f64)> {
    let max = ways.iter().map(|w| w.1).fold(f64::NEG_INFINITY, f64::max);
    let share = |ln: f64| (beta * (ln - max)).exp();
    let sum: f64 = ways.iter().map(|w| share(w.1)).sum();
    ways.iter().map(|w| (w.0, share(w.1) / sum)).collect()
}

/// p of x_j given x₀ … x_{j−1} on a light subpath, j < k.
fn light_factors(scene: &Scene, path: &Path) -> Vec<f64> {
    let v = &path.vertices;
    let mut factors = vec![scene.pdf_emission_vertex(&v[0]).value()];
    for j in 1..path.length() {
        let edge = v[j - 1].edge_to(&v[j]);
        let density = if j == 1 {
            scene.pdf_emission_next(&v[0], &edge).value()
        } else {
            let from = v[j - 1].edge_to(&v[j - 2]).direction();
            scatter(scene, path, j - 1, from, edge.direction(), TransportMode::Importance)
                .map_or(0.0, |(pdf, q)| edge.to_area(pdf * q).value())
        };
        factors.push(density);
    }
    factors
}

/// p of x_j given x_k … x_{j+1} on a sensor subpath.
fn sensor_factors(scene: &Scene, path: &Path) -> Vec<f64> {
    let (k, v) = (path.length(), &path.vertices);
    let mut factors = vec![0.0; k + 1];
    factors[k] = scene.sensor().pdf_vertex().value();
    for j in (0..k).rev() {
        let edge = v[j + 1].edge_to(&v[j]);
        factors[j] = if j + 1 == k {
            edge.to_area(scene.sensor().pdf_direction(edge.direction())).value()
        } else {
            let from = v[j + 1].edge_to(&v[j + 2]).direction();
            scatter(scene, path, j + 1, from, edge.direction(), TransportMode::Radiance)
                .map_or(0.0, |(pdf, q)| edge.to_area(pdf * q).value())
        };
    }
    factors
}

type Event = (
    pathspace::core::measure::Density<pathspace::core::measure::SolidAngle>,
    pathspace::core::measure::Mass,
);

fn scatter(
    scene: &Scene,
    path: &Path,
    i: usize,
    from: pathspace::core::glam::Vec3,
    to: pathspace::core::glam::Vec3,
    mode: TransportMode,
) -> Option<Event> {
    scene.scatter_event(path.vertices[i].surface()?, from, to, mode, path.events[i])
}
