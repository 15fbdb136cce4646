//! The test on tiles of the image, for each kind of path.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::observe::{Arm, PathClass, Tiles};
use crate::json::number;
use crate::stats::{
    Moments, PermutationConfig, StatsError, TileSums, Verdict, max_t, merge_tiles, pareto_khat,
};

/// The permutation test on tiles of the image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TileSummary {
    /// Tiles in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Groups of tiles, of one path class each, after merging until each has enough contributions.
    pub groups: usize,
    /// p-value of all groups together.
    #[serde(deserialize_with = "number")]
    pub p: f64,
    /// Differ below the level, inconclusive where fireflies rule an arm's tiles, otherwise agree.
    pub verdict: Verdict,
}

/// Effective number of contributions that a group of tiles needs in a replicate of either arm.
const TILE_EFFECTIVE_COUNT: f64 = 50.0;

/// The permutation test over tiles × path classes of what both make, tiles merged within each class.
///
/// Classes and not the sum over them: where rare caustics lie over smooth light, the replicates of the sum look well sampled
/// even if no caustic was found at all, and the test would accuse an arm of what it has not had the time to see.
pub(super) fn tile_test(
    a: &Arm,
    b: &Arm,
    classes: &BTreeSet<PathClass>,
    tiles: &Tiles,
    alpha: f64,
) -> Result<Option<TileSummary>, StatsError> {
    let (columns, rows) = (tiles.columns, tiles.rows);
    let mut x = vec![Vec::new(); a.replicates.len()];
    let mut y = vec![Vec::new(); b.replicates.len()];
    for class in classes {
        let (one, two) = (a.class_tiles(class, tiles.count()), b.class_tiles(class, tiles.count()));
        // Signed observables have no effective number of contributions.
        if one.iter().chain(&two).flatten().any(|v| *v < 0.0) {
            continue;
        }
        let sums = [tile_sums(&one)?, tile_sums(&two)?];
        let partition = merge_tiles(columns, rows, &sums, TILE_EFFECTIVE_COUNT)?;
        if !partition.passes {
            continue;
        }
        for (all, tiles) in x.iter_mut().zip(&one).chain(y.iter_mut().zip(&two)) {
            all.extend(partition.merge(tiles)?);
        }
    }
    let groups = x[0].len();
    if groups == 0 {
        return Ok(None);
    }
    // Most pairs are far from the level: a short round tells, and only a suspicion is looked at closely.
    let mut p = max_t(&x, &y, &PermutationConfig { permutations: 999, seed: 1 })?.p;
    if p < 0.01 {
        let permutations = (4.0 / alpha).ceil() as usize - 1;
        p = max_t(&x, &y, &PermutationConfig { permutations, seed: 2 })?.p;
    }
    let verdict = if heavy_tailed(&x)? || heavy_tailed(&y)? {
        Verdict::Inconclusive
    } else if p < alpha {
        Verdict::Differ
    } else {
        Verdict::Agree
    };
    Ok(Some(TileSummary { columns, rows, groups, p, verdict }))
}

/// Whether fireflies rule an arm's tiles: a generalised Pareto shape k̂ ≥ ⅓ of the tiles relative to their means, beyond which a third
/// moment does not exist. A permutation of labels assumes arms of one shape; of a skewed and a symmetric arm with equal means it tells how often
/// a firefly fell, not whether the means differ.
fn heavy_tailed(replicates: &[Vec<f64>]) -> Result<bool, StatsError> {
    let n = replicates.len() as f64;
    let relative: Vec<f64> = (0..replicates[0].len())
        .flat_map(|tile| {
            let mean = replicates.iter().map(|r| r[tile]).sum::<f64>() / n;
            replicates.iter().map(move |r| if mean > 0.0 { r[tile] / mean } else { 0.0 })
        })
        .collect();
    if relative.len() < 64 {
        return Ok(false);
    }
    Ok(pareto_khat(&relative)?.is_some_and(|k| k >= 1.0 / 3.0))
}

/// Mean and variance over replicates of each tile, as Σx and Σx²: their n_eff is E²/Var, which bounds that of the single
/// contributions from above and adds up over independent tiles.
fn tile_sums(rows: &[Vec<f64>]) -> Result<TileSums, StatsError> {
    let mut sums = TileSums::default();
    for tile in 0..rows.first().map_or(0, Vec::len) {
        let moments = Moments::of(&rows.iter().map(|row| row[tile]).collect::<Vec<_>>())?;
        sums.sum.push(moments.mean);
        // A tile without noise has no end of contributions.
        sums.sum_sq.push(moments.variance.max(1e-12 * moments.mean * moments.mean));
    }
    Ok(sums)
}
