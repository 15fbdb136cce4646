//! Statistics of the convergence suite, as pure functions on numbers.
//!
//! | Question | Where |
//! | --- | --- |
//! | Do two arms of replicates have the same mean? | [`welch()`], [`one_sample`] |
//! | … in every one of ≤ 50 signed cells at once? | [`ReplicateSet`], [`compare()`], [`holm`] |
//! | … in hundreds of correlated tiles, arms of any shape? | [`skewed_welch`], [`spread_test`], after [`tail`] |
//! | … of arms that differ in their means at most? | [`max_t()`], after [`merge_tiles`] |
//! | May a t-test be trusted here? | [`effective_count`], [`pareto_khat`] |
//! | … and where it may not? | [`bounded`] |
//! | What bias would have been seen? | [`minimum_detectable_bias`] |
//! | What does the test say in one word? | [`Verdict`], [`decide()`] |
//! | May I stop rendering replicates now? | [`Sequential`], [`GandyScott`] |
//! | Has a Markov chain mixed? (reports only) | [`geyer_time`], [`batch_means`], [`rank_rhat`] |
//! | What do many results say together? | [`p_histogram`], [`geometric_mean`], [`binomial_interval`] |
//! | How large is the error of an image? | [`error`] |
//! | … and at what cost? | [`efficiency()`], [`efficiency_ratio`], [`replicate_slope`] |
//!
//! The unit of observation is the *replicate mean*: the mean of one cell (a path length, a tile,
//! the whole image) over one whole render with a seed of its own. Replicates are independent for
//! every integrator, also for Markov chains and stratified samples, where the samples inside one
//! render are not.
//!
//! Everything that draws random numbers takes a seed and gives the same answer for any number of
//! threads.

pub mod bounded;
mod chains;
mod compare;
mod decide;
mod dist;
mod efficiency;
pub mod error;
mod fault;
mod gandy_scott;
mod max_t;
mod moments;
mod multiple;
mod pareto;
mod replicates;
mod rhat;
mod sequential;
mod shape;
mod spread;
mod summary;
#[cfg(test)]
mod testing;
mod tiles;
mod welch;

pub use chains::{BatchMeans, CorrelationTime, batch_means, geyer_time, sokal_time};
pub use compare::{CellReport, CompareConfig, PairReport, compare, compare_exact};
pub use decide::{Claim, Gates, Reason, Rule, Verdict, decide};
pub use dist::{
    binomial_interval, chi_squared_sf, normal_quantile, normal_sf, student_quantile, student_sf,
};
pub use efficiency::{
    Estimate, efficiency, efficiency_ratio, log_log_slope, mean_interval, replicate_slope,
};
pub use fault::StatsError;
pub use gandy_scott::{GandyScott, Round};
pub use max_t::{MaxT, PermutationConfig, Statistic, max_t};
pub use moments::Moments;
pub use multiple::{benjamini_hochberg, holm};
pub use pareto::{fit_pareto, pareto_khat, pareto_khat_of_tail, tail_size};
pub use replicates::{Cell, ReplicateSet};
pub use rhat::{bulk_ess, multi_chain_ess, rank_rhat, split_rhat};
pub use sequential::{Decision, PairedT, Sequential, SequentialConfig};
pub use shape::{Skewed, Tail, pooled_skewness, skewed_welch, tail};
pub use spread::spread_test;
pub use summary::{PHistogram, geometric_mean, p_histogram};
pub use tiles::{TilePartition, TileSums, effective_count, merge_tiles};
pub use welch::{
    MDB_ALPHA, MDB_POWER, Welch, minimum_detectable_bias, one_sample, one_sample_within, welch,
    welch_within,
};
