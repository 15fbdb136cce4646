//! Integrators against exact answers, in rounds.

use std::ops::ControlFlow;
use std::time::Instant;

use pathspace_core::integrator::{Integrator, IntegratorError};
use pathspace_core::random::derive_seed;

use super::run::{Options, Progress, SuiteError, Team};
use crate::exact::{self, ExactError, ExactScene, Measured, Plan};
use crate::pairs::{LOST, techniques};
use crate::stats::{CellReport, CompareConfig, ExactReport, Reason, Rule, Verdict};
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
        let mut of_scene = Vec::new();
        for integrator in team.integrators(scene.rules)? {
            let what = format!("{}: {}", scene.name, integrator.spec());
            let progress = Progress { done: report.done(), tests: report.tests, what: &what };
            if watch(&progress).is_break() {
                return Ok(ControlFlow::Break(()));
            }
            let level = report.level();
            of_scene.push(measured(scene, &*integrator, config, level, kind));
            report.add_done(1);
        }
        accuse_of_losses(&mut of_scene);
        report.checks.extend(of_scene.into_iter().map(|(check, _)| check));
    }
    Ok(ControlFlow::Continue(()))
}

/// Fails checks of integrators that never saw a path length which another one's same techniques
/// make all the time. A rare event and a missing technique both give 0; how often another
/// integrator meets the event tells them apart.
fn accuse_of_losses(of_scene: &mut [(Check, Option<Measured>)]) {
    for index in 0..of_scene.len() {
        let Some(own) = &of_scene[index].1 else { continue };
        let mut reason = None;
        for cell in own.report.cells.iter().filter(|c| c.reason == Reason::NeverSampled) {
            let Some(length) = cell.length else { continue };
            for (other, theirs) in of_scene.iter() {
                let Some(theirs) = theirs else { continue };
                let common = own.families.common(theirs.families);
                let expected = theirs.made.expected(length, common, &own.made);
                if expected >= LOST {
                    let text = format!(
                        "length {length}: 0 where {:.7} is exact; by {}, which both use, {} makes \
                         at least {expected:.0} contributions in as many samples",
                        cell.test.mean_b,
                        techniques(common).join(", "),
                        other.subject
                    );
                    reason.get_or_insert((text, other.subject.clone()));
                }
            }
        }
        if let Some((text, other)) = reason {
            let check = &mut of_scene[index].0;
            (check.outcome, check.reason) = (CheckOutcome::Failed, Some(text));
            check.integrators.push(other);
        }
    }
}

/// Holds one integrator to one scene at this level.
pub(crate) fn check(
    scene: &ExactScene,
    integrator: &dyn Integrator,
    config: &Config,
    level: f64,
    kind: &'static str,
) -> Check {
    measured(scene, integrator, config, level, kind).0
}

/// The same, with what the last round measured.
fn measured(
    scene: &ExactScene,
    integrator: &dyn Integrator,
    config: &Config,
    level: f64,
    kind: &'static str,
) -> (Check, Option<Measured>) {
    let clock = Instant::now();
    let mut check = Check::of(kind, scene.name, integrator.spec());
    let mut last = None;
    if let Err(error) = rounds(&mut check, &mut last, scene, integrator, config, level) {
        let refused = matches!(error, ExactError::Integrator(IntegratorError::Refused { .. }));
        check.outcome = if refused { CheckOutcome::Skipped } else { CheckOutcome::Failed };
        check.reason = Some(match error {
            ExactError::Integrator(IntegratorError::Refused { reason, .. }) => reason,
            other => other.to_string(),
        });
    }
    check.seconds = clock.elapsed().as_secs_f64();
    (check, last)
}

fn rounds(
    check: &mut Check,
    last: &mut Option<Measured>,
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
        let compare = CompareConfig { rule, tolerance: TOLERANCE };
        let measured = exact::measure(scene, integrator, &plan, &compare)?;
        let report = &measured.report;
        if report.cells.is_empty() {
            return Ok(None);
        }
        let trusted = report.cells.iter().filter(|c| c.reason.is_trusted());
        let p = trusted.fold(1.0, |m: f64, c| m.min(c.p_adjusted));
        verdict = report.verdict;
        check.mdb = Some(report.mdb);
        check.cells = cells(report);
        let replicates = report.replicates;
        *last = Some(measured);
        Ok::<_, ExactError>(Some((p, replicates)))
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

fn cells(report: &ExactReport) -> Vec<CheckCell> {
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
