//! A crop window renders the same numbers as its part of the whole image.

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::description::{Crop, SceneDescription};
use pathspace_core::film::{Film, Layers};
use pathspace_core::random::derive_seed;
use pathspace_integrators::{Defaults, Registry};
use pathspace_validation::stats::{holm, welch};
use rayon::prelude::*;

use crate::models;

const CROP: Crop = Crop { x: 9, y: 6, width: 12, height: 14 };
const REPLICATES: u64 = 32;

/// Mean luminance of the four quarters of the window, one row a replicate.
fn quarters(description: &SceneDescription, spec: &str, steps: usize, seed: u64) -> Vec<[f64; 4]> {
    let scene: Arc<Scene> = Arc::new(models::build(description));
    let integrator =
        Registry::builtin().create(&spec.parse().unwrap(), &Defaults::default()).unwrap();
    (0..REPLICATES)
        .into_par_iter()
        .map(|r| {
            let mut film = Film::new(scene.film(), Layers::NONE);
            let mut run = integrator.start(scene.clone(), derive_seed(seed, r)).unwrap();
            for _ in 0..steps {
                run.step(&mut film);
            }
            let (image, mut sums) = (film.image(), [0.0; 4]);
            let own = scene.film().crop;
            for y in 0..CROP.height {
                for x in 0..CROP.width {
                    let (column, row) = (CROP.x + x - own.x, CROP.y + y - own.y);
                    let quarter = (2 * (2 * y / CROP.height) + 2 * x / CROP.width) as usize;
                    sums[quarter] += image[(row * own.width + column) as usize].iter().sum::<f64>();
                }
            }
            sums
        })
        .collect()
}

fn compare(spec: &str, steps: usize) {
    for (name, whole) in
        [("glossy room", models::glossy_room()), ("lens", models::emitters_and_lens())]
    {
        let mut cropped = whole.clone();
        cropped.film.crop = CROP;
        // The window has a sixth of the pixels and so of the samples of a step.
        let a = quarters(&whole, spec, steps, 1);
        let b = quarters(&cropped, spec, 6 * steps, 2);
        let tests = [0, 1, 2, 3].map(|q| {
            let column = |rows: &[[f64; 4]]| rows.iter().map(|r| r[q]).collect::<Vec<_>>();
            welch(&column(&a), &column(&b)).unwrap()
        });
        let p = holm(&tests.map(|t| t.p));
        for (t, p) in tests.iter().zip(p) {
            let text = format!("{spec} on {name}: {t:?}");
            assert!(p > 1e-4, "{text}");
            assert!(t.mdb < 0.1, "{text}");
        }
    }
}

#[test]
fn path_tracing_of_a_window_is_a_window_of_the_image() {
    compare("pt", 20);
}

#[test]
fn light_tracing_of_a_window_is_a_window_of_the_image() {
    compare("lt", 150);
}
