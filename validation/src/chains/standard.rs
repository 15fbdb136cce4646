//! The chains of the built-in integrators.

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::random::{Stream, derive_seed};
use pathspace_integrators::bdpt::Bdpt;
use pathspace_integrators::chain::ChainTarget;
use pathspace_integrators::mmlt::Mmlt;
use pathspace_integrators::primary::{
    Integrand, Kernel, PrimaryOptions, PrimaryState, PrimaryTarget,
};
use pathspace_integrators::pssmlt::Estimated;
use pathspace_integrators::pt::PathTracer;
use pathspace_integrators::{Defaults, SpecError};

use super::{ChainCheck, invariance, rank, symmetry, unbiased};

/// Every test of every built-in mutation on primary sample space, `starts` bootstrap samples each. The p-values are to be judged together
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
    let spec = |text: &str| text.parse();
    let pt = Arc::new(PathTracer::from_spec(&spec("pt")?, defaults)?);
    let bdpt = Arc::new(Bdpt::from_spec(&spec("bdpt")?, defaults)?);
    let mmlt = Mmlt::from_spec(&spec("mmlt")?, defaults)?;
    let kelemen = PrimaryOptions { mis: false, ..mmlt.options };
    let gaussian = PrimaryOptions { kernel: Kernel::Gaussian { sigma: 1.0 / 64.0 }, ..kelemen };
    let two_stage = PrimaryOptions { two_stage: true, redraw: true, ..kelemen };
    let seed = |i| derive_seed(seed, i);
    let one = |options| PrimaryOptions { redraw: true, ..options };
    let mut checks = Vec::new();
    let target = PrimaryTarget::new(Estimated(pt), one(gaussian));
    checks.extend(primary("pssmlt over pt, gaussian", target, scene, seed(0), starts));
    let target = PrimaryTarget::new(Estimated(bdpt), one(kelemen));
    checks.extend(primary("pssmlt over bdpt, kelemen", target, scene, seed(1), starts));
    let target = PrimaryTarget::new(mmlt.techniques.clone(), kelemen);
    checks.extend(primary("mmlt, kelemen", target, scene, seed(2), starts));
    let target = PrimaryTarget::new(mmlt.techniques, two_stage);
    checks.extend(primary("mmlt, two-stage", target, scene, seed(3), starts));
    Ok(checks)
}

/// Every test of a chain on primary sample space, with ln f* and the first coordinate as functions of its own.
pub fn primary<I: Integrand>(
    name: &str,
    mut target: PrimaryTarget<I>,
    scene: &Scene,
    seed: u64,
    starts: u64,
) -> Vec<ChainCheck> {
    target.prepare(scene, derive_seed(seed, 99));
    let own = |x: &PrimaryState| {
        let coordinate = x.point.vector.get(Stream::Sensor, 0);
        [x.point.f.ln(), coordinate.unwrap_or(0.0).into()]
    };
    let mut checks = invariance(name, &target, scene, &own, seed, starts);
    checks.extend(symmetry(name, &target, scene, derive_seed(seed, 1), starts));
    // As much work as for one step.
    let long = starts / 4;
    checks.extend(rank(name, &target, scene, &own, derive_seed(seed, 2), long));
    checks.extend(unbiased(name, &target, scene, &own, derive_seed(seed, 3), long));
    checks
}
