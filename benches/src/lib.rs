//! Speed against error: how long an integrator works, and what it reaches in that time.
//!
//! ```text
//! experiment ──cells──▶ analysis ──Results──▶ record: results.json, results.csv, pictures
//!     │  ▲                 ▲
//!     ▼  │                 │
//!   budget, peers      metrics, reference
//! ```
//!
//! | Question | Where |
//! | --- | --- |
//! | How long does a render go on? | [`budget`] |
//! | How does it stop, and go on later or elsewhere? | [`session`], [`checkpoint`], [`shard`] |
//! | How large is its error by now? | [`precision`] |
//! | How is it looked at meanwhile? | [`preview`] |
//! | What is rendered, by whom, how often; how does it go on after a stop? | [`experiment`] |
//! | How do other renderers take part? | [`peers`] |
//! | How large is an error, and when is it small enough? | [`metrics`] |
//! | What is it measured against? | [`mod@reference`] |
//! | Do they agree ([`pathspace_validation::pairs`]), and which one is faster? | [`analysis`], [`mod@compare`], [`comparison`] |
//! | What does `results.json` hold, and what is written beside it? | [`results`], [`record`] |
//! | Who stands where, in a sentence and in a table? | [`standing`] |
//! | How does it look? | [`report`], [`plots`] |
//! | How does an image become a file? | [`output`] |
//! | … and a file of any renderer an image? | [`input`] |
//!
//! Everything here stands on [`pathspace_core::integrator::Run`] alone, so that an integrator from
//! another crate is treated as one of ours.

pub mod analysis;
pub mod budget;
pub mod checkpoint;
mod clock;
pub mod compare;
pub mod comparison;
mod csv;
pub mod experiment;
mod expose;
pub mod input;
mod leftovers;
pub mod metrics;
mod moments;
pub mod output;
pub mod peers;
pub mod plots;
pub mod precision;
pub mod preview;
mod program;
pub mod record;
pub mod reference;
pub mod report;
pub mod results;
pub mod session;
pub mod shard;
pub mod standing;

pub use budget::{Budget, Goal};
pub use clock::{Spent, Stopwatch};
pub use csv::csv;
pub use expose::expose;
pub use leftovers::{TemporaryFolder, clear_leftovers, temporary_folder};
pub use moments::ImageMoments;
pub use precision::{Precision, RelativeError};
pub use program::program;
pub use session::{Exposure, Plan, Progress, Session, Status};
pub use shard::Shard;
