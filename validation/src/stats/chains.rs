//! Correlation inside one Markov chain, for reports; verdicts rest on replicates.

use serde::Serialize;

use super::fault::{StatsError, all_finite, at_least};
use super::moments::Moments;

/// Integrated autocorrelation time of a chain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CorrelationTime {
    /// τ = 1 + 2Σρ_k in steps; 1 for independent values and, by convention, for a constant chain.
    pub tau: f64,
    /// Largest lag that entered.
    pub window: usize,
    /// Effective sample size n/τ.
    pub ess: f64,
    /// Standard error of the chain's mean, √(τ c₀/n) with c₀ the variance.
    pub se: f64,
}

/// τ by the initial monotone positive sequence of Geyer (1992), section 3.3.
///
/// Sums Γ_m = ρ_{2m}+ρ_{2m+1} while they are positive, each held to the smallest before it; for
/// reversible chains the true Γ are positive and falling. Work is n times the window. Fails on
/// fewer than 4 values and on non-finite ones.
pub fn geyer_time(chain: &[f64]) -> Result<CorrelationTime, StatsError> {
    let centred = Centred::of(chain)?;
    if centred.variance == 0.0 {
        return Ok(centred.report(1.0, 0));
    }
    let (mut sum, mut smallest, mut m) = (0.0, f64::INFINITY, 0);
    while 2 * m + 1 < chain.len() {
        let gamma = centred.correlation(2 * m) + centred.correlation(2 * m + 1);
        if gamma <= 0.0 {
            break;
        }
        smallest = gamma.min(smallest);
        sum += smallest;
        m += 1;
    }
    Ok(centred.report(2.0 * sum - 1.0, (2 * m).saturating_sub(1)))
}

/// τ by the self-consistent window of Sokal (1989): the smallest M ≥ c·τ(M), τ(M) = 1 + 2Σ_{k≤M}
/// ρ_k.
///
/// `c` is about 5. Needs n ≫ τ to be trusted; fails as [`geyer_time`] does, and on c ≤ 0.
pub fn sokal_time(chain: &[f64], c: f64) -> Result<CorrelationTime, StatsError> {
    if c.is_nan() || c <= 0.0 {
        let expected = "a positive number";
        return Err(StatsError::OutOfRange { what: "window factor", value: c, expected });
    }
    let centred = Centred::of(chain)?;
    if centred.variance == 0.0 {
        return Ok(centred.report(1.0, 0));
    }
    let (mut tau, mut window) = (1.0, 0);
    while window + 1 < chain.len() && (window as f64) < c * tau {
        window += 1;
        tau += 2.0 * centred.correlation(window);
    }
    Ok(centred.report(tau, window))
}

/// A chain minus its mean.
struct Centred {
    values: Vec<f64>,
    variance: f64,
}

impl Centred {
    fn of(chain: &[f64]) -> Result<Self, StatsError> {
        at_least("steps of the chain", 4, chain.len())?;
        let m = Moments::of(chain)?;
        let n = chain.len() as f64;
        let values = chain.iter().map(|x| x - m.mean).collect();
        Ok(Centred { values, variance: m.variance * (n - 1.0) / n })
    }

    /// ρ_k with the divisor n at every lag, which keeps the sequence positive definite.
    fn correlation(&self, lag: usize) -> f64 {
        autocovariance(&self.values, lag) / self.variance
    }

    fn report(&self, tau: f64, window: usize) -> CorrelationTime {
        let n = self.values.len() as f64;
        // An anticorrelated chain can estimate τ ≤ 0; one step is the resolution of the estimate.
        let tau = tau.max(1.0 / n);
        CorrelationTime { tau, window, ess: n / tau, se: (tau * self.variance / n).sqrt() }
    }
}

/// Σ x_i x_{i+lag}/n of centred values.
pub(super) fn autocovariance(centred: &[f64], lag: usize) -> f64 {
    let pairs = centred.iter().zip(&centred[lag..]);
    pairs.map(|(a, b)| a * b).sum::<f64>() / centred.len() as f64
}

/// Mean of a chain with the standard error from its batches.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BatchMeans {
    /// Mean over all full batches.
    pub mean: f64,
    /// Standard error s_b/√b of b batch means.
    pub se: f64,
    /// Number of batches b.
    pub batches: usize,
    /// Steps a batch.
    pub length: usize,
}

/// Non-overlapping batch means (Conway 1963); the remainder at the start of the chain is left out.
///
/// The error is right once a batch is many correlation times long. √n batches is a usual number.
/// Fails on fewer than 2 batches, on fewer steps than batches and on non-finite values.
pub fn batch_means(chain: &[f64], batches: usize) -> Result<BatchMeans, StatsError> {
    at_least("batches", 2, batches)?;
    at_least("steps of the chain", batches, chain.len())?;
    all_finite("chain", chain)?;
    let length = chain.len() / batches;
    let used = &chain[chain.len() - length * batches..];
    let means: Vec<f64> =
        used.chunks_exact(length).map(|b| b.iter().sum::<f64>() / length as f64).collect();
    let m = Moments::of(&means)?;
    Ok(BatchMeans { mean: m.mean, se: m.squared_error().sqrt(), batches, length })
}

#[cfg(test)]
mod tests {
    use super::super::testing::Source;
    use super::*;

    /// Stationary AR(1): correlation φ^k, τ = (1+φ)/(1−φ), variance 1.
    fn autoregressive(seed: u64, n: usize, phi: f64) -> Vec<f64> {
        let mut source = Source::new(seed);
        let mut x = source.normal();
        (0..n)
            .map(|_| {
                x = phi * x + (1.0 - phi * phi).sqrt() * source.normal();
                x
            })
            .collect()
    }

    #[test]
    fn both_windows_find_the_time_of_an_autoregressive_chain() {
        for (phi, tau) in [(0.0, 1.0), (0.5, 3.0), (0.9, 19.0)] {
            let chain = autoregressive(70, 200_000, phi);
            for estimate in [geyer_time(&chain).unwrap(), sokal_time(&chain, 5.0).unwrap()] {
                assert!((estimate.tau / tau - 1.0).abs() < 0.08, "{phi}: {estimate:?}");
                assert!((estimate.ess * estimate.tau - 200_000.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn anticorrelation_makes_a_chain_better_than_independent() {
        let tau = geyer_time(&autoregressive(71, 100_000, -0.5)).unwrap().tau;
        assert!((tau - 1.0 / 3.0).abs() < 0.05, "{tau}");
    }

    #[test]
    fn three_standard_errors_of_the_mean_agree_with_theory() {
        let chain = autoregressive(72, 100_000, 0.8);
        let truth = (9.0 / 100_000f64).sqrt();
        let batches = batch_means(&chain, 300).unwrap();
        for se in [batches.se, geyer_time(&chain).unwrap().se, sokal_time(&chain, 5.0).unwrap().se]
        {
            assert!((se / truth - 1.0).abs() < 0.15, "{se} against {truth}");
        }
    }

    #[test]
    fn batches_leave_out_the_start() {
        let b = batch_means(&[100.0, 1.0, 3.0, 5.0, 7.0], 2).unwrap();
        assert_eq!((b.mean, b.length), (4.0, 2));
        // Batch means 2 and 6: s = √8, s/√2 = 2.
        assert!((b.se - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_constant_chain_has_no_error() {
        let t = geyer_time(&[2.0; 10]).unwrap();
        assert_eq!((t.tau, t.ess, t.se), (1.0, 10.0, 0.0));
    }

    #[test]
    fn bad_chains_are_errors() {
        assert!(geyer_time(&[1.0, 2.0, 3.0]).is_err());
        assert!(sokal_time(&[1.0; 9], -1.0).is_err());
        assert!(batch_means(&[1.0; 9], 1).is_err());
        assert!(batch_means(&[1.0, f64::NAN], 2).is_err());
    }
}
