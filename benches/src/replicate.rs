//! Replicates: whole renders with seeds of their own, several integrators in turn.

use std::ops::ControlFlow;
use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::film::{Families, Film, LayerKey, NonFinite};
use pathspace_core::integrator::{Integrator, IntegratorError};
use pathspace_core::random::derive_seed;
use pathspace_validation::pairs::{Arm as ObservedArm, Observation, Tiles, unique_name};

use crate::budget::{Budget, Status, expose};
use crate::clock::Spent;
use crate::moments::ImageMoments;

/// What is rendered, by whom, for how long and how often.
pub struct Experiment<'a> {
    /// The scene.
    pub scene: Arc<Scene>,
    /// The integrators.
    pub integrators: &'a [Box<dyn Integrator>],
    /// Budget of one replicate.
    pub budget: Budget,
    /// Replicates of each integrator.
    pub replicates: u32,
    /// Seed from which those of the replicates are derived.
    pub seed: u64,
}

/// Where an experiment is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExperimentStatus {
    /// Replicate under way, from 0.
    pub replicate: u32,
    /// Index of the integrator under way.
    pub integrator: usize,
    /// Share of the whole experiment that is done.
    pub done: f64,
    /// The run under way.
    pub run: Status,
}

/// What one replicate of one integrator cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Replicate {
    /// Its seed.
    pub seed: u64,
    /// Steps done.
    pub steps: u64,
    /// Samples per pixel done.
    pub samples_per_pixel: f64,
    /// Time spent on rendering.
    pub spent: Spent,
    /// Rays traced.
    pub rays: u64,
    /// Contributions that were not finite.
    pub nonfinite: u64,
}

/// The replicates of one integrator.
pub struct Arm {
    /// Name, families, and what each replicate saw; the name has `#2`, `#3`, … where the same spec is there more than once.
    pub observed: ObservedArm,
    /// Replicate after replicate.
    pub replicates: Vec<Replicate>,
    /// The first contributions that were not finite.
    pub nonfinite_examples: Vec<NonFinite>,
    /// Moments of all that it sees.
    pub whole: ImageMoments,
    /// For every arm: moments of what both see.
    pub common: Vec<ImageMoments>,
}

/// What an experiment gave.
pub struct Replicates {
    /// The arms in the order of the integrators.
    pub arms: Vec<Arm>,
    /// The grid of tiles.
    pub tiles: Tiles,
    /// False where it was stopped early.
    pub complete: bool,
}

/// Renders every replicate of every integrator: replicate by replicate, with the order of the integrators turned round every
/// time, so that a machine that slows down slows all alike.
///
/// The seed of replicate r of integrator a is derived from (seed, a, r). `watch` is called after every step;
/// where it says to stop, the replicate under way is dropped.
///
/// # Errors
/// Where an integrator does not render the scene.
pub fn run(
    experiment: &Experiment<'_>,
    watch: &mut dyn FnMut(&ExperimentStatus) -> ControlFlow<()>,
) -> Result<Replicates, IntegratorError> {
    let Experiment { scene, integrators, budget, replicates, seed } = experiment;
    let film = scene.film().crop;
    let pixels = film.width as usize * film.height as usize;
    let tiles = Tiles::new(film.width as usize, film.height as usize);
    let mut arms: Vec<Arm> = Vec::new();
    for integrator in *integrators {
        let name = unique_name(integrator.spec(), |n| arms.iter().any(|a| a.name() == n));
        arms.push(Arm {
            observed: ObservedArm::new(name, integrator.families(scene)),
            replicates: Vec::new(),
            nonfinite_examples: Vec::new(),
            whole: ImageMoments::new(pixels),
            common: vec![ImageMoments::new(pixels); integrators.len()],
        });
    }
    let all_families: Vec<Families> = arms.iter().map(|a| a.observed.families).collect();
    let total = f64::from(*replicates) * integrators.len() as f64;
    let mut done = 0.0;
    for replicate in 0..*replicates {
        let mut order: Vec<usize> = (0..integrators.len()).collect();
        if replicate % 2 == 1 {
            order.reverse();
        }
        for index in order {
            let own_seed = derive_seed(derive_seed(*seed, index as u64), replicate.into());
            let mut watch_run = |run: &Status| {
                watch(&ExperimentStatus {
                    replicate,
                    integrator: index,
                    done: (done + run.used) / total,
                    run: *run,
                })
            };
            let integrator = &*integrators[index];
            let e =
                expose(integrator, scene, Observation::LAYERS, own_seed, *budget, &mut watch_run)?;
            if !e.complete {
                return Ok(Replicates { arms, tiles, complete: false });
            }
            done += 1.0;
            let arm = &mut arms[index];
            arm.replicates.push(Replicate {
                seed: own_seed,
                steps: e.steps,
                samples_per_pixel: e.film.samples_per_pixel(),
                spent: e.spent,
                rays: e.work.rays,
                nonfinite: e.film.nonfinite(),
            });
            arm.observed.replicates.push(Observation::of(&e.film, &tiles));
            arm.add_images(&e.film, index, &all_families);
        }
    }
    Ok(Replicates { arms, tiles, complete: true })
}

impl Arm {
    /// Spec of the integrator, unique among the arms.
    pub fn name(&self) -> &str {
        &self.observed.name
    }

    /// Seconds of one replicate, on average.
    pub fn seconds(&self) -> f64 {
        self.average(|r| r.spent.seconds)
    }

    /// The average over replicates of a figure; NaN without replicates.
    pub fn average(&self, f: impl Fn(&Replicate) -> f64) -> f64 {
        self.replicates.iter().map(f).sum::<f64>() / self.replicates.len() as f64
    }

    fn add_images(&mut self, film: &Film, own: usize, families: &[Families]) {
        let room = room_beside(self.nonfinite_examples.len());
        self.nonfinite_examples.extend(film.nonfinite_examples().iter().take(room));
        let image = film.image();
        self.whole.push(&image);
        for (other, &theirs) in families.iter().enumerate() {
            if other == own {
                continue;
            }
            self.common[other].push(&common_image(film, theirs));
        }
    }
}

/// How many more examples are kept beside `n`.
fn room_beside(n: usize) -> usize {
    const MOST: usize = 16;
    MOST.saturating_sub(n)
}

/// The part of the image that `families` can make as well.
fn common_image(film: &Film, families: Families) -> Vec<[f64; 3]> {
    let k = 1.0 / film.samples_per_pixel();
    let mut image = vec![[0.0; 3]; film.width() * film.height()];
    for (key, plane) in film.planes() {
        if let LayerKey::Class { families: class, .. } = key
            && class.intersects(families)
        {
            for (sum, v) in image.iter_mut().zip(plane.sums()) {
                for c in 0..3 {
                    sum[c] += v[c] * k;
                }
            }
        }
    }
    image
}
