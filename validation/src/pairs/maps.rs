//! Where a pair differs: maps over tiles, for the eye and never for the verdict.

use serde::Serialize;

use super::observe::{Method, PathClass, Tiles, common_classes};
use crate::stats::{StatsError, welch};

/// Larger differences are shown as this many standard errors.
const MOST: f64 = 99.0;

/// Difference of two methods in each tile, in standard errors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TileMap {
    /// Path length; null for all lengths together.
    pub length: Option<u32>,
    /// Tiles in a row.
    pub columns: usize,
    /// Rows of tiles.
    pub rows: usize,
    /// Welch's t of the first method over the second in each tile, row by row, cut at ±99.
    pub sigma: Vec<f64>,
}

impl TileMap {
    /// Column, row and value of the largest differences that are 3 standard errors at least, `most`
    /// of them.
    pub fn largest(&self, most: usize) -> Vec<(usize, usize, f64)> {
        let tiles = self.sigma.iter().enumerate().filter(|(_, s)| s.abs() >= 3.0);
        let mut tiles: Vec<_> =
            tiles.map(|(i, s)| (i % self.columns, i / self.columns, *s)).collect();
        tiles.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()));
        tiles.truncate(most);
        tiles
    }

    /// Column and row of the largest difference, where it is 3 standard errors at least.
    pub fn worst(&self) -> Option<[usize; 2]> {
        let tiles = self.sigma.iter().enumerate();
        let (index, size) = tiles.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        (size.abs() >= 3.0).then_some([index % self.columns, index / self.columns])
    }
}

/// Maps of what both methods can make: all lengths together, then each of `lengths`.
///
/// # Errors
/// With fewer than two replicates of an method, or means that are not finite.
pub fn tile_maps(
    a: &Method,
    b: &Method,
    tiles: &Tiles,
    lengths: &[u32],
) -> Result<Vec<TileMap>, StatsError> {
    let classes = common_classes(a, b);
    let mut maps = Vec::new();
    for length in std::iter::once(None).chain(lengths.iter().copied().map(Some)) {
        let chosen: Vec<&PathClass> = classes
            .iter()
            .filter(|c| length.is_none_or(|length| u32::from(c.length) == length))
            .collect();
        let (x, y) = (sum(a, &chosen, tiles), sum(b, &chosen, tiles));
        let mut sigma = Vec::with_capacity(tiles.count());
        for tile in 0..tiles.count() {
            let column = |rows: &[Vec<f64>]| rows.iter().map(|r| r[tile]).collect::<Vec<_>>();
            sigma.push(welch(&column(&x), &column(&y))?.t.clamp(-MOST, MOST));
        }
        maps.push(TileMap { length, columns: tiles.columns, rows: tiles.rows, sigma });
    }
    Ok(maps)
}

/// Tiles of every replicate over the chosen classes together.
fn sum(method: &Method, classes: &[&PathClass], tiles: &Tiles) -> Vec<Vec<f64>> {
    let mut rows = vec![vec![0.0; tiles.count()]; method.replicates.len()];
    for class in classes {
        for (row, own) in rows.iter_mut().zip(method.class_tiles(class, tiles.count())) {
            for (sum, v) in row.iter_mut().zip(own) {
                *sum += v;
            }
        }
    }
    rows
}
