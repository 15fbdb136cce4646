//! From a p-value, a minimum detectable bias and the gates to one of three words.

use serde::{Deserialize, Serialize};

/// What a comparison says about two means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// No difference found, and a relative bias above the minimum detectable one would have been.
    Agree,
    /// The means differ at the level of the test.
    Differ,
    /// The data cannot carry either claim: too noisy, or too heavy-tailed for a t-test.
    Inconclusive,
}

impl Verdict {
    /// The word: `agree`, `differ` or `inconclusive`.
    pub fn as_str(self) -> &'static str {
        match self {
            Verdict::Agree => "agree",
            Verdict::Differ => "differ",
            Verdict::Inconclusive => "inconclusive",
        }
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.as_str())
    }
}

/// Why a [`Verdict`] came out as it did.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// Every value of both sides is exactly 0.
    BothZero,
    /// The minimum detectable bias is within the limit and no difference was found.
    Resolved,
    /// The adjusted p-value is below the level, and the gates pass.
    Significant,
    /// The minimum detectable bias exceeds the limit.
    TooNoisy,
    /// One method is exactly 0 in all its replicates and the other is not: it never sampled the
    /// cell, which a rare event and a missing technique have in common.
    NeverSampled,
    /// Too few effective contributions per replicate for a t-test.
    FewContributions,
    /// Pareto k̂ says that the variance need not exist.
    HeavyTail,
    /// Replicates of different seeds are the same to the bit: nothing is known of their error.
    NoVariance,
}

impl Reason {
    /// True where the p-value of the cell may be believed.
    pub fn is_trusted(self) -> bool {
        use Reason::*;
        !matches!(self, NeverSampled | FewContributions | HeavyTail | NoVariance)
    }
}

/// The figures that tell whether a t-test may be trusted on a cell; the worse method counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Gates {
    /// Effective number of contributions per replicate, (Σx)²/Σx²; `None` where unknown.
    pub n_eff: Option<f64>,
    /// Pareto shape k̂ of the largest samples; `None` where unknown.
    pub khat: Option<f64>,
}

impl Gates {
    /// The worse of two methods in each figure.
    pub fn worse(self, other: Gates) -> Gates {
        Gates {
            n_eff: merge(self.n_eff, other.n_eff, f64::min),
            khat: merge(self.khat, other.khat, f64::max),
        }
    }
}

fn merge(a: Option<f64>, b: Option<f64>, pick: impl Fn(f64, f64) -> f64) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(pick(a, b)),
        (a, b) => a.or(b),
    }
}

/// The thresholds of [`decide()`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rule {
    /// Level for the adjusted p-value.
    pub alpha: f64,
    /// Largest relative minimum detectable bias of an agreement.
    pub mdb_limit: f64,
    /// Smallest effective number of contributions per replicate.
    pub n_eff_min: f64,
    /// k̂ must stay below this; from 1/2 on the variance is infinite.
    pub khat_limit: f64,
}

impl Default for Rule {
    /// α = 10⁻⁴, MDB ≤ 5 %, n_eff ≥ 10, k̂ < 1/2.
    fn default() -> Self {
        Rule { alpha: 1e-4, mdb_limit: 0.05, n_eff_min: 10.0, khat_limit: 0.5 }
    }
}

/// What [`decide()`] judges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Claim {
    /// p-value after adjustment for multiplicity.
    pub p_adjusted: f64,
    /// Relative minimum detectable bias.
    pub mdb: f64,
    /// Trustworthiness of the test.
    pub gates: Gates,
    /// Whether all values of the first and of the second side are exactly 0.
    pub zero: (bool, bool),
}

/// The verdict on one cell.
///
/// In this order: both sides exactly 0 agree; a side that is exactly 0 alone, n_eff below its
/// minimum, or k̂ at its limit is inconclusive, because a t-test then alarms far above its level
/// (with Poisson hits at one per replicate a nominal 10⁻⁴ is 7·10⁻⁴); an adjusted p-value below α
/// differs; a minimum detectable bias within the limit agrees; the rest is inconclusive.
pub fn decide(claim: &Claim, rule: &Rule) -> (Verdict, Reason) {
    match claim.zero {
        (true, true) => return (Verdict::Agree, Reason::BothZero),
        (true, false) | (false, true) => return (Verdict::Inconclusive, Reason::NeverSampled),
        (false, false) => {}
    }
    // Written so that a NaN fails a gate.
    if claim.gates.n_eff.is_some_and(|n| n.is_nan() || n < rule.n_eff_min) {
        return (Verdict::Inconclusive, Reason::FewContributions);
    }
    if claim.gates.khat.is_some_and(|k| k.is_nan() || k >= rule.khat_limit) {
        return (Verdict::Inconclusive, Reason::HeavyTail);
    }
    if claim.p_adjusted < rule.alpha {
        (Verdict::Differ, Reason::Significant)
    } else if claim.mdb <= rule.mdb_limit {
        (Verdict::Agree, Reason::Resolved)
    } else {
        (Verdict::Inconclusive, Reason::TooNoisy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLAIM: Claim = Claim {
        p_adjusted: 0.3,
        mdb: 0.01,
        gates: Gates { n_eff: Some(100.0), khat: Some(0.2) },
        zero: (false, false),
    };

    fn verdict(claim: Claim) -> (Verdict, Reason) {
        decide(&claim, &Rule::default())
    }

    #[test]
    fn a_small_detectable_bias_without_difference_agrees() {
        assert_eq!(verdict(CLAIM), (Verdict::Agree, Reason::Resolved));
    }

    #[test]
    fn a_small_p_value_differs_even_when_noisy() {
        let claim = Claim { p_adjusted: 1e-6, mdb: 0.4, ..CLAIM };
        assert_eq!(verdict(claim), (Verdict::Differ, Reason::Significant));
    }

    #[test]
    fn a_large_detectable_bias_is_inconclusive() {
        let claim = Claim { mdb: 0.051, ..CLAIM };
        assert_eq!(verdict(claim), (Verdict::Inconclusive, Reason::TooNoisy));
    }

    #[test]
    fn failed_gates_silence_a_small_p_value() {
        let few = Gates { n_eff: Some(9.0), khat: None };
        let heavy = Gates { n_eff: None, khat: Some(0.5) };
        let claim = Claim { p_adjusted: 1e-6, ..CLAIM };
        assert_eq!(verdict(Claim { gates: few, ..claim }).1, Reason::FewContributions);
        assert_eq!(verdict(Claim { gates: heavy, ..claim }).1, Reason::HeavyTail);
    }

    #[test]
    fn zero_on_both_sides_agrees_and_on_one_side_says_never_sampled() {
        let both = Claim { zero: (true, true), gates: Gates::default(), mdb: 0.0, ..CLAIM };
        assert_eq!(verdict(both), (Verdict::Agree, Reason::BothZero));
        let one = Claim { zero: (true, false), p_adjusted: 0.0, ..CLAIM };
        assert_eq!(verdict(one), (Verdict::Inconclusive, Reason::NeverSampled));
    }

    #[test]
    fn verdicts_serialise_as_lowercase_words() {
        let json = serde_json::to_string(&[Verdict::Agree, Verdict::Differ, Verdict::Inconclusive]);
        assert_eq!(json.unwrap(), r#"["agree","differ","inconclusive"]"#);
    }

    #[test]
    fn the_worse_arm_counts() {
        let a = Gates { n_eff: Some(5.0), khat: None };
        let b = Gates { n_eff: Some(50.0), khat: Some(0.7) };
        assert_eq!(a.worse(b), Gates { n_eff: Some(5.0), khat: Some(0.7) });
    }
}
