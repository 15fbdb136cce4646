//! Welch's t-test between two methods, its one-sample form, and the bias that it can see.

use serde::Serialize;

use super::dist::{normal_quantile, student_sf};
use super::fault::StatsError;
use super::moments::Moments;

/// Level of the test that a minimum detectable bias refers to.
pub const MDB_ALPHA: f64 = 1e-4;
/// Power of the test that a minimum detectable bias refers to.
pub const MDB_POWER: f64 = 0.9;

/// Result of a test on the difference of two means.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Welch {
    /// Mean of the first method.
    pub mean_a: f64,
    /// Mean of the second method, or the exact value.
    pub mean_b: f64,
    /// Standard error of the difference, √(s_A²/K_A + s_B²/K_B).
    pub se: f64,
    /// (Ȳ_A − Ȳ_B)/SE, signed; ±∞ where constants differ, 0 where they are equal.
    pub t: f64,
    /// Degrees of freedom after Welch (1947) and Satterthwaite (1946).
    pub df: f64,
    /// Two-sided p-value.
    pub p: f64,
    /// Minimum detectable bias relative to the mean, see [`minimum_detectable_bias`].
    pub mdb: f64,
}

/// Welch's two-sample t-test of equal means (Welch 1947).
///
/// t = (Ȳ_A−Ȳ_B)/√(s_A²/K_A+s_B²/K_B) with ν = (s_A²/K_A+s_B²/K_B)² / [ (s_A²/K_A)²/(K_A−1) +
/// (s_B²/K_B)²/(K_B−1) ] and p = 2 P(T_ν > |t|). Two constants: p = 1 where they are equal and p =
/// 0 where they are not. Fails on fewer than 2 values in an method and on non-finite values.
///
/// ```
/// let t = pathspace_validation::stats::welch(&[1.0, 2.0, 3.0], &[2.0, 3.0, 4.0])?;
/// assert!((t.t + 1.224_744_871).abs() < 1e-9 && (t.df - 4.0).abs() < 1e-9);
/// # Ok::<(), pathspace_validation::stats::StatsError>(())
/// ```
pub fn welch(a: &[f64], b: &[f64]) -> Result<Welch, StatsError> {
    welch_within(a, b, 0.0)
}

/// [`welch()`] against the interval null |E Y_A − E Y_B| ≤ `uncertainty`.
///
/// The p-value is the largest over that interval, reached at its ends: p = P(T_ν > (|d|−u)/SE) +
/// P(T_ν > (|d|+u)/SE); u = 0 is the plain test. `uncertainty` has the unit of the means; it fails
/// if negative or not finite.
pub fn welch_within(a: &[f64], b: &[f64], uncertainty: f64) -> Result<Welch, StatsError> {
    let (a, b) = (Moments::of(a)?, Moments::of(b)?);
    let (va, vb) = (a.squared_error(), b.squared_error());
    let df = satterthwaite(&[(va, a.n), (vb, b.n)]);
    test(a.mean, b.mean, (va + vb).sqrt(), df, 0.5 * (a.mean.abs() + b.mean.abs()), uncertainty)
}

/// Student's one-sample t-test of `a` against the exact mean `mu`, with K−1 degrees of freedom.
///
/// Fails on fewer than 2 values and on non-finite values.
pub fn one_sample(a: &[f64], mu: f64) -> Result<Welch, StatsError> {
    one_sample_within(a, mu, 0.0)
}

/// [`one_sample`] against the interval null |E Y − mu| ≤ `uncertainty`, as in [`welch_within`].
///
/// For a reference that is itself known to within an error bound, such as a mesh solution after
/// Richardson extrapolation. The relative minimum detectable bias refers to |mu|.
pub fn one_sample_within(a: &[f64], mu: f64, uncertainty: f64) -> Result<Welch, StatsError> {
    if !mu.is_finite() {
        return Err(StatsError::NonFinite { what: "exact value", index: 0, value: mu });
    }
    let a = Moments::of(a)?;
    test(a.mean, mu, a.squared_error().sqrt(), (a.n - 1) as f64, mu.abs(), uncertainty)
}

/// Relative bias that a two-sided test at level α = 10⁻⁴ finds with power 0.9.
///
/// MDB = (z_{1−α/2} + z_{0.9})·SE/μ = (3.8906 + 1.2816)·SE/μ = 5.17·SE/μ, with z the standard
/// normal quantile; an interval null of half-width `uncertainty` adds uncertainty/μ. The normal
/// quantiles belong to many replicates: the same power needs 1.15 times that bias at 16 a side,
/// 1.07 times at 32. 0 where there is nothing to see (SE = u = 0), infinite where μ = 0 otherwise.
pub fn minimum_detectable_bias(se: f64, mean: f64, uncertainty: f64) -> Result<f64, StatsError> {
    let z = normal_quantile(1.0 - 0.5 * MDB_ALPHA)? + normal_quantile(MDB_POWER)?;
    let bias = z * se + uncertainty;
    Ok(if bias == 0.0 { 0.0 } else { bias / mean.abs() })
}

fn test(
    mean_a: f64,
    mean_b: f64,
    se: f64,
    df: f64,
    mean: f64,
    uncertainty: f64,
) -> Result<Welch, StatsError> {
    if !(uncertainty >= 0.0 && uncertainty.is_finite()) {
        return Err(StatsError::OutOfRange {
            what: "uncertainty",
            value: uncertainty,
            expected: "a finite number ≥ 0",
        });
    }
    let d = mean_a - mean_b;
    let (t, p) = if se > 0.0 {
        let tail = |x: f64| student_sf(x / se, df);
        (d / se, (tail(d.abs() - uncertainty) + tail(d.abs() + uncertainty)).min(1.0))
    } else {
        // Constants: the difference is known exactly.
        let t = if d == 0.0 { 0.0 } else { d.signum() * f64::INFINITY };
        (t, if d.abs() <= uncertainty { 1.0 } else { 0.0 })
    };
    let mdb = minimum_detectable_bias(se, mean, uncertainty)?;
    Ok(Welch { mean_a, mean_b, se, t, df, p, mdb })
}

/// ν = (Σv)²/Σ(v²/(n−1)) of squared standard errors v; Σ(n−1) where all of them are 0.
pub(crate) fn satterthwaite(methods: &[(f64, usize)]) -> f64 {
    let largest = methods.iter().fold(0.0, |m: f64, a| m.max(a.0));
    let pooled: f64 = methods.iter().map(|a| (a.1 - 1) as f64).sum();
    if largest == 0.0 {
        return pooled;
    }
    // Scaled by the largest so that tiny variances do not underflow when squared.
    let sum: f64 = methods.iter().map(|a| a.0 / largest).sum();
    let below: f64 = methods.iter().map(|a| (a.0 / largest).powi(2) / (a.1 - 1) as f64).sum();
    sum * sum / below
}

#[cfg(test)]
mod tests {
    use super::super::{binomial_interval, testing::Source};
    use super::*;

    fn close(a: f64, b: f64, relative: f64) {
        assert!((a - b).abs() <= relative * b.abs(), "{a} against {b}");
    }

    #[test]
    fn student_sleep_data_give_the_published_result() {
        // Student (1908), extra hours of sleep under two drugs: t = −1.8608, df = 17.776, p =
        // 0.07939.
        let a = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0];
        let b = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4];
        let w = welch(&a, &b).unwrap();
        close(w.t, -1.860_813_467_486_85, 1e-12);
        close(w.df, 17.776_473_516_178_9, 1e-12);
        close(w.p, 0.079_394_140_187_358, 1e-10);
    }

    #[test]
    fn one_sample_matches_the_closed_form_of_two_degrees_of_freedom() {
        // t = 2/(1/√3) = 2√3 and P(|T₂| > t) = 1 − t/√(2+t²).
        let w = one_sample(&[1.0, 2.0, 3.0], 0.0).unwrap();
        close(w.t, 12f64.sqrt(), 1e-12);
        close(w.p, 1.0 - (12.0_f64 / 14.0).sqrt(), 1e-10);
    }

    #[test]
    fn equal_constants_agree_and_unequal_constants_differ() {
        let same = welch(&[2.0; 4], &[2.0; 4]).unwrap();
        assert_eq!((same.t, same.p, same.mdb), (0.0, 1.0, 0.0));
        let other = welch(&[2.0; 4], &[2.5; 4]).unwrap();
        assert_eq!((other.t, other.p), (f64::NEG_INFINITY, 0.0));
        let zero = welch(&[0.0; 4], &[0.0; 4]).unwrap();
        assert_eq!((zero.p, zero.mdb), (1.0, 0.0));
    }

    #[test]
    fn one_constant_arm_keeps_the_degrees_of_freedom_of_the_other() {
        close(welch(&[1.0, 2.0, 3.0, 4.0], &[2.0; 9]).unwrap().df, 3.0, 1e-12);
    }

    #[test]
    fn tiny_radiance_does_not_underflow() {
        let a: Vec<f64> = [1.0, 2.0, 3.0].iter().map(|v| v * 1e-140).collect();
        let b: Vec<f64> = [2.0, 3.0, 4.0].iter().map(|v| v * 1e-140).collect();
        close(welch(&a, &b).unwrap().df, 4.0, 1e-12);
    }

    #[test]
    fn interval_null_forgives_its_own_width_and_no_more() {
        let a = [1.009, 1.011, 1.010, 1.0101];
        assert!(one_sample(&a, 1.0).unwrap().p < 1e-3);
        assert!(one_sample_within(&a, 1.0, 0.02).unwrap().p > 0.5);
        assert!(one_sample_within(&a, 1.0, 0.001).unwrap().p < 1e-2);
        assert_eq!(one_sample_within(&[1.5; 3], 1.0, 0.5).unwrap().p, 1.0);
        assert_eq!(one_sample_within(&[1.6; 3], 1.0, 0.5).unwrap().p, 0.0);
    }

    #[test]
    fn detectable_bias_is_5_17_standard_errors_of_the_mean() {
        close(minimum_detectable_bias(0.01, 2.0, 0.0).unwrap(), 5.172_143_7 * 0.005, 1e-7);
        assert_eq!(minimum_detectable_bias(0.0, 0.0, 0.0).unwrap(), 0.0);
        assert_eq!(minimum_detectable_bias(0.1, 0.0, 0.0).unwrap(), f64::INFINITY);
    }

    #[test]
    fn a_bias_of_the_detectable_size_is_found_nine_times_in_ten() {
        // With many replicates, where the normal quantiles hold.
        let mut source = Source::new(11);
        let (k, runs) = (200, 1000);
        let bias = minimum_detectable_bias((2.0 / f64::from(k)).sqrt(), 1.0, 0.0).unwrap();
        let hits = (0..runs)
            .filter(|_| {
                let a = source.normals(k as usize, 1.0 + bias, 1.0);
                let b = source.normals(k as usize, 1.0, 1.0);
                welch(&a, &b).unwrap().p < MDB_ALPHA
            })
            .count() as u64;
        let (low, high) = binomial_interval(hits, runs, 0.999).unwrap();
        assert!(low < 0.9 && 0.88 < high, "{hits} of {runs}");
    }

    #[test]
    fn false_alarms_on_unequal_normals_are_at_the_nominal_level() {
        let mut source = Source::new(1);
        let (runs, mut hits) = (20_000, 0);
        for _ in 0..runs {
            let a = source.normals(16, 1.0, 1.0);
            let b = source.normals(24, 1.0, 5.0);
            hits += u64::from(welch(&a, &b).unwrap().p < 0.05);
        }
        let (low, high) = binomial_interval(hits, runs, 0.999).unwrap();
        assert!(low <= 0.05 && 0.05 <= high, "{hits} of {runs}");
    }

    #[test]
    fn bad_samples_are_errors() {
        assert!(welch(&[1.0], &[1.0, 2.0]).is_err());
        assert!(welch(&[1.0, f64::INFINITY], &[1.0, 2.0]).is_err());
        assert!(one_sample(&[1.0, 2.0], f64::NAN).is_err());
        assert!(welch_within(&[1.0, 2.0], &[1.0, 2.0], -1.0).is_err());
    }
}
