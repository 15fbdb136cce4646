//! Do two sets of images show the same expectation? The test for images of any renderer.
//!
//! ```text
//! images ──▶ means of luminance, R, G, B: Welch, Holm          (channels)
//!        ──▶ tiles of luminance, from 16 images a side on      (pairs::tile_test)
//!        ──▶ noise of an image × seconds: ratio of efficiencies (noise)
//! ```
//!
//! The unit of observation is the image: each has to come from a seed of its own, and nothing is
//! assumed of the pixels inside one. Of a renderer's images no path classes are known, so that
//! everything is one class here. What only path classes could tell (a caustic that no image of a
//! set has met) is left to the tails of tiles, see [`agree()`].

mod channels;
mod noise;

use std::collections::BTreeMap;

use pathspace_core::film::Families;
use serde::Serialize;

use crate::pairs::TileSummary;
use crate::pairs::{ClassMean, Method, Observation, PathClass, TILE_REPLICATES, Tiles, tile_test};
use crate::stats::{
    Estimate, Reason, StatsError, Verdict, normal_quantile, student_quantile, student_sf, welch,
};

pub use channels::{Channel, ChannelTest};
pub use noise::Noise;

/// Fewest images a side for a verdict; with fewer there is a p-value, and the verdict is
/// *inconclusive*.
///
/// The variance of two or three images is hardly known, and Student's t then is right for normal
/// means only.
pub const FEWEST: usize = 4;
/// Most tiles along a side of the map of differences.
pub const MAP_TILES: usize = 64;
/// Larger differences are shown as this many standard deviations.
const MOST: f64 = 99.0;

/// Settings of [`agree()`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgreeConfig {
    /// Probability of the verdict *differ* where the expectations are the same.
    pub alpha: f64,
    /// Largest minimum detectable bias of an agreement, relative to the image's mean luminance.
    pub limit: f64,
    /// Relative difference that rounding of the image files may cause; 10⁻⁶ for 32-bit floats.
    pub tolerance: f64,
}

impl Default for AgreeConfig {
    /// α = 10⁻⁴, 5 %, 10⁻⁶.
    fn default() -> Self {
        AgreeConfig { alpha: 1e-4, limit: 0.05, tolerance: 1e-6 }
    }
}

/// One side: images of one size, each made with a seed of its own.
#[derive(Clone, Copy, Debug)]
pub struct ImageSet<'a> {
    /// Pixels `[r, g, b]` of each image, in rows from top to bottom.
    pub images: &'a [Vec<[f32; 3]>],
    /// Seconds that each image took; empty where they are not known.
    pub seconds: &'a [f64],
}

/// Why the verdict is what it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ground {
    /// A channel's mean over the image differs.
    Image,
    /// Tiles of the image differ.
    Tiles,
    /// No difference was found, and the minimum detectable bias is within the limit.
    Resolved,
    /// All images of both sides are black.
    Black,
    /// The minimum detectable bias is above the limit.
    TooNoisy,
    /// Fewer than [`FEWEST`] images on a side.
    TooFewImages,
    /// Two images of one side are the same to the bit: their seeds were not their own.
    Repeated,
    /// Rare bright pixels rule the means: a t-test can not be trusted.
    HeavyTail,
    /// One side is black.
    OneBlack,
}

/// What one side looks like.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Side {
    /// Number of images.
    pub images: usize,
    /// Mean of R, G and B over all images.
    pub mean: [f64; 3],
    /// Noise of one image.
    pub noise: Noise,
    /// Seconds of one image on average; null where they are not known.
    pub seconds: Option<f64>,
}

/// Difference of the sides in each tile, for the eye and never for the verdict.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SigmaMap {
    /// Tiles in a row.
    pub columns: usize,
    /// Rows of tiles.
    pub rows: usize,
    /// A − B in standard deviations, row by row, cut at ±99: the normal deviate with the tail
    /// probability of Welch's t.
    pub sigma: Vec<f64>,
}

/// What [`agree()`] finds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Agreement {
    /// The verdict.
    pub verdict: Verdict,
    /// Why.
    pub ground: Ground,
    /// Level α of the verdict.
    pub alpha: f64,
    /// p-value over channels and tiles together: below α where the verdict is *differ*.
    pub p: f64,
    /// Minimum detectable bias of the mean luminance, relative: found with probability 0.9 at level
    /// α.
    pub mdb: f64,
    /// The same of a single tile, the median over the tiles; null below 16 images a side.
    pub tile_mdb: Option<f64>,
    /// Limit that an agreement had to keep.
    pub limit: f64,
    /// Mean luminance of A over that of B, minus 1, with its 95 % interval; NaN where B is black.
    pub difference: Estimate,
    /// The tests on the means of luminance, R, G and B.
    pub channels: Vec<ChannelTest>,
    /// The test on tiles, from 16 images a side on.
    pub tiles: Option<TileSummary>,
    /// The sides, A and B.
    pub sides: [Side; 2],
    /// Efficiency of A over that of B, 1/(MSE·seconds), with its 95 % interval; null where seconds
    /// are missing.
    pub efficiency: Option<Estimate>,
    /// The same with relMSE instead of MSE, which weighs dark pixels like bright ones.
    pub efficiency_relative: Option<Estimate>,
    /// The two images of one side (0 for A, 1 for B) that are the same to the bit.
    pub repeated: Option<(usize, [usize; 2])>,
    /// Where they differ.
    pub map: SigmaMap,
}

/// Tests whether two sets of images of `width` × `height` pixels have the same expectation.
///
/// Two tests share the level α where there are 16 images a side, the first has it alone below that.
/// Channels: Welch's t of the means of luminance, R, G and B over the image, after Holm. Tiles: the
/// largest difference and the spread over up to 16 × 16 tiles of luminance ([`crate::pairs`]).
/// Where the residuals of tiles have a heavy tail, the light that came in fireflies widens the null
/// hypothesis of the channels, as between our own integrators.
///
/// The sides may have different numbers of images and different noise. Their seeds must be
/// independent; where both sides share seeds, and are correlated thereby, the test is only more
/// careful.
///
/// # Errors
/// With fewer than 2 images a side, images of other sizes, values that are not finite, another
/// number of seconds than of images, seconds that are not positive, and α or limit outside (0, 1).
pub fn agree(
    width: usize,
    height: usize,
    a: ImageSet<'_>,
    b: ImageSet<'_>,
    config: &AgreeConfig,
) -> Result<Agreement, StatsError> {
    check(width * height, a, config)?;
    check(width * height, b, config)?;
    let tiles = Tiles::new(width, height);
    let methods = [method("a", a, &tiles), method("b", b, &tiles)];
    let few = a.images.len().min(b.images.len());
    let with_tiles = few >= TILE_REPLICATES;
    let level = if with_tiles { 0.5 * config.alpha } else { config.alpha };

    let spotted = [heavy(&methods[0])?, heavy(&methods[1])?];
    let channels = channels::test([a, b], spotted[0].max(spotted[1]), level, config)?;
    let on_tiles = if with_tiles {
        tile_test(&methods[0], &methods[1], &[CLASS].into(), &tiles, level)?
    } else {
        None
    };
    let repeated = [a, b].into_iter().enumerate().find_map(|(i, s)| Some((i, repeated(s.images)?)));

    let luminance = &channels[0];
    let p_channels =
        channels.iter().filter(|c| c.reason.is_trusted()).fold(1.0_f64, |m, c| m.min(c.p));
    let p_tiles = on_tiles.as_ref().map_or(1.0, |t| t.p);
    let p = p_channels.min(p_tiles) * if with_tiles { 2.0 } else { 1.0 };
    let (verdict, ground) = if repeated.is_some() && luminance.reason != Reason::BothZero {
        (Verdict::Inconclusive, Ground::Repeated)
    } else if few < FEWEST {
        (Verdict::Inconclusive, Ground::TooFewImages)
    } else if channels.iter().any(|c| c.verdict == Verdict::Differ) {
        (Verdict::Differ, Ground::Image)
    } else if on_tiles.as_ref().is_some_and(|t| t.verdict == Verdict::Differ) {
        (Verdict::Differ, Ground::Tiles)
    } else {
        (
            luminance.verdict,
            match luminance.reason {
                Reason::BothZero => Ground::Black,
                Reason::Resolved | Reason::Significant => Ground::Resolved,
                Reason::TooNoisy => Ground::TooNoisy,
                Reason::NeverSampled => Ground::OneBlack,
                Reason::FewContributions | Reason::HeavyTail => Ground::HeavyTail,
                // Of replicates of integrators of our own alone.
                Reason::NoVariance => Ground::TooNoisy,
            },
        )
    };
    let sides = [side(a)?, side(b)?];
    let ratio = |cost: fn(&Noise) -> &[f64]| {
        noise::ratio([a, b], [cost(&sides[0].noise), cost(&sides[1].noise)])
    };
    let efficiency = ratio(|n| &n.per_image)?;
    let efficiency_relative = ratio(|n| &n.relative_per_image)?;
    Ok(Agreement {
        verdict,
        ground,
        alpha: config.alpha,
        p: p.min(1.0),
        mdb: luminance.mdb,
        tile_mdb: match &on_tiles {
            Some(t) => Some(tile_mdb(&methods, 0.25 * config.alpha / t.groups.max(1) as f64)?),
            None => None,
        },
        limit: config.limit,
        difference: channels::difference([a, b])?,
        channels,
        tiles: on_tiles,
        sides,
        efficiency,
        efficiency_relative,
        repeated,
        map: map(width, height, a, b)?,
    })
}

/// All light as one class: of another renderer's images nothing finer is known.
const CLASS: PathClass = PathClass { length: 0, families: Families::ALL };

fn check(pixels: usize, set: ImageSet<'_>, config: &AgreeConfig) -> Result<(), StatsError> {
    let (what, expected) = ("images of a side", "a number in (0, 1)");
    if set.images.len() < 2 {
        return Err(StatsError::TooFew { what, need: 2, got: set.images.len() });
    }
    for image in set.images {
        if image.len() != pixels || pixels == 0 {
            return Err(StatsError::LengthMismatch {
                what: "pixels of an image",
                left: pixels,
                right: image.len(),
            });
        }
        if let Some(index) = image.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
            let value =
                image[index].iter().find(|v| !v.is_finite()).map_or(f64::NAN, |v| f64::from(*v));
            return Err(StatsError::NonFinite { what: "pixels of an image", index, value });
        }
    }
    if !set.seconds.is_empty() && set.seconds.len() != set.images.len() {
        let (left, right) = (set.images.len(), set.seconds.len());
        return Err(StatsError::LengthMismatch { what: "images and seconds", left, right });
    }
    if let Some(&value) = set.seconds.iter().find(|s| !(**s > 0.0 && s.is_finite())) {
        return Err(StatsError::OutOfRange { what: "seconds", value, expected: "a number over 0" });
    }
    for (what, value) in [("alpha", config.alpha), ("limit", config.limit)] {
        if !(value > 0.0 && value < 1.0) {
            return Err(StatsError::OutOfRange { what, value, expected });
        }
    }
    Ok(())
}

fn wide(image: &[[f32; 3]]) -> Vec<[f64; 3]> {
    image.iter().map(|p| p.map(f64::from)).collect()
}

/// The images boiled down to tiles of luminance.
fn method(name: &str, set: ImageSet<'_>, tiles: &Tiles) -> Method {
    let mut method = Method::new(name.into(), Families::ALL);
    for image in set.images {
        let tiles = tiles.means(&wide(image));
        let mean = channels::mean(image, Channel::Luminance);
        let classes = BTreeMap::from([(CLASS, ClassMean { mean, tiles, ..ClassMean::default() })]);
        method.replicates.push(Observation { classes, samples: 0 });
    }
    method
}

fn rows(method: &Method) -> Vec<&[f64]> {
    method.replicates.iter().flat_map(|r| r.classes.values()).map(|c| c.tiles.as_slice()).collect()
}

/// Mean luminance that came in fireflies; 0 unless tiles have a heavy tail.
fn heavy(method: &Method) -> Result<f64, StatsError> {
    let rows: Vec<Vec<f64>> = rows(method).into_iter().map(<[f64]>::to_vec).collect();
    if rows.len() < 3 {
        return Ok(0.0);
    }
    Ok(crate::stats::tail(&rows)?.filter(|t| t.is_heavy()).map_or(0.0, |t| t.rare))
}

/// The first two images that are the same.
fn repeated(images: &[Vec<[f32; 3]>]) -> Option<[usize; 2]> {
    (1..images.len()).find_map(|j| (0..j).find(|&i| images[i] == images[j]).map(|i| [i, j]))
}

fn side(set: ImageSet<'_>) -> Result<Side, StatsError> {
    let k = set.images.len() as f64;
    let mean = [Channel::Red, Channel::Green, Channel::Blue]
        .map(|c| set.images.iter().map(|i| channels::mean(i, c)).sum::<f64>() / k);
    let seconds = (!set.seconds.is_empty()).then(|| set.seconds.iter().sum::<f64>() / k);
    Ok(Side { images: set.images.len(), mean, noise: Noise::of(set.images)?, seconds })
}

/// Median over the tiles that have light of the relative bias that a test of each at `level` finds
/// with probability 0.9.
fn tile_mdb(methods: &[Method; 2], level: f64) -> Result<f64, StatsError> {
    let [a, b] = [rows(&methods[0]), rows(&methods[1])];
    let mut found = Vec::new();
    for tile in 0..a[0].len() {
        let column = |rows: &[&[f64]]| rows.iter().map(|r| r[tile]).collect::<Vec<_>>();
        let w = welch(&column(&a), &column(&b))?;
        let mean = 0.5 * (w.mean_a.abs() + w.mean_b.abs());
        if mean > 0.0 {
            found.push(detectable(w.se, w.df, level)? / mean);
        }
    }
    found.sort_by(f64::total_cmp);
    Ok(found.get(found.len() / 2).copied().unwrap_or(0.0))
}

/// Power of the test that a minimum detectable bias refers to.
const POWER: f64 = 0.9;

/// Difference δ·SE that a two-sided t-test with ν degrees of freedom finds at `level` with
/// probability 0.9: δ = t(1 − 1/(4ν)) + z_{0.9}·√(1 + t²/(2ν)) with t = t_{1−α/2}, from the normal
/// approximation of the non-central t (Johnson & Welch 1940).
///
/// For many images that is (z_{1−α/2} + z_{0.9})·SE; few images hardly know their variance, and δ
/// grows.
fn detectable(se: f64, df: f64, level: f64) -> Result<f64, StatsError> {
    if se == 0.0 {
        return Ok(0.0);
    }
    let t = student_quantile(1.0 - 0.5 * level, df)?;
    let spread = (1.0 + t * t / (2.0 * df)).sqrt();
    Ok((t * (1.0 - 0.25 / df) + normal_quantile(POWER)? * spread) * se)
}

fn map(
    width: usize,
    height: usize,
    a: ImageSet<'_>,
    b: ImageSet<'_>,
) -> Result<SigmaMap, StatsError> {
    let tiles = Tiles::at_most(MAP_TILES, width, height);
    let [x, y] = [a, b].map(|s| s.images.iter().map(|i| tiles.means(&wide(i))).collect::<Vec<_>>());
    let mut sigma = Vec::with_capacity(tiles.count());
    for tile in 0..tiles.count() {
        let column = |rows: &[Vec<f64>]| rows.iter().map(|r| r[tile]).collect::<Vec<_>>();
        let w = welch(&column(&x), &column(&y))?;
        let tail = if w.t.is_finite() { student_sf(w.t.abs(), w.df) } else { 0.0 };
        // No normal deviate is known of a probability that has underflown.
        let z = if tail > 0.0 { -normal_quantile(tail.min(0.5))? } else { MOST };
        sigma.push(if w.t == 0.0 { 0.0 } else { z.min(MOST).copysign(w.t) });
    }
    Ok(SigmaMap { columns: tiles.columns, rows: tiles.rows, sigma })
}

#[cfg(test)]
mod tests;
