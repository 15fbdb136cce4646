//! Statistics of the convergence suite, as pure functions on numbers.
//!
//! | Question | Where |
//! | --- | --- |
//! | Do two arms of replicates have the same mean? | [`welch()`], [`one_sample`] |
//! | … in every one of ≤ 50 signed cells at once? | [`ReplicateSet`], [`compare()`], [`holm`] |
//! | What bias would have been seen? | [`minimum_detectable_bias`] |
//! | What does the test say in one word? | [`Verdict`], [`decide()`] |
//! | How large is the error of an image? | [`error`] |
//! | … and at what cost? | [`efficiency()`], [`efficiency_ratio`], [`log_log_slope`] |
//!
//! The unit of observation is the *replicate mean*: the mean of one cell (a path length, a tile, the whole
//! image) over one whole render with a seed of its own. Replicates are independent for every integrator,
//! also for Markov chains and stratified samples, where the samples inside one render are not.
//!
//! Everything that draws random numbers takes a seed and gives the same answer for any number of threads.

mod compare;
mod decide;
mod dist;
mod efficiency;
pub mod error;
mod fault;
mod moments;
mod multiple;
mod replicates;
#[cfg(test)]
mod testing;
mod welch;

pub use compare::{CellReport, CompareConfig, PairReport, compare, compare_exact};
pub use decide::{Claim, Gates, Reason, Rule, Verdict, decide};
pub use dist::{
    binomial_interval, chi_squared_sf, normal_quantile, normal_sf, student_quantile, student_sf,
};
pub use efficiency::{Estimate, efficiency, efficiency_ratio, log_log_slope};
pub use fault::StatsError;
pub use moments::Moments;
pub use multiple::{benjamini_hochberg, holm};
pub use replicates::{Cell, ReplicateSet};
pub use welch::{
    MDB_ALPHA, MDB_POWER, Welch, minimum_detectable_bias, one_sample, one_sample_within, welch,
    welch_within,
};
