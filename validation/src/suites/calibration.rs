//! Are the tests themselves right? False alarms where nothing is wrong (L5).

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use pathspace_core::Scene;
use pathspace_core::integrator::{Integrator, IntegratorError};
use pathspace_core::random::derive_seed;
use pathspace_scenes::library;

use super::run::{Options, Progress, SuiteError, Team, load};
use crate::pairs::{Judgement, Method, Observation, Tiles, judge};
use crate::stats::{
    Cell, CompareConfig, Decision, Sequential, SequentialConfig, StatsError, binomial_interval,
};
use crate::validate::{Check, CheckCell, CheckOutcome, Config, Report, replicates, seed_of};

/// Level at which alarms are counted.
pub const ALPHA: f64 = 0.05;
/// The upper confidence bound of the rate of false alarms may be this times the level.
pub const SLACK: f64 = 1.5;

/// Pixels a side; small, so that a thousand comparisons are soon done.
const SIZE: u32 = 8;
/// Replicates a side of the fixed test, and most of the sequential one.
const FIXED: usize = 16;
const MOST: usize = 32;

/// Scene, samples per pixel of a replicate.
const SCENES: &[(&str, u64)] = &[("cornell-box", 4), ("thin-lens", 8)];

/// What is compared: names of two integrators by their place in the team, and a scene.
struct Case {
    scene: &'static str,
    samples: u64,
    methods: [usize; 2],
}

fn cases(team: &Team<'_>, options: &Options) -> Vec<Case> {
    let n = team.len().min(3);
    let mut cases = Vec::new();
    for &(scene, samples) in SCENES.iter().filter(|(scene, _)| options.wants(scene)) {
        for i in 0..n {
            for j in i..n {
                cases.push(Case { scene, samples, methods: [i, j] });
            }
        }
    }
    cases
}

/// Number of calibrations: all pairs of the first three integrators, each with itself too.
pub(super) fn count(team: &Team<'_>, options: &Options) -> usize {
    cases(team, options).len()
}

/// Names of the scenes.
pub(super) fn names() -> Vec<String> {
    SCENES.iter().map(|(scene, _)| (*scene).to_owned()).collect()
}

/// Counts alarms among `runs` comparisons of integrators that are right, for each case.
///
/// Each comparison has replicates of its own. Alarms are counted of the family-wise p-value of a
/// pair, of its single tests, and of the sequential form, which looks after every replicate. A case
/// passes where the upper Clopper–Pearson bound (95 %, two-sided) of each is at most 1.5 times the
/// level; it is inconclusive where `runs` are too few for that even at the level itself.
pub(super) fn run(
    report: &mut Report,
    team: &Team<'_>,
    options: &Options,
    runs: u64,
    config: &Config,
    watch: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<ControlFlow<()>, SuiteError> {
    for case in cases(team, options) {
        let clock = Instant::now();
        let library = library::find(case.scene);
        let loaded = library.ok_or("no such scene".to_owned()).and_then(|s| load(s, SIZE));
        let (scene, rules) = match loaded {
            Ok(loaded) => loaded,
            Err(error) => {
                return Err(SuiteError::Nothing(format!("{}: {error}", case.scene)));
            }
        };
        let integrators = team.integrators(rules)?;
        let pair = case.methods.map(|i| &*integrators[i]);
        let subject = format!("{} and {}", pair[0].spec(), pair[1].spec());
        let mut specs = pair.map(|integrator| integrator.spec()).to_vec();
        specs.dedup();
        let base = Check::new("calibration", case.scene, subject);
        let mut check = Check { integrators: specs, ..base };
        let mut alarms = Alarms::default();
        let own = seed_of(seed_of(config.seed, case.scene), &check.subject);
        for run in 0..runs {
            let what = format!("{}: {}, {run} of {runs}", case.scene, check.subject);
            let progress = Progress { done: report.done(), tests: report.tests, what: &what };
            if watch(&progress).is_break() {
                return Ok(ControlFlow::Break(()));
            }
            if let Err(error) = alarms.add(&scene, pair, case.samples, derive_seed(own, run)) {
                check.outcome = match error {
                    CalibrationError::Integrator(IntegratorError::Refused { .. }) => {
                        CheckOutcome::Skipped
                    }
                    _ => CheckOutcome::Failed,
                };
                check.reason = Some(error.to_string());
                break;
            }
        }
        if check.reason.is_none() {
            alarms.judge(&mut check, runs)?;
        }
        check.seconds = clock.elapsed().as_secs_f64();
        report.checks.push(check);
        report.add_done(1);
    }
    Ok(ControlFlow::Continue(()))
}

#[derive(Debug, thiserror::Error)]
enum CalibrationError {
    #[error(transparent)]
    Integrator(#[from] IntegratorError),
    #[error(transparent)]
    Stats(#[from] StatsError),
}

/// Alarms at the level so far.
#[derive(Default)]
struct Alarms {
    pair: u64,
    image: u64,
    largest: u64,
    spread: u64,
    sequential: u64,
}

impl Alarms {
    fn add(
        &mut self,
        scene: &Arc<Scene>,
        pair: [&dyn Integrator; 2],
        samples: u64,
        seed: u64,
    ) -> Result<(), CalibrationError> {
        let tiles = Tiles::new(SIZE as usize, SIZE as usize);
        let mut methods = Vec::new();
        for (place, integrator) in pair.into_iter().enumerate() {
            let own = derive_seed(seed, place as u64);
            let batch = replicates(scene, integrator, &tiles, own, 0..MOST as u64, samples)?;
            let families = integrator.families(scene);
            let name = ["a", "b"][place].to_owned();
            methods.push(Method { name, families, replicates: batch.observations });
        }
        self.sequential += u64::from(sequential(&methods)? == Decision::Differ);
        methods.iter_mut().for_each(|method| method.replicates.truncate(FIXED));
        let judgement: Judgement =
            judge(&methods[0], &methods[1], &tiles, &CompareConfig::default())?;
        self.pair += u64::from(judgement.p <= ALPHA);
        self.image += u64::from(judgement.image.p_single <= ALPHA);
        if let Some(t) = judgement.tiles {
            self.largest += u64::from(t.p_largest <= ALPHA);
            self.spread += u64::from(t.p_spread <= ALPHA);
        }
        Ok(())
    }

    fn judge(&self, check: &mut Check, runs: u64) -> Result<(), StatsError> {
        let mut words = Vec::new();
        let mut well = true;
        for (name, alarms) in [
            ("pair", self.pair),
            ("image", self.image),
            ("largest tile", self.largest),
            ("spread over tiles", self.spread),
            ("sequential", self.sequential),
        ] {
            let (low, high) = binomial_interval(alarms, runs, 0.95)?;
            well &= high <= SLACK * ALPHA;
            let rate = alarms as f64 / runs as f64;
            words.push(format!(
                "{name} {:.1} % [{:.1}, {:.1}]",
                100.0 * rate,
                100.0 * low,
                100.0 * high
            ));
            check.cells.push(CheckCell {
                name: name.into(),
                length: None,
                p: 1.0,
                mean: Some(rate),
                expected: Some(ALPHA),
                mdb: None,
            });
        }
        let at_level = binomial_interval((ALPHA * runs as f64).ceil() as u64, runs, 0.95)?;
        check.outcome = match well {
            true => CheckOutcome::Passed,
            false if at_level.1 > SLACK * ALPHA => CheckOutcome::Inconclusive,
            false => CheckOutcome::Failed,
        };
        let title = format!("alarms at {:.0} % in {runs} comparisons", 100.0 * ALPHA);
        check.reason = Some(format!("{title}: {}", words.join(", ")));
        Ok(())
    }
}

/// The e-process over the image, looked at after every replicate.
fn sequential(methods: &[Method]) -> Result<Decision, StatsError> {
    let config = SequentialConfig { alpha: ALPHA, mdb_limit: 0.0, ..SequentialConfig::default() };
    let mut test = Sequential::new(&[Cell::image()], config)?;
    let common = |o: &Observation| -> f64 {
        let both = o.classes.iter().filter(|(class, _)| {
            methods.iter().all(|method| class.families.intersects(method.families))
        });
        both.map(|(_, c)| c.mean).sum()
    };
    let mut decision = Decision::Continue;
    for (a, b) in methods[0].replicates.iter().zip(&methods[1].replicates) {
        decision = test.push(&[common(a)], &[common(b)])?;
        if decision == Decision::Differ {
            break;
        }
    }
    Ok(decision)
}
