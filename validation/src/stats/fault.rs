//! What can be wrong with the numbers handed to a statistic.

use thiserror::Error;

/// Why a statistic cannot be computed from the given numbers.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum StatsError {
    /// Fewer observations than the statistic needs.
    #[error("{what}: {got} given, at least {need} needed")]
    TooFew {
        /// Which observations.
        what: &'static str,
        /// The smallest number that works.
        need: usize,
        /// The number given.
        got: usize,
    },
    /// Two inputs that must have the same length do not.
    #[error("{what}: lengths {left} and {right} differ")]
    LengthMismatch {
        /// Which inputs.
        what: &'static str,
        /// Length of the first.
        left: usize,
        /// Length of the second.
        right: usize,
    },
    /// An observation is NaN or infinite.
    #[error("{what}: value {value} at index {index} is not finite")]
    NonFinite {
        /// Which observations.
        what: &'static str,
        /// Position of the first offender.
        index: usize,
        /// The offending value.
        value: f64,
    },
    /// A parameter lies outside the range where the statistic is defined.
    #[error("{what}: {value} is out of range, expected {expected}")]
    OutOfRange {
        /// Which parameter.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The range in words.
        expected: &'static str,
    },
    /// Replicates of different seeds that are all the same: they carry no information about their
    /// error.
    #[error("{what}: all {n} replicates are the same to the bit; their seeds were not used")]
    NoVariance {
        /// Which replicates.
        what: &'static str,
        /// How many.
        n: usize,
    },
}

/// Fails on the first NaN or infinity of `values`.
pub(crate) fn all_finite(what: &'static str, values: &[f64]) -> Result<(), StatsError> {
    match values.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(StatsError::NonFinite { what, index, value: values[index] }),
        None => Ok(()),
    }
}

/// Fails unless `got >= need`.
pub(crate) fn at_least(what: &'static str, need: usize, got: usize) -> Result<(), StatsError> {
    if got < need { Err(StatsError::TooFew { what, need, got }) } else { Ok(()) }
}

/// Fails unless both lengths agree.
pub(crate) fn same_length(what: &'static str, left: usize, right: usize) -> Result<(), StatsError> {
    if left == right { Ok(()) } else { Err(StatsError::LengthMismatch { what, left, right }) }
}

/// Fails unless `value` lies strictly between 0 and 1.
pub(crate) fn open_unit(what: &'static str, value: f64) -> Result<(), StatsError> {
    if value > 0.0 && value < 1.0 {
        Ok(())
    } else {
        Err(StatsError::OutOfRange { what, value, expected: "a number in (0, 1)" })
    }
}
