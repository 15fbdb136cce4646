//! Mutations of Markov chains (L4), in rounds.

use std::ops::ControlFlow;
use std::time::Instant;

use pathspace_integrators::{Defaults, SpecError};
use pathspace_scenes::library::LibraryScene;

use super::run::{Progress, SuiteError, load};
use crate::chains::{ChainCheck, ChecksError, chain_checks, round_checks};
use crate::stats::{StatsError, holm};
use crate::validate::{Check, CheckCell, CheckOutcome, Config, Confirmed, Report, seed_of};

/// Pixels a side; mutations see the film as a whole.
const SIZE: u32 = 32;
/// Replicates of a test of rounds: where b̂ is kept, ranks of so many have a p-value of 10⁻¹².
const REPLICATES: u64 = 64;

/// Runs every test of every built-in mutation on each scene with `starts` bootstrap samples. A
/// scene is one test, with Holm's adjustment inside; a check is reported for each mutation.
pub(super) fn run(
    report: &mut Report,
    scenes: &[&LibraryScene],
    starts: u64,
    config: &Config,
    watch: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<ControlFlow<()>, SuiteError> {
    for scene in scenes {
        let what = format!("{}: mutations", scene.name);
        let progress = Progress { done: report.done(), tests: report.tests, what: &what };
        if watch(&progress).is_break() {
            return Ok(ControlFlow::Break(()));
        }
        let level = report.level();
        match checks(scene, starts, config, level) {
            Ok(checks) => report.checks.extend(checks),
            Err(reason) => {
                let base = Check::new("chains", scene.name, String::new());
                let outcome = CheckOutcome::Failed;
                report.checks.push(Check { outcome, reason: Some(reason), ..base });
            }
        }
        report.add_done(1);
    }
    Ok(ControlFlow::Continue(()))
}

/// Why a round gave nothing.
#[derive(Debug, thiserror::Error)]
enum ChainsError {
    #[error(transparent)]
    Spec(#[from] SpecError),
    #[error(transparent)]
    Rounds(#[from] ChecksError),
    #[error(transparent)]
    Stats(#[from] StatsError),
}

fn checks(
    scene: &LibraryScene,
    starts: u64,
    config: &Config,
    level: f64,
) -> Result<Vec<Check>, String> {
    let clock = Instant::now();
    let (built, rules) = load(scene, SIZE)?;
    let own = seed_of(seed_of(config.seed, "chains"), scene.name);
    let mut last: Vec<(ChainCheck, f64)> = Vec::new();
    let mut test = Confirmed::new(level, config.rounds().0).map_err(|e| e.to_string())?;
    let rejected = test
        .run(config, |round, factor, _| {
            let seed = pathspace_core::random::derive_seed(own, round);
            let mut checks = chain_checks(&built, &Defaults { rules }, seed, starts * factor)?;
            let replicates = REPLICATES * factor;
            checks.extend(round_checks(&built, &Defaults { rules }, seed, replicates)?);
            let adjusted = holm(&checks.iter().map(|c| c.p).collect::<Vec<_>>());
            let least = adjusted.iter().copied().fold(1.0, f64::min);
            last = checks.into_iter().zip(adjusted).collect();
            Ok::<_, ChainsError>(Some((least, starts as usize)))
        })
        .map_err(|e| e.to_string())?;
    // Which mutations a rejection is about: those whose own tests reject in the last round.
    let at = test.rounds.last().map_or(0.0, |r| r.level);
    let mut checks: Vec<Check> = Vec::new();
    for (chain, p) in last {
        let index = match checks.iter().position(|c| c.subject == chain.mutator) {
            Some(index) => index,
            None => {
                let base = Check::new("chains", scene.name, chain.mutator.clone());
                let rounds = test.rounds.clone();
                checks.push(Check { outcome: CheckOutcome::Passed, rounds, ..base });
                checks.len() - 1
            }
        };
        let check = &mut checks[index];
        if rejected && p <= at {
            check.outcome = CheckOutcome::Failed;
        }
        check.cells.push(CheckCell {
            name: chain.test,
            length: None,
            p,
            mean: None,
            expected: None,
            mdb: None,
        });
        check.seconds = clock.elapsed().as_secs_f64();
    }
    Ok(checks)
}
