//! Speed against error: how long an integrator works, and what it reaches in that time.
//!
//! | Question | Where |
//! | --- | --- |
//! | How long does a render go on? | [`budget`] |
//! | How are renders of several integrators collected? | [`replicate`] |
//! | Do they agree ([`pathspace_validation::pairs`]), and which one is faster? | [`compare`] |
//! | What does `results.json` hold? | [`results`] |
//! | How does it look? | [`report`] |
//! | How does an image become a file? | [`output`] |
//!
//! Everything here stands on [`pathspace_core::integrator::Run`] alone, so that an integrator from another crate is treated as one of ours.

pub mod budget;
mod clock;
pub mod compare;
mod moments;
pub mod output;
pub mod replicate;
pub mod report;
pub mod results;

pub use budget::{Budget, Exposure, Status, expose};
pub use clock::{Spent, Stopwatch};
pub use moments::ImageMoments;
