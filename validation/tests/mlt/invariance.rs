//! Every mutation alone leaves the target as it is: one step from starts of known weight changes no
//! mean.

use pathspace_core::Scene;
use pathspace_core::color::luminance;
use pathspace_core::film::RecordingSink;
use pathspace_core::integrator::PathEstimator;
use pathspace_integrators::bdpt::Bdpt;
use pathspace_integrators::chain::ChainTarget;
use pathspace_integrators::mlt::{MltPath, PathChain};
use pathspace_scenes::library;
use pathspace_validation::stats::holm;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

use super::{numbers, only};
use crate::models;

/// Level of all tests here together.
const ALPHA: f64 = 1e-5;

/// Functions of a path that a wrong transition density moves.
fn observed(x: &MltPath) -> [f64; 8] {
    let k = x.length();
    let deltas = (1..k).filter(|&i| x.is_specular(i)).count();
    let film = x.film();
    let distance = |i: usize| x.edge(i).distance2().max(1e-12).ln();
    let shortest = (0..k).map(distance).fold(f64::INFINITY, f64::min);
    let cos: f64 = (0..k).map(|i| x.edge(i).cos_a() + x.edge(i).cos_b()).sum::<f64>() / k as f64;
    [
        f64::from(film.x),
        f64::from(film.y),
        distance(k - 1),
        k as f64,
        x.target().ln(),
        deltas as f64,
        shortest,
        cos,
    ]
}
const NAMES: [&str; 8] = [
    "film x",
    "film y",
    "last edge",
    "length",
    "ln f*",
    "delta vertices",
    "shortest edge",
    "cosines",
];

/// How much is tried.
struct Plan {
    /// Samples of bidirectional path tracing; every path of a sample that the mutation applies to
    /// is a start.
    samples: u64,
    /// Proposals from each start: their mean has the expectation of one.
    tries: u32,
    /// Fewest proposals with f > 0 in all.
    fewest: u64,
}

/// z of E[Σ w a (h(y) − h(x))] = 0 for each h, with w the weighted contribution of each path of a
/// sample; and how many proposals there were.
fn one_step(scene: &Scene, chain: &PathChain, plan: &Plan, seed: u64) -> ([f64; 8], u64) {
    const BATCHES: u64 = 100;
    let bdpt = "bdpt:max_depth=6".parse().unwrap();
    let bdpt = Bdpt::from_spec(&bdpt, &Default::default()).unwrap();
    let mutator = chain.mutators().next().unwrap();
    let batches: Vec<_> = (0..BATCHES)
        .into_par_iter()
        .map(|batch| {
            let (mut sum, mut sum2, mut moves) = ([0.0; 8], [0.0; 8], 0);
            for i in 0..plan.samples / BATCHES {
                let mut u = numbers(seed, batch * plan.samples / BATCHES + i);
                let mut sink = RecordingSink::default();
                bdpt.estimate(scene, None, &mut u, &mut sink);
                let mut z = [0.0; 8];
                for (contribution, record) in sink.contributions.iter().zip(sink.records) {
                    let Some(mut x) = MltPath::new(scene, record.path) else { continue };
                    if !mutator.applies(&x) {
                        continue;
                    }
                    let w = luminance(&contribution.value.to_array().map(f64::from));
                    let hx = observed(&x);
                    for _ in 0..plan.tries {
                        let proposal = chain.propose(scene, &mut x, &mut u);
                        let Some(y) = proposal.state else { continue };
                        moves += 1;
                        let hy = observed(&y);
                        for j in 0..8 {
                            z[j] += w * proposal.acceptance * (hy[j] - hx[j]);
                        }
                    }
                }
                for j in 0..8 {
                    sum[j] += z[j];
                    sum2[j] += z[j] * z[j];
                }
            }
            (sum, sum2, moves)
        })
        .collect();
    let total = |f: &dyn Fn(usize) -> f64| (0..batches.len()).map(f).sum::<f64>();
    let z = std::array::from_fn(|j| {
        let (sum, sum2) = (total(&|b| batches[b].0[j]), total(&|b| batches[b].1[j]));
        if sum2 > 0.0 { sum / sum2.sqrt() } else { 0.0 }
    });
    (z, batches.iter().map(|b| b.2).sum())
}

fn p_value(z: f64) -> f64 {
    let normal = Normal::standard();
    2.0 * normal.sf(z.abs())
}

/// The models, and caustics through thin glass and under water.
fn scenes() -> Vec<(&'static str, Scene)> {
    let mut scenes = models::all();
    scenes.extend(["glass-lamp", "water-pool"].map(|name| {
        let loaded = library::find(name).unwrap().load(&[("res".into(), "32".into())]).unwrap();
        (name, models::build(&loaded.description))
    }));
    scenes
}

fn invariant(mutation: &str, plan: &Plan) {
    let mut p = Vec::new();
    let mut found = Vec::new();
    let mut all = 0;
    for (index, (name, scene)) in scenes().into_iter().enumerate() {
        let chain = only(&scene, mutation, 6);
        let (z, moves) = one_step(&scene, &chain, plan, 10 + index as u64);
        println!("{mutation} on {name}: {moves} proposals, z {z:.2?}");
        all += moves;
        for (what, z) in NAMES.iter().zip(z) {
            p.push(p_value(z));
            found.push(format!("{mutation} on {name}, {what}: z {z:.2}"));
        }
    }
    assert!(all >= plan.fewest, "{mutation}: only {all} proposals");
    for (p, what) in holm(&p).into_iter().zip(found) {
        assert!(p > ALPHA, "{what}");
    }
}

#[test]
fn bidirectional_mutation_leaves_the_target_invariant() {
    invariant("bidir", &Plan { samples: 40_000, tries: 1, fewest: 100_000 });
}

#[test]
fn lens_perturbation_leaves_the_target_invariant() {
    invariant("lens", &Plan { samples: 40_000, tries: 1, fewest: 100_000 });
}

#[test]
fn caustic_perturbation_leaves_the_target_invariant() {
    invariant("caustic", &Plan { samples: 100_000, tries: 4, fewest: 100_000 });
}

#[test]
fn multi_chain_perturbation_leaves_the_target_invariant() {
    invariant("multi", &Plan { samples: 200_000, tries: 8, fewest: 100_000 });
}

#[test]
fn manifold_perturbation_leaves_the_target_invariant() {
    invariant("manifold", &Plan { samples: 100_000, tries: 4, fewest: 50_000 });
}
