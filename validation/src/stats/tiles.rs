//! Effective number of contributions, and tiles merged until each has enough of them.

use super::fault::{StatsError, all_finite, at_least, same_length};

/// n_eff = (Σx)²/Σx², the number of equal contributions that would scatter as much; 0 where all are
/// 0.
///
/// Kish (1965). Between 1 (a single firefly) and the number of samples that are not 0.
pub fn effective_count(sum: f64, sum_sq: f64) -> f64 {
    if sum_sq > 0.0 { sum * sum / sum_sq } else { 0.0 }
}

/// Sums over the contributions to each tile in one replicate, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TileSums {
    /// Σx of each tile.
    pub sum: Vec<f64>,
    /// Σx² of each tile.
    pub sum_sq: Vec<f64>,
}

/// A grid of tiles merged into rectangles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TilePartition {
    /// For each tile the number of its group.
    pub group: Vec<usize>,
    /// Number of groups.
    pub groups: usize,
    /// Whether every group reaches the wanted n_eff; false only where the whole image does not.
    pub passes: bool,
}

impl TilePartition {
    /// Means over groups of a row of tile means (tiles of equal size).
    ///
    /// Fails where the row has another number of tiles.
    pub fn merge(&self, row: &[f64]) -> Result<Vec<f64>, StatsError> {
        same_length("tiles and values", self.group.len(), row.len())?;
        let mut sum = vec![0.0; self.groups];
        let mut count = vec![0.0; self.groups];
        for (&g, v) in self.group.iter().zip(row) {
            sum[g] += v;
            count[g] += 1.0;
        }
        Ok(sum.iter().zip(&count).map(|(s, c)| s / c).collect())
    }
}

/// Merges tiles of an `nx` × `ny` grid until every group has n_eff ≥ `n_eff_min` in every
/// replicate.
///
/// Top-down: a rectangle is cut, along its longer side and near its middle first, as long as some
/// cut leaves both parts with enough. `replicates` holds those of *both* arms: a partition that
/// does not know the labels leaves a permutation test exact. Fails on no replicates, an empty grid,
/// other numbers of tiles and non-finite sums.
pub fn merge_tiles(
    nx: usize,
    ny: usize,
    replicates: &[TileSums],
    n_eff_min: f64,
) -> Result<TilePartition, StatsError> {
    at_least("tiles", 1, nx * ny)?;
    at_least("replicates", 1, replicates.len())?;
    for r in replicates {
        same_length("tiles and sums", nx * ny, r.sum.len())?;
        same_length("tiles and sums of squares", nx * ny, r.sum_sq.len())?;
        all_finite("tile sums", &r.sum)?;
        all_finite("tile sums of squares", &r.sum_sq)?;
    }
    let enough = |rect: &Rect| {
        replicates.iter().all(|r| {
            let (mut sum, mut sum_sq) = (0.0, 0.0);
            for i in rect.tiles(nx) {
                sum += r.sum[i];
                sum_sq += r.sum_sq[i];
            }
            effective_count(sum, sum_sq) >= n_eff_min
        })
    };
    let whole = Rect { x: (0, nx), y: (0, ny) };
    let passes = enough(&whole);
    let mut partition = TilePartition { group: vec![0; nx * ny], groups: 0, passes };
    let mut open = vec![whole];
    while let Some(rect) = open.pop() {
        match rect.cuts().find(|(low, high)| enough(low) && enough(high)) {
            Some((low, high)) => open.extend([high, low]),
            None => {
                for i in rect.tiles(nx) {
                    partition.group[i] = partition.groups;
                }
                partition.groups += 1;
            }
        }
    }
    Ok(partition)
}

/// Half-open rectangle of tiles.
#[derive(Clone, Copy)]
struct Rect {
    x: (usize, usize),
    y: (usize, usize),
}

impl Rect {
    fn tiles(&self, nx: usize) -> impl Iterator<Item = usize> {
        let x = self.x;
        (self.y.0..self.y.1).flat_map(move |j| (x.0..x.1).map(move |i| j * nx + i))
    }

    /// All ways to cut in two: the longer side first, near the middle first.
    fn cuts(self) -> impl Iterator<Item = (Rect, Rect)> {
        let along_x = middle_out(self.x)
            .map(move |c| (Rect { x: (self.x.0, c), ..self }, Rect { x: (c, self.x.1), ..self }));
        let along_y = middle_out(self.y)
            .map(move |c| (Rect { y: (self.y.0, c), ..self }, Rect { y: (c, self.y.1), ..self }));
        let wide = self.x.1 - self.x.0 >= self.y.1 - self.y.0;
        let (first, second): (Vec<_>, Vec<_>) = if wide {
            (along_x.collect(), along_y.collect())
        } else {
            (along_y.collect(), along_x.collect())
        };
        first.into_iter().chain(second)
    }
}

/// The inner points of a half-open range, from the middle outwards.
fn middle_out((low, high): (usize, usize)) -> impl Iterator<Item = usize> {
    let mut points: Vec<usize> = (low + 1..high).collect();
    points.sort_by_key(|c| (2 * c).abs_diff(low + high));
    points.into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(n: &[f64]) -> TileSums {
        // n unit contributions: Σx = Σx² = n, n_eff = n.
        TileSums { sum: n.to_vec(), sum_sq: n.to_vec() }
    }

    #[test]
    fn equal_contributions_count_fully_and_a_firefly_counts_once() {
        assert_eq!(effective_count(12.0, 12.0), 12.0);
        assert!((effective_count(1e6 + 10.0, 1e12 + 10.0) - 1.0).abs() < 1e-4);
        assert_eq!(effective_count(0.0, 0.0), 0.0);
    }

    #[test]
    fn full_tiles_stay_apart() {
        let partition = merge_tiles(3, 2, &[counts(&[20.0; 6])], 10.0).unwrap();
        assert_eq!((partition.groups, partition.passes), (6, true));
    }

    #[test]
    fn sparse_tiles_merge_until_each_group_has_enough_in_every_replicate() {
        let bright = counts(&[40.0, 40.0, 3.0, 2.0, 40.0, 40.0, 4.0, 3.0]);
        let dim = counts(&[30.0, 30.0, 3.0, 3.0, 30.0, 30.0, 2.0, 3.0]);
        let sums = [bright, dim];
        let partition = merge_tiles(4, 2, &sums, 10.0).unwrap();
        assert!(partition.passes && partition.groups == 5, "{partition:?}");
        for sums in &sums {
            for g in 0..partition.groups {
                let n: f64 = (0..8).filter(|&i| partition.group[i] == g).map(|i| sums.sum[i]).sum();
                assert!(n >= 10.0, "{partition:?}");
            }
        }
    }

    #[test]
    fn an_image_with_too_little_is_one_group_that_fails() {
        let partition = merge_tiles(2, 2, &[counts(&[2.0; 4])], 10.0).unwrap();
        assert_eq!((partition.groups, partition.passes), (1, false));
    }

    #[test]
    fn merged_rows_hold_the_mean_of_each_group() {
        let partition = TilePartition { group: vec![0, 1, 1, 0], groups: 2, passes: true };
        assert_eq!(partition.merge(&[1.0, 2.0, 4.0, 5.0]).unwrap(), [3.0, 3.0]);
        assert!(partition.merge(&[1.0]).is_err());
    }

    #[test]
    fn bad_grids_are_errors() {
        assert!(merge_tiles(0, 2, &[counts(&[])], 10.0).is_err());
        assert!(merge_tiles(2, 2, &[], 10.0).is_err());
        assert!(merge_tiles(2, 2, &[counts(&[1.0; 3])], 10.0).is_err());
    }
}
