//! Many chains on all threads.

use std::sync::{Arc, Mutex, PoisonError};

use pathspace_core::Scene;
use pathspace_core::color::Rgb;
use pathspace_core::driver::{self, Work};
use pathspace_core::film::{Chunk, Contribution, Families, Film, Sink};
use pathspace_core::integrator::{IntegratorError, Run, State};
use pathspace_core::random::{Address, RandomStream, derive_seed};

use super::bootstrap::bootstrap;
use super::{Chain, ChainTarget, Reader, Tally, Writer};
use crate::spec::{Options, SpecError};

/// Mutations of one chain that are kept in memory before the film takes them.
const ROUND: u64 = 8192;

/// First bytes of a checkpoint; changes with its layout.
const FORMAT: u32 = 0x4348_0002;

/// Options that every integrator with chains has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChainOptions {
    /// Number of chains.
    pub chains: u64,
    /// Number of bootstrap samples.
    pub bootstrap: u64,
    /// Let independent proposals refine b̂ after each step. The image is then consistent, not unbiased.
    pub refine: bool,
}

impl Default for ChainOptions {
    fn default() -> Self {
        ChainOptions { chains: 1024, bootstrap: 100_000, refine: false }
    }
}

impl ChainOptions {
    /// From options: `chains`, `bootstrap`, `refine`.
    ///
    /// # Errors
    /// [`SpecError::BadValue`].
    pub fn from_options(options: &mut Options<'_>) -> Result<Self, SpecError> {
        let default = ChainOptions::default();
        Ok(ChainOptions {
            chains: options.integer("chains", default.chains, 1..=1 << 20)?,
            bootstrap: options.integer("bootstrap", default.bootstrap, 1..=1 << 30)?,
            refine: options.boolean("refine", default.refine)?,
        })
    }
}

/// A run of many chains.
///
/// A step is one mutation per pixel in all. After n steps of M mutations chain c of C has done ⌊(nM + c)/C⌋ of them, so that chains share the
/// work to one mutation whatever M and C are. The numbers of chain c in step n come from (seed, n, c), c plus a
/// multiple of C where a step is so long that it is cut into rounds.
pub struct ChainRun<T: ChainTarget> {
    target: T,
    scene: Arc<Scene>,
    seed: u64,
    step: u64,
    options: ChainOptions,
    started: Option<Started<T::State>>,
    prepared: bool,
}

/// What the bootstrap leaves behind.
struct Started<S> {
    samples: u64,
    sum: f64,
    sum2: f64,
    chains: Vec<Mutex<Chain<S>>>,
}

impl<T: ChainTarget> ChainRun<T> {
    /// A run that goes on from `state`, or begins where that is the default. The bootstrap is made by the first step,
    /// or by [`Run::prepare`] before it.
    ///
    /// # Errors
    /// [`IntegratorError::BadState`] where the bytes are not a state of these chains.
    pub fn resume(
        name: &str,
        target: T,
        scene: Arc<Scene>,
        seed: u64,
        state: &State,
        options: ChainOptions,
    ) -> Result<Self, IntegratorError> {
        let mut run = ChainRun {
            target,
            scene,
            seed,
            step: state.step,
            options,
            started: None,
            prepared: false,
        };
        if *state != State::default() {
            let started = run.decode(&state.bytes).ok_or_else(|| IntegratorError::BadState {
                integrator: name.to_owned(),
                reason: "its bytes are not those of these chains".to_owned(),
            })?;
            run.started = Some(started);
        }
        Ok(run)
    }

    /// b̂ by which the next step is normalised, and its standard error; `None` before the first step.
    pub fn normalisation(&self) -> Option<(f64, f64)> {
        self.started.as_ref().map(|started| started.normalisation(self.options.refine))
    }

    /// Statistics of each kind of mutation over all chains.
    pub fn tallies(&self) -> Vec<(String, Tally)> {
        let mut sums = vec![Tally::default(); self.target.kinds().len()];
        for chain in self.started.iter().flat_map(|s| &s.chains) {
            for (sum, tally) in sums.iter_mut().zip(&lock(chain).tallies) {
                *sum += *tally;
            }
        }
        self.target.kinds().into_iter().zip(sums).collect()
    }

    /// The bootstrap; what was not finite goes to the film.
    fn begin(&self, film: &mut Film) -> (Started<T::State>, Work) {
        let ChainOptions { chains, bootstrap: samples, .. } = self.options;
        let scene = &*self.scene;
        let boot = bootstrap(&self.target, scene, self.seed, samples, chains);
        let mut chunk = Chunk::new(film.layers());
        for k in 0..boot.nonfinite.0 {
            let kept = boot.nonfinite.1.get(k as usize).or(boot.nonfinite.1.last());
            if let Some(address) = kept {
                chunk.begin(*address);
            }
            chunk.add(NOT_A_NUMBER);
        }
        film.apply(&chunk);
        let kinds = self.target.kinds().len();
        let chains = boot
            .starts
            .iter()
            .enumerate()
            .filter_map(|(c, &start)| {
                let mut state = boot.replay(&self.target, scene, start)?;
                self.target.place(&mut state, scene, c as u64, chains, self.seed);
                Some(Mutex::new(Chain::new(state, kinds).weighing(start.weight)))
            })
            .collect();
        let work = Work { samples: 0, rays: boot.rays };
        (Started { samples, sum: boot.sum, sum2: boot.sum2, chains }, work)
    }

    fn decode(&self, bytes: &[u8]) -> Option<Started<T::State>> {
        let kinds = self.target.kinds().len();
        let mut r = Reader::new(bytes);
        if r.u32()? != FORMAT || r.u64()? != self.options.chains || r.u64()? != kinds as u64 {
            return None;
        }
        let (samples, sum, sum2) = (r.u64()?, r.f64()?, r.f64()?);
        let count = r.len(1)?;
        if samples != self.options.bootstrap || !(count as u64 == self.options.chains || count == 0)
        {
            return None;
        }
        let mut chains = Vec::with_capacity(count);
        for _ in 0..count {
            let weight = r.f64()?;
            let independent = [r.f64()?, r.f64()?];
            let independent_count = r.u64()?;
            let mut tallies = Vec::with_capacity(kinds);
            for _ in 0..kinds {
                tallies.push(Tally { tried: r.u64()?, possible: r.u64()?, accepted: r.u64()? });
            }
            let state = self.target.decode(&self.scene, &mut r)?;
            let mut chain = Chain::new(state, kinds).weighing(weight);
            chain.tallies = tallies;
            chain.independent = independent;
            chain.independent_count = independent_count;
            chains.push(Mutex::new(chain));
        }
        r.is_empty().then_some(Started { samples, sum, sum2, chains })
    }
}

impl<S> Started<S> {
    /// b̂ and its standard error, from the bootstrap alone or with the independent proposals of all chains so far.
    fn normalisation(&self, refine: bool) -> (f64, f64) {
        let (mut n, mut sum, mut sum2) = (self.samples, self.sum, self.sum2);
        if refine {
            for chain in &self.chains {
                let chain = lock(chain);
                n += chain.independent_count;
                sum += chain.independent[0];
                sum2 += chain.independent[1];
            }
        }
        let n = n as f64;
        let variance = (sum2 - sum * sum / n).max(0.0) / (n * (n - 1.0));
        (sum / n, if n > 1.0 { variance.sqrt() } else { f64::INFINITY })
    }
}

impl<T: ChainTarget> Run for ChainRun<T> {
    fn prepare(&mut self, film: &mut Film) -> Work {
        if !self.prepared {
            self.target.prepare(&self.scene, derive_seed(self.seed, u64::MAX - 2));
            self.prepared = true;
        }
        if self.started.is_some() {
            return Work::default();
        }
        let (started, work) = self.begin(film);
        self.started = Some(started);
        work
    }

    fn step(&mut self, film: &mut Film) -> Work {
        let mut work = self.prepare(film);
        let mutations = film.pixels();
        let Some(started) = &self.started else { return work };
        let count = started.chains.len() as u64;
        if count == 0 {
            // Nothing emits what the bootstrap could find: black samples.
            film.add_samples(mutations);
            self.step += 1;
            return Work { samples: mutations, ..work };
        }
        let (b, _) = started.normalisation(self.options.refine);
        let done = |chain: u64, step: u64| {
            let total = u128::from(step) * u128::from(mutations) + u128::from(chain);
            (total / u128::from(count)) as u64
        };
        let most = mutations.div_ceil(count);
        let rounds = most.div_ceil(ROUND);
        let (target, scene) = (&self.target, &*self.scene);
        for round in 0..rounds {
            // A chain goes on only when all have ended the round: its order never depends on threads.
            work += driver::run_chunks(film, count, |c, chunk| {
                let all = done(c, self.step + 1) - done(c, self.step);
                let n = all.saturating_sub(round * ROUND).min(ROUND);
                let item = round * count + c;
                let address = Address { seed: self.seed, step: self.step, item };
                chunk.begin(address);
                let mut u = RandomStream::new(address);
                let mut chain = lock(&started.chains[c as usize]);
                for _ in 0..n {
                    chain.mutate(target, scene, b, &mut u, chunk);
                }
                chain.flush(target, scene, chunk);
                n
            });
        }
        self.step += 1;
        work
    }

    /// b̂, its relative standard error (an error of the brightness of the whole image, apart from that of its shape), and the share of each kind of
    /// mutation that was accepted; of a kind that never found a state, its share of all mutations.
    fn figures(&self) -> Vec<(String, f64)> {
        let Some((b, error)) = self.normalisation() else { return Vec::new() };
        let mut figures = vec![("b".to_owned(), b)];
        if b > 0.0 {
            figures.push(("relative standard error of b".to_owned(), error / b));
        }
        let tallies = self.tallies();
        let all: u64 = tallies.iter().map(|(_, tally)| tally.tried).sum();
        let tried = tallies.into_iter().filter(|(_, tally)| tally.tried > 0);
        figures.extend(tried.map(|(kind, t)| match t.possible {
            0 => (format!("in vain, {kind}"), t.tried as f64 / all as f64),
            _ => (format!("acceptance, {kind}"), t.acceptance()),
        }));
        figures
    }

    fn save(&self) -> State {
        let Some(started) = &self.started else {
            return State { step: self.step, bytes: Vec::new() };
        };
        let mut w = Writer::new();
        w.u32(FORMAT);
        w.u64(self.options.chains);
        w.u64(self.target.kinds().len() as u64);
        w.u64(started.samples);
        w.f64(started.sum);
        w.f64(started.sum2);
        w.len(started.chains.len());
        for chain in &started.chains {
            let chain = lock(chain);
            w.f64(chain.weight);
            w.f64(chain.independent[0]);
            w.f64(chain.independent[1]);
            w.u64(chain.independent_count);
            for tally in &chain.tallies {
                w.u64(tally.tried);
                w.u64(tally.possible);
                w.u64(tally.accepted);
            }
            self.target.encode(&chain.state, &mut w);
        }
        State { step: self.step, bytes: w.into_bytes() }
    }
}

/// Stands for a bootstrap weight that was not finite.
const NOT_A_NUMBER: Contribution = Contribution {
    film: glam::Vec2::ZERO,
    value: Rgb::grey(f32::NAN),
    weight: 1.0,
    s: 0,
    t: 1,
    emitter: 0,
    families: Families::NONE,
};

/// Locks although another thread panicked: that panic is passed on anyway.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
