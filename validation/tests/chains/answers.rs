//! Films of chains have the mean of bidirectional path tracing, whatever the bootstrap, the chains
//! and the options.

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::color::luminance;
use pathspace_core::description::FilmDescription;
use pathspace_core::film::{Film, LayerKey, Layers};
use pathspace_core::path::WalkRules;
use pathspace_core::random::derive_seed;
use pathspace_integrators::{Defaults, Registry};
use pathspace_validation::exact::{self, Plan};
use pathspace_validation::stats::{holm, welch};
use rayon::prelude::*;

use crate::exact::{judge, measure_as};
use crate::models;

/// Level of each test as a whole.
const ALPHA: f64 = 1e-5;
const LENGTHS: u16 = 4;

fn scene() -> Arc<Scene> {
    let mut description = models::emitters_and_lens();
    description.film = FilmDescription::new(8, 8);
    Arc::new(models::build(&description))
}

/// Replicate means of luminance by path length, and of the left half of the film.
fn replicates(scene: &Arc<Scene>, spec: &str, seed: u64, count: u64, steps: u32) -> Vec<Vec<f64>> {
    let rules = WalkRules { max_length: Some(LENGTHS.into()), ..WalkRules::default() };
    let integrator =
        Registry::builtin().create(&spec.parse().unwrap(), &Defaults { rules }).unwrap();
    let rows: Vec<Vec<f64>> = (0..count)
        .into_par_iter()
        .map(|r| {
            let mut film = Film::new(scene.film(), Layers { length: true, ..Layers::NONE });
            let mut run = integrator.start(scene.clone(), derive_seed(seed, r)).unwrap();
            for _ in 0..steps {
                run.step(&mut film);
            }
            assert_eq!(film.nonfinite(), 0);
            let mean = |image: &[[f64; 3]]| image.iter().map(luminance).sum::<f64>() / 64.0;
            let mut row: Vec<f64> = (1..=LENGTHS)
                .map(|k| film.layer_image(LayerKey::Length(k)).map_or(0.0, |l| mean(&l)))
                .collect();
            let image = film.image();
            let left = image.iter().enumerate().filter(|(i, _)| i % 8 < 4);
            row.push(left.map(|(_, p)| luminance(p)).sum::<f64>() / 64.0);
            row.push(mean(&image));
            row
        })
        .collect();
    (0..rows[0].len()).map(|c| rows.iter().map(|r| r[c]).collect()).collect()
}

fn agree(specs: &[&str], count: u64, steps: u32) {
    let scene = scene();
    let reference = replicates(&scene, "bdpt", 1, 128, 60);
    let mut results = Vec::new();
    for (i, spec) in specs.iter().enumerate() {
        let method = replicates(&scene, spec, 100 + i as u64, count, steps);
        for (cell, (a, b)) in method.iter().zip(&reference).enumerate() {
            let t = welch(a, b).unwrap();
            println!(
                "{spec}, cell {cell}: {:.5} against {:.5}, p {:.1e}, mdb {:.2} %",
                t.mean_a,
                t.mean_b,
                t.p,
                100.0 * t.mdb
            );
            results.push((format!("{spec}, cell {cell}: {t:?}"), t.p, t.mdb));
        }
    }
    let p = holm(&results.iter().map(|r| r.1).collect::<Vec<_>>());
    let wrong: Vec<_> = results.iter().zip(&p).filter(|(_, p)| **p < ALPHA).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// With eight bootstrap samples the normalisation of a replicate is off by tens of per cent: only
/// with its own starts does it average out.
#[test]
fn films_with_eight_bootstrap_samples_are_unbiased() {
    agree(
        &[
            "pssmlt:bootstrap=8,chains=3",
            "pssmlt:bootstrap=8,chains=16,mis=false,stratify=true,kernel=gaussian",
            "pssmlt:over=pt,bootstrap=8,chains=5,target=two-stage,large=0.5",
            "pssmlt:over=pt,bootstrap=8,chains=2,mis=false,large=0",
            "mmlt:bootstrap=8,chains=16",
            "mmlt:bootstrap=8,chains=3,lengths=step,mis=true,continue=0.6",
            "mmlt:bootstrap=8,chains=100,lengths=step,target=two-stage,stratify=true",
            "rjmlt:bootstrap=8,chains=16,jump=0.5",
            "rjmlt:bootstrap=8,chains=5,large=0,jump=0.2,kernel=gaussian,target=two-stage",
        ],
        1000,
        2,
    );
}

/// A/A: brightness does not depend on settings.
#[test]
fn brightness_does_not_depend_on_mutations_chains_or_bootstrap() {
    let scene = scene();
    let total = |spec: &str, seed: u64, steps: u32| {
        replicates(&scene, spec, seed, 32, steps).pop().unwrap()
    };
    for (i, base) in ["pssmlt:mis=false", "pssmlt", "mmlt"].into_iter().enumerate() {
        let seed = 10 * i as u64;
        let with = |chains: u32, bootstrap: u32| {
            let separator = if base.contains(':') { ',' } else { ':' };
            format!("{base}{separator}chains={chains},bootstrap={bootstrap}")
        };
        let methods = [
            total(&with(64, 8000), seed, 10),
            total(&with(64, 8000), seed + 1, 80),
            total(&with(1, 8000), seed + 2, 40),
            total(&with(2000, 2000), seed + 3, 20),
        ];
        for other in &methods[1..] {
            let t = welch(&methods[0], other).unwrap();
            println!(
                "{base}: {:.5} against {:.5}, p {:.1e}, mdb {:.3}",
                t.mean_a, t.mean_b, t.p, t.mdb
            );
            assert!(t.p > ALPHA && t.mdb < 0.25, "{base}: {t:?}");
        }
    }
}

/// Scenes whose lengths a short chain visits often enough.
const EXACT: [&str; 8] = [
    "white furnace",
    "integrating sphere",
    "integrating sphere with a point light",
    "concentric spheres",
    "perpendicular rectangles",
    "polygon light",
    "glass in a furnace, from outside",
    "emitter behind a slab",
];

/// Steps of every replicate: most of the work is the bootstrap, which a pilot would do twice.
const STEPS: u64 = 4;

fn exact_answers(spec: &str, seed: u64, mdb: f64) {
    let mut cells = Vec::new();
    for (index, mut scene) in exact::all().into_iter().enumerate() {
        if !EXACT.contains(&scene.name) {
            continue;
        }
        scene.expected.retain(|e| e.length.is_none_or(|k| k <= 3));
        let seed = derive_seed(seed, index as u64);
        let plan = Plan { replicates: 32, pilot: STEPS, most: STEPS, mdb, seed, ..Plan::default() };
        measure_as(&scene, spec, &plan, &mut cells);
    }
    judge(&cells, mdb);
}

#[test]
fn pssmlt_gives_the_exact_answers() {
    exact_answers("pssmlt:chains=64,bootstrap=2000", 31, 0.05);
    exact_answers("pssmlt:over=pt,chains=64,bootstrap=2000,mis=false,kernel=gaussian", 32, 0.05);
}

#[test]
fn mmlt_gives_the_exact_answers() {
    exact_answers("mmlt:chains=256,bootstrap=40000", 33, 0.05);
}

#[test]
fn rjmlt_gives_the_exact_answers() {
    exact_answers("rjmlt:chains=256,bootstrap=40000,jump=0.2", 34, 0.05);
}
