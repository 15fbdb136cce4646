//! Comparison of two arms, or of one arm with exact values, over all cells at once.

use serde::{Deserialize, Serialize};

use super::decide::{Claim, Gates, Reason, Rule, Verdict, decide};
use super::fault::{StatsError, at_least, same_length};
use super::moments::Moments;
use super::multiple::holm;
use super::replicates::{Cell, ReplicateSet};
use super::welch::{Welch, one_sample_within, welch_within};

/// Settings of [`compare()`].
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

/// Result of [`compare()`] on one cell.
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

/// Result of [`compare()`] on a pair of arms.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PairReport {
    /// First arm.
    pub a: String,
    /// Second arm, or `exact`.
    pub b: String,
    /// Replicates of the first arm.
    pub replicates_a: usize,
    /// Replicates of the second arm, 0 for an exact value.
    pub replicates_b: usize,
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

/// Compares two arms cell by cell with Welch's test, Holm's adjustment and [`decide()`].
///
/// Cells that are exactly 0 in every replicate of both arms agree and do not count among Holm's
/// hypotheses; cells that fail a gate do. If no cell is decisive, all are. Fails for unknown arms
/// and fewer than 2 replicates a side (16 are the least that gives a normal-looking mean, 32 for
/// Markov chains).
///
/// ```
/// use pathspace_validation::stats::{Cell, CompareConfig, ReplicateSet, Verdict, compare};
///
/// let mut set = ReplicateSet::new(vec![Cell::image(), Cell::length(2)]);
/// for r in 0..16 {
///     let noise = 0.001 * f64::from(r % 4);
///     set.push("pt", vec![1.0 + noise, 0.5 - noise])?;
///     set.push("lt", vec![1.003 - noise, 0.6 + noise])?;
/// }
/// let report = compare(&set, "pt", "lt", &CompareConfig::default())?;
/// assert_eq!(report.cells[0].verdict, Verdict::Agree);
/// assert_eq!(report.cells[1].verdict, Verdict::Differ);
/// assert_eq!(report.verdict, Verdict::Differ);
/// # Ok::<(), pathspace_validation::stats::StatsError>(())
/// ```
pub fn compare(
    set: &ReplicateSet,
    a: &str,
    b: &str,
    config: &CompareConfig,
) -> Result<PairReport, StatsError> {
    let (a, b) = (set.arm(a)?, set.arm(b)?);
    at_least("replicates", 2, a.rows.len().min(b.rows.len()))?;
    let mut raw = Vec::with_capacity(set.cells().len());
    for c in 0..set.cells().len() {
        let (x, y) = (a.column(c), b.column(c));
        let scale = Moments::of(&x)?.mean.abs().max(Moments::of(&y)?.mean.abs());
        raw.push(Raw {
            test: welch_within(&x, &y, config.tolerance * scale)?,
            gates: a.gates(c, &x)?.worse(b.gates(c, &y)?),
            zero: (is_zero(&x), is_zero(&y)),
        });
    }
    let names = (a.name.clone(), b.name.clone());
    Ok(judge(set.cells(), names, (a.rows.len(), b.rows.len()), &raw, &config.rule))
}

/// Compares an arm with exact values known to within `uncertainty`, cell by cell, as [`compare()`]
/// does.
///
/// Where the exact value is 0 without uncertainty, a single positive value differs if none is
/// negative: a non-negative estimator of mean 0 is 0 almost surely.
///
/// `exact` and `uncertainty` hold one number a cell, in the unit of the cells; an uncertainty of 0
/// means exact. Fails for an unknown arm, fewer than 2 replicates or other numbers of values.
pub fn compare_exact(
    set: &ReplicateSet,
    arm: &str,
    exact: &[f64],
    uncertainty: &[f64],
    config: &CompareConfig,
) -> Result<PairReport, StatsError> {
    let arm = set.arm(arm)?;
    same_length("cells and exact values", set.cells().len(), exact.len())?;
    same_length("cells and uncertainties", set.cells().len(), uncertainty.len())?;
    let mut raw = Vec::with_capacity(set.cells().len());
    for (c, (&mu, &u)) in exact.iter().zip(uncertainty).enumerate() {
        let x = arm.column(c);
        let dark = is_zero(&x);
        let mut test = one_sample_within(&x, mu, u + config.tolerance * mu.abs())?;
        let mut gates = arm.gates(c, &x)?;
        if mu == 0.0 && u == 0.0 && !dark && x.iter().all(|v| *v >= 0.0) {
            // One hit is proof, however rare the hits are.
            test.p = 0.0;
            gates = Gates::default();
        }
        raw.push(Raw { test, gates, zero: (dark, dark && mu == 0.0) });
    }
    let names = (arm.name.clone(), "exact".into());
    Ok(judge(set.cells(), names, (arm.rows.len(), 0), &raw, &config.rule))
}

struct Raw {
    test: Welch,
    gates: Gates,
    zero: (bool, bool),
}

fn is_zero(column: &[f64]) -> bool {
    column.iter().all(|v| *v == 0.0)
}

fn judge(
    cells: &[Cell],
    (a, b): (String, String),
    (replicates_a, replicates_b): (usize, usize),
    raw: &[Raw],
    rule: &Rule,
) -> PairReport {
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
    PairReport { a, b, replicates_a, replicates_b, verdict, p, mdb, cells: reports }
}

#[cfg(test)]
mod tests {
    use super::super::{binomial_interval, testing::Source};
    use super::*;

    /// Two arms of `k` replicates over the image and `means.len()` lengths, arm b scaled by `bias`.
    fn set(source: &mut Source, k: usize, means: &[f64], noise: f64, bias: f64) -> ReplicateSet {
        let lengths = (0..means.len()).map(|j| Cell::length(j as u32 + 1));
        let mut set = ReplicateSet::new(std::iter::once(Cell::image()).chain(lengths).collect());
        for (arm, scale) in [("a", 1.0), ("b", bias)] {
            for _ in 0..k {
                let values: Vec<f64> =
                    means.iter().map(|m| scale * m * (1.0 + noise * source.normal())).collect();
                let mut row = vec![values.iter().sum()];
                row.extend(values);
                set.push(arm, row).unwrap();
            }
        }
        set
    }

    fn run(set: &ReplicateSet) -> PairReport {
        compare(set, "a", "b", &CompareConfig::default()).unwrap()
    }

    #[test]
    fn equal_arms_agree_and_print_what_they_would_have_seen() {
        let report = run(&set(&mut Source::new(3), 16, &[1.0, 0.5, 0.2], 0.01, 1.0));
        assert_eq!(report.verdict, Verdict::Agree);
        assert!(report.mdb > 0.005 && report.mdb < 0.03, "{}", report.mdb);
    }

    #[test]
    fn a_bias_of_five_percent_differs_everywhere() {
        let report = run(&set(&mut Source::new(4), 16, &[1.0, 0.5, 0.2], 0.01, 1.05));
        assert!(report.cells.iter().all(|c| c.verdict == Verdict::Differ), "{report:?}");
    }

    #[test]
    fn noise_beyond_the_limit_is_inconclusive() {
        let report = run(&set(&mut Source::new(5), 16, &[1.0], 0.2, 1.0));
        assert_eq!(report.verdict, Verdict::Inconclusive);
        assert_eq!(report.cells[0].reason, Reason::TooNoisy);
    }

    #[test]
    fn cells_that_are_zero_on_both_sides_agree_and_leave_the_family() {
        let report = run(&set(&mut Source::new(6), 16, &[1.0, 0.0, 0.0, 0.0], 0.01, 1.0));
        let dark = &report.cells[3];
        assert_eq!((dark.verdict, dark.reason), (Verdict::Agree, Reason::BothZero));
        assert_eq!((dark.test.mdb, dark.p_adjusted), (0.0, 1.0));
        // Two hypotheses remain, and they are the same numbers.
        let expected = (2.0 * report.cells[1].test.p).min(1.0);
        assert_eq!(report.cells[1].p_adjusted, expected);
    }

    #[test]
    fn an_arm_that_never_sampled_a_cell_is_named_and_not_accused() {
        let mut set = ReplicateSet::new(vec![Cell::image()]);
        for r in 0..16 {
            set.push("a", vec![0.0]).unwrap();
            set.push("b", vec![1.0 + 0.001 * f64::from(r)]).unwrap();
        }
        let cell = &run(&set).cells[0];
        assert_eq!((cell.verdict, cell.reason), (Verdict::Inconclusive, Reason::NeverSampled));
    }

    #[test]
    fn rare_hits_fail_the_gate_on_the_replicates_alone() {
        let (mut source, mut set) = (Source::new(7), ReplicateSet::new(vec![Cell::image()]));
        for _ in 0..32 {
            set.push("a", vec![source.poisson(1.0)]).unwrap();
            set.push("b", vec![source.poisson(1.0)]).unwrap();
        }
        assert_eq!(run(&set).cells[0].reason, Reason::FewContributions);
    }

    #[test]
    fn measured_gates_take_precedence() {
        let mut set = set(&mut Source::new(8), 16, &[1.0], 0.01, 1.0);
        let heavy = Gates { n_eff: Some(1e4), khat: Some(0.9) };
        set.set_gates("b", vec![heavy; 2]).unwrap();
        assert_eq!(run(&set).cells[1].reason, Reason::HeavyTail);
    }

    #[test]
    fn rounding_in_a_noise_free_scene_is_not_a_difference() {
        let mut set = ReplicateSet::new(vec![Cell::image()]);
        for _ in 0..16 {
            set.push("a", vec![1.0]).unwrap();
            set.push("b", vec![1.0 + 3e-7]).unwrap();
            set.push("c", vec![1.0 + 3e-5]).unwrap();
        }
        assert_eq!(run(&set).verdict, Verdict::Agree);
        let far = compare(&set, "a", "c", &CompareConfig::default()).unwrap();
        assert_eq!(far.verdict, Verdict::Differ);
    }

    #[test]
    fn exact_values_are_met_within_their_uncertainty() {
        let set = set(&mut Source::new(9), 16, &[1.0, 0.5], 0.01, 1.0);
        let config = CompareConfig::default();
        let good = compare_exact(&set, "a", &[1.5, 1.0, 0.5], &[0.0; 3], &config).unwrap();
        assert_eq!(good.verdict, Verdict::Agree);
        let bad = compare_exact(&set, "a", &[1.5, 1.1, 0.4], &[0.0; 3], &config).unwrap();
        assert_eq!(bad.verdict, Verdict::Differ);
        let loose = compare_exact(&set, "a", &[1.5, 1.1, 0.4], &[0.2; 3], &config).unwrap();
        assert_ne!(loose.verdict, Verdict::Differ);
    }

    #[test]
    fn a_single_hit_where_the_exact_value_is_zero_differs() {
        let mut set = ReplicateSet::new(vec![Cell::length(2), Cell::length(3)]);
        for r in 0..16 {
            set.push("a", vec![if r == 5 { 1e-9 } else { 0.0 }, 0.0]).unwrap();
        }
        let config = CompareConfig::default();
        let report = compare_exact(&set, "a", &[0.0; 2], &[0.0; 2], &config).unwrap();
        let verdicts: Vec<Verdict> = report.cells.iter().map(|c| c.verdict).collect();
        assert_eq!(verdicts, [Verdict::Differ, Verdict::Agree]);
        // The other way round, no hits where light is expected prove nothing.
        let report = compare_exact(&set, "a", &[0.0, 1.0], &[1e-6, 0.0], &config).unwrap();
        let reasons: Vec<Reason> = report.cells.iter().map(|c| c.reason).collect();
        assert_eq!(reasons, [Reason::FewContributions, Reason::NeverSampled]);
    }

    #[test]
    fn the_report_serialises_flat_with_the_promised_fields() {
        let report = run(&set(&mut Source::new(10), 16, &[1.0], 0.01, 1.0));
        let json = serde_json::to_value(&report).unwrap();
        assert_eq!(json["verdict"], "agree");
        for field in ["mean_a", "mean_b", "t", "p", "p_adjusted", "mdb", "verdict", "length"] {
            assert!(json["cells"][1].get(field).is_some(), "{field}");
        }
    }

    #[test]
    fn bad_sets_are_errors() {
        let mut set = ReplicateSet::new(vec![Cell::image()]);
        assert!(set.push("a", vec![1.0, 2.0]).is_err());
        assert!(set.push("a", vec![f64::NAN]).is_err());
        set.push("a", vec![1.0]).unwrap();
        let config = CompareConfig::default();
        assert_eq!(compare(&set, "a", "z", &config), Err(StatsError::UnknownArm("z".into())));
        assert!(matches!(compare(&set, "a", "a", &config), Err(StatsError::TooFew { .. })));
    }

    #[test]
    fn same_against_same_alarms_at_most_at_the_level() {
        let mut source = Source::new(2);
        let mut config = CompareConfig::default();
        config.rule.alpha = 0.05;
        let runs = 4000;
        let alarms = (0..runs)
            .filter(|_| {
                let set = set(&mut source, 16, &[1.0, 0.5, 0.3, 0.1, 0.03], 0.05, 1.0);
                compare(&set, "a", "b", &config).unwrap().verdict == Verdict::Differ
            })
            .count() as u64;
        let (low, high) = binomial_interval(alarms, runs, 0.95).unwrap();
        assert!(high <= 0.075, "{alarms} of {runs}: [{low}, {high}]");
        // Holm over nearly independent cells is not far below its level either.
        assert!(low > 0.03, "{alarms} of {runs}: [{low}, {high}]");
    }
}
