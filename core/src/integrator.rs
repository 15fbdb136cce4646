//! The open set: what an integrator is, and what a run of one can do.

use std::sync::Arc;

use crate::driver::{self, Work};
use crate::film::{Families, Film, RecordingSink, Sink};
use crate::random::{Address, PrimarySample, RandomStream};
use crate::scene::Scene;

/// Turns one point of primary sample space into contributions. With a random stream it is a Monte
/// Carlo integrator ([`MonteCarlo`]); with a mutated vector it is primary-sample-space Metropolis.
pub trait PathEstimator: Send + Sync + 'static {
    /// Emits the contributions of one sample. `pixel` is the pixel (of the whole film) that this
    /// sample belongs to, or `None` for a sample of the whole crop window; estimators that start at
    /// the emitters take no notice of it.
    fn estimate<U: PrimarySample, S: Sink>(
        &self,
        scene: &Scene,
        pixel: Option<[u32; 2]>,
        u: &mut U,
        sink: &mut S,
    );
}

/// A light transport algorithm with its options. Object safe: plug-ins implement it.
pub trait Integrator: Send + Sync {
    /// Short name: `pt`.
    fn name(&self) -> &str;

    /// Name with every option that differs from its default: `pt:nee=false`.
    fn spec(&self) -> String {
        self.name().to_owned()
    }

    /// Families of techniques that it uses on this scene: which paths it can see.
    fn families(&self, scene: &Scene) -> Families;

    /// Whether it renders scenes with participating media. Others are refused such a scene when
    /// they start, so that no image is silently wrong.
    fn sees_media(&self) -> bool {
        false
    }

    /// Begins a run: goes on from the state before the first step. Two runs with different seeds
    /// are independent replicates.
    ///
    /// # Errors
    /// Where the scene is not for this integrator (a radiosity solver and a mirror).
    fn start(&self, scene: Arc<Scene>, seed: u64) -> Result<Box<dyn Run>, IntegratorError> {
        if scene.has_media() && !self.sees_media() {
            let reason = "it has participating media, which this integrator can not do".to_owned();
            return Err(IntegratorError::Refused { integrator: self.name().to_owned(), reason });
        }
        self.resume(scene, seed, &State::default())
    }

    /// Goes on from a saved state, to the bit as if never interrupted.
    ///
    /// # Errors
    /// As [`Integrator::start`], and where the state is not of this integrator.
    fn resume(
        &self,
        scene: Arc<Scene>,
        seed: u64,
        state: &State,
    ) -> Result<Box<dyn Run>, IntegratorError>;
}

/// An integrator at work on one scene with one seed.
pub trait Run: Send {
    /// Does what the next step needs first, a bootstrap for instance. A step does it by itself;
    /// callers that plan how many steps fit into a time ask for it beforehand, to tell its time
    /// from that of a step.
    fn prepare(&mut self, _film: &mut Film) -> Work {
        Work::default()
    }

    /// About one sample (or mutation) per pixel. Runs on the current rayon pool; the film is the
    /// same to the bit for any number of threads.
    fn step(&mut self, film: &mut Film) -> Work;

    /// `count` steps, the same to the bit as one after the other. Steps that are made together need
    /// not wait for each other's last items.
    fn steps(&mut self, film: &mut Film, count: u64) -> Work {
        let mut work = Work::default();
        for _ in 0..count {
            work += self.step(film);
        }
        work
    }

    /// Everything besides the film that the next step depends on.
    fn save(&self) -> State;

    /// Figures about the run so far by name, for people: acceptance of mutations, normalisation and
    /// its standard error. Nothing depends on them.
    fn figures(&self) -> Vec<(String, f64)> {
        Vec::new()
    }

    /// Makes `step` the next step and says true, where a step depends on nothing but the seed and
    /// its number. Such a run can be shared out by steps, and its steps are independent of each
    /// other. A Markov chain says false and stays where it is: shards and replicates of it get
    /// seeds of their own.
    fn seek(&mut self, _step: u64) -> bool {
        false
    }

    /// The paths of one work item of a step, made as the step makes them: for whoever wants to look
    /// at a single path. `None` where a step is more than independent samples.
    fn replay(&self, _step: u64, _item: u64) -> Option<RecordingSink> {
        None
    }
}

/// Saved state of a [`Run`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct State {
    /// Steps done.
    pub step: u64,
    /// Whatever else the integrator needs, in its own encoding.
    pub bytes: Vec<u8>,
}

/// Why an integrator does not run on a scene.
#[derive(Debug, thiserror::Error, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum IntegratorError {
    /// The scene has something the integrator can not treat.
    #[error("{integrator} does not render this scene: {reason}")]
    Refused {
        /// The integrator.
        integrator: String,
        /// What is in the way.
        reason: String,
    },
    /// A saved state does not fit.
    #[error("the saved state is not one of {integrator}: {reason}")]
    BadState {
        /// The integrator.
        integrator: String,
        /// What is wrong.
        reason: String,
    },
}

/// Plain Monte Carlo over a [`PathEstimator`]: one sample per pixel and step.
pub struct MonteCarlo<E> {
    estimator: Arc<E>,
    scene: Arc<Scene>,
    seed: u64,
    step: u64,
}

impl<E: PathEstimator> MonteCarlo<E> {
    /// A run that starts at step `step`.
    pub fn new(estimator: Arc<E>, scene: Arc<Scene>, seed: u64, step: u64) -> Self {
        MonteCarlo { estimator, scene, seed, step }
    }
}

impl<E: PathEstimator> Run for MonteCarlo<E> {
    fn step(&mut self, film: &mut Film) -> Work {
        self.steps(film, 1)
    }

    fn steps(&mut self, film: &mut Film, count: u64) -> Work {
        let crop = film.description().crop;
        let items = film.pixels();
        let (estimator, scene) = (&*self.estimator, &*self.scene);
        let steps = self.step..self.step + count;
        let work = driver::run_steps(film, self.seed, steps, items, |item, u, chunk| {
            let (x, y) = (item % crop.width as u64, item / crop.width as u64);
            let pixel = [crop.x + x as u32, crop.y + y as u32];
            estimator.estimate(scene, Some(pixel), u, chunk);
        });
        self.step += count;
        work
    }

    fn save(&self) -> State {
        State { step: self.step, bytes: Vec::new() }
    }

    fn seek(&mut self, step: u64) -> bool {
        self.step = step;
        true
    }

    fn replay(&self, step: u64, item: u64) -> Option<RecordingSink> {
        let crop = self.scene.film().crop;
        let width = u64::from(crop.width);
        let pixel = [crop.x + (item % width) as u32, crop.y + (item / width) as u32];
        let mut sink = RecordingSink::default();
        let mut u = RandomStream::new(Address { seed: self.seed, step, item });
        self.estimator.estimate(&self.scene, Some(pixel), &mut u, &mut sink);
        Some(sink)
    }
}
