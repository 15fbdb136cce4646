//! What `--error` does to the mean of an image: rendering stops on the estimate that it is judged
//! by.
//!
//! An estimator with fireflies is run until its relative error is surely below a target, with many
//! seeds; and with fixed numbers of samples, as many as those runs took on average. Printed are the
//! mean over seeds, relative to the truth 1, with its standard error, and how many runs ended
//! darker than 1. Run with `cargo run --release -p pathspace-benches --example stopping -- 10000`.

use glam::Vec2;
use pathspace_benches::Precision;
use pathspace_core::color::{Rgb, luminance};
use pathspace_core::description::FilmDescription;
use pathspace_core::film::{Chunk, Contribution, Families, Film, Layers, Sink};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// Pixels of a side.
const SIDE: u32 = 8;
/// Most samples per pixel of a run.
const MOST: u32 = 20_000;
/// Share of the light that comes in fireflies.
const RARE: f64 = 0.5;

/// One sample of every pixel: ½ always, and ½/p with probability p.
fn add_sample(film: &mut Film, random: &mut Pcg32, p: f64) {
    let mut chunk = Chunk::new(film.layers());
    for i in 0..SIDE * SIDE {
        let u = f64::from(random.next_u32()) / 4_294_967_296.0;
        let value = 1.0 - RARE + if u < p { RARE / p } else { 0.0 };
        chunk.add(Contribution {
            film: Vec2::new((i % SIDE) as f32 + 0.5, (i / SIDE) as f32 + 0.5),
            value: Rgb::grey(value as f32),
            weight: 1.0,
            s: 0,
            t: 2,
            emitter: 0,
            families: Families::ALL,
        });
    }
    film.apply(&chunk);
    film.add_samples(film.pixels());
}

/// Mean of the image and samples per pixel of one run, until the error or for a fixed number of
/// samples.
fn run(seed: u64, p: f64, target: Option<f64>, samples: u32) -> (f64, f64) {
    let mut random = Pcg32::seed_from_u64(seed);
    let mut film = Film::new(&FilmDescription::new(SIDE, SIDE), Layers::NONE);
    let mut precision = Precision::new(film.pixels());
    for _ in 0..samples {
        add_sample(&mut film, &mut random, p);
        if let Some(target) = target {
            precision.end_batch(&film);
            if precision.error(&film).is_some_and(|e| e.high <= target) {
                break;
            }
        }
    }
    (luminance(&film.mean()), film.samples_per_pixel())
}

fn main() {
    let seeds: u64 = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(1000);
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    println!(
        "fireflies a sample of the image, target: spp, mean until the error (dark), mean with as many samples fixed (dark)"
    );
    for rate in [4.0, 1.0, 0.25, 0.0625] {
        for target in [0.5, 0.1] {
            let p = rate / f64::from(SIDE * SIDE);
            let stopped: Vec<(f64, f64)> =
                (0..seeds).map(|seed| run(seed, p, Some(target), MOST)).collect();
            let spp = mean(&stopped.iter().map(|r| r.1).collect::<Vec<_>>());
            let fixed: Vec<(f64, f64)> =
                (0..seeds).map(|seed| run(seed + seeds, p, None, spp.round() as u32)).collect();
            let tell = |runs: &[(f64, f64)]| {
                let values: Vec<f64> = runs.iter().map(|r| r.0).collect();
                let m = mean(&values);
                let variance = mean(&values.iter().map(|v| (v - m) * (v - m)).collect::<Vec<_>>());
                let dark = values.iter().filter(|v| **v < 1.0).count() as f64 / seeds as f64;
                let error = (variance / seeds as f64).sqrt();
                format!("{m:.4} ± {error:.4} ({:.0} %)", 100.0 * dark)
            };
            println!("{rate}, {target}: {spp:.1}, {}, {}", tell(&stopped), tell(&fixed));
        }
    }
}
