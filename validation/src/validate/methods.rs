//! The integrators of a scene while they are being compared.

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::integrator::{Integrator, IntegratorError};
use pathspace_core::random::derive_seed;

use super::config::Config;
use super::pairs::Pairing;
use super::render::{self, Batch};
use super::report::{MethodReport, MethodState};
use super::seed_of;
use crate::pairs::{Method, Tiles, unique_name};

/// Stream of the pilot; rounds have the numbers from 0.
const PILOT: u64 = u64::MAX;

/// An integrator on a scene.
pub(super) struct Contender<'a> {
    integrator: &'a dyn Integrator,
    seed: u64,
    pub(super) method: Method,
    /// Steps of a replicate in the first round.
    steps: u64,
    pub(super) report: MethodReport,
}

impl<'a> Contender<'a> {
    /// All of them, after their pilots. Seeds follow from the scene's and the name alone.
    pub(super) fn all(
        scene: &Arc<Scene>,
        integrators: &[&'a dyn Integrator],
        tiles: &Tiles,
        config: &Config,
        pairing: Pairing,
        seed: u64,
    ) -> Vec<Self> {
        let mut all: Vec<Contender<'a>> = Vec::new();
        for &integrator in integrators {
            let name = unique_name(integrator.spec(), |n| all.iter().any(|c| c.method.name == n));
            let mut contender = Contender {
                integrator,
                seed: seed_of(seed, &name),
                method: Method::new(name.clone(), integrator.families(scene)),
                steps: config.samples,
                report: MethodReport {
                    integrator: name,
                    state: MethodState::Rendered,
                    reason: None,
                    replicates: 0,
                    samples: 0,
                    rays: 0,
                    nonfinite: 0,
                    mean: None,
                },
            };
            let own = derive_seed(contender.seed, PILOT);
            match render::pilot(scene, integrator, tiles, own, config.samples) {
                Ok(pilot) => {
                    // What all others are held to should add no noise of its own.
                    let first = all.is_empty() && pairing == Pairing::First;
                    let mdb = if first { 0.5 * config.mdb } else { config.mdb };
                    contender.steps =
                        pilot.steps(config.replicates, mdb, config.rays, config.hopeless);
                    contender.report.samples = contender.steps;
                    contender.account(&pilot.batch);
                }
                Err(error) => contender.fail(&error),
            }
            all.push(contender);
        }
        all
    }

    /// True where it may be compared.
    pub(super) fn is_well(&self) -> bool {
        self.report.state == MethodState::Rendered
    }

    /// Renders the replicates of a round in place of those before it, `factor` times as long as in
    /// the first.
    pub(super) fn render(
        &mut self,
        scene: &Arc<Scene>,
        tiles: &Tiles,
        round: u64,
        replicates: usize,
        factor: u64,
    ) {
        self.method.replicates.clear();
        self.add(scene, tiles, round, 0..replicates as u64, factor);
    }

    /// Renders more replicates of a round.
    pub(super) fn add(
        &mut self,
        scene: &Arc<Scene>,
        tiles: &Tiles,
        round: u64,
        range: std::ops::Range<u64>,
        factor: u64,
    ) {
        let own = derive_seed(self.seed, round);
        let steps = self.steps.saturating_mul(factor);
        match render::replicates(scene, self.integrator, tiles, own, range, steps) {
            Ok(batch) => {
                self.account(&batch);
                self.method.replicates.extend(batch.observations);
                if self.method.ignores_its_seed() {
                    self.report.state = MethodState::Failed;
                    let n = self.method.replicates.len();
                    self.report.reason = Some(format!(
                        "{n} replicates of different seeds are the same to the bit: the seed is not used"
                    ));
                }
                if round == 0 {
                    self.report.replicates = self.method.replicates.len();
                    self.report.mean = self.mean();
                }
            }
            Err(error) => self.fail(&error),
        }
    }

    fn mean(&self) -> Option<f64> {
        let image = |o: &crate::pairs::Observation| o.classes.values().map(|c| c.mean).sum::<f64>();
        let n = self.method.replicates.len();
        (n > 0).then(|| self.method.replicates.iter().map(image).sum::<f64>() / n as f64)
    }

    fn account(&mut self, batch: &Batch) {
        self.report.rays += batch.total_rays();
        self.report.nonfinite += batch.nonfinite;
        if batch.nonfinite > 0 {
            self.report.state = MethodState::Failed;
            if self.report.reason.is_none() {
                let first = batch.first_nonfinite.as_deref().unwrap_or("");
                self.report.reason =
                    Some(format!("{} contributions are not finite: {first}", batch.nonfinite));
            }
        }
    }

    fn fail(&mut self, error: &IntegratorError) {
        self.report.state = match error {
            IntegratorError::Refused { .. } => MethodState::Refused,
            _ => MethodState::Failed,
        };
        self.report.reason = Some(match error {
            IntegratorError::Refused { reason, .. } => reason.clone(),
            other => other.to_string(),
        });
    }
}
