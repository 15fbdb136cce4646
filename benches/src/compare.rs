//! Comparison of integrators: do they agree on what both can make, and how fast is each?

use pathspace_validation::json::number;
use pathspace_validation::pairs::{Judgement, judge};
use pathspace_validation::stats::{CompareConfig, StatsError, Verdict, efficiency};
use serde::{Deserialize, Serialize};

use crate::replicate::{Arm, Replicates};

/// What one integrator reached. Figures of one replicate, averaged over replicates.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IntegratorSummary {
    /// Spec of the integrator.
    pub integrator: String,
    /// Samples per pixel.
    pub spp: f64,
    /// Wall-clock seconds of rendering, start-up of the integrator included.
    pub seconds: f64,
    /// Processor seconds of all threads.
    pub cpu_seconds: f64,
    /// Mean over pixels and channels of the variance across replicates, over all that this integrator sees.
    pub mse: f64,
    /// The same of variance / (mean² + ε).
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

/// Judges what an experiment gave.
///
/// # Errors
/// With fewer than two replicates of an integrator, or means that are not finite.
pub fn compare(replicates: &Replicates, config: &CompareConfig) -> Result<Comparison, StatsError> {
    let arms = &replicates.arms;
    let integrators = arms.iter().map(summarise).collect();
    let mut pairs = Vec::new();
    for i in 0..arms.len() {
        for j in i + 1..arms.len() {
            pairs.push(compare_pair(replicates, i, j, config)?);
        }
    }
    Ok(Comparison { integrators, pairs })
}

fn summarise(arm: &Arm) -> IntegratorSummary {
    let mse = arm.whole.mse();
    let mut mean = [0.0; 3];
    for p in arm.whole.mean() {
        for c in 0..3 {
            mean[c] += p[c] / arm.whole.mean().len() as f64;
        }
    }
    IntegratorSummary {
        integrator: arm.name().to_owned(),
        spp: arm.average(|r| r.samples_per_pixel),
        seconds: arm.seconds(),
        cpu_seconds: arm.average(|r| r.spent.cpu_seconds),
        mse,
        relmse: arm.whole.relative_mse(),
        efficiency: efficiency(mse, arm.seconds()),
        replicates: arm.replicates.len(),
        rays: arm.average(|r| r.rays as f64),
        nonfinite: arm.replicates.iter().map(|r| r.nonfinite).sum(),
        mean,
        output: None,
    }
}

fn compare_pair(
    replicates: &Replicates,
    i: usize,
    j: usize,
    config: &CompareConfig,
) -> Result<PairSummary, StatsError> {
    let (a, b) = (&replicates.arms[i], &replicates.arms[j]);
    let (mse_a, mse_b) = (a.common[j].mse(), b.common[i].mse());
    Ok(PairSummary {
        judgement: judge(&a.observed, &b.observed, &replicates.tiles, config)?,
        mse_a,
        mse_b,
        efficiency_ratio: (mse_b * b.seconds()) / (mse_a * a.seconds()),
    })
}
