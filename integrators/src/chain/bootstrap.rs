//! The bootstrap: b̂ and the starts of the chains.

use pathspace_core::Scene;
use pathspace_core::driver;
use pathspace_core::random::{Address, RandomStream, derive_seed};
use rayon::prelude::*;

use super::deal::{Deal, deal};
use super::{Candidate, Candidates, ChainTarget};

/// Bootstrap samples in a parallel task.
const BATCH: u64 = 256;

/// Where a chain starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// The bootstrap sample.
    pub sample: u64,
    /// Its [`Candidate::index`].
    pub index: u32,
    /// Weight of the chain: it is normalised by b̂ times this. All of them together weigh as much
    /// as there are chains.
    pub weight: f64,
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

    /// The start of a chain, made again from its numbers. `None` only where the target breaks its
    /// contract and gives another answer the second time.
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

/// Draws `samples` bootstrap samples on the current rayon pool and picks the starts of `chains`
/// chains. The same to the bit for any number of threads; only candidates are kept, not their
/// states.
///
/// Each [group](Candidate::key) of candidates has chains of its own, weighted to its share of ΣW;
/// within a group starts are drawn by strata of W in the order of the keys, one for each chain
/// (stratified resampling). For each chain alone E w h(X₀) = Σ W_i h(x_i)/ΣW_i; together they miss
/// no important part.
pub fn bootstrap<T: ChainTarget>(
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
    candidates.par_sort_unstable_by_key(|(item, c)| (c.key, *item, c.index));
    let (items, candidates): (Vec<u64>, Vec<Candidate>) = candidates.into_iter().unzip();
    let start = |one: Deal| Start {
        sample: items[one.candidate],
        index: candidates[one.candidate].index,
        weight: one.weight,
    };
    result.starts = deal(&candidates, seed, chains).into_iter().map(start).collect();
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
