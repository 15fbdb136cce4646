//! The test on tiles of the image, for each kind of path.
//!
//! Class by class and not over their sum: where rare caustics lie over smooth light, the replicates
//! of the sum look well sampled even if no caustic was found at all, and the test would accuse an
//! method of what it has not had the time to see.
//!
//! Which tiles are fit for a test is asked of all tiles of a class together, never of one tile.
//! Tiles that are chosen because *their* replicates scatter little are those whose fireflies have
//! not come yet; of light tracing onto glossy plates such tiles lack up to a half of their light,
//! at thirty standard errors of their own.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::observe::{Method, PathClass, Tiles};
use crate::json::number;
use crate::stats::{
    PermutationConfig, StatsError, Tail, Verdict, pooled_skewness, skewed_welch, spread_test, tail,
    welch,
};

/// The test on tiles of the image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TileSummary {
    /// Tiles in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Groups of tiles tested, of one path class each.
    pub groups: usize,
    /// Relative minimum detectable bias of a tile by itself, the median over the smallest groups;
    /// null where none is lit.
    #[serde(deserialize_with = "number", default = "unknown")]
    pub mdb: f64,
    /// Share of the light of both whose tiles were fit for a test.
    #[serde(deserialize_with = "number")]
    pub share: f64,
    /// p-value of all groups together.
    #[serde(deserialize_with = "number")]
    pub p: f64,
    /// p-value of the largest difference of a group.
    #[serde(deserialize_with = "number")]
    pub p_largest: f64,
    /// p-value of a difference spread over many groups.
    #[serde(deserialize_with = "number")]
    pub p_spread: f64,
    /// Differ below the level, agree where half of the light was tested, otherwise inconclusive.
    pub verdict: Verdict,
}

/// Of reports that did not know it yet.
fn unknown() -> f64 {
    f64::NAN
}

/// Sides of a group in tiles.
const SIDES: [usize; 3] = [1, 2, 4];
/// A tile must be lit in this share of the replicates of an method, or in none.
const LIT: f64 = 0.75;
/// A class with so few dark tiles has a shape that is not that of counting.
const DENSE: f64 = 0.98;
/// Share of the light below which tiles that show no difference prove no agreement.
const HALF: f64 = 0.5;

/// Tiles of a class merged to groups, the same in both methods.
struct Groups {
    side: usize,
    dense: bool,
    methods: [Vec<Vec<f64>>; 2],
}

/// Whether a class can be tested.
enum Fitness {
    /// From this side of a group on.
    From(Groups),
    /// Too few replicates are lit, or too few tiles.
    Sparse,
    /// Fireflies rule an method.
    Heavy,
}

/// Tests tiles × path classes; `None` where no class is fit for it.
///
/// Two tests share the level. The largest difference: Welch's t of each group, cleared of the
/// skewness that the groups of its class have in common, by Bonferroni over groups of 1, 2×2 and
/// 4×4 tiles. The spread: [`spread_test`] over the smallest groups.
///
/// # Errors
/// With fewer than four replicates of an method, or means that are not finite.
pub fn tile_test(
    a: &Method,
    b: &Method,
    classes: &BTreeSet<PathClass>,
    tiles: &Tiles,
    alpha: f64,
) -> Result<Option<TileSummary>, StatsError> {
    let (mut all, mut seen, mut heavy) = (0.0, 0.0, false);
    let mut fit = Vec::new();
    for class in classes {
        let methods = [a.class_tiles(class, tiles.count()), b.class_tiles(class, tiles.count())];
        let light = light(&methods);
        all += light;
        match fitness(&methods, tiles)? {
            Fitness::From(groups) => fit.push((groups, methods, light)),
            Fitness::Sparse => {}
            Fitness::Heavy => heavy = true,
        }
    }
    // Fireflies in one class are likely in the others: what is too sparse to tell is then left
    // alone.
    fit.retain(|(groups, ..)| !heavy || groups.side == 1 && groups.dense);
    let (mut count, mut least) = (0, 1.0_f64);
    let mut detectable = Vec::new();
    let mut finest = [vec![Vec::new(); a.replicates.len()], vec![Vec::new(); b.replicates.len()]];
    for (groups, methods, light) in &fit {
        seen += light;
        for (all, own) in finest.iter_mut().zip(&groups.methods) {
            all.iter_mut().zip(own).for_each(|(all, own)| all.extend(own));
        }
        for side in SIDES.into_iter().filter(|s| *s >= groups.side) {
            let larger = merged(methods, tiles, side);
            let [x, y] = if side == groups.side { &groups.methods } else { &larger };
            // Of a few large groups no skewness is known.
            if side > groups.side && x[0].len() * x.len() < 200 {
                continue;
            }
            let skewness = [pooled_skewness(x), pooled_skewness(y)];
            for cell in 0..x[0].len() {
                let column = |rows: &[Vec<f64>]| rows.iter().map(|r| r[cell]).collect::<Vec<_>>();
                let (one, two) = (column(x), column(y));
                least = least.min(skewed_welch(&one, &two, skewness)?.p);
                count += 1;
                if side == groups.side {
                    let mdb = welch(&one, &two)?.mdb;
                    detectable.extend((!mdb.is_nan()).then_some(mdb));
                }
            }
        }
    }
    if count == 0 {
        return Ok(None);
    }
    let p_largest = (count as f64 * least).min(1.0);
    let p_spread = spread(&finest, alpha)?;
    let p = (2.0 * p_largest.min(p_spread)).min(1.0);
    let share = if all > 0.0 { seen / all } else { 1.0 };
    let verdict = if p < alpha {
        Verdict::Differ
    } else if share >= HALF {
        Verdict::Agree
    } else {
        Verdict::Inconclusive
    };
    let (columns, rows) = (tiles.columns, tiles.rows);
    detectable.sort_by(f64::total_cmp);
    let mdb = detectable.get(detectable.len() / 2).copied().unwrap_or(f64::NAN);
    let groups = count;
    Ok(Some(TileSummary { columns, rows, groups, mdb, share, p, p_largest, p_spread, verdict }))
}

/// Most pairs are far from the level: a short round tells, and only a suspicion is looked at
/// closely.
fn spread(finest: &[Vec<Vec<f64>>; 2], alpha: f64) -> Result<f64, StatsError> {
    const MOST: f64 = 99_999.0;
    let [x, y] = finest;
    let k = x.len().min(y.len());
    let short = PermutationConfig { permutations: 999, seed: 1 };
    let p = spread_test(&x[..k], &y[..k], &short)?;
    if p >= 0.01 {
        return Ok(p);
    }
    let permutations = (4.0 / alpha).min(MOST) as usize;
    spread_test(&x[..k], &y[..k], &PermutationConfig { permutations, seed: 2 })
}

/// The smallest groups of a class whose shape a t-test can bear in both methods.
fn fitness(methods: &[Vec<Vec<f64>>; 2], tiles: &Tiles) -> Result<Fitness, StatsError> {
    for side in SIDES {
        let methods = merged(methods, tiles, side);
        if methods[0][0].is_empty() {
            continue;
        }
        let (mut fit, mut all_dense) = (true, true);
        for method in &methods {
            let dense = lit(method) >= DENSE;
            all_dense &= dense;
            match tail(method)? {
                Some(t) if dense && t.is_heavy() => return Ok(Fitness::Heavy),
                Some(t) => fit &= t.is_light(),
                // An method without noise, or in the dark, has no tail.
                None => fit &= constant(method),
            }
        }
        if fit {
            return Ok(Fitness::From(Groups { side, dense: all_dense, methods }));
        }
    }
    Ok(Fitness::Sparse)
}

/// Light of a class that an method owes to fireflies: 0 unless its tiles have a heavy tail.
pub(super) fn firefly_light(rows: &[Vec<f64>]) -> Result<f64, StatsError> {
    if rows.len() < 3 || rows[0].is_empty() {
        return Ok(0.0);
    }
    Ok(tail(rows)?.filter(Tail::is_heavy).map_or(0.0, |t| t.rare))
}

/// Means over groups of `side` × `side` tiles, of those groups that are fit in both methods;
/// without groups where these are less than half of all that have light.
fn merged(methods: &[Vec<Vec<f64>>; 2], tiles: &Tiles, side: usize) -> [Vec<Vec<f64>>; 2] {
    let whole = [coarse(&methods[0], tiles, side), coarse(&methods[1], tiles, side)];
    let fit = [fit_groups(&whole[0], &whole[1]), fit_groups(&whole[1], &whole[0])];
    let bright = |g: &usize| whole.iter().flatten().any(|row| row[*g] != 0.0);
    let bright: Vec<usize> = (0..fit[0].len()).filter(bright).collect();
    let both = |g: &usize| fit[0][*g] && fit[1][*g];
    let chosen: Vec<usize> = bright.iter().copied().filter(both).collect();
    let enough = 2 * chosen.len() >= bright.len();
    whole.map(|method| {
        let pick = |row: &Vec<f64>| chosen.iter().filter(|_| enough).map(|&g| row[g]).collect();
        method.iter().map(pick).collect()
    })
}

/// Which groups of an method are fit for a test: those that are lit in nearly all replicates.
/// Groups that are dark in all of them are fit where that can not be chance: where the method is
/// neither sparse nor dark elsewhere, and the other method sees no less there than in others.
fn fit_groups(method: &[Vec<f64>], other: &[Vec<f64>]) -> Vec<bool> {
    let groups = method[0].len();
    let share =
        |g: usize| method.iter().filter(|r| r[g] != 0.0).count() as f64 / method.len() as f64;
    let light = |g: usize| other.iter().map(|r| r[g].abs()).sum::<f64>() / other.len() as f64;
    let shares: Vec<f64> = (0..groups).map(share).collect();
    let lit: Vec<usize> = (0..groups).filter(|&g| shares[g] >= LIT).collect();
    let sparse = shares.iter().filter(|s| **s > 0.0 && **s < LIT).count();
    let dark = (0..groups).filter(|&g| shares[g] == 0.0 && light(g) != 0.0).count();
    let mut typical: Vec<f64> = lit.iter().map(|&g| light(g)).collect();
    typical.sort_by(f64::total_cmp);
    let median = typical.get(typical.len() / 2).copied().unwrap_or(f64::INFINITY);
    let dense = 4 * sparse <= lit.len() && dark <= lit.len();
    (0..groups)
        .map(|g| shares[g] >= LIT || shares[g] == 0.0 && dense && light(g) >= 0.5 * median)
        .collect()
}

/// Means over blocks of `side` × `side` tiles.
fn coarse(rows: &[Vec<f64>], tiles: &Tiles, side: usize) -> Vec<Vec<f64>> {
    let columns = tiles.columns.div_ceil(side);
    let blocks = columns * tiles.rows.div_ceil(side);
    let group = |tile: usize| (tile / tiles.columns / side) * columns + tile % tiles.columns / side;
    let mean = |row: &Vec<f64>| {
        let (mut sum, mut count) = (vec![0.0; blocks], vec![0.0; blocks]);
        for (tile, v) in row.iter().enumerate() {
            sum[group(tile)] += v;
            count[group(tile)] += 1.0;
        }
        sum.iter().zip(&count).map(|(s, n)| s / n).collect()
    };
    rows.iter().map(mean).collect()
}

/// Share of all values that are not 0, of the groups that have any.
fn lit(method: &[Vec<f64>]) -> f64 {
    let groups = (0..method[0].len()).filter(|&g| method.iter().any(|row| row[g] != 0.0));
    let (mut all, mut lit) = (0.0_f64, 0.0);
    for g in groups {
        all += method.len() as f64;
        lit += method.iter().filter(|row| row[g] != 0.0).count() as f64;
    }
    if all > 0.0 { lit / all } else { 1.0 }
}

fn constant(method: &[Vec<f64>]) -> bool {
    method.iter().all(|row| row == &method[0])
}

/// Light of a class, that of the method that saw more.
fn light(methods: &[Vec<Vec<f64>>; 2]) -> f64 {
    let sum = |method: &[Vec<f64>]| method.iter().flatten().sum::<f64>() / method.len() as f64;
    sum(&methods[0]).abs().max(sum(&methods[1]).abs())
}

#[cfg(test)]
mod tests {
    use pathspace_core::film::Families;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::super::observe::{ClassMean, Observation};
    use super::*;

    const CLASS: PathClass = PathClass { length: 2, families: Families::S1 };
    const SIDE: usize = 16;

    struct Source(Pcg64Mcg);

    impl Source {
        fn uniform(&mut self) -> f64 {
            1.0 - self.0.random::<f64>()
        }

        /// Gamma of shape n and mean 1.
        fn gamma(&mut self, n: u32) -> f64 {
            -(0..n).map(|_| self.uniform().ln()).sum::<f64>() / f64::from(n)
        }
    }

    fn method(value: impl FnMut(usize) -> f64) -> Method {
        let mut value = value;
        let mut method = Method::new("method".into(), Families::ALL);
        for _ in 0..16 {
            let tiles: Vec<f64> = (0..SIDE * SIDE).map(&mut value).collect();
            let mean = tiles.iter().sum::<f64>() / (SIDE * SIDE) as f64;
            method.replicates.push(observation(ClassMean { mean, tiles, ..ClassMean::default() }));
        }
        method
    }

    fn observation(class: ClassMean) -> Observation {
        Observation { classes: [(CLASS, class)].into(), samples: 0 }
    }

    fn test(a: &Method, b: &Method) -> Option<TileSummary> {
        let tiles = Tiles::new(SIDE, SIDE);
        tile_test(a, b, &BTreeSet::from([CLASS]), &tiles, 5e-5).unwrap()
    }

    /// 5 % more in a region of 4 × 4 tiles.
    fn planted(tile: usize) -> f64 {
        let (x, y) = (tile % SIDE, tile / SIDE);
        if (5..9).contains(&x) && (6..10).contains(&y) { 1.05 } else { 1.0 }
    }

    #[test]
    fn a_bias_of_five_percent_in_a_region_is_found() {
        for seed in 0..3 {
            let mut s = Source(Pcg64Mcg::seed_from_u64(seed));
            let (a, b) = (method(|_| s.gamma(1600)), method(planted));
            let found = test(&a, &b).unwrap();
            assert_eq!(found.verdict, Verdict::Differ, "{found:?}");
        }
    }

    #[test]
    fn methods_of_different_shape_and_equal_means_do_not_differ() {
        let mut least: f64 = 1.0;
        for seed in 0..20 {
            let mut s = Source(Pcg64Mcg::seed_from_u64(100 + seed));
            let a = method(|_| s.gamma(6));
            let b = method(|_| s.gamma(2000));
            least = least.min(test(&a, &b).unwrap().p);
        }
        assert!(least > 2e-4, "{least}");
    }

    #[test]
    fn tiles_that_fireflies_rule_are_not_tested() {
        // A third of the light comes once in a hundred replicates of a tile.
        let mut s = Source(Pcg64Mcg::seed_from_u64(7));
        let a = method(|_| 0.67 * s.gamma(800) + if s.uniform() < 0.01 { 33.0 } else { 0.0 });
        let mut s = Source(Pcg64Mcg::seed_from_u64(8));
        let b = method(|_| s.gamma(800));
        assert_eq!(test(&a, &b), None);
        // The same without any firefly is a difference.
        let mut s = Source(Pcg64Mcg::seed_from_u64(7));
        let a = method(|_| 0.67 * s.gamma(800));
        assert_eq!(test(&a, &b).unwrap().verdict, Verdict::Differ);
    }

    #[test]
    fn tiles_that_an_arm_hits_by_rare_chance_are_not_tested() {
        let mut s = Source(Pcg64Mcg::seed_from_u64(10));
        let a = method(|_| if s.uniform() < 0.02 { 50.0 } else { 0.0 });
        let mut s = Source(Pcg64Mcg::seed_from_u64(11));
        let b = method(|_| s.gamma(100));
        assert_eq!(test(&a, &b), None);
    }

    #[test]
    fn a_tile_that_one_arm_leaves_dark_differs() {
        let mut s = Source(Pcg64Mcg::seed_from_u64(9));
        let a = method(|tile| if tile == 37 { 0.0 } else { s.gamma(100) });
        let b = method(|_| s.gamma(100));
        assert_eq!(test(&a, &b).unwrap().verdict, Verdict::Differ);
    }
}
