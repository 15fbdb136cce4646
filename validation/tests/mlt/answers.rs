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

#[test]
fn path_space_metropolis_gives_the_exact_answers() {
    let mut cells = Vec::new();
    for (index, mut scene) in exact::all().into_iter().enumerate() {
        if !SCENES.contains(&scene.name) {
            continue;
        }
        // Rare lengths of one chain need more mutations than a test has.
        scene.expected.retain(|e| e.length.is_none_or(|k| k <= 3));
        let seed = derive_seed(8, index as u64);
        // Half of it is the bootstrap: b̂ carries the error of the whole image.
        let plan = Plan { replicates: 32, pilot: 6, most: 24, mdb: 0.1, seed, ..Plan::default() };
        measure_as(&scene, "mlt:chains=1024,bootstrap=10000", &plan, &mut cells);
    }
    judge(&cells, 0.1);
}
