//! Speed against error: how long an integrator works, and what it reaches in that time.
//!
//! | Question | Where |
//! | --- | --- |
//! | How long does a render go on? | [`budget`] |
//! | How does it stop, and go on later or elsewhere? | [`session`], [`checkpoint`], [`shard`] |
//! | How large is its error by now? | [`precision`] |
//! | How is it looked at meanwhile? | [`preview`] |
//! | How are renders of several integrators collected? | [`replicate`] |
//! | Do they agree ([`pathspace_validation::pairs`]), and which one is faster? | [`compare`] |
//! | What does `results.json` hold? | [`results`] |
//! | How does it look? | [`report`] |
//! | How does an image become a file? | [`output`] |
//!
//! Everything here stands on [`pathspace_core::integrator::Run`] alone, so that an integrator from another crate is treated as one of ours.

pub mod budget;
pub mod checkpoint;
mod clock;
pub mod compare;
mod moments;
pub mod output;
pub mod precision;
pub mod preview;
pub mod replicate;
pub mod report;
pub mod results;
pub mod session;
pub mod shard;

pub use budget::{Budget, Exposure, Status, expose};
pub use clock::{Spent, Stopwatch};
pub use moments::ImageMoments;
pub use precision::{Precision, RelativeError};
pub use session::{Goal, Plan, Progress, Session};
pub use shard::Shard;
