//! What a comparison says, as tables and `--json` show it.

use pathspace_validation::stats::Verdict;
use serde::Serialize;

use crate::results::PairSummary;

/// What one integrator reached. Figures of one replicate, averaged over replicates.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IntegratorSummary {
    /// Spec of the integrator.
    pub integrator: String,
    /// Samples per pixel.
    pub spp: f64,
    /// Wall-clock seconds of rendering, start-up of the integrator included, loading and compiling
    /// of another renderer not.
    pub seconds: f64,
    /// Processor seconds of all threads.
    pub cpu_seconds: f64,
    /// Seconds of another renderer for loading and compiling, in all replicates; 0 for ours.
    pub startup_seconds: f64,
    /// MSE over all that this integrator sees: mean over pixels and channels of the variance across
    /// replicates, or of the squared error against a reference.
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
