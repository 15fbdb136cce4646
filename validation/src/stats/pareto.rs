//! Pareto k̂: does the variance of a contribution exist?

use super::fault::{StatsError, all_finite, at_least};

/// Fewest samples in the tail that a fit is tried on.
const FEWEST: usize = 5;

/// Size of the tail that k̂ is fitted to, min(⌈3√S⌉, ⌊S/5⌋) of S samples (Vehtari et al. 2024,
/// section 2.3).
pub fn tail_size(samples: u64) -> usize {
    let s = samples as f64;
    (3.0 * s.sqrt()).ceil().min((s / 5.0).floor()) as usize
}

/// Shape k̂ of the generalised Pareto distribution fitted to the upper tail of `samples`.
///
/// Moments of order ≥ 1/k do not exist, so a variance needs k < 1/2; the t-test is trusted below
/// that only. The excesses of the [`tail_size`] largest samples over the next smaller one are
/// fitted as in [`fit_pareto`], then k̂ is drawn towards 1/2 with the weight of ten samples. `None`
/// where at least one and fewer than 5 samples exceed the threshold (too few hits to say anything;
/// n_eff tells that), −∞ where none does (equal samples have no tail). Fails on fewer than 25
/// samples and on non-finite ones.
pub fn pareto_khat(samples: &[f64]) -> Result<Option<f64>, StatsError> {
    pareto_khat_of_tail(samples, samples.len() as u64)
}

/// [`pareto_khat`] where only the largest values of `total` samples were kept, in any order.
///
/// `largest` must hold at least [`tail_size`]`(total)` + 1 values.
pub fn pareto_khat_of_tail(largest: &[f64], total: u64) -> Result<Option<f64>, StatsError> {
    let m = tail_size(total);
    at_least("samples in the tail", FEWEST, m)?;
    at_least("largest samples", m + 1, largest.len())?;
    all_finite("samples", largest)?;
    let mut top = largest.to_vec();
    top.sort_by(|a, b| b.total_cmp(a));
    let threshold = top[m];
    let mut excess: Vec<f64> = top[..m].iter().map(|x| x - threshold).collect();
    excess.retain(|x| *x > 0.0);
    excess.reverse();
    if excess.is_empty() {
        // A tail of zeros is the absence of hits, not the absence of a tail.
        return Ok((threshold != 0.0).then_some(f64::NEG_INFINITY));
    }
    if excess.len() < FEWEST {
        return Ok(None);
    }
    let (k, _) = fit_pareto(&excess)?;
    let n = excess.len() as f64;
    Ok(Some((n * k + 10.0 * 0.5) / (n + 10.0)))
}

/// Shape k and scale σ of the generalised Pareto distribution 1 − (1 + k x/σ)^{−1/k}, positive k
/// heavy.
///
/// The quasi-Bayesian estimator of Zhang & Stephens (2009), eqs. 5–8, in θ = −k/σ: the mean of θ
/// over a grid of 30+⌊√n⌋ points, weighted by the profile likelihood n(ln(−θ/k) − k − 1) with k(θ)
/// = mean ln(1 − θx). `excess` must be ascending and positive, at least 5 values.
pub fn fit_pareto(excess: &[f64]) -> Result<(f64, f64), StatsError> {
    at_least("excesses", FEWEST, excess.len())?;
    all_finite("excesses", excess)?;
    if excess[0] <= 0.0 || excess.windows(2).any(|w| w[0] > w[1]) {
        let expected = "positive values in ascending order";
        return Err(StatsError::OutOfRange { what: "excesses", value: excess[0], expected });
    }
    let n = excess.len();
    let largest = excess[n - 1];
    let quartile = excess[((n as f64 / 4.0 + 0.5) as usize).max(1) - 1];
    let shape = |theta: f64| excess.iter().map(|x| (-theta * x).ln_1p()).sum::<f64>() / n as f64;

    let points = 30 + (n as f64).sqrt() as usize;
    let theta: Vec<f64> = (1..=points)
        .map(|j| {
            let spread = 1.0 - (points as f64 / (j as f64 - 0.5)).sqrt();
            1.0 / largest + spread / (3.0 * quartile)
        })
        .collect();
    let likelihood: Vec<f64> = theta
        .iter()
        .map(|&theta| {
            let k = shape(theta);
            n as f64 * ((-theta / k).ln() - k - 1.0)
        })
        .collect();
    // A grid point at θ = 0 exactly has no likelihood in this parametrisation; it is passed over.
    let best = likelihood.iter().copied().filter(|l| l.is_finite()).fold(f64::MIN, f64::max);
    let (mut weight, mut mean) = (0.0, 0.0);
    for (theta, l) in theta.iter().zip(&likelihood).filter(|(_, l)| l.is_finite()) {
        let w = (l - best).exp();
        weight += w;
        mean += w * theta;
    }
    let theta = mean / weight;
    let k = shape(theta);
    Ok((k, -k / theta))
}

#[cfg(test)]
mod tests {
    use super::super::testing::Source;
    use super::*;

    /// Generalised Pareto with unit scale by inversion.
    fn pareto(source: &mut Source, k: f64) -> f64 {
        if k == 0.0 { -source.uniform().ln() } else { (source.uniform().powf(-k) - 1.0) / k }
    }

    #[test]
    fn shape_and_scale_of_simulated_excesses_are_recovered() {
        let mut source = Source::new(40);
        for k in [-0.3, 0.0, 0.3, 0.7, 1.2] {
            let mut x: Vec<f64> = (0..4000).map(|_| 2.5 * pareto(&mut source, k)).collect();
            x.sort_by(f64::total_cmp);
            let (shape, scale) = fit_pareto(&x).unwrap();
            // Standard deviation of the estimate is (1+k)/√n; four of them.
            assert!((shape - k).abs() < 4.0 * (1.0 + k) / 4000f64.sqrt(), "{k}: {shape}");
            assert!((scale / 2.5 - 1.0).abs() < 0.15, "{k}: {scale}");
        }
    }

    #[test]
    fn khat_tells_finite_from_infinite_variance() {
        let mut source = Source::new(41);
        let mut khat = |f: &mut dyn FnMut(&mut Source) -> f64| {
            let x: Vec<f64> = (0..100_000).map(|_| f(&mut source)).collect();
            pareto_khat(&x).unwrap().unwrap()
        };
        assert!(khat(&mut |s| s.uniform()) < 0.0);
        assert!(khat(&mut |s| -s.uniform().ln()) < 0.2);
        let light = khat(&mut |s| s.uniform().powf(-0.25));
        assert!((light - 0.25).abs() < 0.15, "{light}");
        let heavy = khat(&mut |s| s.uniform().powf(-0.8));
        assert!((heavy - 0.8).abs() < 0.15, "{heavy}");
        // Lognormal σ = 3 has a variance that no render will ever see.
        assert!(khat(&mut |s| (3.0 * s.normal()).exp()) > 0.5);
    }

    #[test]
    fn the_kept_tail_gives_the_answer_of_all_samples() {
        let mut source = Source::new(42);
        let mut x: Vec<f64> = (0..10_000).map(|_| pareto(&mut source, 0.4)).collect();
        let all = pareto_khat(&x).unwrap();
        x.sort_by(|a, b| b.total_cmp(a));
        assert_eq!(pareto_khat_of_tail(&x[..=tail_size(10_000)], 10_000).unwrap(), all);
        assert!(pareto_khat_of_tail(&x[..tail_size(10_000)], 10_000).is_err());
    }

    #[test]
    fn equal_samples_have_no_tail_and_rare_hits_no_answer() {
        assert_eq!(pareto_khat(&[2.0; 400]).unwrap(), Some(f64::NEG_INFINITY));
        let mut x = vec![0.0; 400];
        assert_eq!(pareto_khat(&x).unwrap(), None);
        x[7] = 5.0;
        assert_eq!(pareto_khat(&x).unwrap(), None);
    }

    #[test]
    fn the_unit_of_the_samples_does_not_matter() {
        let mut source = Source::new(43);
        let x: Vec<f64> = (0..2000).map(|_| pareto(&mut source, 0.4)).collect();
        let scaled: Vec<f64> = x.iter().map(|v| v * 1024.0).collect();
        let (one, kilo) =
            (pareto_khat(&x).unwrap().unwrap(), pareto_khat(&scaled).unwrap().unwrap());
        assert!((one - kilo).abs() < 1e-12, "{one} against {kilo}");
    }

    #[test]
    fn bad_samples_are_errors() {
        assert!(pareto_khat(&[1.0; 20]).is_err());
        let mut x = vec![1.0; 100];
        x[3] = f64::NAN;
        assert!(pareto_khat(&x).is_err());
        assert!(fit_pareto(&[3.0, 2.0, 1.0, 4.0, 5.0]).is_err());
    }
}
