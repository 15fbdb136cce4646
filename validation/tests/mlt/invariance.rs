//! Every mutation alone leaves the target as it is: one step from starts of known weight changes no mean.

use pathspace_core::Scene;
use pathspace_integrators::chain::ChainTarget;
use pathspace_integrators::mlt::{MltPath, PathChain};
use pathspace_validation::stats::holm;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

use super::{numbers, only};
use crate::models;

/// Level of all tests here together.
const ALPHA: f64 = 1e-5;
const STARTS: u64 = 100_000;

/// Functions of a path that a wrong transition density moves.
fn observed(x: &MltPath) -> [f64; 8] {
    let k = x.length();
    let deltas = (1..k).filter(|&i| x.is_delta(i)).count();
    let film = x.film();
    let shortest =
        (0..k).map(|i| x.edge(i).distance2()).fold(f64::INFINITY, f64::min).max(1e-12).ln();
    let cos: f64 = (0..k).map(|i| x.edge(i).cos_a() + x.edge(i).cos_b()).sum::<f64>() / k as f64;
    [
        f64::from(film.x),
        f64::from(film.y),
        f64::from((film.x - 16.0) * (film.y - 16.0)),
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
    "film xy",
    "length",
    "ln f*",
    "delta vertices",
    "shortest edge",
    "cosines",
];

/// z of E[W a (h(y) − h(x))] = 0 for each h; and how many proposals there were.
fn one_step(scene: &Scene, chain: &PathChain, seed: u64) -> ([f64; 8], u64) {
    let batches: Vec<_> = (0..100)
        .into_par_iter()
        .map(|batch| {
            let (mut sum, mut sum2, mut moves) = ([0.0; 8], [0.0; 8], 0);
            for i in 0..STARTS / 100 {
                let mut u = numbers(seed, batch * STARTS / 100 + i);
                let Some((mut x, w)) = chain.bootstrap(scene, &mut u) else { continue };
                let proposal = chain.propose(scene, &mut x, &mut u);
                let Some(y) = proposal.state else { continue };
                moves += 1;
                let (hx, hy) = (observed(&x), observed(&y));
                for j in 0..8 {
                    let z = w * proposal.acceptance * (hy[j] - hx[j]);
                    sum[j] += z;
                    sum2[j] += z * z;
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

fn invariant(mutation: &str, fewest: u64) {
    let mut p = Vec::new();
    let mut found = Vec::new();
    let mut all = 0;
    for (index, (name, scene)) in models::all().into_iter().enumerate() {
        let chain = only(&scene, mutation, 6);
        let (z, moves) = one_step(&scene, &chain, 10 + index as u64);
        println!("{mutation} on {name}: {moves} proposals, z {z:.2?}");
        all += moves;
        for (what, z) in NAMES.iter().zip(z) {
            p.push(p_value(z));
            found.push(format!("{mutation} on {name}, {what}: z {z:.2}"));
        }
    }
    assert!(all >= fewest, "{mutation}: only {all} proposals");
    for (p, what) in holm(&p).into_iter().zip(found) {
        assert!(p > ALPHA, "{what}");
    }
}

#[test]
fn bidirectional_mutation_leaves_the_target_invariant() {
    invariant("bidir", 50_000);
}

#[test]
fn lens_perturbation_leaves_the_target_invariant() {
    invariant("lens", 50_000);
}

#[test]
fn caustic_perturbation_leaves_the_target_invariant() {
    invariant("caustic", 5000);
}

#[test]
fn multi_chain_perturbation_leaves_the_target_invariant() {
    invariant("multi", 5000);
}
