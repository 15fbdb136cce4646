//! Budgets and goals: how long a render goes on. Plain data.

use serde::{Deserialize, Serialize};

/// When a run ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Budget {
    /// After this many steps; a step is one sample (or mutation) per pixel.
    Samples(u64),
    /// After this many seconds of rendering, start-up of the integrator (bootstrap) included.
    Seconds(f64),
}

impl Budget {
    /// Samples per pixel or seconds.
    pub fn amount(self) -> f64 {
        match self {
            Budget::Samples(n) => n as f64,
            Budget::Seconds(s) => s,
        }
    }

    /// `factor` times as much.
    pub fn times(self, factor: u64) -> Self {
        match self {
            Budget::Samples(n) => Budget::Samples(n.saturating_mul(factor)),
            Budget::Seconds(s) => Budget::Seconds(s * factor as f64),
        }
    }

    /// The budget with its unit: `16 spp`, `0.5 s`.
    pub fn words(self) -> String {
        match self {
            Budget::Samples(n) => format!("{n} spp"),
            Budget::Seconds(s) => format!("{s} s"),
        }
    }

    /// Share of the budget that is used up, in [0, 1].
    pub(crate) fn used(self, steps: u64, seconds: f64) -> f64 {
        let used = match self {
            Budget::Samples(n) => steps as f64 / n.max(1) as f64,
            Budget::Seconds(s) => seconds / s,
        };
        used.clamp(0.0, 1.0)
    }

    /// True where it is better to stop than to make another step of `step` seconds.
    ///
    /// A budget in seconds ends at the end of the step that is nearest to it: another step is made
    /// where it would end nearer to the budget than now, so that the error is at most half a step.
    /// There is always one step.
    pub(crate) fn is_spent(self, steps: u64, seconds: f64, step: f64) -> bool {
        match self {
            Budget::Samples(n) => steps >= n.max(1),
            Budget::Seconds(s) => steps > 0 && seconds + 0.5 * step > s,
        }
    }
}

/// When a render ends: at the first of these.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Goal {
    /// Where the budget is used up.
    pub budget: Option<Budget>,
    /// Where the relative error ([`Precision`](crate::Precision)) is surely, by the upper end of
    /// its interval, no larger than this.
    pub error: Option<f64>,
}

impl From<Budget> for Goal {
    fn from(budget: Budget) -> Self {
        Goal { budget: Some(budget), error: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_end_at_the_step_that_is_nearest() {
        // Steps of 0.4 s and 1 s to fill: two make 0.8, three 1.2; four steps of 0.3 make 1.2,
        // three 0.9.
        for (step, expected) in [(0.4, 2), (0.3, 3), (0.26, 4), (5.0, 1), (0.1, 10)] {
            let mut steps = 0;
            while !Budget::Seconds(1.0).is_spent(steps, steps as f64 * step, step) {
                steps += 1;
            }
            // 0.4: 0.8 and 1.2 are equally near but for rounding.
            assert!(steps.abs_diff(expected) <= u64::from(step == 0.4), "{step}: {steps}");
        }
    }

    #[test]
    fn samples_are_counted_exactly() {
        assert!(!Budget::Samples(3).is_spent(2, 1e9, 1.0));
        assert!(Budget::Samples(3).is_spent(3, 0.0, 1.0));
        assert_eq!(Budget::Samples(4).used(1, 0.0), 0.25);
    }
}
