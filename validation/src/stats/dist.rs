//! Tail probabilities and quantiles that never panic and keep their relative precision far out.
//!
//! Survival functions come from statrs as `sf`, never as 1 − cdf, which is 0 beyond 8 σ. Quantiles
//! of Student and beta are found by bisection on those functions, so that a quantile and its tail
//! agree to the last bits.

use statrs::distribution::{Beta, ChiSquared, ContinuousCDF, Normal, StudentsT};

use super::fault::{StatsError, open_unit};

/// P(Z > z) of the standard normal distribution.
pub fn normal_sf(z: f64) -> f64 {
    Normal::standard().sf(z)
}

/// The z with P(Z ≤ z) = p of the standard normal distribution; fails unless 0 < p < 1.
pub fn normal_quantile(p: f64) -> Result<f64, StatsError> {
    open_unit("probability", p)?;
    Ok(Normal::standard().inverse_cdf(p))
}

/// P(T > t) of Student's t with `df` degrees of freedom, also for t = ±∞.
///
/// `df` need not be whole; infinity gives the normal distribution. NaN where `df` is not positive.
pub fn student_sf(t: f64, df: f64) -> f64 {
    if t.is_infinite() {
        return if t > 0.0 { 0.0 } else { 1.0 };
    }
    StudentsT::new(0.0, 1.0, df).map_or(f64::NAN, |d| d.sf(t))
}

/// The t with P(T ≤ t) = p of Student's t with `df` degrees of freedom.
///
/// Fails unless 0 < p < 1 and df > 0.
pub fn student_quantile(p: f64, df: f64) -> Result<f64, StatsError> {
    open_unit("probability", p)?;
    if df.is_nan() || df <= 0.0 {
        return Err(StatsError::OutOfRange {
            what: "degrees of freedom",
            value: df,
            expected: "a positive number",
        });
    }
    // The upper tail of |t| keeps precision on both sides of the median.
    let tail = p.min(1.0 - p);
    let mut high = 1.0;
    while student_sf(high, df) > tail && high < 1e300 {
        high *= 2.0;
    }
    let t = bisect(0.0, high, |t| student_sf(t, df) > tail);
    Ok(if p < 0.5 { -t } else { t })
}

/// P(X > x) of the χ² distribution with `df` degrees of freedom; NaN where `df` is not positive.
pub fn chi_squared_sf(x: f64, df: f64) -> f64 {
    ChiSquared::new(df).map_or(f64::NAN, |d| d.sf(x))
}

/// Exact interval of Clopper & Pearson (1934) for a probability after `hits` of `trials`.
///
/// The bounds are the α/2 quantile of Beta(k, n−k+1) and the 1−α/2 quantile of Beta(k+1, n−k), with
/// α = 1 − `confidence`; they cover the truth with at least that confidence. Fails on `trials` = 0,
/// on `hits` > `trials` and on a confidence outside (0, 1).
pub fn binomial_interval(
    hits: u64,
    trials: u64,
    confidence: f64,
) -> Result<(f64, f64), StatsError> {
    open_unit("confidence", confidence)?;
    if trials == 0 || hits > trials {
        return Err(StatsError::OutOfRange {
            what: "hits",
            value: hits as f64,
            expected: "at most the number of trials, which is positive",
        });
    }
    let (k, n) = (hits as f64, trials as f64);
    let tail = 0.5 * (1.0 - confidence);
    let low = match Beta::new(k, n - k + 1.0) {
        Ok(d) if hits > 0 => bisect(0.0, 1.0, |x| d.cdf(x) < tail),
        _ => 0.0,
    };
    let high = match Beta::new(k + 1.0, n - k) {
        Ok(d) if hits < trials => bisect(0.0, 1.0, |x| d.sf(x) > tail),
        _ => 1.0,
    };
    Ok((low, high))
}

/// The point in [low, high] where `below` turns from true to false, to the last bit.
fn bisect(mut low: f64, mut high: f64, below: impl Fn(f64) -> bool) -> f64 {
    loop {
        let mid = low + 0.5 * (high - low);
        if mid <= low || mid >= high {
            return mid;
        }
        if below(mid) {
            low = mid;
        } else {
            high = mid;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64, relative: f64) {
        assert!((a - b).abs() <= relative * b.abs(), "{a} against {b}");
    }

    #[test]
    fn student_quantile_matches_printed_tables() {
        close(student_quantile(0.975, 29.0).unwrap(), 2.045_229_642_132_703, 1e-9);
        close(student_quantile(0.975, 1.0).unwrap(), 12.706_204_736_432_1, 1e-9);
        close(student_quantile(0.005, 10.0).unwrap(), -3.169_272_672_616_951, 1e-9);
    }

    #[test]
    fn student_tail_keeps_relative_precision_far_out() {
        // One degree of freedom is the Cauchy distribution, P(T > t) = atan(1/t)/π.
        close(student_sf(1e9, 1.0), (1e-9_f64).atan() / std::f64::consts::PI, 1e-9);
        // Two degrees of freedom: P(T > t) = (1 − t/√(2+t²))/2 → 1/(2t²).
        close(student_sf(1e8, 2.0), 0.5e-16, 1e-9);
    }

    #[test]
    fn infinite_t_has_no_tail() {
        assert_eq!(student_sf(f64::INFINITY, 7.0), 0.0);
        assert_eq!(student_sf(f64::NEG_INFINITY, 7.0), 1.0);
    }

    #[test]
    fn normal_quantiles_of_the_detectable_bias_sum_to_5_17() {
        let z = normal_quantile(1.0 - 0.5e-4).unwrap() + normal_quantile(0.9).unwrap();
        close(z, 5.172_143_7, 1e-7);
    }

    #[test]
    fn chi_squared_tail_matches_tables() {
        close(chi_squared_sf(18.307_038_053_275_147, 10.0), 0.05, 1e-9);
    }

    #[test]
    fn clopper_pearson_of_no_hits_is_the_closed_form() {
        let (low, high) = binomial_interval(0, 20, 0.95).unwrap();
        assert_eq!(low, 0.0);
        close(high, 1.0 - 0.025_f64.powf(1.0 / 20.0), 1e-9);
    }

    #[test]
    fn clopper_pearson_of_all_hits_mirrors_no_hits() {
        let (low, high) = binomial_interval(20, 20, 0.95).unwrap();
        assert_eq!(high, 1.0);
        close(low, 0.025_f64.powf(1.0 / 20.0), 1e-9);
    }

    #[test]
    fn clopper_pearson_solves_its_binomial_equations() {
        // P(X ≥ 3 | low) = P(X ≤ 3 | high) = α/2, summed directly for n = 10, k = 3.
        let (low, high) = binomial_interval(3, 10, 0.95).unwrap();
        let choose = [1.0, 10.0, 45.0, 120.0];
        let mass = |p: f64, k: usize| choose[k] * p.powi(k as i32) * (1.0 - p).powi(10 - k as i32);
        close(1.0 - (0..3).map(|k| mass(low, k)).sum::<f64>(), 0.025, 1e-9);
        close((0..4).map(|k| mass(high, k)).sum::<f64>(), 0.025, 1e-9);
    }

    #[test]
    fn out_of_range_parameters_are_errors() {
        assert!(normal_quantile(0.0).is_err());
        assert!(student_quantile(0.5, -1.0).is_err());
        assert!(binomial_interval(3, 2, 0.95).is_err());
        assert!(binomial_interval(0, 0, 0.95).is_err());
    }
}
