//! A comparison of integrators on one scene in one call, and what it says, as tables and `--json` show it.

use std::ops::ControlFlow;
use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::integrator::Integrator;
use pathspace_validation::json::number;
use pathspace_validation::pairs::{Judgement, unique_name};
use pathspace_validation::stats::{CompareConfig, StatsError, Verdict};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::analysis::{Questions, analyse};
use crate::budget::Budget;
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

/// Renders all replicates on the current rayon pool and judges them, for programs that want figures and no files; [`Plan`] has several
/// scenes and budgets, goes on after a stop, and tells where it is.
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

/// What one integrator reached. Figures of one replicate, averaged over replicates.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IntegratorSummary {
    /// Spec of the integrator.
    pub integrator: String,
    /// Samples per pixel.
    pub spp: f64,
    /// Wall-clock seconds of rendering, start-up of the integrator included, loading and compiling of another renderer not.
    pub seconds: f64,
    /// Processor seconds of all threads.
    pub cpu_seconds: f64,
    /// Seconds of another renderer for loading and compiling, in all replicates; 0 for ours.
    pub startup_seconds: f64,
    /// MSE over all that this integrator sees: mean over pixels and channels of the variance across replicates, or of the squared
    /// error against a reference.
    pub mse: f64,
    /// The same of error / (mean² + ε).
    pub relmse: f64,
    /// 1 / (mse · seconds).
    pub efficiency: f64,
    /// Replicates finished.
    pub replicates: usize,
    /// Rays of one replicate.
    pub rays: f64,
    /// Contributions that were not finite, in all replicates.
    pub nonfinite: u64,
    /// Mean of the image.
    pub mean: [f64; 3],
    /// Image file, where one was written.
    pub output: Option<String>,
}

/// Two integrators compared on the paths that both can make.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairSummary {
    /// Do they agree?
    #[serde(flatten)]
    pub judgement: Judgement,
    /// MSE of the first on what both make.
    #[serde(deserialize_with = "number")]
    pub mse_a: f64,
    /// MSE of the second on what both make.
    #[serde(deserialize_with = "number")]
    pub mse_b: f64,
    /// Efficiency of the first over that of the second on what both make.
    #[serde(deserialize_with = "number")]
    pub efficiency_ratio: f64,
    /// Lower end of its 95 % interval.
    #[serde(deserialize_with = "number")]
    pub efficiency_ratio_low: f64,
    /// Upper end of its 95 % interval.
    #[serde(deserialize_with = "number")]
    pub efficiency_ratio_high: f64,
}

/// All integrators and all pairs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The integrators.
    pub integrators: Vec<IntegratorSummary>,
    /// Every pair of them.
    pub pairs: Vec<PairSummary>,
}

impl Comparison {
    /// True where a pair differs.
    pub fn any_differ(&self) -> bool {
        self.pairs.iter().any(|p| p.judgement.verdict == Verdict::Differ)
    }
}
