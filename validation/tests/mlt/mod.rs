//! Path-space Metropolis: states against the oracle, every mutation alone, the whole against exact
//! answers.

mod answers;
mod balance;
mod checkpoints;
mod densities;
mod invariance;
mod normals;
mod options;
mod states;

use pathspace_core::Scene;
use pathspace_core::random::{Address, RandomStream};
use pathspace_integrators::chain::ChainTarget;
use pathspace_integrators::mlt::{Mlt, MltPath, PathChain};

/// The numbers of item `item` of a test.
fn numbers(seed: u64, item: u64) -> RandomStream {
    RandomStream::new(Address { seed, step: 0, item })
}

/// A chain with the mutations that `options` name.
fn chain(scene: &Scene, options: &str) -> PathChain {
    let spec = format!("mlt:{options}").parse().unwrap();
    Mlt::from_spec(&spec, &Default::default()).unwrap().target(scene)
}

/// One mutation alone, by its name.
fn only(scene: &Scene, name: &str, max_depth: u32) -> PathChain {
    let shares: Vec<String> = ["bidir", "lens", "caustic", "multi", "manifold"]
        .iter()
        .map(|m| format!("{m}={}", u8::from(*m == name)))
        .collect();
    // Large steps: where densities are wrong, they are more so the further a step goes.
    chain(scene, &format!("{},area=1,max_depth={max_depth}", shares.join(",")))
}

/// The starts of a chain with their weights.
fn starts<'a>(
    chain: &'a PathChain,
    scene: &'a Scene,
    seed: u64,
) -> impl Iterator<Item = (MltPath, f64)> + 'a {
    (0..).filter_map(move |item| chain.bootstrap(scene, &mut numbers(seed, item)))
}
