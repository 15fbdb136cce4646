//! Error against time: efficiency, ratios with intervals, slopes of convergence curves.

use serde::{Deserialize, Serialize};

use super::dist::student_quantile;
use super::fault::{StatsError, at_least, open_unit, same_length};
use super::moments::Moments;
use crate::json::number;

/// Efficiency 1/(MSE·T), with T the seconds of one replicate, its bootstrap included.
///
/// Infinite for an exact image; NaN where the estimated MSE is negative, since that says only that
/// it is small.
pub fn efficiency(mse: f64, seconds: f64) -> f64 {
    if mse < 0.0 { f64::NAN } else { 1.0 / (mse * seconds) }
}

/// A figure with its confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The figure.
    #[serde(deserialize_with = "number")]
    pub value: f64,
    /// Lower end of the interval.
    #[serde(deserialize_with = "number")]
    pub low: f64,
    /// Upper end of the interval.
    #[serde(deserialize_with = "number")]
    pub high: f64,
}

/// Ratio of the efficiencies of A over B, (MSE_B·T_B)/(MSE_A·T_A), with its interval.
///
/// `cost_a` and `cost_b` hold MSE·T of each replicate. With c̄ and cv the mean and the coefficient
/// of variation of the costs, ln ratio = ln c̄_B − ln c̄_A ± t_{1−α/2}·√(cv_A²/K_A + cv_B²/K_B), by
/// the delta method; degrees of freedom after Welch and Satterthwaite. Fails on fewer than 2
/// replicates a side and where a mean cost is not positive.
pub fn efficiency_ratio(
    cost_a: &[f64],
    cost_b: &[f64],
    confidence: f64,
) -> Result<Estimate, StatsError> {
    open_unit("confidence", confidence)?;
    let (a, b) = (Moments::of(cost_a)?, Moments::of(cost_b)?);
    for m in [a, b] {
        if m.mean <= 0.0 {
            let expected = "a positive number";
            return Err(StatsError::OutOfRange { what: "mean cost", value: m.mean, expected });
        }
    }
    let (va, vb) = (a.cv().powi(2) / a.n as f64, b.cv().powi(2) / b.n as f64);
    let df = super::welch::satterthwaite(&[(va, a.n), (vb, b.n)]);
    let half = student_quantile(0.5 + 0.5 * confidence, df)? * (va + vb).sqrt();
    let ln = b.mean.ln() - a.mean.ln();
    Ok(Estimate { value: ln.exp(), low: (ln - half).exp(), high: (ln + half).exp() })
}

/// Slope of ln `error` against ln `budget` by least squares, with its t interval of n−2 degrees of
/// freedom.
///
/// −1 is expected of an MSE: shallower means infinite variance, bias or an unmixed chain, steeper
/// stratification. Fails on fewer than 3 points, equal budgets only, and values that are not
/// positive.
pub fn log_log_slope(
    budget: &[f64],
    error: &[f64],
    confidence: f64,
) -> Result<Estimate, StatsError> {
    open_unit("confidence", confidence)?;
    same_length("budgets and errors", budget.len(), error.len())?;
    at_least("points of the curve", 3, budget.len())?;
    let logs = |what, values: &[f64]| -> Result<Vec<f64>, StatsError> {
        let bad = values.iter().find(|v| !(**v > 0.0 && v.is_finite()));
        match bad {
            Some(&value) => {
                Err(StatsError::OutOfRange { what, value, expected: "a positive number" })
            }
            None => Ok(values.iter().map(|v| v.ln()).collect()),
        }
    };
    let (x, y) = (logs("budget", budget)?, logs("error", error)?);
    let (mx, my) = (Moments::of(&x)?, Moments::of(&y)?);
    if mx.variance == 0.0 {
        let expected = "budgets that differ";
        return Err(StatsError::OutOfRange { what: "budget", value: budget[0], expected });
    }
    let n = x.len() as f64;
    let sxx = mx.variance * (n - 1.0);
    let sxy: f64 = x.iter().zip(&y).map(|(x, y)| (x - mx.mean) * (y - my.mean)).sum();
    let slope = sxy / sxx;
    let residual: f64 =
        x.iter().zip(&y).map(|(x, y)| (y - my.mean - slope * (x - mx.mean)).powi(2)).sum();
    let half =
        student_quantile(0.5 + 0.5 * confidence, n - 2.0)? * (residual / (n - 2.0) / sxx).sqrt();
    Ok(Estimate { value: slope, low: slope - half, high: slope + half })
}

#[cfg(test)]
mod tests {
    use super::super::{binomial_interval, testing::Source};
    use super::*;

    fn close(a: f64, b: f64, relative: f64) {
        assert!((a - b).abs() <= relative * b.abs(), "{a} against {b}");
    }

    #[test]
    fn ratio_of_efficiencies_is_covered_at_its_confidence() {
        let mut source = Source::new(25);
        let (runs, mut covered) = (2000, 0);
        for _ in 0..runs {
            let a = source.normals(16, 2.0, 0.4);
            let b = source.normals(16, 6.0, 0.6);
            let r = efficiency_ratio(&a, &b, 0.95).unwrap();
            covered += u64::from(r.low <= 3.0 && 3.0 <= r.high);
        }
        let (low, high) = binomial_interval(covered, runs, 0.999).unwrap();
        assert!(low <= 0.95 && 0.95 <= high, "{covered} of {runs}");
    }

    #[test]
    fn slope_of_an_exact_power_law_is_its_exponent() {
        let budget: Vec<f64> = (0..6).map(|j| f64::from(1 << j)).collect();
        let error: Vec<f64> = budget.iter().map(|n| 3.0 / n).collect();
        let slope = log_log_slope(&budget, &error, 0.95).unwrap();
        close(slope.value, -1.0, 1e-12);
        assert!(slope.high - slope.low < 1e-6);
    }

    #[test]
    fn slope_interval_covers_at_its_confidence() {
        let mut source = Source::new(26);
        let budget: Vec<f64> = (0..6).map(|j| f64::from(1 << j)).collect();
        let (runs, mut covered) = (2000, 0);
        for _ in 0..runs {
            let error: Vec<f64> =
                budget.iter().map(|n| (0.1 * source.normal()).exp() / n).collect();
            let s = log_log_slope(&budget, &error, 0.9).unwrap();
            covered += u64::from(s.low <= -1.0 && -1.0 <= s.high);
        }
        let (low, high) = binomial_interval(covered, runs, 0.999).unwrap();
        assert!(low <= 0.9 && 0.9 <= high, "{covered} of {runs}");
    }

    #[test]
    fn bad_curves_and_costs_are_errors() {
        assert!(log_log_slope(&[1.0, 2.0, 4.0], &[1.0, 0.0, 1.0], 0.95).is_err());
        assert!(log_log_slope(&[2.0; 3], &[1.0; 3], 0.95).is_err());
        assert!(efficiency_ratio(&[0.0, 0.0], &[1.0, 1.0], 0.95).is_err());
    }
}
