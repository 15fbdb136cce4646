//! Experiments: scenes × integrators × budgets × replicates.
//!
//! A replicate is a whole render with a seed of its own. Budgets have replicates of their own too:
//! the points of a curve are then independent, which its slope's interval relies on, another
//! renderer can take part that shows no image before it is done, and an interrupted experiment
//! loses one render at most. It costs twice the largest budget at 2^j, where one run observed on
//! its way would cost it once.
//!
//! The integrators take turns, replicate by replicate, in an order that is turned round every time,
//! so that a machine that slows down slows all alike.

mod cell;
mod config;
mod store;

use std::ops::ControlFlow;
use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::film::Families;
use pathspace_core::integrator::{Integrator, IntegratorError};
use pathspace_validation::pairs::{Observation, Tiles};
use thiserror::Error;

pub use cell::{Cell, replay};
pub use config::{ChangedScene, Config, ConfigError, Many, SceneConfig};
pub use store::{Key, Store, StoreError};

use crate::budget::Budget;
use crate::expose::expose;
use crate::peers::{Peer, PeerError, Request};
use crate::session::Status;

/// Why an experiment ended.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// An integrator does not render a scene.
    #[error("{scene}: {source}")]
    Integrator {
        /// The scene.
        scene: String,
        /// The reason.
        source: IntegratorError,
    },
    /// Cells cannot be kept.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Who takes part.
pub enum Contestant {
    /// One of our integrators, or a plug-in's.
    Own(Box<dyn Integrator>),
    /// Another renderer.
    Peer(Box<Peer>),
}

/// One scene with those who render it.
pub struct Setup {
    /// Name of the scene, unique in the experiment.
    pub name: String,
    /// Hash of its content.
    pub hash: String,
    /// The hash with what was changed of film, filter and depth: what cells and references go by.
    pub key: String,
    /// The scene.
    pub scene: Arc<Scene>,
    /// Name, unique among those of the scene, and integrator.
    pub contestants: Vec<(String, Contestant)>,
}

/// All that is to be rendered.
pub struct Plan {
    /// The scenes.
    pub setups: Vec<Setup>,
    /// Budgets, the smallest first.
    pub budgets: Vec<Budget>,
    /// Replicates of each integrator with each budget.
    pub replicates: u32,
    /// Seed from which the others are derived.
    pub seed: u64,
    /// Threads of the pool that it runs on.
    pub threads: usize,
    /// Who was left out on the way, with the reason: other renderers that failed, and, where a
    /// scene has others left, integrators that refuse it.
    pub failures: Vec<String>,
}

/// Where an experiment is.
#[derive(Clone, Debug, PartialEq)]
pub struct ExperimentStatus<'a> {
    /// The scene under way.
    pub scene: &'a str,
    /// The integrator under way.
    pub integrator: &'a str,
    /// Replicate under way, from 0.
    pub replicate: u32,
    /// Share of the whole experiment that is done.
    pub done: f64,
}

impl Contestant {
    /// Families of techniques that it uses on a scene.
    pub fn families(&self, scene: &Scene) -> Families {
        match self {
            Contestant::Own(integrator) => integrator.families(scene),
            Contestant::Peer(peer) => peer.families(),
        }
    }

    /// True for another renderer.
    pub fn is_external(&self) -> bool {
        matches!(self, Contestant::Peer(_))
    }
}

impl Setup {
    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        let crop = self.scene.film().crop;
        crop.width as usize * crop.height as usize
    }

    /// The grid of tiles.
    pub fn tiles(&self) -> Tiles {
        let crop = self.scene.film().crop;
        Tiles::new(crop.width as usize, crop.height as usize)
    }
}

impl Plan {
    /// The finished replicates of an integrator with a budget, in order; those that cannot be read
    /// are left out.
    pub fn cells(
        &self,
        store: &Store,
        setup: &Setup,
        integrator: &str,
        budget: Budget,
    ) -> Vec<Cell> {
        let words = budget.words();
        let key = |r| self.key(&setup.key, integrator, &words, r);
        (0..self.replicates).filter_map(|r| store.get(&key(r))).collect()
    }

    /// Renders every cell that the store does not have. `watch` is called after every step; where
    /// it says to stop, the render under way is dropped and the answer is `false`.
    ///
    /// # Errors
    /// Where an integrator does not render a scene, or cells cannot be kept.
    pub fn run(
        &mut self,
        store: &Store,
        watch: &mut dyn FnMut(&ExperimentStatus<'_>) -> ControlFlow<()>,
    ) -> Result<bool, ExperimentError> {
        let mut setups = std::mem::take(&mut self.setups);
        let mut failures = Vec::new();
        let done = self.run_all(&mut setups, store, &mut failures, watch);
        self.setups = setups;
        self.failures.append(&mut failures);
        done
    }

    fn run_all(
        &self,
        setups: &mut [Setup],
        store: &Store,
        failures: &mut Vec<String>,
        watch: &mut dyn FnMut(&ExperimentStatus<'_>) -> ControlFlow<()>,
    ) -> Result<bool, ExperimentError> {
        let methods: usize = setups.iter().map(|s| s.contestants.len()).sum();
        let each: f64 = self.budgets.iter().map(|b| b.amount()).sum();
        let total = each * f64::from(self.replicates) * methods as f64;
        let mut done = 0.0;
        for setup in setups {
            let mut failed = vec![false; setup.contestants.len()];
            for replicate in 0..self.replicates {
                for budget in &self.budgets {
                    for turn in 0..setup.contestants.len() {
                        let last = setup.contestants.len() - 1;
                        let method = if replicate % 2 == 1 { last - turn } else { turn };
                        let share = done;
                        done += budget.amount();
                        if failed[method] {
                            continue;
                        }
                        let status = |used: f64| (share + used * budget.amount()) / total;
                        match self.cell(
                            setup,
                            At { method, replicate, budget: *budget },
                            store,
                            &status,
                            watch,
                        )? {
                            Turn::Done => {}
                            Turn::Stopped => return Ok(false),
                            Turn::Failed(reason) => {
                                failed[method] = true;
                                failures.push(format!("{}: left out: {reason}", setup.name));
                            }
                        }
                    }
                }
            }
        }
        Ok(true)
    }

    /// Renders one cell where it is not there.
    fn cell(
        &self,
        setup: &mut Setup,
        at: At,
        store: &Store,
        share: &dyn Fn(f64) -> f64,
        watch: &mut dyn FnMut(&ExperimentStatus<'_>) -> ControlFlow<()>,
    ) -> Result<Turn, ExperimentError> {
        let At { method, replicate, budget } = at;
        let tiles = setup.tiles();
        let Setup { name: scene, key, scene: world, contestants, .. } = setup;
        let others = contestants.len() > 1;
        let (integrator, contestant) = &mut contestants[method];
        let words = budget.words();
        let key = self.key(key, integrator, &words, replicate);
        // One that is there but damaged is rendered again.
        if store.has(&key) && store.get(&key).is_some() {
            return Ok(Turn::Done);
        }
        let mut watch = |used: f64| {
            watch(&ExperimentStatus { scene, integrator, replicate, done: share(used) })
        };
        let job = Job { budget, replicate, seed: key.seed() };
        match self.render(contestant, world, &tiles, &job, &mut watch) {
            Ok(Some(cell)) => {
                store.put(&key, &cell)?;
                Ok(Turn::Done)
            }
            Ok(None) => Ok(Turn::Stopped),
            Err(RenderError::Integrator(source)) if others => Ok(Turn::Failed(source.to_string())),
            Err(RenderError::Integrator(source)) => {
                Err(ExperimentError::Integrator { scene: scene.clone(), source })
            }
            // It was stopped, or Ctrl-C came while it failed.
            Err(RenderError::Peer(_)) if watch(1.0).is_break() => Ok(Turn::Stopped),
            Err(RenderError::Peer(e)) => Ok(Turn::Failed(e.to_string())),
        }
    }

    fn key<'a>(
        &self,
        scene: &'a str,
        integrator: &'a str,
        budget: &'a str,
        replicate: u32,
    ) -> Key<'a> {
        let (seed, threads) = (self.seed, self.threads);
        Key { scene, integrator, budget, replicate, seed, threads }
    }

    /// One cell; `None` where it was stopped.
    fn render(
        &self,
        contestant: &mut Contestant,
        scene: &Arc<Scene>,
        tiles: &Tiles,
        job: &Job,
        watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Result<Option<Cell>, RenderError> {
        match contestant {
            Contestant::Own(integrator) => {
                let mut watch = |status: &Status| watch(status.used);
                let layers = Observation::LAYERS;
                let e = expose(&**integrator, scene, layers, job.seed, job.budget, &mut watch)?;
                Ok(e.complete.then(|| Cell::of(&e, job.seed, tiles)))
            }
            Contestant::Peer(peer) => {
                if watch(0.0).is_break() {
                    return Ok(None);
                }
                let request = Request {
                    seed: job.seed,
                    replicate: job.replicate,
                    budget: job.budget,
                    threads: self.threads,
                };
                let rendered = peer.render(&request, &mut || watch(0.0))?;
                let mut cell = Cell::of_image(rendered.image, peer.families(), job.seed, tiles);
                let answer = rendered.answer;
                (cell.seconds, cell.startup_seconds) = (answer.seconds, answer.startup_seconds);
                cell.cpu_seconds = answer.cpu_seconds.unwrap_or(f64::NAN);
                (cell.spp, cell.rays) = (answer.spp, answer.rays);
                Ok(Some(cell))
            }
        }
    }
}

/// Whose turn it is.
struct At {
    method: usize,
    replicate: u32,
    budget: Budget,
}

/// What one cell asks for.
struct Job {
    budget: Budget,
    replicate: u32,
    seed: u64,
}

/// How the turn of one ended.
enum Turn {
    Done,
    Stopped,
    Failed(String),
}

/// Why one cell is not there.
enum RenderError {
    Integrator(IntegratorError),
    Peer(PeerError),
}

impl From<IntegratorError> for RenderError {
    fn from(e: IntegratorError) -> Self {
        RenderError::Integrator(e)
    }
}

impl From<PeerError> for RenderError {
    fn from(e: PeerError) -> Self {
        RenderError::Peer(e)
    }
}
