//! Bounded test functions on path space, for scenes whose tails are too heavy for a t-test.
//!
//! All unbiased estimators agree on ∫ f g dμ for any g(x̄) ∈ \[0, 1\]. With g = 1 where f(x̄) ≤
//! C·p(x̄) for the densities p of *both* arms, every contribution f g/p lies in \[0, C\], nothing
//! is biased, and what g leaves out, ∫ f (1−g) dμ, is reported with its interval.

use serde::{Deserialize, Serialize};

use super::dist::student_quantile;
use super::efficiency::Estimate;
use super::fault::{StatsError, open_unit};
use super::moments::Moments;

/// Whether g(x̄) = 1: `contribution` f(x̄) is at most `bound`·p(x̄) for every density.
///
/// The densities are those of the whole path under every arm that is compared (the sum over
/// techniques for an arm with MIS), from the f64 oracle, so that all arms ask the same g. A NaN is
/// left out. `bound` has the unit of f/p.
pub fn keeps(contribution: f64, densities: &[f64], bound: f64) -> bool {
    densities.iter().all(|p| contribution <= bound * p)
}

/// Sums of one replicate, split by g.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BoundedSums {
    /// Number of samples, those without contribution included.
    pub samples: u64,
    /// Σ f g/p.
    pub kept: f64,
    /// Σ (f g/p)².
    pub kept_sq: f64,
    /// Σ f (1−g)/p.
    pub left_out: f64,
}

impl BoundedSums {
    /// Adds one sample of value f/p (0 where it contributes nothing), kept or not.
    pub fn add(&mut self, value: f64, keep: bool) {
        self.samples += 1;
        if keep {
            self.kept += value;
            self.kept_sq += value * value;
        } else {
            self.left_out += value;
        }
    }

    /// Estimate of ∫ f g dμ, the row entry of a [`ReplicateSet`](super::ReplicateSet); 0 without
    /// samples.
    pub fn kept_mean(&self) -> f64 {
        self.kept / self.samples.max(1) as f64
    }

    /// Estimate of the left-out mass ∫ f (1−g) dμ; 0 without samples.
    pub fn left_out_mean(&self) -> f64 {
        self.left_out / self.samples.max(1) as f64
    }

    /// Effective number of kept contributions, (Σx)²/Σx².
    pub fn n_eff(&self) -> f64 {
        super::tiles::effective_count(self.kept, self.kept_sq)
    }
}

/// Mean of replicate means with its Student interval, for the left-out mass.
///
/// Ȳ ± t_{1−α/2, K−1}·s/√K. The left-out part is the heavy-tailed one, so that the interval says
/// how much was seen, not how much there may be. Fails on fewer than 2 values, non-finite ones and
/// a confidence outside (0, 1).
pub fn mean_interval(replicates: &[f64], confidence: f64) -> Result<Estimate, StatsError> {
    open_unit("confidence", confidence)?;
    let m = Moments::of(replicates)?;
    let t = student_quantile(0.5 + 0.5 * confidence, (m.n - 1) as f64)?;
    let half = t * m.squared_error().sqrt();
    Ok(Estimate { value: m.mean, low: m.mean - half, high: m.mean + half })
}

/// Interval for the mean of independent values in \[0, `bound`\] that holds for every n, without
/// normality.
///
/// The empirical Bernstein bound of Maurer & Pontil (2009), theorem 4, on both sides: x̄ ± (√(2 s²
/// ln(4/α)/n) + 7 C ln(4/α)/(3(n−1))), α = 1 − `confidence`. `values` are the f g/p of independent
/// samples, zeros included. Fails on fewer than 2 values and on one outside \[0, bound\].
pub fn bernstein_interval(
    values: &[f64],
    bound: f64,
    confidence: f64,
) -> Result<Estimate, StatsError> {
    open_unit("confidence", confidence)?;
    let m = Moments::of(values)?;
    if let Some(&value) = values.iter().find(|v| !(0.0..=bound).contains(*v)) {
        let expected = "a number between 0 and the bound";
        return Err(StatsError::OutOfRange { what: "bounded value", value, expected });
    }
    let (n, ln) = (m.n as f64, (4.0 / (1.0 - confidence)).ln());
    let half = (2.0 * m.variance * ln / n).sqrt() + 7.0 * bound * ln / (3.0 * (n - 1.0));
    Ok(Estimate { value: m.mean, low: m.mean - half, high: m.mean + half })
}

#[cfg(test)]
mod tests {
    use super::super::testing::Source;
    use super::super::welch;
    use super::*;

    #[test]
    fn a_path_is_kept_only_where_every_arm_samples_it_well() {
        assert!(keeps(2.0, &[1.0, 4.0], 2.0));
        assert!(!keeps(2.1, &[1.0, 4.0], 2.0));
        assert!(!keeps(2.0, &[0.0, 4.0], 2.0));
        assert!(!keeps(f64::NAN, &[1.0], 2.0));
    }

    #[test]
    fn sums_split_and_add_up() {
        let mut sums = BoundedSums::default();
        sums.add(1.0, true);
        sums.add(3.0, true);
        sums.add(100.0, false);
        sums.add(0.0, true);
        assert_eq!((sums.kept_mean(), sums.left_out_mean()), (1.0, 25.0));
        assert_eq!(sums.n_eff(), 1.6);
    }

    /// f(x) = x^{-0.8} on (0, 1), ∫f = 5. Arm "uniform" has p = 1 and infinite variance, arm
    /// "fitted" p ∝ x^{-0.7}. Kept: f ≤ 10 p for both.
    fn replicate(source: &mut Source, uniform: bool, samples: u64) -> BoundedSums {
        let density = |x: f64| [1.0, 0.3 * x.powf(-0.7)];
        let mut sums = BoundedSums::default();
        for _ in 0..samples {
            let u = source.uniform();
            let x = if uniform { u } else { u.powf(1.0 / 0.3) };
            let f = x.powf(-0.8);
            let p = density(x);
            sums.add(f / if uniform { p[0] } else { p[1] }, keeps(f, &p, 10.0));
        }
        sums
    }

    #[test]
    fn arms_of_infinite_variance_agree_on_the_bounded_part_with_its_exact_value() {
        let mut source = Source::new(80);
        let mut arm = |uniform| -> Vec<f64> {
            (0..16).map(|_| replicate(&mut source, uniform, 4000).kept_mean()).collect()
        };
        let w = welch(&arm(true), &arm(false)).unwrap();
        assert!(w.p > 1e-3 && w.mdb < 0.05, "{w:?}");
        // f ≤ 10 for x ≥ 10^{-1.25}: ∫ x^{-0.8} = 5(1 − 10^{-0.25}).
        let exact = 5.0 * (1.0 - 10f64.powf(-0.25));
        assert!((w.mean_b - exact).abs() < 0.02 * exact, "{w:?} against {exact}");
    }

    #[test]
    fn the_left_out_mass_is_reported_with_its_interval() {
        let mut source = Source::new(81);
        let left: Vec<f64> =
            (0..16).map(|_| replicate(&mut source, false, 4000).left_out_mean()).collect();
        let interval = mean_interval(&left, 0.999).unwrap();
        let exact = 5.0 * 10f64.powf(-0.25);
        assert!(interval.low < exact && exact < interval.high, "{interval:?} against {exact}");
        assert!(interval.high - interval.low < 0.1 * exact, "{interval:?}");
    }

    #[test]
    fn bernstein_covers_rare_hits_where_student_does_not() {
        // 30 samples with hits of probability 2 %: more than half of the runs see none at all.
        let mut source = Source::new(82);
        let (mut bernstein, mut student) = (0, 0);
        for _ in 0..500 {
            let x: Vec<f64> = (0..30).map(|_| f64::from(source.uniform() < 0.02)).collect();
            let inside = |e: Estimate| u32::from(e.low <= 0.02 && 0.02 <= e.high);
            bernstein += inside(bernstein_interval(&x, 1.0, 0.95).unwrap());
            student += inside(mean_interval(&x, 0.95).unwrap());
        }
        assert!(bernstein >= 490, "{bernstein} of 500");
        assert!(student < 300, "{student} of 500");
    }

    #[test]
    fn values_beyond_the_bound_are_errors() {
        assert!(bernstein_interval(&[0.5, 1.5], 1.0, 0.95).is_err());
        assert!(bernstein_interval(&[0.5, -0.5], 1.0, 0.95).is_err());
        assert!(mean_interval(&[1.0], 0.95).is_err());
    }
}
