//! The whole algorithm against exact answers.

use pathspace_core::random::derive_seed;
use pathspace_validation::exact::{self, Plan};

use crate::exact::{judge, measure_as};

/// Diffuse scenes, for which the chain is ergodic, length by length; glass with its only path.
const SCENES: [&str; 7] = [
    "integrating sphere",
    "integrating sphere with a point light",
    "concentric spheres",
    "perpendicular rectangles",
    "polygon light",
    "glass in a furnace, from outside",
    "emitter behind a slab",
];

/// Measures the scenes with one integrator: half of its work is the bootstrap, b̂ carries the error
/// of the whole image.
fn suite(spec: &str, replicates: usize, steps: u64, mdb: f64) {
    let mut cells = Vec::new();
    for (index, mut scene) in exact::all().into_iter().enumerate() {
        if !SCENES.contains(&scene.name) {
            continue;
        }
        // Rare lengths of one chain need more mutations than a test has.
        scene.expected.retain(|e| e.length.is_none_or(|k| k <= 3));
        let seed = derive_seed(8, index as u64);
        let plan = Plan { replicates, pilot: steps, most: steps, mdb, seed, ..Plan::default() };
        measure_as(&scene, spec, &plan, &mut cells);
    }
    judge(&cells, mdb);
}

#[test]
fn path_space_metropolis_gives_the_exact_answers() {
    suite("mlt:chains=1024,bootstrap=10000", 32, 24, 0.1);
}

#[test]
fn two_stage_targets_give_the_exact_answers() {
    suite("mlt:chains=1024,bootstrap=10000,target=two-stage", 24, 8, 0.15);
}

#[test]
fn energy_redistribution_gives_the_exact_answers() {
    suite("erpt:mutations=10", 24, 24, 0.1);
}

#[test]
fn energy_redistribution_of_bidirectional_seeds_gives_the_exact_answers() {
    suite("erpt:seeds=bdpt,mutations=20,chains=3", 24, 24, 0.1);
}
