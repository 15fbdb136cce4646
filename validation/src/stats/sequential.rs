//! Stopping early without fooling oneself: the paired t e-process.
//!
//! Looking at a t-test again and again raises its false alarms: every 8 pairs up to 128, from 1 %
//! to 6 %; up to 512, to 10 %; without end, to all. An e-process may be looked at after every
//! replicate: the probability that it *ever* reaches 1/α under the null is at most α (Ville 1939).
//! The price is a smaller power at any one size.

use serde::{Deserialize, Serialize};

use super::cell::Cell;
use super::fault::{StatsError, all_finite, at_least, open_unit, same_length};
use super::welch::minimum_detectable_bias;

/// Running paired t statistic of differences of replicate means, and its e-value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PairedT {
    n: u64,
    mean: f64,
    squares: f64,
}

impl PairedT {
    /// Adds the difference of one pair of replicates (update of Welford 1962).
    pub fn push(&mut self, difference: f64) {
        self.n += 1;
        let d = difference - self.mean;
        self.mean += d / self.n as f64;
        self.squares += d * (difference - self.mean);
    }

    /// Number of pairs so far.
    pub fn pairs(&self) -> u64 {
        self.n
    }

    /// Mean difference.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Standard error of the mean difference, s/√n; infinite below 2 pairs.
    pub fn se(&self) -> f64 {
        if self.n < 2 {
            return f64::INFINITY;
        }
        let n = self.n as f64;
        (self.squares / (n - 1.0) / n).sqrt()
    }

    /// ln of the Bayes factor of "mean ≠ 0" against "mean = 0", an e-process.
    ///
    /// BF_n = (1+ng)^{−1/2}·[(1+t²/ν)/(1+t²/(ν(1+ng)))]^{(ν+1)/2} with t = D̄/(s/√n), ν = n−1, for
    /// a normal prior of variance g on the standardised mean (Gönen et al. 2005; as an e-process
    /// Pérez-Ortiz et al. 2024). 0 below 2 pairs and where all differences are exactly 0.
    pub fn ln_e_value(&self, g: f64) -> f64 {
        if self.n < 2 || (self.mean == 0.0 && self.squares == 0.0) {
            return 0.0;
        }
        let n = self.n as f64;
        let (df, widened) = (n - 1.0, (n * g).ln_1p());
        // t²/ν = n D̄²/Σ(D−D̄)², infinite where the differences are equal.
        let ratio = n * self.mean * self.mean / self.squares;
        let gain = if ratio.is_finite() {
            ratio.ln_1p() - (ratio / (1.0 + n * g)).ln_1p()
        } else {
            widened
        };
        0.5 * (df + 1.0) * gain - 0.5 * widened
    }

    /// Half the width of a confidence sequence for the mean: the means m for which the e-value of
    /// "mean = m" is below 1/α. The probability that the mean is *ever* outside D̄ ± this, however
    /// often one looks, is at most α (Ville 1939).
    ///
    /// With w = 1+ng and c = (√w/α)^{2/n}, BF_n < 1/α means t² < ν(c−1)/(1−c/w). Infinite while c ≥
    /// w: too few pairs to say anything.
    pub fn half_width(&self, g: f64, alpha: f64) -> f64 {
        if self.n < 2 {
            return f64::INFINITY;
        }
        let n = self.n as f64;
        let w = 1.0 + n * g;
        let c = ((0.5 * w.ln() - alpha.ln()) * 2.0 / n).exp();
        if c >= w {
            return f64::INFINITY;
        }
        let t2 = (n - 1.0) * (c - 1.0) / (1.0 - c / w);
        t2.sqrt() * self.se()
    }
}

/// Settings of [`Sequential`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SequentialConfig {
    /// Probability bound on ever stopping with *differ* under the null.
    pub alpha: f64,
    /// Variance g of the standardised mean difference that the e-process expects.
    pub g: f64,
    /// Stop as [`Decision::Resolved`] once the minimum detectable bias of every decisive cell is at
    /// most this.
    pub mdb_limit: f64,
    /// Fewest pairs before that.
    pub min_pairs: u64,
}

impl Default for SequentialConfig {
    /// α = 10⁻⁴, g = 1, MDB ≤ 5 % after at least 16 pairs.
    fn default() -> Self {
        SequentialConfig { alpha: 1e-4, g: 1.0, mdb_limit: 0.05, min_pairs: 16 }
    }
}

/// What to do after a pair of replicates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Decision {
    /// Render another pair.
    Continue,
    /// The methods differ; stays so.
    Differ,
    /// Precise enough to stop. The verdict of the fixed-size comparison on the replicates may then
    /// be printed as a figure, but only this e-process keeps its level.
    Resolved,
}

/// Sequential comparison of two methods over many cells by the average of their e-values.
///
/// The average of e-values is an e-value whatever their dependence; one cell of m needs e ≥ m/α
/// alone, many faint ones help each other. Every e-process is exact for normal differences in the
/// information of its own scale-free history; that the average may be monitored in the joint
/// history of dependent cells is checked by simulation here, not proved. The gates against heavy
/// tails apply as for any t statistic.
#[derive(Clone, Debug, PartialEq)]
pub struct Sequential {
    config: SequentialConfig,
    cells: Vec<State>,
    pairs: u64,
    largest: f64,
}

#[derive(Clone, Debug, PartialEq)]
struct State {
    decisive: bool,
    difference: PairedT,
    /// Sum over both methods, for the mean that relative figures refer to.
    sum: f64,
}

impl Sequential {
    /// Starts a comparison; if no cell is decisive, all are. Fails without cells and on α outside
    /// (0, 1) or g ≤ 0.
    pub fn new(cells: &[Cell], config: SequentialConfig) -> Result<Self, StatsError> {
        at_least("cells", 1, cells.len())?;
        open_unit("alpha", config.alpha)?;
        if !(config.g > 0.0 && config.g.is_finite()) {
            let expected = "a positive number";
            return Err(StatsError::OutOfRange { what: "g", value: config.g, expected });
        }
        let all = !cells.iter().any(|c| c.decisive);
        let state = |c: &Cell| State {
            decisive: c.decisive || all,
            difference: PairedT::default(),
            sum: 0.0,
        };
        Ok(Sequential {
            config,
            cells: cells.iter().map(state).collect(),
            pairs: 0,
            largest: f64::NEG_INFINITY,
        })
    }

    /// Adds one replicate of each method, one value a cell, and decides.
    ///
    /// Fails on other numbers of values and on non-finite ones; the comparison is then unchanged.
    pub fn push(&mut self, a: &[f64], b: &[f64]) -> Result<Decision, StatsError> {
        for row in [a, b] {
            same_length("cells and values of a replicate", self.cells.len(), row.len())?;
            all_finite("replicate", row)?;
        }
        self.pairs += 1;
        for (cell, (a, b)) in self.cells.iter_mut().zip(a.iter().zip(b)) {
            cell.difference.push(a - b);
            cell.sum += a + b;
        }
        self.largest = self.largest.max(self.ln_e_value());
        self.decision()
    }

    /// ln of the average e-value at this moment.
    pub fn ln_e_value(&self) -> f64 {
        let ln = self.ln_e_values();
        let largest = ln.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = ln.iter().map(|e| (e - largest).exp()).sum();
        largest + (sum / ln.len() as f64).ln()
    }

    /// ln of the e-value of every cell, for locating a difference.
    pub fn ln_e_values(&self) -> Vec<f64> {
        self.cells.iter().map(|c| c.difference.ln_e_value(self.config.g)).collect()
    }

    /// Anytime-valid p-value, min(1, 1/max_n e_n).
    pub fn p(&self) -> f64 {
        (-self.largest).exp().min(1.0)
    }

    /// Number of pairs so far.
    pub fn pairs(&self) -> u64 {
        self.pairs
    }

    /// Largest relative minimum detectable bias of the decisive cells, from the paired standard
    /// error.
    pub fn mdb(&self) -> Result<f64, StatsError> {
        let mut largest: f64 = 0.0;
        for cell in self.cells.iter().filter(|c| c.decisive) {
            let mean = cell.sum / (2 * self.pairs.max(1)) as f64;
            largest = largest.max(minimum_detectable_bias(cell.difference.se(), mean, 0.0)?);
        }
        Ok(largest)
    }

    fn decision(&self) -> Result<Decision, StatsError> {
        if self.largest >= -self.config.alpha.ln() {
            return Ok(Decision::Differ);
        }
        let precise = self.pairs >= self.config.min_pairs && self.mdb()? <= self.config.mdb_limit;
        Ok(if precise { Decision::Resolved } else { Decision::Continue })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{binomial_interval, one_sample, testing::Source};
    use super::*;

    #[test]
    fn e_value_is_the_published_bayes_factor() {
        // t = 2, n = 4 differences: mean 1, s = 1. BF = 5^{-1/2}·[(1+4/3)/(1+4/15)]².
        let mut t = PairedT::default();
        let s = 1.5_f64.sqrt();
        [1.0 + s, 1.0 - s, 1.0, 1.0].iter().for_each(|d| t.push(*d));
        let expected = 5f64.powf(-0.5) * (35.0f64 / 19.0).powi(2);
        assert!((t.ln_e_value(1.0) - expected.ln()).abs() < 1e-12);
    }

    #[test]
    fn the_confidence_sequence_ends_where_the_e_value_is_one_over_alpha() {
        let mut source = Source::new(55);
        let d = source.normals(12, 0.4, 1.0);
        let statistic = |m: f64| {
            let mut t = PairedT::default();
            d.iter().for_each(|d| t.push(d - m));
            t
        };
        let t = statistic(0.0);
        let half = t.half_width(1.0, 0.05);
        for end in [t.mean() - half, t.mean() + half] {
            assert!((statistic(end).ln_e_value(1.0) - 20f64.ln()).abs() < 1e-9, "{half}");
        }
        let mut few = PairedT::default();
        [1.0, 2.0].iter().for_each(|d| few.push(*d));
        assert_eq!(few.half_width(1.0, 0.05), f64::INFINITY);
    }

    #[test]
    fn the_confidence_sequence_holds_the_mean_at_every_look() {
        let mut source = Source::new(56);
        let escapes = (0..3000)
            .filter(|_| {
                let mut t = PairedT::default();
                source.normals(100, 2.0, 3.0).iter().any(|d| {
                    t.push(*d);
                    (t.mean() - 2.0).abs() > t.half_width(1.0, 0.05)
                })
            })
            .count() as u64;
        let (_, high) = binomial_interval(escapes, 3000, 0.95).unwrap();
        assert!(high <= 0.05, "{escapes} of 3000");
    }

    #[test]
    fn equal_differences_give_a_finite_limit_and_zeros_no_evidence() {
        let (mut constant, mut zero) = (PairedT::default(), PairedT::default());
        for _ in 0..4 {
            constant.push(0.5);
            zero.push(0.0);
        }
        assert!((constant.ln_e_value(1.0) - 1.5 * 5f64.ln()).abs() < 1e-12);
        assert_eq!(zero.ln_e_value(1.0), 0.0);
    }

    /// Runs that alarm at any of the looks at 8, 16, … 128 pairs of equal normals.
    fn alarms(runs: u64, seed: u64, alarm: impl Fn(&[f64]) -> bool) -> u64 {
        let mut source = Source::new(seed);
        (0..runs)
            .filter(|_| {
                let d = source.normals(128, 0.0, 1.0);
                (1..=16).any(|look| alarm(&d[..8 * look]))
            })
            .count() as u64
    }

    #[test]
    fn looking_every_8_pairs_stays_below_the_level() {
        let hits = alarms(6000, 50, |d| {
            let mut t = PairedT::default();
            d.iter().for_each(|d| t.push(*d));
            t.ln_e_value(1.0) >= 100f64.ln()
        });
        let (_, high) = binomial_interval(hits, 6000, 0.95).unwrap();
        assert!(high <= 0.01, "{hits} of 6000");
    }

    #[test]
    fn looking_every_8_pairs_breaks_a_plain_t_test() {
        let hits = alarms(1000, 51, |d| one_sample(d, 0.0).unwrap().p < 0.01);
        let (low, _) = binomial_interval(hits, 1000, 0.95).unwrap();
        assert!(low > 0.03, "{hits} of 1000");
    }

    /// Share of `runs` comparisons over correlated cells that ever differ, looking after each of 64
    /// pairs.
    fn ever_differ(runs: u64, cells: usize, alpha: f64, seed: u64) -> u64 {
        let mut source = Source::new(seed);
        let names: Vec<Cell> = (0..cells as u32).map(Cell::length).collect();
        let config = SequentialConfig { alpha, mdb_limit: 0.0, ..Default::default() };
        (0..runs)
            .filter(|_| {
                let mut test = Sequential::new(&names, config).unwrap();
                (0..64).any(|_| {
                    let mut row = || -> Vec<f64> {
                        let common = source.normal();
                        (0..cells).map(|_| 1.0 + 0.1 * (common + source.normal())).collect()
                    };
                    let (a, b) = (row(), row());
                    test.push(&a, &b).unwrap() == Decision::Differ
                })
            })
            .count() as u64
    }

    #[test]
    fn the_average_over_correlated_cells_keeps_the_level_at_every_look() {
        let hits = ever_differ(1500, 6, 0.05, 52);
        let (_, high) = binomial_interval(hits, 1500, 0.95).unwrap();
        assert!(high <= 0.05, "{hits} of 1500");
    }

    #[test]
    fn a_bias_stops_early_and_its_cell_has_the_largest_e_value() {
        let mut source = Source::new(53);
        let cells = [Cell::image(), Cell::length(2), Cell::length(3)];
        let mut test = Sequential::new(&cells, SequentialConfig::default()).unwrap();
        let mut decision = Decision::Continue;
        while decision == Decision::Continue && test.pairs() < 200 {
            let a: Vec<f64> = (0..3).map(|_| 1.0 + 0.1 * source.normal()).collect();
            let mut b: Vec<f64> = (0..3).map(|_| 1.0 + 0.1 * source.normal()).collect();
            b[1] *= 1.2;
            decision = test.push(&a, &b).unwrap();
        }
        assert_eq!(decision, Decision::Differ);
        assert!(test.pairs() < 40 && test.p() <= 1e-4, "{}", test.pairs());
        let e = test.ln_e_values();
        assert!(e[1] > e[0] && e[1] > e[2], "{e:?}");
    }

    #[test]
    fn equal_arms_stop_once_they_are_precise() {
        let mut source = Source::new(54);
        let mut test = Sequential::new(&[Cell::image()], SequentialConfig::default()).unwrap();
        let mut pair = || {
            let (a, b) = (1.0 + 0.03 * source.normal(), 1.0 + 0.03 * source.normal());
            test.push(&[a], &[b]).unwrap()
        };
        while pair() == Decision::Continue {}
        assert_eq!(pair(), Decision::Resolved);
        // 5.17·0.03·√2/√n = 5 % at n = 19.2.
        assert!((16..30).contains(&test.pairs()), "{}", test.pairs());
    }

    #[test]
    fn bad_input_is_an_error_and_changes_nothing() {
        let mut test = Sequential::new(&[Cell::image()], SequentialConfig::default()).unwrap();
        assert!(test.push(&[1.0, 2.0], &[1.0]).is_err());
        assert!(test.push(&[f64::NAN], &[1.0]).is_err());
        assert_eq!(test.pairs(), 0);
        assert!(Sequential::new(&[], SequentialConfig::default()).is_err());
    }
}
