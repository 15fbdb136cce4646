//! The tests on the means of luminance, R, G and B over the image.

use pathspace_core::color::luminance;
use serde::Serialize;

use super::{AgreeConfig, ImageSet, detectable};
use crate::stats::{
    Claim, Estimate, Gates, Moments, Reason, Rule, StatsError, Verdict, decide, holm,
    student_quantile, welch, welch_within,
};

/// What is averaged over an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Channel {
    /// Luminance of linear sRGB.
    Luminance,
    /// Red.
    Red,
    /// Green.
    Green,
    /// Blue.
    Blue,
}

impl Channel {
    /// All of them; luminance, which the minimum detectable bias refers to, is the first.
    pub const ALL: [Channel; 4] = [Channel::Luminance, Channel::Red, Channel::Green, Channel::Blue];
}

/// The test on one channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelTest {
    /// Which.
    pub channel: Channel,
    /// Mean over image and images of A.
    pub mean_a: f64,
    /// Mean of B.
    pub mean_b: f64,
    /// Standard error of the difference.
    pub se: f64,
    /// Welch's t.
    pub t: f64,
    /// p-value of this channel alone.
    pub p_single: f64,
    /// p-value after Holm's adjustment over the channels.
    pub p: f64,
    /// Minimum detectable bias, relative to the mean of both sides.
    pub mdb: f64,
    /// Verdict.
    pub verdict: Verdict,
    /// Why.
    pub reason: Reason,
}

/// Mean of a channel over an image.
pub(super) fn mean(image: &[[f32; 3]], channel: Channel) -> f64 {
    let of = |p: &[f32; 3]| {
        let p = p.map(f64::from);
        match channel {
            Channel::Luminance => luminance(&p),
            Channel::Red => p[0],
            Channel::Green => p[1],
            Channel::Blue => p[2],
        }
    };
    image.iter().map(of).sum::<f64>() / image.len() as f64
}

fn means(set: ImageSet<'_>, channel: Channel) -> Vec<f64> {
    set.images.iter().map(|i| mean(i, channel)).collect()
}

/// Tests every channel; `rare` is the luminance that came in fireflies.
pub(super) fn test(
    sides: [ImageSet<'_>; 2],
    rare: f64,
    level: f64,
    config: &AgreeConfig,
) -> Result<Vec<ChannelTest>, StatsError> {
    let rule = Rule { alpha: level, mdb_limit: config.limit, ..Rule::default() };
    // Fireflies take the same share of each channel, for all that is known.
    let luminance = [means(sides[0], Channel::Luminance), means(sides[1], Channel::Luminance)];
    let scale = largest(&luminance)?;
    let share = if scale > 0.0 { rare / scale } else { 0.0 };
    let hypotheses = Channel::ALL.len() as f64;
    let mut found = Vec::new();
    for channel in Channel::ALL {
        let [x, y] = [means(sides[0], channel), means(sides[1], channel)];
        let zero = [&x, &y].map(|c| c.iter().all(|v| *v == 0.0));
        let scale = largest(&[x.clone(), y.clone()])?;
        let within = (share + config.tolerance) * scale;
        let w = welch_within(&x, &y, within)?;
        let n_eff = effective(&x)?.min(effective(&y)?);
        let size = 0.5 * (w.mean_a.abs() + w.mean_b.abs());
        let bias = detectable(w.se, w.df, level / hypotheses)? + within;
        let mdb = if bias == 0.0 { 0.0 } else { bias / size };
        let gates = Gates { n_eff: Some(n_eff), khat: None };
        found.push((channel, w, Claim { p_adjusted: 1.0, mdb, gates, zero: (zero[0], zero[1]) }));
    }
    // Channels without light are no hypotheses.
    let lit: Vec<usize> = (0..found.len()).filter(|&c| found[c].2.zero != (true, true)).collect();
    let adjusted = holm(&lit.iter().map(|&c| found[c].1.p).collect::<Vec<_>>());
    for (&c, p) in lit.iter().zip(adjusted) {
        found[c].2.p_adjusted = p;
    }
    let tests = found.into_iter().map(|(channel, w, claim)| {
        let (verdict, reason) = decide(&claim, &rule);
        ChannelTest {
            channel,
            mean_a: w.mean_a,
            mean_b: w.mean_b,
            se: w.se,
            t: w.t,
            p_single: w.p,
            p: claim.p_adjusted,
            mdb: claim.mdb,
            verdict,
            reason,
        }
    });
    Ok(tests.collect())
}

fn largest(columns: &[Vec<f64>; 2]) -> Result<f64, StatsError> {
    Ok(Moments::of(&columns[0])?.mean.abs().max(Moments::of(&columns[1])?.mean.abs()))
}

/// Ȳ²/s², an upper bound on the effective number of contributions to an image.
fn effective(column: &[f64]) -> Result<f64, StatsError> {
    let m = Moments::of(column)?;
    Ok(if m.mean == 0.0 { 0.0 } else { m.mean * m.mean / m.variance })
}

/// Mean luminance of A over that of B, minus 1, with its 95 % interval.
pub(super) fn difference(sides: [ImageSet<'_>; 2]) -> Result<Estimate, StatsError> {
    let [x, y] = sides.map(|s| means(s, Channel::Luminance));
    let w = welch(&x, &y)?;
    if w.mean_b == 0.0 {
        return Ok(Estimate { value: f64::NAN, low: f64::NAN, high: f64::NAN });
    }
    let value = w.mean_a / w.mean_b - 1.0;
    let half = student_quantile(0.975, w.df)? * w.se / w.mean_b.abs();
    Ok(Estimate { value, low: value - half, high: value + half })
}
