//! Gandy & Scott's rounds: a test with a tiny level that rarely needs its full budget.

use super::fault::{StatsError, at_least, open_unit};

/// Outcome of one round of [`GandyScott`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Round {
    /// Undecided: test again on fresh data.
    Again,
    /// The null hypothesis is rejected.
    Reject,
    /// No evidence against it.
    Accept,
}

/// Sequential test in at most k rounds of independent data (Gandy & Scott 2020, algorithm 1).
///
/// With β = α/k and γ = β^{1/k}, round i rejects if its p-value q ≤ β_i, accepts if q > γ + β_i,
/// and otherwise goes on with β_{i+1} = β_i/γ; the last round accepts what it does not reject. A
/// true null reaches round i with probability ≤ γ^{i−1}, so it is rejected with probability ≤ Σ
/// γ^{i−1}β/γ^{i−1} = α. Most true nulls end in the first round, most gross errors too; the full
/// budget is spent on what is near the border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GandyScott {
    rounds: u32,
    round: u32,
    beta: f64,
    gamma: f64,
}

impl GandyScott {
    /// A test of level `alpha` in at most `rounds` rounds (7 is usual); fails on alpha outside (0,
    /// 1) or no rounds.
    pub fn new(alpha: f64, rounds: u32) -> Result<Self, StatsError> {
        open_unit("alpha", alpha)?;
        at_least("rounds", 1, rounds as usize)?;
        let beta = alpha / f64::from(rounds);
        Ok(GandyScott { rounds, round: 0, beta, gamma: beta.powf(1.0 / f64::from(rounds)) })
    }

    /// β of the coming round: it rejects a q at or below this.
    pub fn level(&self) -> f64 {
        self.beta
    }

    /// Judges the p-values of one round, combined by Bonferroni as q = min(1, m·min p).
    ///
    /// Every round must use data independent of the earlier ones. Fails on no p-values and on p
    /// outside \[0, 1\].
    pub fn observe(&mut self, p: &[f64]) -> Result<Round, StatsError> {
        at_least("p-values", 1, p.len())?;
        if let Some(&value) = p.iter().find(|p| !(0.0..=1.0).contains(*p)) {
            let expected = "a number in [0, 1]";
            return Err(StatsError::OutOfRange { what: "p-value", value, expected });
        }
        let q = (p.len() as f64 * p.iter().copied().fold(1.0, f64::min)).min(1.0);
        self.round += 1;
        if q <= self.beta {
            return Ok(Round::Reject);
        }
        if q > self.gamma + self.beta || self.round >= self.rounds {
            return Ok(Round::Accept);
        }
        self.beta /= self.gamma;
        Ok(Round::Again)
    }

    /// Runs the rounds on `test`, which gets the factor of its sample size: 1 first, then `growth`.
    ///
    /// Returns whether the null is rejected, and the rounds used. Errors of `test` are passed on.
    pub fn run<E: From<StatsError>>(
        mut self,
        growth: u32,
        mut test: impl FnMut(u32) -> Result<Vec<f64>, E>,
    ) -> Result<(bool, u32), E> {
        loop {
            let p = test(if self.round == 0 { 1 } else { growth })?;
            match self.observe(&p)? {
                Round::Again => {}
                end => return Ok((end == Round::Reject, self.round)),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{binomial_interval, testing::Source};
    use super::*;

    #[test]
    fn thresholds_follow_the_algorithm() {
        let test = GandyScott::new(1e-5, 7).unwrap();
        assert!((test.beta - 1e-5 / 7.0).abs() < 1e-18);
        assert!((test.gamma - 0.146_2).abs() < 1e-4, "{}", test.gamma);
    }

    #[test]
    fn the_last_round_decides() {
        let mut test = GandyScott::new(0.05, 2).unwrap();
        // β = 0.025, γ = 0.158; then β₂ = γ.
        assert_eq!(test.observe(&[0.1]).unwrap(), Round::Again);
        assert_eq!(test.observe(&[0.17]).unwrap(), Round::Accept);
    }

    #[test]
    fn false_alarms_stay_below_the_level_and_most_runs_end_at_once() {
        let mut source = Source::new(60);
        let (runs, mut hits, mut rounds) = (20_000u64, 0, 0);
        for _ in 0..runs {
            let p = |_| Ok::<_, StatsError>(vec![source.uniform(), source.uniform()]);
            let (rejected, used) = GandyScott::new(0.05, 5).unwrap().run(4, p).unwrap();
            hits += u64::from(rejected);
            rounds += u64::from(used);
        }
        let (low, high) = binomial_interval(hits, runs, 0.95).unwrap();
        assert!(high <= 0.055 && low > 0.02, "{hits} of {runs}");
        assert!(rounds < 2 * runs, "{rounds}");
    }

    #[test]
    fn a_gross_error_is_rejected_in_the_first_round() {
        let p = |_| Ok::<_, StatsError>(vec![0.4, 1e-9]);
        assert_eq!(GandyScott::new(1e-5, 7).unwrap().run(4, p), Ok((true, 1)));
    }

    #[test]
    fn the_sample_grows_after_the_first_round() {
        let mut factors = Vec::new();
        let p = |factor| {
            factors.push(factor);
            Ok::<_, StatsError>(vec![if factors.len() < 3 { 0.1 } else { 0.9 }])
        };
        assert_eq!(GandyScott::new(0.05, 7).unwrap().run(4, p), Ok((false, 3)));
        assert_eq!(factors, [1, 4, 4]);
    }

    #[test]
    fn bad_p_values_are_errors() {
        let mut test = GandyScott::new(0.05, 7).unwrap();
        assert!(test.observe(&[]).is_err());
        assert!(test.observe(&[f64::NAN]).is_err());
        assert!(GandyScott::new(0.0, 7).is_err());
    }
}
