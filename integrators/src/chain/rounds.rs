//! How a run is cut into rounds, each with a bootstrap and chains of its own.
//!
//! **Why there are rounds.** b̂ of N bootstrap samples has the relative variance A/N, A = Var W/b².
//! Chains that keep one b̂ for ever never get rid of it: their image is unbiased, but its
//! brightness stays wrong by √(A/N) however long they run. A b̂ that grows better while the chains
//! run would be correlated with their starts, and E[b̂ h(X)] = ∫ f* h holds only for the b̂ of the
//! very samples that the starts were drawn from.
//!
//! So the run is cut into rounds that are independent of each other. Round r has N_r bootstrap
//! samples, M_r mutations and the image Î_r, which is unbiased by itself. The film is their sum, so
//! that each weighs M_r/M with M = ΣM_r: weights that are fixed beforehand, not taken from the
//! data. The image is therefore unbiased at every step, and with B/M_r the variance of the chains
//!
//! ```text
//! E‖Î − I‖² = Σ_r (M_r/M)² (A/N_r + B/M_r) = A/N + B/M   for N_r = κ M_r, N = ΣN_r.
//! ```
//!
//! That is the error of one b̂ of all N samples together: keeping the rounds apart loses nothing.
//! Both terms fall like 1/n.
//!
//! **How many bootstrap samples.** At equal time T = c_b N + c_m M the error is least at
//!
//! ```text
//! κ = N/M = √(A c_m / (B c_b)),   and is then (√(A c_b) + √(B c_m))²/T.
//! ```
//!
//! A does not depend on the film. B does: a pixel sees one mutation in P, so that B = βP for P
//! pixels. Hence κ = κ₁/√P, with κ₁ = √(A c_m/(β c_b)) a property of scene and integrator. The
//! minimum is flat: where κ is twice or half of the best, the error is less than a quarter above
//! the least.
//!
//! **How long a round is.** The length of a run is not known beforehand. Rounds double, so that a
//! bootstrap never takes more than about 2κ of what was done before it, and chains grow longer.
//! Beyond 2¹⁸ samples rounds stay equal, because the candidates of a bootstrap are kept in memory.

use super::ChainOptions;

/// Mutations per pixel of the first round.
const FIRST: f64 = 8.0;
/// κ₁: bootstrap samples per mutation on a film of one pixel, could it be larger than [`MOST`].
const SHARE: f64 = 16.0;
/// Least and most bootstrap samples for each mutation.
const LEAST: f64 = 1.0 / 32.0;
const MOST: f64 = 1.0;
/// Fewest bootstrap samples of a round, where none are asked for.
const SMALLEST: u64 = 1024;
/// Most bootstrap samples of a round, where not more are asked for.
const LARGEST: u64 = 1 << 18;
/// Most chains, where none are asked for.
const CHAINS: u64 = 1024;
/// Mutations that a chain makes at the least, where the number of chains is not asked for: so that
/// its start is a small part of its work.
const SHORTEST: u64 = 32;

/// One round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Round {
    /// Its number, from 0.
    pub index: u64,
    /// Bootstrap samples.
    pub samples: u64,
    /// Chains.
    pub chains: u64,
    /// Its first step.
    pub begin: u64,
    /// The step after its last one.
    pub end: u64,
}

/// The rounds of a run; they follow from its options and the size of the film alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rounds {
    first: u64,
    largest: u64,
    chains: Option<u64>,
    pixels: u64,
    endless: bool,
}

impl Rounds {
    /// Rounds for a film of so many pixels.
    pub fn new(options: &ChainOptions, pixels: u64) -> Self {
        let pixels = pixels.max(1);
        let automatic = (FIRST * pixels as f64 * share(pixels)) as u64;
        let first = options.bootstrap.unwrap_or(automatic.clamp(SMALLEST, LARGEST));
        Rounds {
            first,
            largest: first.max(LARGEST),
            chains: options.chains,
            pixels,
            endless: !options.rounds,
        }
    }

    /// The round that a step belongs to.
    pub fn at(&self, step: u64) -> Round {
        let mut round = self.round(0, self.first, 0);
        while step >= round.end {
            let alike = round.samples == self.largest;
            // Rounds of the largest size are passed over at once.
            let passed = if alike { (step - round.begin) / (round.end - round.begin) } else { 1 };
            let begin = round.begin + passed * (round.end - round.begin);
            let samples = (2 * round.samples).min(self.largest);
            round = self.round(round.index + passed, samples, begin);
        }
        round
    }

    fn round(&self, index: u64, samples: u64, begin: u64) -> Round {
        let steps = (samples as f64 / share(self.pixels) / self.pixels as f64).round().max(1.0);
        let mutations = (steps * self.pixels as f64) as u64;
        let chains = self.chains.unwrap_or((mutations / SHORTEST).clamp(1, CHAINS));
        let end = if self.endless { u64::MAX } else { begin.saturating_add(steps as u64) };
        Round { index, samples, chains, begin, end }
    }
}

/// κ: bootstrap samples for each mutation on a film of so many pixels.
fn share(pixels: u64) -> f64 {
    (SHARE / (pixels as f64).sqrt()).clamp(LEAST, MOST)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPTIONS: ChainOptions = ChainOptions { chains: None, bootstrap: None, rounds: true };

    fn list(rounds: &Rounds, count: usize) -> Vec<Round> {
        let mut list = vec![rounds.at(0)];
        while list.len() < count {
            list.push(rounds.at(list[list.len() - 1].end));
        }
        list
    }

    #[test]
    fn rounds_follow_each_other_and_hold_all_their_steps() {
        for pixels in [1, 20, 256, 65_536, 1 << 24] {
            let rounds = Rounds::new(&OPTIONS, pixels);
            for (i, pair) in list(&rounds, 14).windows(2).enumerate() {
                let (a, b) = (pair[0], pair[1]);
                assert_eq!((a.index, b.index, a.end), (i as u64, i as u64 + 1, b.begin));
                for step in [a.begin, (a.begin + a.end) / 2, a.end - 1] {
                    assert_eq!(rounds.at(step), a, "{pixels} pixels, step {step}");
                }
                assert!(b.samples >= a.samples && b.end - b.begin >= a.end - a.begin);
            }
        }
    }

    /// A film of any size, from its first round on: bootstrap samples keep pace with mutations.
    #[test]
    fn bootstrap_samples_grow_with_the_mutations() {
        for pixels in [64, 4096, 65_536, 1 << 22] {
            let rounds = Rounds::new(&OPTIONS, pixels);
            let (mut samples, mut mutations) = (0.0, 0.0);
            for round in list(&rounds, 20) {
                samples += round.samples as f64;
                mutations += (round.end - round.begin) as f64 * pixels as f64;
                let kept = samples / mutations / share(pixels);
                assert!((0.4..2.1).contains(&kept), "{pixels} pixels: {kept} of the share");
            }
        }
    }

    #[test]
    fn what_is_asked_for_is_what_the_first_round_has() {
        let asked = ChainOptions { chains: Some(7), bootstrap: Some(500_000), ..OPTIONS };
        let rounds = list(&Rounds::new(&asked, 256), 4);
        assert!(rounds.iter().all(|r| (r.chains, r.samples) == (7, 500_000)));
        let one = Rounds::new(&ChainOptions { rounds: false, ..asked }, 256);
        assert_eq!(one.at(1 << 40), one.at(0));
    }

    #[test]
    fn short_rounds_have_fewer_chains() {
        assert_eq!(Rounds::new(&OPTIONS, 256).at(0).chains, 64);
        assert_eq!(Rounds::new(&OPTIONS, 65_536).at(0).chains, 1024);
    }
}
