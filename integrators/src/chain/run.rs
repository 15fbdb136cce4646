//! Rounds of many chains on all threads.

use std::sync::{Arc, Mutex, PoisonError};

use pathspace_core::Scene;
use pathspace_core::color::Rgb;
use pathspace_core::description::Crop;
use pathspace_core::driver::{self, Turns, Work};
use pathspace_core::film::{Chunk, Contribution, Families, Film, Sink};
use pathspace_core::integrator::{IntegratorError, Run, State};
use pathspace_core::random::{Address, RandomStream, derive_seed};
use rayon::prelude::*;

use super::bootstrap::bootstrap;
use super::rounds::{Round, Rounds};
use super::{Chain, ChainTarget, Reader, Tally, Writer};
use crate::spec::{Options, SpecError};

/// Mutations of one chain that are kept in memory before the film takes them.
const PORTION: u64 = 8192;

/// First bytes of a checkpoint; changes with its layout.
const FORMAT: u32 = 0x4348_0003;

/// Sets the seeds of rounds apart from others that follow from the run's.
const ROUND_SEEDS: u64 = u64::MAX - 4;

/// Options that every integrator with chains has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChainOptions {
    /// Number of chains; `None`: as many as the size of the round allows.
    pub chains: Option<u64>,
    /// Number of bootstrap samples of the first round; `None`: by the size of the film.
    pub bootstrap: Option<u64>,
    /// Rounds of growing size ([`Rounds`]). Else there is one without end, whose b̂ never gets
    /// better.
    pub rounds: bool,
}

impl Default for ChainOptions {
    fn default() -> Self {
        ChainOptions { chains: None, bootstrap: None, rounds: true }
    }
}

impl ChainOptions {
    /// From options: `chains`, `bootstrap`, `rounds` = grow | one.
    ///
    /// # Errors
    /// [`SpecError::BadValue`].
    pub fn from_options(options: &mut Options<'_>) -> Result<Self, SpecError> {
        Ok(ChainOptions {
            chains: options.optional_integer("chains", 1..=1 << 20)?,
            bootstrap: options.optional_integer("bootstrap", 1..=1 << 30)?,
            rounds: options.choice("rounds", &[("grow", true), ("one", false)])?,
        })
    }
}

/// A run of many chains.
///
/// A step is one mutation per pixel in all. After n steps of M mutations in a round chain c of C
/// has done ⌊(nM + c)/C⌋ of them, so that chains share the work to one mutation whatever M and C
/// are. The numbers of chain c in step n of the run come from (seed, n, c), c plus a multiple of C
/// where a step is so long that it is cut into portions.
pub struct ChainRun<T: ChainTarget> {
    target: T,
    scene: Arc<Scene>,
    seed: u64,
    step: u64,
    rounds: Rounds,
    past: Past,
    started: Option<Started<T::State>>,
    prepared: bool,
}

/// What the bootstrap of a round leaves behind.
struct Started<S> {
    round: Round,
    sum: f64,
    sum2: f64,
    chains: Vec<Mutex<Chain<S>>>,
}

/// How chains share the mutations of a step.
#[derive(Clone, Copy)]
struct Share {
    /// M.
    mutations: u64,
    /// C.
    chains: u64,
}

impl Share {
    /// Mutations of a chain in the first n steps, ⌊(nM + c)/C⌋.
    fn done(self, chain: u64, steps: u64) -> u64 {
        let total = u128::from(steps) * u128::from(self.mutations) + u128::from(chain);
        (total / u128::from(self.chains)) as u64
    }

    /// Mutations of a chain in step n.
    fn of(self, chain: u64, step: u64) -> u64 {
        self.done(chain, step + 1) - self.done(chain, step)
    }

    /// Parts that a step of a chain is cut into.
    fn portions(self) -> u64 {
        self.mutations.div_ceil(self.chains).div_ceil(PORTION)
    }

    /// Parts that a step is cut into; chains that have no mutation in it have no part.
    fn tasks(self) -> u64 {
        self.chains.min(self.mutations) * self.portions()
    }

    /// Chain and portion of a part of step n. Where there are more chains than mutations, those
    /// with nM + c ≥ C − M modulo C have one.
    fn task(self, step: u64, task: u64) -> (u64, u64) {
        let Share { mutations, chains } = self;
        if mutations >= chains {
            return (task % chains, task / chains);
        }
        let before = u128::from(step) * u128::from(mutations) % u128::from(chains);
        ((2 * chains - mutations - before as u64 + task) % chains, 0)
    }
}

/// What people are told of the rounds that have ended; nothing depends on it.
#[derive(Clone, Debug, Default, PartialEq)]
struct Past {
    /// Their steps, n_r in all.
    steps: u64,
    /// Σ n_r b̂_r.
    sum: f64,
    /// Σ n_r² times the squared standard error of b̂_r.
    variance: f64,
    /// By kind of mutation.
    tallies: Vec<Tally>,
}

impl<T: ChainTarget> ChainRun<T> {
    /// A run that goes on from `state`, or begins where that is the default. The bootstrap is made
    /// by the first step, or by [`Run::prepare`] before it.
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
        let Crop { width, height, .. } = scene.film().crop;
        let rounds = Rounds::new(&options, u64::from(width) * u64::from(height));
        let tallies = vec![Tally::default(); target.kinds().len()];
        let past = Past { tallies, ..Past::default() };
        let (seed, step) = (seed, state.step);
        let mut run =
            ChainRun { target, scene, seed, step, rounds, past, started: None, prepared: false };
        if *state != State::default() {
            let saved = run.decode(&state.bytes).ok_or_else(|| IntegratorError::BadState {
                integrator: name.to_owned(),
                reason: "its bytes are not those of these chains".to_owned(),
            })?;
            (run.past, run.started) = saved;
        }
        Ok(run)
    }

    /// The mean of b̂ over all rounds, each weighing as much as in the film, and its standard
    /// error; `None` before the first step.
    pub fn normalisation(&self) -> Option<(f64, f64)> {
        let Past { steps, mut sum, mut variance, .. } = self.past;
        let mut n = steps as f64;
        if let Some(started) = &self.started {
            let (b, error) = started.normalisation();
            let own = (self.step - started.round.begin) as f64;
            if n + own == 0.0 {
                return Some((b, error));
            }
            n += own;
            sum += own * b;
            variance += (own * error).powi(2);
        }
        (n > 0.0).then(|| (sum / n, variance.sqrt() / n))
    }

    /// Statistics of each kind of mutation over all chains so far.
    pub fn tallies(&self) -> Vec<(String, Tally)> {
        let mut sums = self.past.tallies.clone();
        if let Some(started) = &self.started {
            started.add_tallies(&mut sums);
        }
        self.target.kinds().into_iter().zip(sums).collect()
    }

    /// The bootstrap of a round; what was not finite goes to the film.
    fn begin(&self, round: Round, film: &mut Film) -> (Started<T::State>, Work) {
        let scene = &*self.scene;
        let seed = derive_seed(derive_seed(self.seed, ROUND_SEEDS), round.index);
        let boot = bootstrap(&self.target, scene, seed, round.samples, round.chains);
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
        let starts: Vec<(Option<Chain<T::State>>, u64)> = boot
            .starts
            .par_iter()
            .enumerate()
            .map(|(c, &start)| {
                let before = driver::rays_on_this_thread();
                let chain = boot.replay(&self.target, scene, start).map(|mut state| {
                    self.target.place(&mut state, scene, c as u64, round.chains, seed);
                    Chain::new(state, kinds).weighing(start.weight)
                });
                (chain, driver::rays_on_this_thread() - before)
            })
            .collect();
        let rays = boot.rays + starts.iter().map(|(_, rays)| rays).sum::<u64>();
        let chains = starts.into_iter().filter_map(|(chain, _)| chain.map(Mutex::new)).collect();
        (Started { round, sum: boot.sum, sum2: boot.sum2, chains }, Work { samples: 0, rays })
    }

    fn decode(&self, bytes: &[u8]) -> Option<(Past, Option<Started<T::State>>)> {
        let kinds = self.target.kinds().len();
        let mut r = Reader::new(bytes);
        let round = self.rounds.at(self.step);
        if r.u32()? != FORMAT || r.u64()? != kinds as u64 {
            return None;
        }
        let (steps, sum, variance) = (r.u64()?, r.f64()?, r.f64()?);
        let past = Past { steps, sum, variance, tallies: tallies(kinds, &mut r)? };
        // Other options make other rounds.
        let asked = (r.u64()?, r.u64()?);
        if past.steps != round.begin || asked != (round.samples, round.chains) {
            return None;
        }
        if r.u8()? == 0 {
            return (r.is_empty() && self.step == round.begin).then_some((past, None));
        }
        let (sum, sum2) = (r.f64()?, r.f64()?);
        let count = r.len(1)?;
        if !(count as u64 == round.chains || count == 0) {
            return None;
        }
        let mut chains = Vec::with_capacity(count);
        for _ in 0..count {
            let weight = r.f64()?;
            let tallies = tallies(kinds, &mut r)?;
            let state = self.target.decode(&self.scene, &mut r)?;
            let mut chain = Chain::new(state, kinds).weighing(weight);
            chain.tallies = tallies;
            chains.push(Mutex::new(chain));
        }
        r.is_empty().then_some((past, Some(Started { round, sum, sum2, chains })))
    }

    /// So many steps of the round under way.
    fn mutate(&self, started: &Started<T::State>, film: &mut Film, steps: u64) -> Work {
        let mutations = film.pixels();
        let count = started.chains.len() as u64;
        if count == 0 {
            // Nothing emits what the bootstrap could find: black samples.
            film.add_samples(steps * mutations);
            return Work { samples: steps * mutations, rays: 0 };
        }
        let (b, _) = started.normalisation();
        let share = Share { mutations, chains: count };
        let first = self.step - started.round.begin;
        let (portions, tasks) = (share.portions(), share.tasks());
        let turns = Turns::new(started.chains.len());
        let (target, scene) = (&self.target, &*self.scene);
        driver::run_chunks(film, steps * tasks, |index, chunk| {
            let (step, task) = (first + index / tasks, index % tasks);
            let (chain, portion) = share.task(step, task);
            let n = share.of(chain, step).saturating_sub(portion * PORTION).min(PORTION);
            // Every step has all portions of a chain, or one mutation of some of the chains.
            let turn = match mutations < count {
                true => share.done(chain, step) - share.done(chain, first),
                false => (step - first) * portions + portion,
            };
            let item = portion * count + chain;
            let address = Address { seed: self.seed, step: started.round.begin + step, item };
            chunk.begin(address);
            let one = &started.chains[chain as usize];
            let done = turns.take(chain as usize, turn, one, |chain| {
                let mut u = RandomStream::new(address);
                for _ in 0..n {
                    chain.mutate(target, scene, b, &mut u, chunk);
                }
                chain.flush(target, scene, chunk);
                n
            });
            done.unwrap_or(0)
        })
    }

    /// Rounds that have begun.
    fn begun(&self) -> u64 {
        let round = self.rounds.at(self.step);
        round.index + u64::from(self.started.is_some())
    }

    /// Ends the round under way where its steps are done.
    fn end(&mut self) {
        let over = |started: &mut Started<T::State>| self.step >= started.round.end;
        let Some(started) = self.started.take_if(over) else { return };
        let (b, error) = started.normalisation();
        let steps = started.round.end - started.round.begin;
        self.past.steps += steps;
        self.past.sum += steps as f64 * b;
        self.past.variance += (steps as f64 * error).powi(2);
        started.add_tallies(&mut self.past.tallies);
    }
}

/// As many tallies as there are kinds.
fn tallies(kinds: usize, r: &mut Reader<'_>) -> Option<Vec<Tally>> {
    let mut one = || Some(Tally { tried: r.u64()?, possible: r.u64()?, accepted: r.u64()? });
    (0..kinds).map(|_| one()).collect()
}

fn write_tallies(tallies: &[Tally], w: &mut Writer) {
    for tally in tallies {
        w.u64(tally.tried);
        w.u64(tally.possible);
        w.u64(tally.accepted);
    }
}

impl<S> Started<S> {
    /// b̂ and its standard error.
    fn normalisation(&self) -> (f64, f64) {
        let n = self.round.samples as f64;
        let variance = (self.sum2 - self.sum * self.sum / n).max(0.0) / (n * (n - 1.0));
        (self.sum / n, if n > 1.0 { variance.sqrt() } else { f64::INFINITY })
    }

    fn add_tallies(&self, sums: &mut [Tally]) {
        for chain in &self.chains {
            for (sum, tally) in sums.iter_mut().zip(&lock(chain).tallies) {
                *sum += *tally;
            }
        }
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
        let (started, work) = self.begin(self.rounds.at(self.step), film);
        self.started = Some(started);
        work
    }

    fn step(&mut self, film: &mut Film) -> Work {
        self.steps(film, 1)
    }

    fn steps(&mut self, film: &mut Film, count: u64) -> Work {
        let mut work = Work::default();
        let end = self.step + count;
        while self.step < end {
            work += self.prepare(film);
            let Some(started) = &self.started else { break };
            let steps = end.min(started.round.end) - self.step;
            work += self.mutate(started, film, steps);
            self.step += steps;
            self.end();
        }
        work
    }

    /// b̂, its relative standard error (an error of the brightness of the whole image, apart from
    /// that of its shape), and the share of each kind of mutation that was accepted; of a kind that
    /// never found a state, its share of all mutations.
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
        figures.push(("rounds begun".to_owned(), self.begun() as f64));
        figures
    }

    fn save(&self) -> State {
        let mut w = Writer::new();
        if self.step == 0 && self.started.is_none() {
            return State::default();
        }
        w.u32(FORMAT);
        w.u64(self.past.tallies.len() as u64);
        w.u64(self.past.steps);
        w.f64(self.past.sum);
        w.f64(self.past.variance);
        write_tallies(&self.past.tallies, &mut w);
        let round = self.rounds.at(self.step);
        w.u64(round.samples);
        w.u64(round.chains);
        w.u8(u8::from(self.started.is_some()));
        if let Some(started) = &self.started {
            w.f64(started.sum);
            w.f64(started.sum2);
            w.len(started.chains.len());
            for chain in &started.chains {
                let chain = lock(chain);
                w.f64(chain.weight);
                write_tallies(&chain.tallies, &mut w);
                self.target.encode(&chain.state, &mut w);
            }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_steps_are_all_mutations_of_all_chains() {
        for (mutations, chains) in [(1, 1), (1, 7), (20, 7), (20, 20), (20, 33), (30_000, 3)] {
            let share = Share { mutations, chains };
            let mut made = vec![0; chains as usize];
            for step in 0..40 {
                let mut all = 0;
                for task in 0..share.tasks() {
                    let (chain, portion) = share.task(step, task);
                    let n = share.of(chain, step).saturating_sub(portion * PORTION).min(PORTION);
                    assert!(n > 0 || mutations > PORTION, "{mutations} {chains}");
                    made[chain as usize] += n;
                    all += n;
                }
                assert_eq!(all, mutations);
                for (chain, made) in made.iter().enumerate() {
                    assert_eq!(*made, share.done(chain as u64, step + 1));
                }
            }
        }
    }
}
