//! Do two integrators agree? From films to the verdict on a pair (L3).
//!
//! ```text
//! film ──observe──▶ Observation ─┐   image and path lengths: Welch, Holm      (cells)
//! film ──observe──▶ Observation ─┼─▶ tiles × kinds of path: one test on all   (tiles)  ──▶ Judgement
//!   …   replicates of two methods  ─┘   what only one of the two can make        (unseen)
//! ```
//!
//! The unit of observation is the mean of one path class over one replicate. A [`PathClass`] holds
//! the paths of one length that the same families of techniques can make; a pair is compared on the
//! classes that both integrators can make, and told what was left out.

mod cells;
mod judge;
mod maps;
mod observe;
mod place;
mod tiles;
mod unseen;

pub(crate) use cells::LOST;
pub use cells::{Channel, well_sampled};
pub use judge::{Judgement, LengthSummary, TILE_REPLICATES, Unseen, judge};
pub use maps::{TileMap, tile_maps};
pub use observe::{ClassMean, Method, Observation, PathClass, Source, TILES, Tiles, unique_name};
pub use place::Place;
pub use tiles::{TileSummary, tile_test};
pub(crate) use unseen::techniques;
