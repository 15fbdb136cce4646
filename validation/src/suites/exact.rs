//! Integrators against exact answers, in rounds.

use std::ops::ControlFlow;
use std::time::Instant;

use pathspace_core::integrator::{Integrator, IntegratorError};
use pathspace_core::random::derive_seed;

use super::run::{Options, Progress, SuiteError, Team};
use crate::exact::{self, ExactError, ExactScene, Plan};
use crate::stats::{CellReport, CompareConfig, PairReport, Rule, Verdict};
use crate::validate::{Check, CheckCell, CheckOutcome, Config, Confirmed, Report, seed_of};

/// What geometry in `f32` may move a mean by, relative.
const TOLERANCE: f64 = 5e-6;

/// The exact scenes of these names (all where there are none) that the options want.
pub(super) fn scenes(names: &[&str], options: &Options) -> Vec<ExactScene> {
    let wanted =
        |s: &ExactScene| (names.is_empty() || names.contains(&s.name)) && options.wants(s.name);
    exact::all().into_iter().filter(wanted).collect()
}

/// Holds every integrator to every scene.
pub(super) fn run(
    report: &mut Report,
    team: &Team<'_>,
    scenes: &[ExactScene],
    config: &Config,
    kind: &'static str,
    watch: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<ControlFlow<()>, SuiteError> {
    for scene in scenes {
        for integrator in team.integrators(scene.rules)? {
            let what = format!("{}: {}", scene.name, integrator.spec());
            let progress = Progress { done: report.done(), tests: report.tests, what: &what };
            if watch(&progress).is_break() {
                return Ok(ControlFlow::Break(()));
            }
            let level = report.level();
            report.checks.push(check(scene, &*integrator, config, level, kind));
            report.add_done(1);
        }
    }
    Ok(ControlFlow::Continue(()))
}

/// Holds one integrator to one scene at this level.
pub(crate) fn check(
    scene: &ExactScene,
    integrator: &dyn Integrator,
    config: &Config,
    level: f64,
    kind: &'static str,
) -> Check {
    let clock = Instant::now();
    let mut check = Check::of(kind, scene.name, integrator.spec());
    if let Err(error) = rounds(&mut check, scene, integrator, config, level) {
        let refused = matches!(error, ExactError::Integrator(IntegratorError::Refused { .. }));
        check.outcome = if refused { CheckOutcome::Skipped } else { CheckOutcome::Failed };
        check.reason = Some(match error {
            ExactError::Integrator(IntegratorError::Refused { reason, .. }) => reason,
            other => other.to_string(),
        });
    }
    check.seconds = clock.elapsed().as_secs_f64();
    check
}

fn rounds(
    check: &mut Check,
    scene: &ExactScene,
    integrator: &dyn Integrator,
    config: &Config,
    level: f64,
) -> Result<(), ExactError> {
    let own = seed_of(seed_of(config.seed, scene.name), &check.subject);
    let mut test = Confirmed::new(level, config.rounds().0)?;
    let mut verdict = Verdict::Inconclusive;
    let rejected = test.run(config, |round, factor, at| {
        let plan = Plan {
            replicates: config.replicates,
            pilot: config.samples,
            most: u64::MAX,
            mdb: config.mdb / (factor as f64).sqrt(),
            rays: config.rays.saturating_mul(factor),
            seed: derive_seed(own, round),
        };
        let rule = Rule { alpha: at, ..Rule::default() };
        let report = exact::measure(
            scene,
            integrator,
            &plan,
            &CompareConfig { rule, tolerance: TOLERANCE },
        )?;
        if report.cells.is_empty() {
            return Ok(None);
        }
        let trusted = report.cells.iter().filter(|c| c.reason.is_trusted());
        let p = trusted.fold(1.0, |m: f64, c| m.min(c.p_adjusted));
        verdict = report.verdict;
        check.mdb = Some(report.mdb);
        check.cells = cells(&report);
        Ok::<_, ExactError>(Some((p, report.replicates_a)))
    })?;
    if check.cells.is_empty() {
        check.outcome = CheckOutcome::Skipped;
        check.reason = Some("it can not make these paths".into());
    } else {
        check.outcome = CheckOutcome::of(rejected, verdict);
    }
    check.rounds = test.rounds;
    Ok(())
}

fn cells(report: &PairReport) -> Vec<CheckCell> {
    let finite = |v: f64| v.is_finite().then_some(v);
    let cell = |c: &CellReport| CheckCell {
        name: c.name.clone(),
        length: c.length,
        p: c.p_adjusted,
        mean: Some(c.test.mean_a),
        expected: Some(c.test.mean_b),
        mdb: finite(c.test.mdb),
    };
    report.cells.iter().map(cell).collect()
}
