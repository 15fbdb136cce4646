//! Energy redistribution path tracing (Cline, Talbot and Egbert 2005): samples of path tracing,
//! each spread over its neighbourhood by short chains.
//!
//! A sample of energy W = f*(x)/p(x) starts N chains of m mutations each; every mutation deposits
//! W/(N m). Because mutations leave f* invariant, E[W h(X_i)] = ∫ f* h after any number of them,
//! whatever N is: N may depend on W. It is W/(m c e) at random rounded up or down, so that all
//! deposits are about the same (§3.2, "equal deposition flow"), with e the mean energy by a pilot
//! and c chains for a sample of that energy.
//!
//! Independent samples reach everything, so that mutations need not be ergodic, and there is no
//! start-up or correlation between steps.

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::driver::{self, Work};
use pathspace_core::film::{Chunk, Families, Film, Sink};
use pathspace_core::integrator::{Integrator, IntegratorError, Run, State};
use pathspace_core::random::{Address, PrimarySample, RandomStream, derive_seed};

use crate::bdpt::Bdpt;
use crate::chain::{Chain, ChainTarget, bootstrap};
use crate::mlt::{PathChain, Seeds, Shares, Sizes, not_finite};
use crate::pt::PathTracer;
use crate::spec::{Defaults, Spec, SpecError};

/// Name in the registry.
pub const NAME: &str = "erpt";

/// Samples of the pilot that measures the mean energy.
const PILOT: u64 = 10_000;
/// Most chains of one sample: a sample brighter than that deposits more with each mutation.
const MAX_CHAINS: f64 = 4096.0;
/// Seeds whose deposits are kept together before the film takes them.
const SEEDS_PER_CHUNK: u64 = 8;

/// Energy redistribution path tracing.
#[derive(Clone, Debug)]
pub struct Erpt {
    /// How often each mutation is tried.
    pub shares: Shares,
    /// How far perturbations go.
    pub sizes: Sizes,
    /// Mutations of a chain, m.
    pub mutations: u64,
    /// Chains that a sample of mean energy starts on average, c.
    pub chains: f64,
    seeds: Seeds,
    spec: String,
}

impl Erpt {
    /// From options: `seeds` = pt | bdpt, `mutations` (of a chain), `chains` (of a sample of mean
    /// energy), `bidir`, `lens`, `caustic`, `multi` (shares), `step` and `area` (sizes of
    /// perturbations), `max_depth`, `rr_depth`.
    ///
    /// # Errors
    /// Where an option is unknown or its value out of range.
    pub fn from_spec(spec: &Spec, defaults: &Defaults) -> Result<Self, SpecError> {
        let mut options = spec.options();
        let shares = Shares::from_options(&mut options)?;
        let sizes = Sizes::from_options(&mut options)?;
        let by_bdpt = options.choice("seeds", &[("pt", false), ("bdpt", true)])?;
        let rules = options.walk_rules(defaults)?;
        let erpt = Erpt {
            shares,
            sizes,
            mutations: options.integer("mutations", 100, 1..=1 << 20)?,
            chains: options.number("chains", 1.0, 1e-3..=1e3)?,
            seeds: if by_bdpt {
                Seeds::Bdpt(Bdpt::for_starts(rules.max_length))
            } else {
                Seeds::Pt(PathTracer::for_starts(rules))
            },
            spec: spec.to_string(),
        };
        options.finish()?;
        Ok(erpt)
    }
}

impl Integrator for Erpt {
    fn name(&self) -> &str {
        NAME
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn families(&self, scene: &Scene) -> Families {
        self.seeds.families(scene)
    }

    fn resume(
        &self,
        scene: Arc<Scene>,
        seed: u64,
        state: &State,
    ) -> Result<Box<dyn Run>, IntegratorError> {
        let mutators = self.shares.mutators(&scene, &self.sizes, self.seeds.max_length());
        let target = PathChain::new(&scene, self.seeds.clone(), false, mutators);
        let (mutations, chains) = (self.mutations, self.chains);
        let step = state.step;
        Ok(Box::new(ErptRun { target, scene, seed, step, mutations, chains, energy: None }))
    }
}

/// A run. Between steps there is no state: each sample has chains of its own.
struct ErptRun {
    target: PathChain,
    scene: Arc<Scene>,
    seed: u64,
    step: u64,
    mutations: u64,
    chains: f64,
    /// Mean energy of a sample by the pilot, once it is known.
    energy: Option<f64>,
}

impl ErptRun {
    /// The mean energy of a sample: of the same pilot in every part of a run, so that a resumed run
    /// goes on to the bit.
    fn pilot(&self) -> (f64, u64) {
        let seed = derive_seed(self.seed, u64::MAX - 3);
        let pilot = bootstrap(&self.target, &self.scene, seed, PILOT, 0);
        // Nothing found: any positive number leaves the estimate unbiased.
        let b = pilot.b();
        (if b > 0.0 { b } else { 1.0 }, pilot.rays)
    }

    /// The sample of one item and its chains. `scale` converts what a seed deposits to what its
    /// mutations count as samples.
    fn redistribute(&self, energy: f64, scale: f64, u: &mut RandomStream, chunk: &mut Chunk) {
        let (target, scene) = (&self.target, &*self.scene);
        let start = target.bootstrap(scene, u);
        let round = f64::from(u.next());
        let Some((x, w)) = start else { return };
        if !w.is_finite() {
            chunk.add(not_finite(&x));
            return;
        }
        let wanted = self.chains * w / energy;
        let (chains, deposit) = if wanted > MAX_CHAINS {
            (MAX_CHAINS, w / MAX_CHAINS)
        } else {
            ((wanted + round).floor(), energy / self.chains)
        };
        let deposit = scale * deposit / self.mutations as f64;
        for _ in 0..chains as u64 {
            let mut chain = Chain::new(x.clone(), 0);
            for _ in 0..self.mutations {
                chain.mutate(target, scene, deposit, u, chunk);
            }
            chain.flush(target, scene, chunk);
        }
    }
}

impl Run for ErptRun {
    fn prepare(&mut self, _: &mut Film) -> Work {
        if self.energy.is_some() {
            return Work::default();
        }
        let (energy, rays) = self.pilot();
        self.energy = Some(energy);
        Work { rays, ..Work::default() }
    }

    fn step(&mut self, film: &mut Film) -> Work {
        let mut work = self.prepare(film);
        let Some(energy) = self.energy else { return work };
        // A seed counts as the mutations that it makes on average, so that a step has about one for
        // each pixel.
        let per_seed = (self.chains * self.mutations as f64).ceil().max(1.0) as u64;
        let seeds = (film.pixels() / per_seed).max(1);
        let run = &*self;
        let chunks = seeds.div_ceil(SEEDS_PER_CHUNK);
        work += driver::run_chunks(film, chunks, |index, chunk| {
            let items = index * SEEDS_PER_CHUNK..((index + 1) * SEEDS_PER_CHUNK).min(seeds);
            for item in items.clone() {
                let address = Address { seed: run.seed, step: run.step, item };
                chunk.begin(address);
                let mut u = RandomStream::new(address);
                run.redistribute(energy, per_seed as f64, &mut u, chunk);
            }
            (items.end - items.start) * per_seed
        });
        self.step += 1;
        work
    }

    fn save(&self) -> State {
        State { step: self.step, bytes: Vec::new() }
    }

    fn seek(&mut self, step: u64) -> bool {
        self.step = step;
        true
    }
}
