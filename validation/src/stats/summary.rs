//! Summaries over many results: histograms of p-values, geometric means with bootstrap intervals.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde::Serialize;

use super::dist::chi_squared_sf;
use super::efficiency::Estimate;
use super::fault::{StatsError, at_least, open_unit};

/// Counts of p-values in equal bins over \[0, 1\], with a test of uniformity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PHistogram {
    /// Number of p-values in \[i/n, (i+1)/n), the last bin with 1.
    pub counts: Vec<u64>,
    /// p-value of Pearson's χ² against equal counts, bins−1 degrees of freedom.
    pub p: f64,
}

/// Histogram of p-values: flat where all nulls are true and the test is exact.
///
/// The χ² needs about 5 p-values a bin, and independent ones. Fails on fewer than 2 bins, no
/// p-values, and p outside \[0, 1\].
pub fn p_histogram(p: &[f64], bins: usize) -> Result<PHistogram, StatsError> {
    at_least("bins", 2, bins)?;
    at_least("p-values", 1, p.len())?;
    let mut counts = vec![0u64; bins];
    for &value in p {
        if !(0.0..=1.0).contains(&value) {
            let expected = "a number in [0, 1]";
            return Err(StatsError::OutOfRange { what: "p-value", value, expected });
        }
        counts[((value * bins as f64) as usize).min(bins - 1)] += 1;
    }
    let expected = p.len() as f64 / bins as f64;
    let chi: f64 = counts.iter().map(|&c| (c as f64 - expected).powi(2) / expected).sum();
    Ok(PHistogram { counts, p: chi_squared_sf(chi, (bins - 1) as f64) })
}

/// Geometric mean exp(mean ln x) with a percentile bootstrap interval (Efron & Tibshirani 1993,
/// chapter 13).
///
/// For ratios over a set of scenes. `resamples` of 9999 is usual; the same seed gives the same
/// interval. With few values the interval is too narrow, by about √((n−1)/n) and the normal against
/// Student's quantile. Fails on fewer than 2 values, values that are not positive, no resamples,
/// and a confidence outside (0, 1).
pub fn geometric_mean(
    x: &[f64],
    confidence: f64,
    resamples: usize,
    seed: u64,
) -> Result<Estimate, StatsError> {
    open_unit("confidence", confidence)?;
    at_least("values", 2, x.len())?;
    at_least("resamples", 1, resamples)?;
    if let Some(&value) = x.iter().find(|v| !(**v > 0.0 && v.is_finite())) {
        let expected = "a positive number";
        return Err(StatsError::OutOfRange { what: "value", value, expected });
    }
    let ln: Vec<f64> = x.iter().map(|v| v.ln()).collect();
    let n = ln.len();
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut means: Vec<f64> = (0..resamples)
        .map(|_| (0..n).map(|_| ln[rng.random_range(0..n)]).sum::<f64>() / n as f64)
        .collect();
    means.sort_by(f64::total_cmp);
    let tail = 0.5 * (1.0 - confidence);
    let at = |q: f64| means[((q * resamples as f64) as usize).min(resamples - 1)].exp();
    let value = (ln.iter().sum::<f64>() / n as f64).exp();
    Ok(Estimate { value, low: at(tail), high: at(1.0 - tail) })
}

#[cfg(test)]
mod tests {
    use super::super::testing::Source;
    use super::super::{binomial_interval, welch};
    use super::*;

    #[test]
    fn bins_are_half_open_and_the_last_holds_one() {
        let h = p_histogram(&[0.0, 0.25, 0.5, 0.999, 1.0], 4).unwrap();
        assert_eq!(h.counts, [1, 1, 1, 2]);
    }

    #[test]
    fn p_values_of_true_nulls_are_flat_and_of_false_ones_are_not() {
        let mut source = Source::new(90);
        let mut p = |bias: f64| -> Vec<f64> {
            (0..2000)
                .map(|_| {
                    let a = source.normals(16, bias, 1.0);
                    welch(&a, &source.normals(16, 0.0, 1.0)).unwrap().p
                })
                .collect()
        };
        assert!(p_histogram(&p(0.0), 20).unwrap().p > 1e-3);
        assert!(p_histogram(&p(0.3), 20).unwrap().p < 1e-6);
    }

    #[test]
    fn geometric_mean_of_a_ratio_and_its_inverse_is_one() {
        let g = geometric_mean(&[0.25, 4.0, 1.0], 0.95, 999, 1).unwrap();
        assert!((g.value - 1.0).abs() < 1e-12);
        assert!(g.low < 1.0 && g.high > 1.0);
    }

    #[test]
    fn bootstrap_interval_covers_nearly_at_its_confidence() {
        let mut source = Source::new(91);
        let (runs, mut covered) = (600, 0);
        for seed in 0..runs {
            let x: Vec<f64> = (0..40).map(|_| (0.5 * source.normal()).exp()).collect();
            let g = geometric_mean(&x, 0.95, 399, seed).unwrap();
            covered += u64::from(g.low <= 1.0 && 1.0 <= g.high);
        }
        let (low, high) = binomial_interval(covered, runs, 0.999).unwrap();
        assert!(low <= 0.95 && high >= 0.92, "{covered} of {runs}");
    }

    #[test]
    fn equal_seeds_give_equal_intervals() {
        let x = [1.0, 2.0, 3.0, 5.0];
        let run = |seed| geometric_mean(&x, 0.9, 199, seed).unwrap();
        assert_eq!(run(3), run(3));
        assert_ne!(run(3), run(4));
    }

    #[test]
    fn bad_values_are_errors() {
        assert!(p_histogram(&[1.5], 10).is_err());
        assert!(p_histogram(&[0.5], 1).is_err());
        assert!(geometric_mean(&[1.0, 0.0], 0.95, 99, 0).is_err());
        assert!(geometric_mean(&[1.0], 0.95, 99, 0).is_err());
    }
}
