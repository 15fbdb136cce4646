//! The driver of Markov chains (Metropolis et al. 1953; Hastings 1970; Veach and Guibas 1997),
//! shared by all Metropolis integrators.
//!
//! A chain's states x are samples of some space with a target density f*/b, b = ∫f*. N bootstrap
//! samples x_i ~ p with W_i = f*(x_i)/p(x_i) give b̂ = ΣW_i/N; chains start at X₀ ∝ W_i. Then E[b̂
//! h(X_n)] = ∫ f* h for every n and every N ≥ 1 (Veach 1997, §11.3.1), so that a mutation that
//! emits b̂ f_j(x)/f*(x) estimates I_j without bias. Nothing is ever rescaled afterwards. Starts of
//! one path length have chains of their own, as many as their share of b̂ rounded to at least one,
//! and weights that make the share exact. A run is cut into independent rounds of growing size,
//! each with a bootstrap and chains of its own, so that the error of b̂ falls with the rest.
//!
//! | step | file |
//! | --- | --- |
//! | what an integrator says of its chain: [`ChainTarget`], [`Proposal`] | here |
//! | one mutation: acceptance, rejected states, expected values | `markov` |
//! | bootstrap | `bootstrap` |
//! | what one bootstrap sample offers | `candidates` |
//! | starts, and the weights of chains | `deal` |
//! | how a run is cut into rounds | [`rounds`] |
//! | steps on all threads, checkpoints | `run` |
//! | bytes of checkpoints | `codec` |
//! | two-stage targets | `image` |

mod bootstrap;
mod candidates;
mod codec;
mod deal;
mod image;
mod markov;
pub mod rounds;
mod run;

pub use bootstrap::{Bootstrap, Start, bootstrap};
pub use candidates::{Candidate, Candidates, film_key};
pub use codec::{Reader, Writer};
pub use image::ImageWeight;
pub use markov::{Chain, Tally};
pub use run::{ChainOptions, ChainRun};

use pathspace_core::Scene;
use pathspace_core::film::{Contribution, Sink};
use pathspace_core::random::RandomStream;

/// A Markov chain with its target f*/b on some state space.
///
/// The scalar f* must be positive wherever a channel of f_j is: luminance (or luminance over a
/// positive function of the film position) is.
pub trait ChainTarget: Send + Sync + 'static {
    /// A state and whatever belongs to it: contributions, buffers.
    type State: Clone + Send;

    /// Names of the mutations, in the order of [`Proposal::kind`]; for statistics.
    fn kinds(&self) -> Vec<String>;

    /// Called once before the bootstrap, and again when a run is resumed: the place to measure what
    /// the target depends on (a pilot image, probabilities of mutations). Everything must follow
    /// from `seed` alone, apart from the numbers of the bootstrap and the chains.
    fn prepare(&mut self, _scene: &Scene, _seed: u64) {}

    /// One bootstrap sample: a state x and W = f*(x)/p(x); `None` where W = 0. All its randomness
    /// is `u`: called again with the same numbers it gives the same state. A W that is not finite
    /// is counted as a non-finite contribution and starts no chain.
    fn bootstrap(&self, scene: &Scene, u: &mut RandomStream) -> Option<(Self::State, f64)>;

    /// What a run's bootstrap draws: [`ChainTarget::bootstrap`], or, where a sample has several
    /// states to offer, any number of x_i with E Σ_i W_i h(x_i) = ∫ f* h. Chains start at one of
    /// the candidates of all samples, and b̂ is the mean of Σ_i W_i.
    fn candidates(&self, scene: &Scene, u: &mut RandomStream, found: &mut Candidates) {
        if let Some((_, weight)) = self.bootstrap(scene, u) {
            found.add(Candidate { weight, key: 0, index: 0 });
        }
    }

    /// A candidate's state, made again from the numbers of its sample.
    fn start(&self, scene: &Scene, u: &mut RandomStream, _index: u32) -> Option<Self::State> {
        self.bootstrap(scene, u).map(|(x, _)| x)
    }

    /// Told once to every start: chain number `chain` of `chains` in the run of `seed`, for
    /// stratification across chains.
    fn place(&self, _x: &mut Self::State, _scene: &Scene, _chain: u64, _chains: u64, _seed: u64) {}

    /// Proposes a move from `x` and judges it; does not move. The driver draws the number that
    /// decides.
    ///
    /// `x` may lend buffers to the proposal; [`ChainTarget::recycle`] brings them back.
    fn propose(
        &self,
        scene: &Scene,
        x: &mut Self::State,
        u: &mut RandomStream,
    ) -> Proposal<Self::State>;

    /// Takes a state that is no longer needed (a rejected proposal, or the state left behind) for
    /// its buffers.
    fn recycle(&self, _x: &mut Self::State, _unused: Self::State) {}

    /// Emits `weight`·f_j(x)/f*(x) for every contribution j of x.
    fn splat<S: Sink>(&self, scene: &Scene, x: &Self::State, weight: f64, sink: &mut S);

    /// Writes the whole state, to the bit.
    fn encode(&self, x: &Self::State, out: &mut Writer);

    /// Reads what [`ChainTarget::encode`] wrote; `None` where the bytes are no state.
    fn decode(&self, scene: &Scene, bytes: &mut Reader<'_>) -> Option<Self::State>;
}

/// A proposed move from the current state x to y.
///
/// A mutation is one sample of the film. It adds b̂·`weight_current` to x and
/// b̂·`weight_proposed` + `weight_independent` to y.
#[derive(Clone, Debug)]
pub struct Proposal<S> {
    /// y; `None` where f*(y) = 0 or no move was found.
    pub state: Option<S>,
    /// a(x→y) = min(1, f*(y) T(y→x) / (f*(x) T(x→y))); 0 without a state.
    pub acceptance: f64,
    /// Weight of x: 1 − a for expected values (Veach 1997, §11.5), 1 without a state.
    pub weight_current: f64,
    /// Weight of y: a for expected values.
    pub weight_proposed: f64,
    /// Weight of y as a sample that does not depend on the chain, in units of f*: f*(y)/p(y) times
    /// its share (Kelemen et al. 2002, §5), not multiplied by b̂. 0 for moves that depend on x.
    pub weight_independent: f64,
    /// Index of the mutation in [`ChainTarget::kinds`].
    pub kind: u8,
    /// The contribution that was not finite, if that is why there is no state: counted and
    /// reported, never part of a chain.
    pub nonfinite: Option<Contribution>,
}

impl<S> Proposal<S> {
    /// The move to `state` with acceptance a, at most 1, and the weights of expected values, 1 − a
    /// and a. An acceptance that is not a number (0·∞ where ratios leave the range) counts as 0:
    /// `f64::clamp` would hand it on into every weight.
    pub fn new(state: S, acceptance: f64, kind: u8) -> Self {
        let a = if acceptance > 0.0 { acceptance.min(1.0) } else { 0.0 };
        Proposal {
            state: Some(state),
            acceptance: a,
            weight_current: 1.0 - a,
            weight_proposed: a,
            ..Proposal::rejected(kind)
        }
    }

    /// No move: all weight stays with the current state.
    pub fn rejected(kind: u8) -> Self {
        Proposal {
            state: None,
            acceptance: 0.0,
            weight_current: 1.0,
            weight_proposed: 0.0,
            weight_independent: 0.0,
            kind,
            nonfinite: None,
        }
    }
}
