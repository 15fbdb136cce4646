//! The chains of the built-in integrators.

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::integrator::IntegratorError;
use pathspace_core::random::{Stream, derive_seed};
use pathspace_integrators::bdpt::Bdpt;
use pathspace_integrators::chain::ChainTarget;
use pathspace_integrators::mlt::{Mlt, MltPath, PathChain};
use pathspace_integrators::mmlt::{Mmlt, Multiplexed};
use pathspace_integrators::primary::{
    Integrand, Kernel, PrimaryOptions, PrimaryState, PrimaryTarget,
};
use pathspace_integrators::pssmlt::Estimated;
use pathspace_integrators::pt::PathTracer;
use pathspace_integrators::rjmlt::Rjmlt;
use pathspace_integrators::{Defaults, Registry, Spec, SpecError};

use super::{ChainCheck, independent_rounds, invariance, rank, symmetry, unbiased};

/// Mutations on path space, by their options.
const PATH_MUTATIONS: [&str; 5] = ["bidir", "lens", "caustic", "multi", "manifold"];

/// For [`primary`]: the film position of a path from the sensor, which every point of `pssmlt`
/// begins with.
pub const SENSOR: (Stream, usize) = (Stream::Sensor, 0);
/// For [`primary`]: the technique, with which every point of `mmlt` and `rjmlt` begins. Those by
/// t = 1 read nothing of the sensor's.
pub const SELECTOR: (Stream, usize) = Multiplexed::SELECTOR;

/// Every test of every built-in mutation on primary sample space and on path space, each mutation
/// alone, `starts` bootstrap samples each. The p-values are to be judged together
/// ([`crate::stats::holm`]).
///
/// # Errors
/// Never with the built-in integrators: their own specs are read.
pub fn chain_checks(
    scene: &Scene,
    defaults: &Defaults,
    seed: u64,
    starts: u64,
) -> Result<Vec<ChainCheck>, SpecError> {
    let pt = Arc::new(PathTracer::from_spec(&spec_of("pt")?, defaults)?);
    let bdpt = Arc::new(Bdpt::from_spec(&spec_of("bdpt")?, defaults)?);
    let mmlt = Mmlt::from_spec(&spec_of("mmlt")?, defaults)?;
    let kelemen = PrimaryOptions { mis: false, ..mmlt.options };
    let gaussian = PrimaryOptions { kernel: Kernel::Gaussian { sigma: 1.0 / 64.0 }, ..kelemen };
    let two_stage = PrimaryOptions { two_stage: true, redraw: true, ..kelemen };
    let seed = |i| derive_seed(seed, i);
    let one = |options| PrimaryOptions { redraw: true, ..options };
    let mut checks = Vec::new();
    let target = PrimaryTarget::new(Estimated(pt), one(gaussian));
    checks.extend(primary("pssmlt over pt, gaussian", target, SENSOR, scene, seed(0), starts));
    let target = PrimaryTarget::new(Estimated(bdpt), one(kelemen));
    checks.extend(primary("pssmlt over bdpt, kelemen", target, SENSOR, scene, seed(1), starts));
    let target = PrimaryTarget::new(mmlt.techniques.clone(), kelemen);
    checks.extend(primary("mmlt, kelemen", target, SELECTOR, scene, seed(2), starts));
    let target = PrimaryTarget::new(mmlt.techniques, two_stage);
    checks.extend(primary("mmlt, two-stage", target, SELECTOR, scene, seed(3), starts));
    let rjmlt = Rjmlt::from_spec(&spec_of("rjmlt:jump=0.3")?, defaults)?;
    let target = PrimaryTarget::new(rjmlt.techniques.clone(), rjmlt.options);
    checks.extend(primary("rjmlt", target, SELECTOR, scene, seed(4), starts));
    // Few states have somewhere to jump to. Only sums: over pairs of techniques, of which one makes
    // a path seldom and with a large weight, they are not normal.
    let alone = PrimaryOptions { large: 0.0, jump: 1.0, ..rjmlt.options };
    let target = PrimaryTarget::new(rjmlt.techniques, alone);
    let own = own(SELECTOR);
    checks.extend(invariance("rjmlt, jumps alone", &target, scene, &own, seed(5), 4 * starts));
    for (index, alone) in PATH_MUTATIONS.iter().enumerate() {
        let share = |m: &str| format!("{m}={}", u8::from(m == *alone));
        // Steps over the whole film: where densities are wrong, they are more so the further a step
        // goes.
        let options = format!("mlt:{},area=1", PATH_MUTATIONS.map(share).join(","));
        let target = Mlt::from_spec(&spec_of(&options)?, defaults)?.target(scene);
        checks.extend(path(
            &format!("mlt, {alone}"),
            &target,
            scene,
            seed(10 + index as u64),
            starts,
        ));
    }
    Ok(checks)
}

/// Integrators with chains, each with a bootstrap so small that every step of a small film is a
/// round of its own.
const ROUNDS: [&str; 4] = ["pssmlt", "mmlt", "rjmlt", "mlt"];

/// Independence of the rounds of every integrator with chains, `replicates` of each. To be judged
/// together with [`chain_checks`].
///
/// # Errors
/// Where an integrator does not render the scene.
pub fn round_checks(
    scene: &Arc<Scene>,
    defaults: &Defaults,
    seed: u64,
    replicates: u64,
) -> Result<Vec<ChainCheck>, ChecksError> {
    let registry = Registry::builtin();
    let check = |(index, name): (usize, &&str)| {
        let spec = spec_of(&format!("{name}:bootstrap=64,chains=8"))?;
        let integrator = registry.create(&spec, defaults)?;
        let seed = derive_seed(seed, 20 + index as u64);
        let check = independent_rounds(&*integrator, scene, seed, replicates)?;
        Ok(ChainCheck { mutator: format!("{name}, rounds"), ..check })
    };
    ROUNDS.iter().enumerate().map(check).collect()
}

/// Why the tests of an integrator could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ChecksError {
    /// Its options.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The scene.
    #[error(transparent)]
    Integrator(#[from] IntegratorError),
}

fn spec_of(text: &str) -> Result<Spec, SpecError> {
    text.parse()
}

/// Every test of a chain on path space, with ln f* and the logarithm of the length of the edge at
/// the sensor as functions of its own.
pub fn path(
    name: &str,
    target: &PathChain,
    scene: &Scene,
    seed: u64,
    starts: u64,
) -> Vec<ChainCheck> {
    let own = |x: &MltPath| {
        let last = x.edge(x.length() - 1);
        [x.target().ln(), 0.5 * last.distance2().ln()]
    };
    every(name, target, scene, &own, seed, starts)
}

/// Every test of a chain on primary sample space, with ln f* and one `coordinate` as functions of
/// its own.
///
/// Every evaluation must read that coordinate: one that a state may lack, or have from an earlier
/// state, is no function of where the chain is.
pub fn primary<I: Integrand>(
    name: &str,
    mut target: PrimaryTarget<I>,
    coordinate: (Stream, usize),
    scene: &Scene,
    seed: u64,
    starts: u64,
) -> Vec<ChainCheck> {
    target.prepare(scene, derive_seed(seed, 99));
    every(name, &target, scene, &own(coordinate), seed, starts)
}

fn every<T: ChainTarget>(
    name: &str,
    target: &T,
    scene: &Scene,
    own: &(impl Fn(&T::State) -> [f64; 2] + Sync),
    seed: u64,
    starts: u64,
) -> Vec<ChainCheck> {
    let mut checks = invariance(name, target, scene, own, seed, starts);
    checks.extend(symmetry(name, target, scene, derive_seed(seed, 1), starts));
    // As much work as for one step.
    let long = starts / 4;
    checks.extend(rank(name, target, scene, own, derive_seed(seed, 2), long));
    checks.extend(unbiased(name, target, scene, own, derive_seed(seed, 3), long));
    checks
}

/// ln f* and a coordinate.
fn own((stream, index): (Stream, usize)) -> impl Fn(&PrimaryState) -> [f64; 2] + Sync {
    move |x| {
        let coordinate = x.point.vector.get(stream, index);
        [x.point.f.ln(), coordinate.unwrap_or(0.0).into()]
    }
}
