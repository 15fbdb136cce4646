//! Comparison of integrators: do they agree on what both can make, and how fast is each?

use std::collections::BTreeSet;

use pathspace_validation::stats::{
    CompareConfig, Moments, PermutationConfig, Reason, StatsError, TileSums, Verdict, efficiency,
    max_t, merge_tiles, pareto_khat,
};
use serde::Serialize;

use crate::cells::{CellTest, test_cells};
use crate::replicate::{Arm, PathClass, Replicate, Replicates, luminance};
use crate::unseen;

/// Fewest replicates a side for the test on tiles.
pub const TILE_REPLICATES: usize = 16;

/// What one integrator reached. Figures of one replicate, averaged over replicates.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IntegratorSummary {
    /// Spec of the integrator.
    pub integrator: String,
    /// Samples per pixel.
    pub spp: f64,
    /// Wall-clock seconds of rendering, start-up of the integrator included.
    pub seconds: f64,
    /// Processor seconds of all threads.
    pub cpu_seconds: f64,
    /// Mean over pixels and channels of the variance across replicates, over all that this integrator sees.
    pub mse: f64,
    /// The same of variance / (mean² + ε).
    pub relmse: f64,
    /// 1 / (mse · seconds).
    pub efficiency: f64,
    /// Replicates finished.
    pub replicates: usize,
    /// Rays of one replicate.
    pub rays: f64,
    /// Contributions that were not finite, in all replicates.
    pub nonfinite: u64,
    /// Mean of the image.
    pub mean: [f64; 3],
    /// Image file, where one was written.
    pub output: Option<String>,
}

/// What one integrator of a pair can not make of the other's image.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unseen {
    /// Who can not make it.
    pub integrator: String,
    /// Whose image it is missing from.
    pub of: String,
    /// Share of that image's mean luminance.
    pub fraction: f64,
    /// Which paths these are.
    pub reason: String,
}

/// The test on one path length, or on the image.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LengthSummary {
    /// Path length in edges; null for the image.
    pub length: Option<u32>,
    /// Verdict.
    pub verdict: Verdict,
    /// Why.
    pub reason: Reason,
    /// p-value after Holm's adjustment over image and lengths.
    pub p: f64,
    /// Minimum detectable bias, relative.
    pub mdb: f64,
    /// Mean luminance of the first integrator.
    pub mean_a: f64,
    /// Mean luminance of the second.
    pub mean_b: f64,
}

/// The permutation test on tiles of the image.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TileSummary {
    /// Tiles in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Groups of tiles, of one path class each, after merging until each has enough contributions.
    pub groups: usize,
    /// p-value of all groups together.
    pub p: f64,
    /// Differ below the level, inconclusive where fireflies rule an arm's tiles, otherwise agree.
    pub verdict: Verdict,
}

/// Two integrators compared on the paths that both can make.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PairSummary {
    /// First integrator.
    pub a: String,
    /// Second integrator.
    pub b: String,
    /// Verdict on the pair.
    pub verdict: Verdict,
    /// Family-wise p-value over image, lengths and tiles, of those where the test may be trusted.
    pub p: f64,
    /// Minimum detectable bias of the image, relative.
    pub mdb: f64,
    /// The test on the image.
    pub image: LengthSummary,
    /// The tests on path lengths.
    pub lengths: Vec<LengthSummary>,
    /// The test on tiles, with enough replicates.
    pub tiles: Option<TileSummary>,
    /// What was left out.
    pub unseen: Vec<Unseen>,
    /// MSE of the first on what both make.
    pub mse_a: f64,
    /// MSE of the second on what both make.
    pub mse_b: f64,
    /// Efficiency of the first over that of the second on what both make.
    pub efficiency_ratio: f64,
}

/// All integrators and all pairs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The integrators.
    pub integrators: Vec<IntegratorSummary>,
    /// Every pair of them.
    pub pairs: Vec<PairSummary>,
}

impl Comparison {
    /// True where a pair differs.
    pub fn any_differ(&self) -> bool {
        self.pairs.iter().any(|p| p.verdict == Verdict::Differ)
    }
}

/// Judges what an experiment gave.
///
/// # Errors
/// With fewer than two replicates of an integrator, or means that are not finite.
pub fn compare(replicates: &Replicates, config: &CompareConfig) -> Result<Comparison, StatsError> {
    let arms = &replicates.arms;
    let integrators = arms.iter().map(summarise).collect();
    let mut pairs = Vec::new();
    for i in 0..arms.len() {
        for j in i + 1..arms.len() {
            pairs.push(compare_pair(replicates, i, j, config)?);
        }
    }
    Ok(Comparison { integrators, pairs })
}

fn summarise(arm: &Arm) -> IntegratorSummary {
    let mse = arm.whole.mse();
    let mut mean = [0.0; 3];
    for p in arm.whole.mean() {
        for c in 0..3 {
            mean[c] += p[c] / arm.whole.mean().len() as f64;
        }
    }
    IntegratorSummary {
        integrator: arm.name.clone(),
        spp: arm.average(|r| r.samples_per_pixel),
        seconds: arm.seconds(),
        cpu_seconds: arm.average(|r| r.spent.cpu_seconds),
        mse,
        relmse: arm.whole.relative_mse(),
        efficiency: efficiency(mse, arm.seconds()),
        replicates: arm.replicates.len(),
        rays: arm.average(|r| r.rays as f64),
        nonfinite: arm.replicates.iter().map(|r| r.nonfinite).sum(),
        mean,
        output: None,
    }
}

fn compare_pair(
    replicates: &Replicates,
    i: usize,
    j: usize,
    config: &CompareConfig,
) -> Result<PairSummary, StatsError> {
    let (a, b) = (&replicates.arms[i], &replicates.arms[j]);
    let with_tiles = a.replicates.len().min(b.replicates.len()) >= TILE_REPLICATES;
    // Two tests share the level of the pair.
    let mut own = *config;
    if with_tiles {
        own.rule.alpha *= 0.5;
    }
    let classes = common_classes(a, b);
    let cells = test_cells(a, b, &classes, &own)?;
    let tiles = if with_tiles { tile_test(replicates, i, j, own.rule.alpha)? } else { None };
    let (verdict, p) = judge(&cells, tiles.as_ref(), with_tiles);
    let (mse_a, mse_b) = (a.common[j].mse(), b.common[i].mse());
    let summary = PairSummary {
        a: a.name.clone(),
        b: b.name.clone(),
        verdict,
        p,
        mdb: cells[0].test.mdb,
        image: cell_summary(&cells[0]),
        lengths: cells[1..].iter().map(cell_summary).collect(),
        tiles,
        unseen: [left_out(a, b), left_out(b, a)].into_iter().flatten().collect(),
        mse_a,
        mse_b,
        efficiency_ratio: (mse_b * b.seconds()) / (mse_a * a.seconds()),
    };
    Ok(summary)
}

/// Effective number of contributions that a group of tiles needs in a replicate of either arm.
const TILE_EFFECTIVE_COUNT: f64 = 50.0;

/// The permutation test over tiles × path classes of what both make, tiles merged within each class.
///
/// Classes and not the sum over them: where rare caustics lie over smooth light, the replicates of the sum look well sampled
/// even if no caustic was found at all, and the test would accuse an arm of what it has not had the time to see.
fn tile_test(
    replicates: &Replicates,
    i: usize,
    j: usize,
    alpha: f64,
) -> Result<Option<TileSummary>, StatsError> {
    let (columns, rows) = (replicates.tiles.columns, replicates.tiles.rows);
    let (a, b) = (&replicates.arms[i], &replicates.arms[j]);
    let mut x = vec![Vec::new(); a.replicates.len()];
    let mut y = vec![Vec::new(); b.replicates.len()];
    for class in common_classes(a, b) {
        let (one, two) =
            (class_tiles(a, class, columns * rows), class_tiles(b, class, columns * rows));
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

/// Path classes that both arms can make and at least one has met.
fn common_classes(a: &Arm, b: &Arm) -> BTreeSet<PathClass> {
    let met = [a, b].into_iter().flat_map(|arm| &arm.replicates).flat_map(|r| r.classes.keys());
    let both =
        |c: &&PathClass| c.families.intersects(a.families) && c.families.intersects(b.families);
    met.filter(both).copied().collect()
}

/// Mean luminance of each tile in each replicate, over one class.
fn class_tiles(arm: &Arm, class: PathClass, tiles: usize) -> Vec<Vec<f64>> {
    let row = |r: &Replicate| r.classes.get(&class).map_or(vec![0.0; tiles], |c| c.tiles.clone());
    arm.replicates.iter().map(row).collect()
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

/// Verdict and p-value of a pair from its two tests: *differ* where any cell or the tiles differ; else *agree* where the
/// image does.
fn judge(cells: &[CellTest], tiles: Option<&TileSummary>, with_tiles: bool) -> (Verdict, f64) {
    if cells.len() == 1 {
        // Nothing that both can make.
        return (Verdict::Inconclusive, 1.0);
    }
    let mut p = cells.iter().filter(|c| c.is_trusted()).fold(1.0, |m: f64, c| m.min(c.p));
    let any = cells.iter().any(|c| c.verdict == Verdict::Differ);
    let mut verdict = if any { Verdict::Differ } else { cells[0].verdict };
    if let Some(tiles) = tiles {
        if tiles.verdict != Verdict::Inconclusive {
            p = p.min(tiles.p);
        }
        if tiles.verdict == Verdict::Differ {
            verdict = Verdict::Differ;
        }
    }
    (verdict, if with_tiles { (2.0 * p).min(1.0) } else { p })
}

fn cell_summary(cell: &CellTest) -> LengthSummary {
    LengthSummary {
        length: cell.length.map(u32::from),
        verdict: cell.verdict,
        reason: cell.reason,
        p: cell.p,
        mdb: cell.test.mdb,
        mean_a: cell.test.mean_a,
        mean_b: cell.test.mean_b,
    }
}

/// What `blind` can not make of the image of `of`.
fn left_out(blind: &Arm, of: &Arm) -> Option<Unseen> {
    let (mut all, mut out) = (0.0, 0.0);
    for replicate in &of.replicates {
        for (class, value) in &replicate.classes {
            let y = luminance(&value.mean);
            all += y;
            if !class.families.intersects(blind.families) {
                out += y;
            }
        }
    }
    (out != 0.0).then(|| Unseen {
        integrator: blind.name.clone(),
        of: of.name.clone(),
        fraction: out / all,
        reason: unseen::reason(blind.families),
    })
}
