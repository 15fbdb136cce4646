//! The bootstrap: b̂ and the starts of the chains.

use pathspace_core::Scene;
use pathspace_core::driver;
use pathspace_core::mutant::{self, Mutant};
use pathspace_core::random::{Address, PrimarySample, RandomStream, derive_seed};
use rayon::prelude::*;

use super::{Candidate, Candidates, ChainTarget};

/// Bootstrap samples in a parallel task.
const BATCH: u64 = 256;

/// Where a chain starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Start {
    /// The bootstrap sample.
    pub sample: u64,
    /// Its [`Candidate::index`].
    pub index: u32,
}

/// What N independent samples say of the target. W is the sum over the candidates of a sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Bootstrap {
    /// N.
    pub samples: u64,
    /// ΣW_i of the finite ones.
    pub sum: f64,
    /// ΣW_i².
    pub sum2: f64,
    /// W that were NaN or infinite: how many, and the address of the first ones.
    pub nonfinite: (u64, Vec<Address>),
    /// Where chain c starts; empty where every W is 0.
    pub starts: Vec<Start>,
    /// Rays traced.
    pub rays: u64,
    seed: u64,
}

impl Bootstrap {
    /// b̂ = ΣW_i/N.
    pub fn b(&self) -> f64 {
        if self.samples > 0 { self.sum / self.samples as f64 } else { 0.0 }
    }

    /// Standard error of b̂; infinite for N < 2.
    pub fn standard_error(&self) -> f64 {
        let n = self.samples as f64;
        if n < 2.0 {
            return f64::INFINITY;
        }
        ((self.sum2 - self.sum * self.sum / n).max(0.0) / (n * (n - 1.0))).sqrt()
    }

    /// The start of a chain, made again from its numbers. `None` only where the target breaks its contract and gives
    /// another answer the second time.
    pub fn replay<T: ChainTarget>(
        &self,
        target: &T,
        scene: &Scene,
        start: Start,
    ) -> Option<T::State> {
        let mut u = RandomStream::new(address(self.seed, start.sample));
        target.start(scene, &mut u, start.index)
    }
}

fn address(seed: u64, item: u64) -> Address {
    Address { seed, step: 0, item }
}

/// Draws `samples` bootstrap samples on the current rayon pool and picks the starts of `chains` chains. The same to the bit for any number of
/// threads; only candidates are kept, not their states.
///
/// Starts are drawn by strata of ΣW in the order of [`Candidate::key`], one for each chain (stratified resampling), and dealt
/// to the chains in a random rotation: each chain alone starts at X₀ ∝ W_i, together they miss no important part.
pub fn bootstrap<T: ChainTarget>(
    target: &T,
    scene: &Scene,
    seed: u64,
    samples: u64,
    chains: u64,
) -> Bootstrap {
    let boot = draw(target, scene, seed, samples, chains);
    mutant::swap(Mutant::IndependentB, boot, |boot| {
        let other = draw(target, scene, derive_seed(seed, 1), samples, chains);
        Bootstrap { sum: other.sum, sum2: other.sum2, ..boot }
    })
}

fn draw<T: ChainTarget>(
    target: &T,
    scene: &Scene,
    seed: u64,
    samples: u64,
    chains: u64,
) -> Bootstrap {
    // Numbers of their own, apart from those of the chains.
    let seed = derive_seed(seed, u64::MAX - 1);
    let batches: Vec<Batch> = (0..samples.div_ceil(BATCH))
        .into_par_iter()
        .map(|batch| {
            let before = driver::rays_on_this_thread();
            let mut done = Batch::default();
            let mut found = Candidates::default();
            for item in batch * BATCH..((batch + 1) * BATCH).min(samples) {
                found.clear();
                target.candidates(scene, &mut RandomStream::new(address(seed, item)), &mut found);
                let total = found.total();
                if total.is_finite() && total >= 0.0 {
                    done.sum += total;
                    done.sum2 += total * total;
                    done.candidates.extend(found.iter().map(|c| (item, *c)));
                } else {
                    done.nonfinite.push(address(seed, item));
                }
            }
            done.rays = driver::rays_on_this_thread() - before;
            done
        })
        .collect();
    let mut result = Bootstrap {
        samples,
        sum: 0.0,
        sum2: 0.0,
        nonfinite: (0, Vec::new()),
        starts: Vec::new(),
        rays: 0,
        seed,
    };
    let mut candidates = Vec::new();
    for batch in batches {
        result.sum += batch.sum;
        result.sum2 += batch.sum2;
        result.rays += batch.rays;
        result.nonfinite.0 += batch.nonfinite.len() as u64;
        let room = 16 - result.nonfinite.1.len();
        result.nonfinite.1.extend(batch.nonfinite.into_iter().take(room));
        candidates.extend(batch.candidates);
    }
    candidates.sort_unstable_by_key(|(item, c)| (c.key, *item, c.index));
    let sums = candidates.iter().scan(0.0, |sum, (_, c)| {
        *sum += c.weight;
        Some(*sum)
    });
    let cdf: Vec<f64> = sums.collect();
    let starts = starts(&cdf, seed, chains).into_iter().map(|i| &candidates[i]);
    result.starts = starts.map(|(sample, c)| Start { sample: *sample, index: c.index }).collect();
    result
}

/// What a parallel task hands over.
#[derive(Default)]
struct Batch {
    sum: f64,
    sum2: f64,
    /// With their samples.
    candidates: Vec<(u64, Candidate)>,
    nonfinite: Vec<Address>,
    rays: u64,
}

/// Indices drawn in proportion to the steps of a running sum.
fn starts(cdf: &[f64], seed: u64, chains: u64) -> Vec<usize> {
    let total = cdf.last().copied().unwrap_or(0.0);
    if !(total > 0.0) {
        return Vec::new();
    }
    let last = cdf.partition_point(|&c| c < total);
    let mut u = RandomStream::new(Address { seed, step: 1, item: 0 });
    // 48 bits: as fine as many samples of equal weight need.
    let mut number = || u.next() as f64 + u.next() as f64 / 16_777_216.0;
    let rotation = (number() * chains as f64) as u64;
    (0..chains)
        .map(|chain| {
            let stratum = (chain + rotation) % chains;
            let x = (stratum as f64 + number()) / chains as f64 * total;
            // The first whose running sum exceeds x: samples without weight are never it.
            cdf.partition_point(|&c| c <= x).min(last)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_chain_alone_starts_in_proportion_to_the_weights() {
        let cdf = [0.0, 1.0, 1.0, 4.0, 6.0];
        let mut counts = [[0.0; 5]; 3];
        let n = 30_000;
        for seed in 0..n {
            for (chain, &start) in starts(&cdf, seed, 3).iter().enumerate() {
                counts[chain][start] += 1.0;
            }
        }
        for counts in counts {
            for (count, w) in counts.iter().zip([0.0, 1.0, 0.0, 3.0, 2.0]) {
                let p = w / 6.0;
                let sd = (n as f64 * p * (1.0 - p)).sqrt();
                assert!((count - n as f64 * p).abs() <= 4.5 * sd, "{counts:?}");
            }
        }
    }

    #[test]
    fn strata_share_the_chains_out() {
        // A sample of half the weight starts half the chains, but for one at each border.
        let starts = starts(&[1.0, 3.0, 4.0], 7, 100);
        let middle = starts.iter().filter(|&&s| s == 1).count();
        assert!((49..=51).contains(&middle), "{middle}");
    }

    #[test]
    fn no_weight_no_start() {
        assert!(starts(&[], 1, 4).is_empty());
        assert!(starts(&[0.0, 0.0], 1, 4).is_empty());
    }
}
