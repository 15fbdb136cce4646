//! Are Markov chains right? (L4) Tests of one chain target, each mutation alone, that need no exact
//! answer.
//!
//! Bootstrap samples x_i ~ p with weights W_i = f*/p stand for the target f*/b: every expectation
//! under the target is one of W times something under p, without any chain having to mix.
//!
//! | test | what must hold | file |
//! | --- | --- | --- |
//! | one-step invariance | E W(x) φ(h(X₁) − h(x)) = 0 for every h and odd φ | [`invariance`] |
//! | Bowker's symmetry | E W 1{x ∈ A, X₁ ∈ B} = E W 1{x ∈ B, X₁ ∈ A} | [`symmetry`] |
//! | rank test | the rank of h(x) among L steps of the chain before and after it is uniform | [`rank`] |
//! | normalisation | E b̂ h(X_n) = ∫ f* h with four bootstrap samples | [`unbiased`] |
//! | rounds | the brightness of one round says nothing of the next one's | [`independent_rounds`] |

mod invariance;
mod rank;
mod rounds;
mod standard;
mod symmetry;
mod unbiased;

pub use invariance::invariance;
pub use rank::rank;
pub use rounds::independent_rounds;
pub use standard::{ChecksError, SELECTOR, SENSOR, chain_checks, path, primary, round_checks};
pub use symmetry::symmetry;
pub use unbiased::unbiased;

use pathspace_core::Scene;
use pathspace_core::color::luminance;
use pathspace_core::film::{Contribution, Sink};
use pathspace_core::random::{Address, RandomStream, derive_seed};
use pathspace_integrators::chain::{Chain, ChainTarget};
use rayon::prelude::*;

use crate::stats::{chi_squared_sf, normal_sf};

/// One test of one mutation.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainCheck {
    /// Integrator and mutation.
    pub mutator: String,
    /// What was tested.
    pub test: String,
    /// Standard normal under the null hypothesis; for χ² tests (χ² − df)/√(2 df), for reading only.
    pub z: f64,
    /// Probability of something as extreme where all is right.
    pub p: f64,
}

impl ChainCheck {
    fn normal(mutator: String, test: String, z: f64) -> Self {
        ChainCheck { mutator, test, z, p: 2.0 * normal_sf(z.abs()) }
    }

    fn chi_squared(mutator: String, test: String, chi2: f64, df: f64) -> Self {
        let z = (chi2 - df) / (2.0 * df).sqrt();
        ChainCheck { mutator, test, z, p: chi_squared_sf(chi2, df) }
    }
}

/// Functions of a state that tests look at.
#[derive(Clone, Copy, Debug, Default)]
pub struct Features {
    /// Mean film position in units of the film.
    pub film: [f64; 2],
    /// Mean path length.
    pub length: f64,
    /// Mean number of emitter-side vertices.
    pub s: f64,
    /// What the caller adds: ln f*, a coordinate.
    pub own: [f64; 2],
}

/// Names of [`Features::list`].
pub const FEATURES: [&str; 6] = ["film x", "film y", "length", "s", "own 0", "own 1"];

impl Features {
    /// All of them.
    pub fn list(&self) -> [f64; 6] {
        [self.film[0], self.film[1], self.length, self.s, self.own[0], self.own[1]]
    }

    /// Of a state, by what it splats; means are weighted by luminance. `own` adds two functions.
    pub fn of<T: ChainTarget>(
        target: &T,
        scene: &Scene,
        x: &T::State,
        own: &impl Fn(&T::State) -> [f64; 2],
    ) -> Self {
        let mut sums = Sums { features: Features::default(), weight: 0.0 };
        target.splat(scene, x, 1.0, &mut sums);
        let crop = scene.film().crop;
        let Features { film, length, s, .. } = sums.features;
        let k = if sums.weight > 0.0 { 1.0 / sums.weight } else { 0.0 };
        let relative =
            |v: f64, origin: u32, size: u32| (v * k - f64::from(origin)) / f64::from(size);
        Features {
            film: [relative(film[0], crop.x, crop.width), relative(film[1], crop.y, crop.height)],
            length: length * k,
            s: s * k,
            own: own(x),
        }
    }
}

struct Sums {
    features: Features,
    weight: f64,
}

impl Sink for Sums {
    fn add(&mut self, c: Contribution) {
        let w = luminance(&c.value.to_array().map(f64::from));
        let f = &mut self.features;
        f.film[0] += w * c.film.x as f64;
        f.film[1] += w * c.film.y as f64;
        f.length += w * f64::from(c.length());
        f.s += w * f64::from(c.s);
        self.weight += w;
    }
}

/// Takes what nobody looks at.
struct Nowhere;

impl Sink for Nowhere {
    fn add(&mut self, _: Contribution) {}
}

/// Numbers of start `item` of a test.
fn stream(seed: u64, item: u64) -> RandomStream {
    RandomStream::new(Address { seed, step: 0, item })
}

/// One mutation of a chain by production code; the kind of the mutation and whether it moved.
fn step<T: ChainTarget>(
    target: &T,
    scene: &Scene,
    chain: &mut Chain<T::State>,
    u: &mut RandomStream,
) -> (usize, bool) {
    let before: Vec<u64> = chain.tallies.iter().map(|t| t.tried).collect();
    let moved = chain.mutate(target, scene, 1.0, u, &mut Nowhere);
    let kind = chain.tallies.iter().zip(before).position(|(t, n)| t.tried > n);
    (kind.unwrap_or(0), moved)
}

/// Runs `f` on every bootstrap sample with W > 0, in order, on the current pool.
fn starts<T: ChainTarget, R: Send>(
    target: &T,
    scene: &Scene,
    seed: u64,
    count: u64,
    f: impl Fn(T::State, f64, &mut RandomStream) -> R + Sync,
) -> Vec<R> {
    let seed = derive_seed(seed, 17);
    (0..count)
        .into_par_iter()
        .filter_map(|item| {
            let mut u = stream(seed, item);
            let (x, w) = target.bootstrap(scene, &mut u)?;
            w.is_finite().then(|| f(x, w, &mut stream(derive_seed(seed, 1), item)))
        })
        .collect()
}
