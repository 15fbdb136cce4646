//! Comparison of an estimator with exact values, over all cells at once.

use serde::{Deserialize, Serialize};

use super::cell::Cell;
use super::decide::{Claim, Gates, Reason, Rule, Verdict, decide};
use super::fault::{StatsError, all_finite, at_least, same_length};
use super::moments::Moments;
use super::multiple::holm;
use super::welch::{Welch, one_sample_within};

/// Settings of [`compare_exact`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CompareConfig {
    /// Thresholds of the verdict; `alpha` bounds the probability of a false *differ* over all cells
    /// of a pair.
    pub rule: Rule,
    /// Relative difference of means that single-precision arithmetic may cause by itself: a
    /// half-width of the null hypothesis, so that noise-free scenes are not told apart by rounding.
    pub tolerance: f64,
}

impl Default for CompareConfig {
    /// The default [`Rule`] and a tolerance of 10⁻⁶.
    fn default() -> Self {
        CompareConfig { rule: Rule::default(), tolerance: 1e-6 }
    }
}

/// Result of [`compare_exact`] on one cell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CellReport {
    /// Name of the cell.
    pub name: String,
    /// Path length, `None` for the sum over all.
    pub length: Option<u32>,
    /// Whether the pair can only agree if this cell does.
    pub decisive: bool,
    /// The test, with its unadjusted p-value and minimum detectable bias.
    #[serde(flatten)]
    pub test: Welch,
    /// Holm's adjusted p-value over the cells of the pair.
    pub p_adjusted: f64,
    /// Verdict on the cell.
    pub verdict: Verdict,
    /// Why.
    pub reason: Reason,
    /// The gates that were applied; infinities serialise as null.
    pub gates: Gates,
}

/// Result of [`compare_exact`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExactReport {
    /// Replicates; 0 of an estimator that sees none of the cells.
    pub replicates: usize,
    /// *Differ* if any cell differs; else *agree* if every decisive cell agrees; else
    /// *inconclusive*.
    pub verdict: Verdict,
    /// Smallest adjusted p-value of all cells, 1 without cells.
    pub p: f64,
    /// Largest relative minimum detectable bias of the decisive cells; infinity serialises as null.
    pub mdb: f64,
    /// The cells in the order of the set.
    pub cells: Vec<CellReport>,
}

/// Compares replicates with exact values known to within `uncertainty`, cell by cell, with a
/// t-test, Holm's adjustment and [`decide()`].
///
/// `rows` holds one row a replicate with one number a cell. Cells that are exactly 0 in every
/// replicate and in truth agree and do not count among Holm's hypotheses; cells that fail a gate
/// do. If no cell is decisive, all are.
///
/// Where the exact value is 0 without uncertainty, a single positive value differs if none is
/// negative: a non-negative estimator of mean 0 is 0 almost surely.
///
/// `exact` and `uncertainty` hold one number a cell, in the unit of the cells; an uncertainty of 0
/// means exact. Fails on fewer than 2 replicates, other numbers of values and values that are not
/// finite.
pub fn compare_exact(
    cells: &[Cell],
    rows: &[Vec<f64>],
    exact: &[f64],
    uncertainty: &[f64],
    config: &CompareConfig,
) -> Result<ExactReport, StatsError> {
    same_length("cells and exact values", cells.len(), exact.len())?;
    same_length("cells and uncertainties", cells.len(), uncertainty.len())?;
    at_least("replicates", 2, rows.len())?;
    for row in rows {
        same_length("cells and values of a replicate", cells.len(), row.len())?;
        all_finite("replicate", row)?;
    }
    let mut raw = Vec::with_capacity(cells.len());
    for (c, (&mu, &u)) in exact.iter().zip(uncertainty).enumerate() {
        let x: Vec<f64> = rows.iter().map(|row| row[c]).collect();
        let dark = is_zero(&x);
        let mut test = one_sample_within(&x, mu, u + config.tolerance * mu.abs())?;
        let mut gates = Gates { n_eff: implied_n_eff(&x)?, khat: None };
        if mu == 0.0 && u == 0.0 && !dark && x.iter().all(|v| *v >= 0.0) {
            // One hit is proof, however rare the hits are.
            test.p = 0.0;
            gates = Gates::default();
        }
        raw.push(Raw { test, gates, zero: (dark, dark && mu == 0.0) });
    }
    Ok(judge(cells, rows.len(), &raw, &config.rule))
}

/// Ȳ²/s² of the replicate means, an upper bound on n_eff = (Σx)²/Σx² that needs no samples.
///
/// For n independent samples a replicate has n_eff = n μ²/(σ²+μ²) ≤ n μ²/σ² = E²/Var of its mean.
/// `None` where a value is negative: signed observables have no such reading.
fn implied_n_eff(column: &[f64]) -> Result<Option<f64>, StatsError> {
    if column.iter().any(|v| *v < 0.0) {
        return Ok(None);
    }
    let m = Moments::of(column)?;
    Ok(Some(if m.mean == 0.0 { 0.0 } else { m.mean * m.mean / m.variance }))
}

struct Raw {
    test: Welch,
    gates: Gates,
    zero: (bool, bool),
}

fn is_zero(column: &[f64]) -> bool {
    column.iter().all(|v| *v == 0.0)
}

fn judge(cells: &[Cell], replicates: usize, raw: &[Raw], rule: &Rule) -> ExactReport {
    let tested: Vec<usize> = (0..raw.len()).filter(|&c| raw[c].zero != (true, true)).collect();
    let adjusted = holm(&tested.iter().map(|&c| raw[c].test.p).collect::<Vec<_>>());
    let mut p_adjusted = vec![1.0; raw.len()];
    for (&c, p) in tested.iter().zip(adjusted) {
        p_adjusted[c] = p;
    }

    let all_decisive = !cells.iter().any(|c| c.decisive);
    let reports: Vec<CellReport> = cells
        .iter()
        .zip(raw)
        .zip(&p_adjusted)
        .map(|((cell, raw), &p_adjusted)| {
            let claim = Claim { p_adjusted, mdb: raw.test.mdb, gates: raw.gates, zero: raw.zero };
            let (verdict, reason) = decide(&claim, rule);
            CellReport {
                name: cell.name.clone(),
                length: cell.length,
                decisive: cell.decisive || all_decisive,
                test: raw.test,
                p_adjusted,
                verdict,
                reason,
                gates: raw.gates,
            }
        })
        .collect();

    let mut decisive = reports.iter().filter(|c| c.decisive);
    let verdict = if reports.iter().any(|c| c.verdict == Verdict::Differ) {
        Verdict::Differ
    } else if decisive.all(|c| c.verdict == Verdict::Agree) {
        Verdict::Agree
    } else {
        Verdict::Inconclusive
    };
    let mdb = reports.iter().filter(|c| c.decisive).fold(0.0, |m: f64, c| m.max(c.test.mdb));
    let p = p_adjusted.iter().fold(1.0, |m: f64, p| m.min(*p));
    ExactReport { replicates, verdict, p, mdb, cells: reports }
}

#[cfg(test)]
mod tests {
    use super::super::{binomial_interval, testing::Source};
    use super::*;

    /// The image and one cell for each mean.
    fn cells(means: &[f64]) -> Vec<Cell> {
        let lengths = (0..means.len()).map(|j| Cell::length(j as u32 + 1));
        std::iter::once(Cell::image()).chain(lengths).collect()
    }

    fn truth(means: &[f64]) -> Vec<f64> {
        std::iter::once(means.iter().sum()).chain(means.iter().copied()).collect()
    }

    /// Replicates of these means with relative noise.
    fn rows(source: &mut Source, k: usize, means: &[f64], noise: f64) -> Vec<Vec<f64>> {
        let row = |_| {
            truth(&means.iter().map(|m| m * (1.0 + noise * source.normal())).collect::<Vec<_>>())
        };
        (0..k).map(row).collect()
    }

    fn run(means: &[f64], rows: &[Vec<f64>], bias: f64) -> ExactReport {
        let exact: Vec<f64> = truth(means).iter().map(|m| m * bias).collect();
        let none = vec![0.0; exact.len()];
        compare_exact(&cells(means), rows, &exact, &none, &CompareConfig::default()).unwrap()
    }

    #[test]
    fn what_is_right_agrees_and_prints_what_would_have_been_seen() {
        let means = [1.0, 0.5, 0.2];
        let report = run(&means, &rows(&mut Source::new(3), 16, &means, 0.01), 1.0);
        assert_eq!(report.verdict, Verdict::Agree);
        assert!(report.mdb > 0.003 && report.mdb < 0.03, "{}", report.mdb);
    }

    #[test]
    fn a_bias_of_five_percent_differs_everywhere() {
        let means = [1.0, 0.5, 0.2];
        let report = run(&means, &rows(&mut Source::new(4), 16, &means, 0.01), 1.05);
        assert!(report.cells.iter().all(|c| c.verdict == Verdict::Differ), "{report:?}");
    }

    #[test]
    fn noise_beyond_the_limit_is_inconclusive() {
        let report = run(&[1.0], &rows(&mut Source::new(5), 16, &[1.0], 0.2), 1.0);
        assert_eq!(report.verdict, Verdict::Inconclusive);
        assert_eq!(report.cells[0].reason, Reason::TooNoisy);
    }

    #[test]
    fn cells_that_are_zero_in_truth_and_here_agree_and_leave_the_family() {
        let means = [1.0, 0.0, 0.0, 0.0];
        let report = run(&means, &rows(&mut Source::new(6), 16, &means, 0.01), 1.0);
        let dark = &report.cells[3];
        assert_eq!((dark.verdict, dark.reason), (Verdict::Agree, Reason::BothZero));
        assert_eq!((dark.test.mdb, dark.p_adjusted), (0.0, 1.0));
        // Two hypotheses remain, and they are the same numbers.
        let expected = (2.0 * report.cells[1].test.p).min(1.0);
        assert!((report.cells[1].p_adjusted - expected).abs() < 1e-12);
    }

    #[test]
    fn rare_hits_fail_the_gate_on_the_replicates_alone() {
        let mut source = Source::new(7);
        let rows: Vec<Vec<f64>> = (0..32).map(|_| vec![source.poisson(1.0)]).collect();
        let config = CompareConfig::default();
        let report = compare_exact(&[Cell::image()], &rows, &[1.0], &[0.0], &config).unwrap();
        assert_eq!(report.cells[0].reason, Reason::FewContributions);
    }

    #[test]
    fn rounding_in_a_noise_free_scene_is_not_a_difference() {
        let rows = vec![vec![1.0]; 16];
        let at = |exact: f64| {
            let config = CompareConfig::default();
            compare_exact(&[Cell::image()], &rows, &[exact], &[0.0], &config).unwrap().verdict
        };
        assert_eq!(at(1.0 + 3e-7), Verdict::Agree);
        assert_eq!(at(1.0 + 3e-5), Verdict::Differ);
    }

    #[test]
    fn exact_values_are_met_within_their_uncertainty() {
        let means = [1.0, 0.5];
        let (cells, rows) = (cells(&means), rows(&mut Source::new(9), 16, &means, 0.01));
        let config = CompareConfig::default();
        let bad = compare_exact(&cells, &rows, &[1.5, 1.1, 0.4], &[0.0; 3], &config).unwrap();
        assert_eq!(bad.verdict, Verdict::Differ);
        let loose = compare_exact(&cells, &rows, &[1.5, 1.1, 0.4], &[0.2; 3], &config).unwrap();
        assert_ne!(loose.verdict, Verdict::Differ);
    }

    #[test]
    fn a_single_hit_where_the_exact_value_is_zero_differs() {
        let cells = [Cell::length(2), Cell::length(3)];
        let rows: Vec<Vec<f64>> =
            (0..16).map(|r| vec![if r == 5 { 1e-9 } else { 0.0 }, 0.0]).collect();
        let config = CompareConfig::default();
        let report = compare_exact(&cells, &rows, &[0.0; 2], &[0.0; 2], &config).unwrap();
        let verdicts: Vec<Verdict> = report.cells.iter().map(|c| c.verdict).collect();
        assert_eq!(verdicts, [Verdict::Differ, Verdict::Agree]);
        // The other way round, no hits where light is expected prove nothing by themselves.
        let report = compare_exact(&cells, &rows, &[0.0, 1.0], &[1e-6, 0.0], &config).unwrap();
        let reasons: Vec<Reason> = report.cells.iter().map(|c| c.reason).collect();
        assert_eq!(reasons, [Reason::FewContributions, Reason::NeverSampled]);
    }

    #[test]
    fn bad_sets_are_errors() {
        let config = CompareConfig::default();
        let run =
            |rows: &[Vec<f64>]| compare_exact(&[Cell::image()], rows, &[1.0], &[0.0], &config);
        assert!(run(&[vec![1.0, 2.0], vec![1.0, 2.0]]).is_err());
        assert!(run(&[vec![f64::NAN], vec![1.0]]).is_err());
        assert!(matches!(run(&[vec![1.0]]), Err(StatsError::TooFew { .. })));
    }

    #[test]
    fn what_is_right_alarms_at_most_at_the_level() {
        let mut source = Source::new(2);
        let mut config = CompareConfig::default();
        config.rule.alpha = 0.05;
        let means = [1.0, 0.5, 0.3, 0.1, 0.03];
        let (cells, exact, runs) = (cells(&means), truth(&means), 4000);
        let alarms = (0..runs)
            .filter(|_| {
                let rows = rows(&mut source, 16, &means, 0.05);
                let report = compare_exact(&cells, &rows, &exact, &[0.0; 6], &config).unwrap();
                report.verdict == Verdict::Differ
            })
            .count() as u64;
        let (low, high) = binomial_interval(alarms, runs, 0.95).unwrap();
        assert!(high <= 0.075, "{alarms} of {runs}: [{low}, {high}]");
        // Holm over nearly independent cells is not far below its level either.
        assert!(low > 0.03, "{alarms} of {runs}: [{low}, {high}]");
    }
}
