//! Holds an integrator to what a scene must give.

use std::sync::Arc;

use pathspace_core::film::{Film, Layers};
use pathspace_core::integrator::{Integrator, IntegratorError, Run};
use pathspace_core::random::derive_seed;
use pathspace_core::{Scene, SceneError};
use rayon::prelude::*;

use super::{ExactLength, ExactScene};
use crate::stats::{CompareConfig, PairReport, ReplicateSet, StatsError, Verdict, compare_exact};

/// How long to measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Replicates, each with a seed of its own.
    pub replicates: usize,
    /// Steps of each replicate before it is looked at for the first time.
    pub pilot: u64,
    /// Most steps of each replicate.
    pub most: u64,
    /// Rays of all replicates together after which none begins a further step.
    pub rays: u64,
    /// The relative minimum detectable bias to reach in every cell.
    pub mdb: f64,
    /// Seed of all.
    pub seed: u64,
}

impl Default for Plan {
    fn default() -> Self {
        Plan { replicates: 24, pilot: 4, most: 2000, rays: u64::MAX, mdb: 0.005, seed: 1 }
    }
}

/// Why nothing could be measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExactError {
    /// The scene is not one.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The integrator refuses the scene.
    #[error(transparent)]
    Integrator(#[from] IntegratorError),
    /// Statistics of too little or broken data.
    #[error(transparent)]
    Stats(#[from] StatsError),
    /// Contributions that were NaN or infinite.
    #[error("{count} contributions are not finite, the first {first}")]
    NonFinite {
        /// How many.
        count: u64,
        /// What replays one.
        first: String,
    },
}

/// Runs replicates of `integrator` on `scene` until every cell that it can see has a minimum detectable bias of `plan.mdb`, or as
/// long as the plan allows, and compares with the exact values. The number of steps depends on the variances alone,
/// so that the means stay unbiased but for a vanishing dependence of the two.
///
/// # Errors
/// Where the scene or the integrator does not start or a contribution is not finite. An integrator that sees none of the paths gives a report
/// without cells.
pub fn measure(
    scene: &ExactScene,
    integrator: &dyn Integrator,
    plan: &Plan,
    config: &CompareConfig,
) -> Result<PairReport, ExactError> {
    let built = Arc::new(Scene::new(&scene.description)?);
    let expected = scene.seen_by(integrator.families(&built));
    if expected.is_empty() {
        return Ok(PairReport {
            a: integrator.spec(),
            b: "exact".into(),
            replicates_a: 0,
            replicates_b: 0,
            verdict: Verdict::Inconclusive,
            p: 1.0,
            mdb: f64::INFINITY,
            cells: Vec::new(),
        });
    }
    let mut replicates = Vec::with_capacity(plan.replicates);
    for r in 0..plan.replicates {
        let run = integrator.start(built.clone(), derive_seed(plan.seed, r as u64))?;
        let film = Film::new(built.film(), Layers { length: true, ..Layers::NONE });
        replicates.push((run, film));
    }
    let (mut steps, mut rays) = (0_u64, 0_u64);
    let mut more = plan.pilot.min(plan.most);
    loop {
        rays += expose(&mut replicates, more);
        steps += more;
        let report = report(&expected, &replicates, integrator, config)?;
        let reached = report.mdb <= plan.mdb;
        if reached || steps >= plan.most || rays >= plan.rays {
            return Ok(report);
        }
        // Standard errors fall with the root of the steps; a tenth more than that.
        let want = steps as f64 * (report.mdb / plan.mdb).powi(2) * 1.1;
        more = (want.min(plan.most as f64).ceil() as u64).saturating_sub(steps).max(1);
        // What the rays that are left will do.
        let left = (plan.rays - rays) as f64 / (rays as f64 / steps as f64).max(1.0);
        more = more.min(plan.most - steps).min((left.ceil() as u64).max(1));
    }
}

/// Runs every replicate for `steps` steps; rays of all, or samples where an integrator counts no rays.
fn expose(replicates: &mut [(Box<dyn Run>, Film)], steps: u64) -> u64 {
    let cost = |(run, film): &mut (Box<dyn Run>, Film)| -> u64 {
        let works = (0..steps).map(|_| run.step(film));
        works.map(|work| work.rays.max(work.samples)).sum()
    };
    replicates.par_iter_mut().map(cost).sum()
}

fn report(
    expected: &[ExactLength],
    replicates: &[(Box<dyn Run>, Film)],
    integrator: &dyn Integrator,
    config: &CompareConfig,
) -> Result<PairReport, ExactError> {
    let arm = integrator.spec();
    let mut set = ReplicateSet::new(expected.iter().map(ExactLength::cell).collect());
    for (_, film) in replicates {
        if film.nonfinite() > 0 {
            let first = format!("{:?}", film.nonfinite_examples().first());
            return Err(ExactError::NonFinite { count: film.nonfinite(), first });
        }
        set.push(&arm, expected.iter().map(|e| e.observe(film)).collect())?;
    }
    let exact: Vec<f64> = expected.iter().map(|e| e.mean).collect();
    let uncertainty: Vec<f64> = expected.iter().map(|e| e.uncertainty).collect();
    Ok(compare_exact(&set, &arm, &exact, &uncertainty, config)?)
}
