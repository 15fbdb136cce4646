//! Mean and variance of a sample.

use super::fault::{StatsError, all_finite, at_least};

/// Size, mean and unbiased variance of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// Number of observations n.
    pub n: usize,
    /// Mean x̄ = Σx/n.
    pub mean: f64,
    /// Unbiased variance s² = Σ(x−x̄)²/(n−1).
    pub variance: f64,
}

impl Moments {
    /// Moments of `x` in two passes, with the correction of Chan, Golub & LeVeque (1983), eq. 1.7.
    ///
    /// A constant sample has variance exactly 0. Fails on fewer than 2 values or on a non-finite
    /// one.
    pub fn of(x: &[f64]) -> Result<Self, StatsError> {
        at_least("observations", 2, x.len())?;
        all_finite("observations", x)?;
        // The mean of equal numbers need not round to that number, so constants are met first.
        if x.iter().all(|v| *v == x[0]) {
            return Ok(Moments { n: x.len(), mean: x[0], variance: 0.0 });
        }
        let n = x.len() as f64;
        let mean = x.iter().sum::<f64>() / n;
        let (mut sum, mut sum_sq) = (0.0, 0.0);
        for v in x {
            let d = v - mean;
            sum += d;
            sum_sq += d * d;
        }
        let variance = ((sum_sq - sum * sum / n) / (n - 1.0)).max(0.0);
        Ok(Moments { n: x.len(), mean: mean + sum / n, variance })
    }

    /// Squared standard error of the mean, s²/n.
    pub fn squared_error(&self) -> f64 {
        self.variance / self.n as f64
    }

    /// Coefficient of variation s/|x̄|; infinite where the mean is 0 and the variance is not.
    pub fn cv(&self) -> f64 {
        if self.variance == 0.0 { 0.0 } else { self.variance.sqrt() / self.mean.abs() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constant_sample_has_exactly_zero_variance() {
        let m = Moments::of(&[0.1; 7]).unwrap();
        assert_eq!((m.mean, m.variance), (0.1, 0.0));
    }

    #[test]
    fn large_offset_keeps_the_variance() {
        let m = Moments::of(&[1e9 + 4.0, 1e9 + 7.0, 1e9 + 13.0, 1e9 + 16.0]).unwrap();
        assert_eq!((m.mean, m.variance), (1e9 + 10.0, 30.0));
    }

    #[test]
    fn non_finite_values_are_named() {
        let e = Moments::of(&[1.0, f64::NAN, 2.0]).unwrap_err();
        assert!(matches!(e, StatsError::NonFinite { index: 1, .. }), "{e}");
    }
}
