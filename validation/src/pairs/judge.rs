//! The verdict on a pair.

use serde::{Deserialize, Serialize};

use super::cells::{CellTest, Channel, test_cells};
use super::observe::{Method, Tiles, common_classes};
use super::place::{Place, place};
use super::tiles::{TileSummary, tile_test};
use super::unseen;
use crate::json::number;
use crate::stats::{CompareConfig, Reason, StatsError, Verdict};

/// Fewest replicates a side for the test on tiles.
pub const TILE_REPLICATES: usize = 16;

/// What one integrator of a pair can not make of the other's image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unseen {
    /// Who can not make it.
    pub integrator: String,
    /// Whose image it is missing from.
    pub of: String,
    /// Share of that image's mean luminance.
    #[serde(deserialize_with = "number")]
    pub fraction: f64,
    /// Which paths these are.
    pub reason: String,
}

/// The test on one path length, or on the image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LengthSummary {
    /// Path length in edges; null for the image.
    pub length: Option<u32>,
    /// What was looked at; the means are in it.
    #[serde(default = "luminance")]
    pub channel: Channel,
    /// Verdict.
    pub verdict: Verdict,
    /// Why.
    pub reason: Reason,
    /// p-value of this test alone.
    #[serde(deserialize_with = "number", default)]
    pub p_single: f64,
    /// p-value after Holm's adjustment over image and lengths.
    #[serde(deserialize_with = "number")]
    pub p: f64,
    /// Minimum detectable bias, relative.
    #[serde(deserialize_with = "number")]
    pub mdb: f64,
    /// Mean of the first integrator.
    #[serde(deserialize_with = "number")]
    pub mean_a: f64,
    /// Mean of the second.
    #[serde(deserialize_with = "number")]
    pub mean_b: f64,
}

/// Of reports that knew no other.
fn luminance() -> Channel {
    Channel::Luminance
}

/// Two integrators judged on the paths that both can make.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Judgement {
    /// First integrator.
    pub a: String,
    /// Second integrator.
    pub b: String,
    /// Verdict on the pair.
    pub verdict: Verdict,
    /// Family-wise p-value over image, lengths and tiles, of those where the test may be trusted.
    #[serde(deserialize_with = "number")]
    pub p: f64,
    /// Minimum detectable bias of the image, relative.
    #[serde(deserialize_with = "number")]
    pub mdb: f64,
    /// The test on the image.
    pub image: LengthSummary,
    /// The tests on path lengths.
    pub lengths: Vec<LengthSummary>,
    /// The tests on red and blue, of the image and of path lengths; none of a grey scene.
    #[serde(default)]
    pub channels: Vec<LengthSummary>,
    /// The paths on which the two differ most, where they look as if they did.
    #[serde(default)]
    pub place: Option<Place>,
    /// Techniques that both use, in words: a mistake in one of these may show in neither.
    #[serde(default)]
    pub common: Vec<String>,
    /// The test on tiles, with enough replicates.
    pub tiles: Option<TileSummary>,
    /// What was left out.
    pub unseen: Vec<Unseen>,
}

/// Judges two methods of one scene: image and lengths, with [`TILE_REPLICATES`] a side or more also
/// tiles.
///
/// # Errors
/// With fewer than two replicates of an method, or means that are not finite.
pub fn judge(
    a: &Method,
    b: &Method,
    tiles: &Tiles,
    config: &CompareConfig,
) -> Result<Judgement, StatsError> {
    let with_tiles = a.replicates.len().min(b.replicates.len()) >= TILE_REPLICATES;
    // Two tests share the level of the pair.
    let mut own = *config;
    if with_tiles {
        own.rule.alpha *= 0.5;
    }
    let classes = common_classes(a, b);
    let mut cells = test_cells(a, b, &classes, &own)?;
    let blind = a.ignores_its_seed() || b.ignores_its_seed();
    if blind {
        for cell in &mut cells {
            (cell.verdict, cell.reason) = (Verdict::Inconclusive, Reason::NoVariance);
        }
    }
    let with_tiles = with_tiles && !blind;
    let tiles = if with_tiles { tile_test(a, b, &classes, tiles, own.rule.alpha)? } else { None };
    let (verdict, p) = combine(&cells, tiles.as_ref(), with_tiles);
    let of = |coloured: bool| {
        let wanted = move |c: &&CellTest| (c.channel != Channel::Luminance) == coloured;
        cells[1..].iter().filter(wanted).map(cell_summary).collect()
    };
    Ok(Judgement {
        a: a.name.clone(),
        b: b.name.clone(),
        verdict,
        p,
        mdb: cells[0].test.mdb,
        image: cell_summary(&cells[0]),
        lengths: of(false),
        channels: of(true),
        place: place(a, b, &classes)?,
        common: unseen::techniques(a.families.common(b.families)),
        tiles,
        unseen: [left_out(a, b), left_out(b, a)].into_iter().flatten().collect(),
    })
}

/// Verdict and p-value of a pair from its two tests: *differ* where any cell or the tiles differ;
/// else *agree* where the image does.
fn combine(cells: &[CellTest], tiles: Option<&TileSummary>, with_tiles: bool) -> (Verdict, f64) {
    if cells.len() == 1 {
        // Nothing that both can make.
        return (Verdict::Inconclusive, 1.0);
    }
    let mut p = cells.iter().filter(|c| c.reason.is_trusted()).fold(1.0, |m: f64, c| m.min(c.p));
    let any = cells.iter().any(|c| c.verdict == Verdict::Differ);
    let mut verdict = if any { Verdict::Differ } else { cells[0].verdict };
    if let Some(tiles) = tiles {
        p = p.min(tiles.p);
        if tiles.verdict == Verdict::Differ {
            verdict = Verdict::Differ;
        }
    }
    (verdict, if with_tiles { (2.0 * p).min(1.0) } else { p })
}

fn cell_summary(cell: &CellTest) -> LengthSummary {
    LengthSummary {
        length: cell.length.map(u32::from),
        channel: cell.channel,
        verdict: cell.verdict,
        reason: cell.reason,
        p_single: cell.test.p,
        p: cell.p,
        mdb: cell.test.mdb,
        mean_a: cell.test.mean_a,
        mean_b: cell.test.mean_b,
    }
}

/// What `blind` can not make of the image of `of`.
fn left_out(blind: &Method, of: &Method) -> Option<Unseen> {
    let (mut all, mut out) = (0.0, 0.0);
    for replicate in &of.replicates {
        for (class, value) in &replicate.classes {
            all += value.mean;
            if !class.families.intersects(blind.families) {
                out += value.mean;
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
