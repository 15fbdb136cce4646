//! Renders replicates of one integrator: a pilot that tells how many samples are needed, then the
//! samples.

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::film::Film;
use pathspace_core::integrator::{Integrator, IntegratorError};
use pathspace_core::random::derive_seed;
use rayon::prelude::*;

use crate::pairs::{Observation, Tiles};
use crate::stats::{Moments, minimum_detectable_bias};

/// Replicates of a pilot.
const PILOT: u64 = 8;

/// What replicates gave and cost.
#[derive(Clone, Debug, Default)]
pub(crate) struct Batch {
    pub(crate) observations: Vec<Observation>,
    /// Rays of the first step of all replicates, and of the other steps.
    pub(crate) rays: (u64, u64),
    pub(crate) nonfinite: u64,
    /// What replays a contribution that was not finite.
    pub(crate) first_nonfinite: Option<String>,
}

impl Batch {
    pub(crate) fn total_rays(&self) -> u64 {
        self.rays.0 + self.rays.1
    }

    pub(crate) fn extend(&mut self, more: Batch) {
        self.observations.extend(more.observations);
        self.rays.0 += more.rays.0;
        self.rays.1 += more.rays.1;
        self.nonfinite += more.nonfinite;
        self.first_nonfinite = self.first_nonfinite.take().or(more.first_nonfinite);
    }
}

/// Renders replicates `range` of `steps` steps each. Replicates run side by side; each is the same
/// for any number of threads.
pub(crate) fn replicates(
    scene: &Arc<Scene>,
    integrator: &dyn Integrator,
    tiles: &Tiles,
    seed: u64,
    range: std::ops::Range<u64>,
    steps: u64,
) -> Result<Batch, IntegratorError> {
    let one = |r: u64| {
        let mut film = Film::new(scene.film(), Observation::LAYERS);
        let own = derive_seed(seed, r);
        let mut run = integrator.start(Arc::clone(scene), own)?;
        let mut rays = (0, 0);
        for step in 0..steps.max(1) {
            let work = run.step(&mut film);
            // An integrator that counts no rays pays by samples.
            let cost = work.rays.max(work.samples);
            if step == 0 { rays.0 += cost } else { rays.1 += cost }
        }
        let first_nonfinite =
            film.nonfinite_examples().first().map(|n| format!("{n:?} of replicate seed {own}"));
        Ok(Batch {
            observations: vec![Observation::of(&film, tiles)],
            rays,
            nonfinite: film.nonfinite(),
            first_nonfinite,
        })
    };
    let all: Result<Vec<Batch>, IntegratorError> = range.into_par_iter().map(one).collect();
    let mut sum = Batch::default();
    for batch in all? {
        sum.extend(batch);
    }
    Ok(sum)
}

/// What a pilot measured.
pub(crate) struct Pilot {
    pub(crate) batch: Batch,
    steps: u64,
}

/// Renders a pilot. It decides how long the replicates proper are and is not tested itself, so that
/// the size of the sample does not depend on the data of the test.
pub(crate) fn pilot(
    scene: &Arc<Scene>,
    integrator: &dyn Integrator,
    tiles: &Tiles,
    seed: u64,
    steps: u64,
) -> Result<Pilot, IntegratorError> {
    // Two steps tell the start-up of chains from the rest.
    let steps = steps.max(2);
    Ok(Pilot { batch: replicates(scene, integrator, tiles, seed, 0..PILOT, steps)?, steps })
}

impl Pilot {
    /// Steps of each of `replicates` replicates after which the image has a minimum detectable bias
    /// of `mdb` against an integrator that is just as noisy; as many as `rays` rays allow, at least
    /// those of the pilot.
    pub(crate) fn steps(
        &self,
        replicates: usize,
        mdb: f64,
        rays: u64,
        hopeless: Option<f64>,
    ) -> u64 {
        let k = replicates as f64;
        let pilots = PILOT as f64;
        let start = self.batch.rays.0 as f64 / pilots;
        let step = self.batch.rays.1 as f64 / pilots / (self.steps - 1) as f64;
        let allowed = 1.0 + (rays as f64 / k - start) / step.max(1.0);
        let steps_for = |mdb: f64| match self.relative_error() {
            // The standard error falls with the root of the samples; the pilot's variance is known
            // to a factor of two.
            Some(error) => {
                let se = error * (2.0 * pilots / k).sqrt();
                let own = minimum_detectable_bias(se, 1.0, 0.0).unwrap_or(f64::INFINITY);
                1.5 * self.steps as f64 * (own / mdb).powi(2)
            }
            None => f64::INFINITY,
        };
        let allowed = match hopeless {
            Some(limit) if steps_for(limit) > allowed => 0.25 * allowed,
            _ => allowed,
        };
        // `as` saturates.
        (steps_for(mdb).min(allowed).ceil() as u64).max(self.steps)
    }

    /// Relative standard error of the image's mean over the pilot; `None` where nothing was seen.
    fn relative_error(&self) -> Option<f64> {
        let image = |o: &Observation| o.classes.values().map(|c| c.mean).sum::<f64>();
        let column: Vec<f64> = self.batch.observations.iter().map(image).collect();
        let moments = Moments::of(&column).ok()?;
        (moments.mean != 0.0).then(|| moments.squared_error().sqrt() / moments.mean.abs())
    }
}
