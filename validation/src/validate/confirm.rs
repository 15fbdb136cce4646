//! Verdicts that are never left to one round.

use super::config::{Config, StoppingRule};
use super::report::RoundReport;
use crate::stats::{GandyScott, Round, StatsError};

/// A test in rounds of fresh seeds that rejects in the second one at the earliest.
///
/// In the first round a p-value that would reject is taken for the least that does not, which only
/// raises it: the level holds.
#[derive(Clone, Debug)]
pub(crate) struct Confirmed {
    test: GandyScott,
    /// The rounds so far.
    pub(crate) rounds: Vec<RoundReport>,
}

impl Confirmed {
    pub(crate) fn new(level: f64, most: u32) -> Result<Self, StatsError> {
        Ok(Confirmed { test: GandyScott::new(level, most)?, rounds: Vec::new() })
    }

    /// Level of the coming round.
    pub(crate) fn level(&self) -> f64 {
        self.test.level()
    }

    /// Takes the p-value of a round.
    pub(crate) fn observe(&mut self, p: f64, replicates: usize) -> Result<Round, StatsError> {
        let level = self.level();
        let least = if self.rounds.is_empty() { level * (1.0 + 1e-9) } else { 0.0 };
        self.rounds.push(RoundReport { p, level, replicates });
        self.test.observe(&[p.max(least).min(1.0)])
    }

    /// Runs all rounds that are needed: `one` is told the number of the round, how many times the
    /// samples of the first it takes, and the level; it gives p-value and replicates, or `None`
    /// where there is nothing to test. True where the test rejects.
    pub(crate) fn run<E: From<StatsError>>(
        &mut self,
        config: &Config,
        mut one: impl FnMut(u64, u64, f64) -> Result<Option<(f64, usize)>, E>,
    ) -> Result<bool, E> {
        let (most, growth) = config.rounds();
        for round in 0..u64::from(most) {
            let factor = if round == 0 { 1 } else { u64::from(growth) };
            let Some((p, replicates)) = one(round, factor, self.level())? else { break };
            match self.observe(p, replicates)? {
                Round::Again => {}
                end => return Ok(end == Round::Reject),
            }
        }
        Ok(false)
    }
}

impl Config {
    /// Most rounds and their growth; those of [`StoppingRule::Rounds`] for checks where another one
    /// is asked for.
    pub(crate) fn rounds(&self) -> (u32, u32) {
        match self.stopping {
            StoppingRule::Rounds { most, growth } => (most, growth),
            StoppingRule::Sequential { .. } => (4, 2),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_round_alone_never_rejects() {
        let mut test = Confirmed::new(1e-5, 4).unwrap();
        assert_eq!(test.observe(0.0, 32).unwrap(), Round::Again);
        assert_eq!(test.observe(0.0, 32).unwrap(), Round::Reject);
        let mut test = Confirmed::new(1e-5, 4).unwrap();
        assert_eq!(test.observe(0.0, 32).unwrap(), Round::Again);
        assert_eq!(test.observe(0.5, 32).unwrap(), Round::Accept);
    }

    #[test]
    fn later_rounds_have_more_samples() {
        let mut seen = Vec::new();
        let mut test = Confirmed::new(1e-5, 4).unwrap();
        let rejected = test.run(&Config::default(), |round, factor, _| {
            seen.push((round, factor));
            Ok::<_, StatsError>(Some((1e-9, 32)))
        });
        assert_eq!((rejected, seen), (Ok(true), vec![(0, 1), (1, 2)]));
    }
}
