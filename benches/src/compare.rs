//! A comparison of integrators on one scene in one call.

use std::ops::ControlFlow;
use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::integrator::Integrator;
use pathspace_validation::pairs::unique_name;
use pathspace_validation::stats::{CompareConfig, StatsError};
use thiserror::Error;

use crate::analysis::{Questions, analyse};
use crate::budget::Budget;
use crate::comparison::Comparison;
use crate::experiment::{Contestant, ExperimentError, Plan, Setup, Store};

/// What is compared.
pub struct Contest {
    /// The scene.
    pub scene: Arc<Scene>,
    /// The integrators.
    pub integrators: Vec<Box<dyn Integrator>>,
    /// Budget of one replicate.
    pub budget: Budget,
    /// Replicates of each integrator.
    pub replicates: u32,
    /// Seed from which those of the replicates are derived.
    pub seed: u64,
}

/// Why there is no comparison.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CompareError {
    /// An integrator does not render the scene, or there is no place for temporary files.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// With fewer than two replicates, or means that are not finite.
    #[error(transparent)]
    Stats(#[from] StatsError),
}

/// Renders all replicates on the current rayon pool and judges them, for programs that want figures
/// and no files; [`Plan`] has several scenes and budgets, goes on after a stop, and tells where it
/// is.
///
/// # Errors
/// [`CompareError`].
pub fn compare(contest: Contest, tests: &CompareConfig) -> Result<Comparison, CompareError> {
    let Contest { scene, integrators, budget, replicates, seed } = contest;
    let mut contestants: Vec<(String, Contestant)> = Vec::new();
    for integrator in integrators {
        let name = unique_name(integrator.spec(), |n| contestants.iter().any(|c| c.0 == n));
        contestants.push((name, Contestant::Own(integrator)));
    }
    let (name, hash, key) = ("scene".to_owned(), String::new(), String::new());
    let setups = vec![Setup { name, hash, key, scene, contestants }];
    let budgets = vec![budget];
    let mut plan = Plan { setups, budgets, replicates, seed, threads: 0, failures: Vec::new() };
    let store = Store::temporary().map_err(ExperimentError::from)?;
    plan.run(&store, &mut |_| ControlFlow::Continue(()))?;
    let questions = Questions { tests: *tests, ..Questions::default() };
    Ok(analyse(&plan, &store, &plan.setups[0], None, &questions)?.comparison)
}
