//! Statistics of the convergence suite, as pure functions on numbers.
//!
//! | Question | Where |
//! | --- | --- |
//! | Do two methods of replicates have the same mean? | [`welch()`], [`one_sample`] |
//! | … in every one of ≤ 50 signed cells at once? | [`compare_exact`], [`holm`] |
//! | … in hundreds of correlated tiles, methods of any shape? | [`skewed_welch`], [`spread_test`], after [`tail`] |
//! | May a t-test be trusted here? | [`pareto_khat`] |
//! | What bias would have been seen? | [`minimum_detectable_bias`] |
//! | What does the test say in one word? | [`Verdict`], [`decide()`] |
//! | May I stop rendering replicates now? | [`Sequential`], [`GandyScott`] |
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

mod cell;
mod compare;
mod decide;
mod dist;
mod efficiency;
pub mod error;
mod fault;
mod gandy_scott;
mod moments;
mod multiple;
mod pareto;
mod sequential;
mod shape;
mod spread;
mod summary;
#[cfg(test)]
mod testing;
mod welch;

pub use cell::Cell;
pub use compare::{CellReport, CompareConfig, ExactReport, compare_exact};
pub use decide::{Claim, Gates, Reason, Rule, Verdict, decide};
pub use dist::{
    binomial_interval, chi_squared_sf, normal_quantile, normal_sf, student_quantile, student_sf,
};
pub use efficiency::{Estimate, efficiency, efficiency_ratio, mean_interval, replicate_slope};
pub use fault::StatsError;
pub use gandy_scott::{GandyScott, Round};
pub use moments::Moments;
pub use multiple::holm;
pub use pareto::{fit_pareto, pareto_khat, pareto_khat_of_tail, tail_size};
pub use sequential::{Decision, PairedT, Sequential, SequentialConfig};
pub use shape::{Skewed, Tail, pooled_skewness, skewed_welch, tail};
pub use spread::{PermutationConfig, spread_test};
pub use summary::{PHistogram, geometric_mean, p_histogram};
pub use welch::{
    MDB_ALPHA, MDB_POWER, Welch, minimum_detectable_bias, one_sample, one_sample_within, welch,
    welch_within,
};
