//! How large an error is, and what it costs to make it small. The statistics stand in
//! [`pathspace_validation::stats`]; here they meet images.
//!
//! | Metric | Where |
//! | --- | --- |
//! | MSE and relMSE of each replicate, against a reference or against each other | [`errors`] |
//! | time to reach a target error | [`time_to_error()`] |
//! | what the eye sees of it | [`flip()`] |
//!
//! An error of zero mean is estimated without bias, by products of two independent differences; the
//! estimate may be negative, and is averaged as it is.

mod errors;
mod flip;
mod time_to_error;

pub use errors::{Against, Errors, TRIMMED, errors};
pub use flip::{flip, flip_is_built_in};
pub use time_to_error::{Reached, time_to_error};
