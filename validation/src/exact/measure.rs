//! Holds an integrator to what a scene must give.

use std::sync::Arc;

use pathspace_core::film::{Families, Film, Layers};
use pathspace_core::integrator::{Integrator, IntegratorError, Run};
use pathspace_core::random::derive_seed;
use pathspace_core::{Scene, SceneError};
use rayon::prelude::*;

use super::{ExactLength, ExactScene, Made};
use crate::stats::{
    Cell, CellReport, CompareConfig, ExactReport, StatsError, Verdict, compare_exact,
};

/// What was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// How it compares with the exact values.
    pub report: ExactReport,
    /// Families of techniques that the integrator uses on the scene.
    pub families: Families,
    /// What its techniques made.
    pub made: Made,
}

/// How long to measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Replicates, each with a seed of its own; as many more make the pilot.
    pub replicates: usize,
    /// Steps of each pilot replicate before it is looked at for the first time, and fewest of a
    /// replicate that is tested. From `most` on there is nothing to find out and no pilot.
    pub pilot: u64,
    /// Most steps of each replicate.
    pub most: u64,
    /// Rays that pilot and replicates together should not exceed, but for the first look at the
    /// pilot and `pilot` steps of each replicate.
    pub rays: u64,
    /// The relative minimum detectable bias to aim at in every cell.
    pub mdb: f64,
    /// Seed of all.
    pub seed: u64,
}

impl Default for Plan {
    fn default() -> Self {
        Plan { replicates: 24, pilot: 4, most: 2000, rays: u64::MAX, mdb: 0.005, seed: 1 }
    }
}

/// Why nothing could be measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExactError {
    /// The scene is not one.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The integrator refuses the scene.
    #[error(transparent)]
    Integrator(#[from] IntegratorError),
    /// Statistics of too little or broken data.
    #[error(transparent)]
    Stats(#[from] StatsError),
    /// Contributions that were NaN or infinite.
    #[error("{count} contributions are not finite, the first {first}")]
    NonFinite {
        /// How many.
        count: u64,
        /// What replays one.
        first: String,
    },
}

/// Steps over those that the pilot's variance asks for. That variance is itself known to 30 % from
/// 24 replicates, and where tails are heavy a short pilot has not met them and finds it too small.
const MARGIN: f64 = 1.3;
/// A pilot goes on while it is shorter than this part of the steps that it asks for.
const PILOT_SHARE: f64 = 0.1;
/// Part of the rays that a pilot may take.
const PILOT_RAYS: f64 = 0.2;

/// Runs replicates of `integrator` on `scene` for as many steps as should give every cell that it
/// can see a minimum detectable bias of `plan.mdb`, and compares with the exact values.
///
/// A pilot with seeds of its own tells how many steps that takes and is thrown away: to stop when
/// the tested data themselves look quiet would favour replicates that have not met their rare
/// bright paths yet. A minimum detectable bias that is then missed by little stays as it is; the
/// report says what it came to. Steps are those that replicates with the pilot's variance σ² need,
/// n = 1.3 n_pilot (z σ_pilot / √K / (m μ − u))², for a bias m, uncertainty u of the exact mean μ
/// and z = 5.17.
///
/// # Errors
/// Where the scene or the integrator does not start or a contribution is not finite. An integrator
/// that sees none of the paths gives a report without cells.
pub fn measure(
    scene: &ExactScene,
    integrator: &dyn Integrator,
    plan: &Plan,
    config: &CompareConfig,
) -> Result<Measured, ExactError> {
    let built = Arc::new(Scene::new(&scene.description)?);
    let families = integrator.families(&built);
    let expected = scene.seen_by(families);
    if expected.is_empty() {
        let report = ExactReport {
            replicates: 0,
            verdict: Verdict::Inconclusive,
            p: 1.0,
            mdb: f64::INFINITY,
            cells: Vec::new(),
        };
        return Ok(Measured { report, families, made: Made::default() });
    }
    let test = Test { built: &built, expected: &expected, integrator, config };
    let steps = test.pilot(plan)?;
    let mut replicates = test.start(plan, plan.seed)?;
    expose(&mut replicates, steps);
    let report = test.report(&replicates)?;
    let mut made = Made::default();
    replicates.iter().for_each(|(_, film)| made.add(film));
    Ok(Measured { report, families, made })
}

/// What is held to what.
struct Test<'a> {
    built: &'a Arc<Scene>,
    expected: &'a [ExactLength],
    integrator: &'a dyn Integrator,
    config: &'a CompareConfig,
}

type Replicate = (Box<dyn Run>, Film);

impl Test<'_> {
    /// Replicates before their first step.
    fn start(&self, plan: &Plan, seed: u64) -> Result<Vec<Replicate>, ExactError> {
        let one = |r: usize| {
            let run = self.integrator.start(self.built.clone(), derive_seed(seed, r as u64))?;
            let layers = Layers { length: true, technique: true, ..Layers::NONE };
            let film = Film::new(self.built.film(), layers);
            Ok((run, film))
        };
        (0..plan.replicates).map(one).collect()
    }

    /// The steps that a pilot asks for, within what the plan allows.
    fn pilot(&self, plan: &Plan) -> Result<u64, ExactError> {
        let least = plan.pilot.clamp(1, plan.most.max(1));
        if least >= plan.most || plan.replicates == 0 {
            return Ok(least);
        }
        let mut replicates = self.start(plan, derive_seed(plan.seed, u64::MAX))?;
        // Chains begin with a bootstrap, which no later step pays for. Where such starts leave a
        // pilot no room, the rays alone say how many steps there are.
        let (one, others) = replicates.split_at_mut(1);
        let start = expose(one, 1) as f64;
        let count = plan.replicates as f64;
        if count * start > PILOT_RAYS * plan.rays as f64 {
            let step = expose(one, 1).max(1) as f64;
            let more = (plan.rays as f64 - count * start) / (count * step);
            // `as` saturates, and makes 0 of what is negative.
            return Ok((more as u64).saturating_add(1).clamp(least, plan.most));
        }
        let first = start as u64 + expose(others, 1);
        let (mut steps, mut rays) = (1, 0);
        let mut more = least - 1;
        loop {
            rays += expose(&mut replicates, more);
            steps += more;
            let wanted = steps as f64 * self.shortfall(&self.report(&replicates)?, plan.mdb);
            // `as` saturates.
            let wanted = (MARGIN * wanted).min(plan.most as f64).ceil() as u64;
            let spent = (first + rays) as f64;
            let per_step = match steps {
                1 => first as f64,
                _ => rays as f64 / (steps - 1) as f64,
            };
            let affordable = |rays: f64| (rays / per_step.max(1.0)).floor() as u64;
            let longer = (PILOT_SHARE * wanted as f64) as u64;
            let longer = longer.saturating_sub(steps).min(3 * steps);
            more = longer.min(affordable(PILOT_RAYS * plan.rays as f64 - spent));
            if more == 0 {
                let left = plan.rays as f64 - spent - first as f64;
                return Ok(wanted.min(affordable(left).saturating_add(1)).max(least));
            }
        }
    }

    /// Squared ratio of the standard errors to those that make the bias `mdb` detectable, in the
    /// worst cell.
    fn shortfall(&self, report: &ExactReport, mdb: f64) -> f64 {
        let cells = report.cells.iter().zip(self.expected);
        let of_cell = |(cell, expected): (&CellReport, &ExactLength)| {
            let (test, mu) = (&cell.test, expected.mean.abs());
            let never_sampled = test.mean_a == 0.0 && mu > 0.0;
            if never_sampled || test.mdb.is_infinite() {
                return f64::INFINITY;
            }
            // The half-width of the null hypothesis does not fall with more steps.
            let uncertainty = expected.uncertainty + self.config.tolerance * mu;
            let (noise, room) = (test.mdb * mu - uncertainty, mdb * mu - uncertainty);
            match (noise > 0.0, room > 0.0) {
                (false, _) => 0.0,
                (true, true) => (noise / room).powi(2),
                (true, false) => f64::INFINITY,
            }
        };
        cells.map(of_cell).fold(0.0, f64::max)
    }

    fn report(&self, replicates: &[Replicate]) -> Result<ExactReport, ExactError> {
        let expected = self.expected;
        let cells: Vec<Cell> = expected.iter().map(ExactLength::cell).collect();
        let mut rows = Vec::with_capacity(replicates.len());
        for (_, film) in replicates {
            if film.nonfinite() > 0 {
                let first = format!("{:?}", film.nonfinite_examples().first());
                return Err(ExactError::NonFinite { count: film.nonfinite(), first });
            }
            rows.push(expected.iter().map(|e| e.observe(film)).collect());
        }
        let exact: Vec<f64> = expected.iter().map(|e| e.mean).collect();
        let uncertainty: Vec<f64> = expected.iter().map(|e| e.uncertainty).collect();
        Ok(compare_exact(&cells, &rows, &exact, &uncertainty, self.config)?)
    }
}

/// Runs every replicate for `steps` steps; rays of all, or samples where an integrator counts no
/// rays.
fn expose(replicates: &mut [Replicate], steps: u64) -> u64 {
    let cost = |(run, film): &mut Replicate| -> u64 {
        let works = (0..steps).map(|_| run.step(film));
        works.map(|work| work.rays.max(work.samples)).sum()
    };
    replicates.par_iter_mut().map(cost).sum()
}
