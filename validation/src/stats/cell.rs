//! What is tested: the image, or one path length of it.

use serde::{Deserialize, Serialize};

/// One observable of a render: the whole image or a tile, over all path lengths or one.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Cell {
    /// Name for reports, unique in its set by convention.
    pub name: String,
    /// Path length (number of edges), `None` for the sum over all lengths.
    pub length: Option<u32>,
    /// Whether a pair can only agree if this cell agrees; any cell can make it differ.
    pub decisive: bool,
}

impl Cell {
    /// The whole image over all path lengths; decisive.
    pub fn image() -> Self {
        Cell { name: "image".into(), length: None, decisive: true }
    }

    /// The whole image over paths of one length; not decisive, since long paths carry little light
    /// and much noise.
    pub fn length(length: u32) -> Self {
        Cell { name: format!("length {length}"), length: Some(length), decisive: false }
    }
}
