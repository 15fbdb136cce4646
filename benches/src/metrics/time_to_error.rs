//! How long it takes until the error is small enough.

use pathspace_validation::stats::{Moments, StatsError, normal_quantile};

use crate::results::TimeToError;

/// What replicates of one budget reached.
#[derive(Clone, Copy, Debug)]
pub struct Reached<'a> {
    /// Seconds of a replicate.
    pub seconds: f64,
    /// Error of every replicate.
    pub errors: &'a [f64],
}

/// Seconds to the error `target`, from budgets in ascending order with independent replicates.
///
/// Between the last budget whose mean error is above the target and the first below it, ln error is
/// linear in ln seconds: ln t = x₁ + u(x₂ − x₁) with u = (y₁ − ln E)/(y₁ − y₂), and by the delta
/// method Var ln t = [(1−u)²·cv₁²/K₁ + u²·cv₂²/K₂]·(Δx/Δy)². Nothing is extrapolated: where the
/// largest budget does not reach the target the run is censored, and its time is all that is known;
/// where the smallest one does already, its time is an upper bound.
///
/// # Errors
/// On no budget, fewer than two replicates and errors that are not finite.
pub fn time_to_error(points: &[Reached<'_>], target: f64) -> Result<TimeToError, StatsError> {
    let none = || StatsError::TooFew { what: "budgets", need: 1, got: 0 };
    let last = points.last().ok_or_else(none)?;
    let moments = points.iter().map(|p| Moments::of(p.errors)).collect::<Result<Vec<_>, _>>()?;
    let known = |seconds, low, high, censored| TimeToError { target, seconds, low, high, censored };
    match moments.iter().position(|m| m.mean <= target) {
        None => Ok(known(f64::NAN, last.seconds, f64::NAN, true)),
        Some(0) => Ok(known(points[0].seconds, 0.0, points[0].seconds, false)),
        Some(j) => {
            let (a, b) = (&moments[j - 1], &moments[j]);
            let (x1, x2) = (points[j - 1].seconds.ln(), points[j].seconds.ln());
            if b.mean <= 0.0 {
                // Small beyond measure: somewhere between the two.
                return Ok(known(
                    points[j].seconds,
                    points[j - 1].seconds,
                    points[j].seconds,
                    false,
                ));
            }
            let (y1, y2) = (a.mean.ln(), b.mean.ln());
            let u = (y1 - target.ln()) / (y1 - y2);
            let ln = x1 + u * (x2 - x1);
            let part = |share: f64, m: &Moments| (share * m.cv()).powi(2) / m.n as f64;
            let se = (part(1.0 - u, a) + part(u, b)).sqrt() * ((x2 - x1) / (y1 - y2)).abs();
            let half = normal_quantile(0.975)? * se;
            Ok(known(ln.exp(), (ln - half).exp(), (ln + half).exp(), false))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points<'a>(errors: &'a [[f64; 2]], seconds: &[f64]) -> Vec<Reached<'a>> {
        errors.iter().zip(seconds).map(|(e, s)| Reached { seconds: *s, errors: e }).collect()
    }

    #[test]
    fn a_power_law_is_met_exactly() {
        // Error 1/t: 0.3 is reached at t = 10/3.
        let errors = [[1.0, 1.0], [0.5, 0.5], [0.25, 0.25]];
        let t = time_to_error(&points(&errors, &[1.0, 2.0, 4.0]), 0.3).unwrap();
        assert!((t.seconds - 1.0 / 0.3).abs() < 1e-9 && !t.censored);
        assert!((t.high - t.low).abs() < 1e-9);
    }

    #[test]
    fn noise_widens_the_interval() {
        let errors = [[0.8, 1.2], [0.4, 0.6]];
        let t = time_to_error(&points(&errors, &[1.0, 2.0]), 0.75).unwrap();
        // u = ln(4/3)/ln 2, cv² = 2·0.2² in both, K = 2, slope −1.
        let u = (4.0f64 / 3.0).ln() / 2f64.ln();
        let se = (0.04 * ((1.0 - u).powi(2) + u * u)).sqrt();
        assert!(((t.high / t.low).ln() - 2.0 * 1.959964 * se).abs() < 1e-6, "{t:?}");
    }

    #[test]
    fn targets_out_of_reach_are_censored_and_easy_ones_bounded() {
        let errors = [[1.0, 1.0], [0.5, 0.5]];
        let t = time_to_error(&points(&errors, &[1.0, 2.0]), 0.1).unwrap();
        assert!(t.censored && t.seconds.is_nan() && t.low == 2.0);
        let t = time_to_error(&points(&errors, &[1.0, 2.0]), 3.0).unwrap();
        assert!(!t.censored && (t.low, t.high) == (0.0, 1.0));
        assert!(time_to_error(&[], 1.0).is_err());
    }
}
