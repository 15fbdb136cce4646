//! Transition densities are those of the proposals, delta vertices and all: from a fixed path x̄
//! the proposals of a mutation estimate ∫ f*(ȳ) 1{T(x̄→ȳ) > 0} dμ(ȳ) as the mean of f*(ȳ)/T(x̄→ȳ),
//! and bidirectional path tracing estimates the same integral by its own densities.
//!
//! That needs paths whose kept vertices have no area: point and directional lights, and a pinhole.

use glam::DVec3;
use pathspace_core::color::luminance;
use pathspace_core::description::EmitterDescription;
use pathspace_core::film::RecordingSink;
use pathspace_core::integrator::PathEstimator;
use pathspace_core::{Rgb, Scene};
use pathspace_integrators::bdpt::Bdpt;
use pathspace_integrators::mlt::{Kept, MltPath};
use pathspace_validation::scene_builder::{SceneBuilder, smooth_sphere};
use rayon::prelude::*;

use super::{numbers, only, starts};
use crate::models::{build, mirror, v};

const PROPOSALS: u64 = 10_000;
const SAMPLES: u64 = 120_000;
/// Fixed paths for each mutation.
const STATES: usize = 24;

/// A mirror ball, a glass ball of triangles and a shiny wall under a point light and a beam.
fn scene() -> Scene {
    let mut b = SceneBuilder::new(16);
    let white = b.diffuse(0.7);
    let (glass, mirror) = (b.glass(1.5), b.material(mirror()));
    b.rectangle(v(-1.0, -1.0, 0.0), v(2.0, 0.0, 0.0), v(0.0, 2.0, 0.0), white);
    b.rectangle(v(-1.0, 1.0, 0.0), v(2.0, 0.0, 0.0), v(0.0, 0.0, 1.5), white);
    b.rectangle(v(1.0, -1.0, 0.0), v(0.0, 0.0, 1.5), v(0.0, 2.0, 0.0), mirror);
    b.sphere(v(-0.4, 0.3, 0.4), 0.4, mirror);
    b.mesh(smooth_sphere(0.35, 3), glass).to_world =
        glam::DAffine3::from_translation(v(0.4, -0.2, 0.5));
    b.emitter(EmitterDescription::Point {
        position: v(0.3, 0.2, 1.6),
        intensity: Rgb::new(1.0, 0.8, 0.5),
    });
    b.emitter(EmitterDescription::Directional {
        direction: v(-0.4, 0.5, -1.0),
        irradiance: Rgb::new(0.4, 0.8, 1.0),
    });
    b.look_at(v(0.1, -2.2, 1.4), v(0.0, 0.0, 0.4), DVec3::Z, 45.0);
    build(&b.finish())
}

/// Every path of many samples with its weighted contribution.
fn reference(scene: &Scene, depth: u32) -> Vec<Vec<(MltPath, f64)>> {
    let spec = format!("bdpt:max_depth={depth}").parse().unwrap();
    let bdpt = Bdpt::from_spec(&spec, &Default::default()).unwrap();
    (0..SAMPLES)
        .into_par_iter()
        .map(|item| {
            let mut sink = RecordingSink::default();
            bdpt.estimate(scene, None, &mut numbers(21, item), &mut sink);
            let paths = sink.contributions.iter().zip(sink.records);
            paths
                .filter_map(|(c, r)| {
                    let w = luminance(&c.value.to_array().map(f64::from));
                    Some((MltPath::new(scene, r.path)?, w))
                })
                .collect()
        })
        .collect()
}

/// Sum and sum of squares over `n` to mean and squared standard error.
fn mean(sum: [f64; 2], n: u64) -> (f64, f64) {
    let (n, m) = (n as f64, sum[0] / n as f64);
    (m, (sum[1] / n - m * m) / n)
}

/// The share of the light that proposals from `x` with `kept` can reach, by the proposals and by
/// the reference; with squared errors.
fn compare(mutation: &str, depth: u32, fixed: impl Fn(&MltPath) -> Option<Kept> + Sync) {
    let scene = scene();
    let reference = reference(&scene, depth);
    let chain = only(&scene, mutation, depth);
    let mutator = chain.mutators().next().unwrap();
    let states: Vec<_> = starts(&chain, &scene, 22)
        .filter_map(|(x, _)| Some((fixed(&x)?, x)))
        .take(STATES)
        .collect();
    let results: Vec<_> = states
        .par_iter()
        .enumerate()
        .map(|(index, (kept, x))| {
            let mut sums = [[0.0; 2]; 2];
            let mut add = |side: usize, z: f64| {
                sums[side][0] += z;
                sums[side][1] += z * z;
            };
            for item in 0..PROPOSALS {
                let mut u = numbers(30 + index as u64, item);
                let z =
                    mutator.propose(&scene, x, &mut u).filter(|y| y.kept == *kept).and_then(|y| {
                        let ln = mutator.ln_transition(&scene, x, &y.path, *kept)?;
                        Some(y.path.target() / ln.exp())
                    });
                add(0, z.unwrap_or(0.0));
            }
            for sample in &reference {
                let reached = |y: &MltPath| {
                    // The kept vertices are the same: they have no area.
                    let same = kept.light == 0 || y.vertices()[0] == x.vertices()[0];
                    same && mutator.ln_transition(&scene, x, y, *kept).is_some()
                };
                let z: f64 = sample.iter().filter(|(y, _)| reached(y)).map(|(_, w)| w).sum();
                add(1, z);
            }
            (mean(sums[0], PROPOSALS), mean(sums[1], SAMPLES))
        })
        .collect();
    assert_eq!(results.len(), STATES);
    let mut chi2 = 0.0;
    let (mut a, mut b) = (0.0, 0.0);
    for ((proposed, e), (reached, e2)) in &results {
        let z = (proposed - reached) / (e + e2).sqrt();
        println!("{mutation}: {proposed:.5} against {reached:.5}, z {z:.2}");
        assert!(z.abs() < 5.5, "{mutation}: {proposed} against {reached}");
        chi2 += z * z;
        a += proposed;
        b += reached;
    }
    println!("{mutation}: χ² {chi2:.1} of {STATES}, sums {a:.4} {b:.4}");
    assert!(chi2 < 75.0, "{mutation}: χ² {chi2}");
}

#[test]
fn lens_perturbation_has_its_density() {
    compare("lens", 4, |x| {
        let pinned = x.length() == 2 || (x.length() == 3 && x.is_specular(2));
        pinned.then_some(Kept { light: 1, sensor: 1 })
    });
}

#[test]
fn multi_chain_perturbation_has_its_density() {
    compare("multi", 5, |x| {
        // L D S⁺ D E.
        let k = x.length();
        let pinned = k >= 4
            && !x.is_specular(k - 1)
            && !x.is_specular(1)
            && (2..k - 1).all(|i| x.is_specular(i));
        pinned.then_some(Kept { light: 1, sensor: 1 })
    });
}

#[test]
fn caustic_perturbation_has_its_density() {
    compare("caustic", 4, |x| {
        let k = x.length();
        let pinned = k >= 3 && !x.is_specular(k - 1) && (1..k - 1).all(|i| x.is_specular(i));
        pinned.then_some(Kept { light: 1, sensor: 1 })
    });
}

#[test]
fn manifold_perturbation_has_its_density() {
    compare("manifold", 4, |x| {
        // L S⁺ D E.
        let k = x.length();
        let pinned = k >= 3 && !x.is_specular(k - 1) && (1..k - 1).all(|i| x.is_specular(i));
        pinned.then_some(Kept { light: 1, sensor: 1 })
    });
}

#[test]
fn bidirectional_mutation_has_its_density() {
    let kept = std::sync::atomic::AtomicUsize::new(0);
    compare("bidir", 3, |_| {
        // The whole path, all but the light, all but the pinhole, all but both.
        let all = [[0, 0], [1, 0], [0, 1], [1, 1]];
        let [light, sensor] = all[kept.fetch_add(1, std::sync::atomic::Ordering::Relaxed) % 4];
        Some(Kept { light, sensor })
    });
}
