//! Error against time: efficiency, ratios with intervals, slopes of convergence curves.

use serde::{Deserialize, Serialize};

use super::dist::student_quantile;
use super::fault::{StatsError, open_unit, same_length};
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

/// Mean of the costs or errors of replicates with its interval, ln x̄ ± t_{1−α/2}·cv/√K.
///
/// On the logarithm, as in [`efficiency_ratio`]. Where the mean is not positive, which says only
/// that it is small, x̄ ± t·s/√K.
///
/// # Errors
/// On fewer than 2 replicates.
pub fn mean_interval(x: &[f64], confidence: f64) -> Result<Estimate, StatsError> {
    open_unit("confidence", confidence)?;
    let m = Moments::of(x)?;
    let t = student_quantile(0.5 + 0.5 * confidence, (m.n - 1) as f64)?;
    if m.mean > 0.0 {
        let spread = (t * m.cv() / (m.n as f64).sqrt()).exp();
        return Ok(Estimate { value: m.mean, low: m.mean / spread, high: m.mean * spread });
    }
    let half = t * m.squared_error().sqrt();
    Ok(Estimate { value: m.mean, low: m.mean - half, high: m.mean + half })
}

/// Slope of ln ē against ln budget, with ē_j the mean over the errors of independent replicates at
/// budget j.
///
/// By least squares the slope is Σ w_j ln ē_j with w_j = (x_j − x̄)/Σ(x − x̄)². Its variance is Σ
/// w_j² cv_j²/K_j, because the budgets have replicates of their own; degrees of freedom after Welch
/// and Satterthwaite. The noise of each point is known, so that two budgets are enough and a bend
/// is no noise.
///
/// # Errors
/// On fewer than 2 budgets or 2 replicates, equal budgets only, and mean errors that are not
/// positive.
pub fn replicate_slope(
    budget: &[f64],
    errors: &[&[f64]],
    confidence: f64,
) -> Result<Estimate, StatsError> {
    open_unit("confidence", confidence)?;
    same_length("budgets and errors", budget.len(), errors.len())?;
    let moments = errors.iter().map(|e| Moments::of(e)).collect::<Result<Vec<_>, _>>()?;
    let x = logarithms("budget", budget)?;
    let y = logarithms("mean error", &moments.iter().map(|m| m.mean).collect::<Vec<_>>())?;
    let mx = Moments::of(&x)?;
    if mx.variance == 0.0 {
        let expected = "budgets that differ";
        return Err(StatsError::OutOfRange { what: "budget", value: budget[0], expected });
    }
    let sxx = mx.variance * (x.len() - 1) as f64;
    let w = x.iter().map(|x| (x - mx.mean) / sxx);
    let slope = w.clone().zip(&y).map(|(w, y)| w * y).sum::<f64>();
    let parts: Vec<(f64, usize)> =
        w.zip(&moments).map(|(w, m)| ((w * m.cv()).powi(2) / m.n as f64, m.n)).collect();
    let se = parts.iter().map(|p| p.0).sum::<f64>().sqrt();
    let df = super::welch::satterthwaite(&parts);
    let half = student_quantile(0.5 + 0.5 * confidence, df)? * se;
    Ok(Estimate { value: slope, low: slope - half, high: slope + half })
}

fn logarithms(what: &'static str, values: &[f64]) -> Result<Vec<f64>, StatsError> {
    match values.iter().find(|v| !(**v > 0.0 && v.is_finite())) {
        Some(&value) => Err(StatsError::OutOfRange { what, value, expected: "a positive number" }),
        None => Ok(values.iter().map(|v| v.ln()).collect()),
    }
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
    fn slope_of_replicates_is_covered_at_its_confidence() {
        let mut source = Source::new(27);
        let budget = [1.0, 2.0, 4.0, 8.0];
        let (runs, mut covered) = (2000, 0);
        for _ in 0..runs {
            let errors: Vec<Vec<f64>> =
                budget.iter().map(|n| source.normals(8, 3.0 / n, 0.6 / n)).collect();
            let views: Vec<&[f64]> = errors.iter().map(Vec::as_slice).collect();
            let s = replicate_slope(&budget, &views, 0.95).unwrap();
            covered += u64::from(s.low <= -1.0 && -1.0 <= s.high);
        }
        let (low, high) = binomial_interval(covered, runs, 0.999).unwrap();
        assert!(low <= 0.95 && 0.95 <= high, "{covered} of {runs}");
    }

    #[test]
    fn slope_of_replicates_by_hand() {
        // Two budgets: slope = ln(ē₂/ē₁)/ln 4 = ln(1/4)/ln 4; Var = (cv₁² + cv₂²)/2/ln²4 with cv² =
        // 2·(0.5/2)² and 0.
        let s = replicate_slope(&[1.0, 4.0], &[&[1.5, 2.5], &[0.5, 0.5]], 0.95).unwrap();
        close(s.value, -1.0, 1e-12);
        let se = (0.125f64 / 2.0).sqrt() / 4f64.ln();
        close(s.high - s.value, 12.7062 * se, 1e-4);
    }

    #[test]
    fn intervals_of_means_are_even_on_the_logarithm() {
        let e = mean_interval(&[1.0, 3.0], 0.95).unwrap();
        // cv/√K = √2/2/√2.
        close(e.high, 2.0 * (12.7062f64 * 0.5).exp(), 1e-3);
        close(e.low * e.high, 4.0, 1e-12);
        let e = mean_interval(&[-1.0, 0.5], 0.95).unwrap();
        close(e.high - e.low, 2.0 * 12.7062 * 0.75, 1e-4);
    }

    #[test]
    fn bad_curves_and_costs_are_errors() {
        assert!(replicate_slope(&[1.0, 2.0], &[&[1.0, 2.0], &[0.0, 0.0]], 0.95).is_err());
        assert!(replicate_slope(&[2.0; 2], &[&[1.0, 2.0], &[1.0, 2.0]], 0.95).is_err());
        assert!(efficiency_ratio(&[0.0, 0.0], &[1.0, 1.0], 0.95).is_err());
    }
}
