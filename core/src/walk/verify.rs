//! Debug builds recompute one in every [`EVERY`] weights by the oracle (after Mitsuba 0.6,
//! `verification.cpp`).

use std::cell::Cell;

use super::connect::joined;
use super::subpath::{Walk, WalkVertex};
use crate::path::{Technique, WalkRules, ln_density};
use crate::scene::Scene;

/// How seldom: the oracle takes the time of thousands of weights.
const EVERY: u64 = 1024;

/// Largest difference for a path without short edges.
const TOLERANCE: f64 = 1e-4;

/// Positions are `f32` in the unit sphere, so a direction errs by about 2⁻²⁴ over the length d of
/// its edge, and its cosine by that over the cosine; the densities of a weight feel the shortest d
/// cosθ several times.
const PER_INVERSE_LENGTH: f64 = 64.0 / 16_777_216.0;

thread_local! {
    static SEEN: Cell<u64> = const { Cell::new(0) };
}

/// Compares a weight with the oracle's, now and then.
///
/// # Panics
/// Where they differ: a bug in the running sums.
pub(super) fn verify(
    scene: &Scene,
    walk: &Walk,
    light: &[WalkVertex],
    sensor: &[WalkVertex],
    weight: f64,
) {
    let seen = SEEN.with(|n| n.replace(n.get() + 1));
    if !seen.is_multiple_of(EVERY) {
        return;
    }
    let path = joined(light, sensor);
    let rules = WalkRules { max_length: None, rr_depth: walk.rr_depth };
    let k = path.length();
    let densities: Vec<_> = (0..=k + 1)
        .map(|s| {
            let t = k + 1 - s;
            let on = walk.weights.techniques.contains(s, t);
            on.then(|| ln_density(scene, &path, Technique::new(s, t), &rules)).flatten()
        })
        .collect();
    let oracle = walk.weights.heuristic.weight_ln(light.len(), &densities);
    let shortest = path
        .vertices
        .windows(2)
        .map(|w| w[0].edge_to(&w[1]))
        .map(|e| e.distance2().sqrt() * e.cos_a().abs().min(e.cos_b().abs()))
        .fold(1.0, f64::min);
    assert!(
        (oracle - weight).abs() <= TOLERANCE + PER_INVERSE_LENGTH / shortest,
        "weight {weight} of technique ({}, {}) should be {oracle}: {path:?}",
        light.len(),
        sensor.len()
    );
}
