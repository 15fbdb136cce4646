//! `pathspace validate`.

use std::fs;
use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use pathspace_integrators::Registry;
use pathspace_validation::stats::Verdict;
use pathspace_validation::suites::{self, Options, Suite};
use pathspace_validation::validate::{
    Check, CheckOutcome, Failure, MethodState, PairReport, Report, SceneReport, StoppingRule,
};
use serde::Serialize;

use super::args::ValidateArgs;
use super::interrupt::{self, Interrupted};
use super::progress::Progress;
use super::scene::pool;
use super::table::{Table, percent};
use super::words::{did_you_mean, quoted};
use super::{Done, mutants, program};

/// What `--json` prints; see docs/json.md.
#[derive(Debug, Serialize)]
struct Object<'a> {
    threads: usize,
    passed: bool,
    failures: Vec<FailureReport>,
    #[serde(flatten)]
    report: &'a Report,
}

/// A failure with the command that shows it again.
#[derive(Debug, Serialize)]
struct FailureReport {
    #[serde(flatten)]
    failure: Failure,
    replay: String,
}

/// Runs a suite.
pub(super) fn validate(
    registry: &Registry,
    args: &ValidateArgs,
    out: &mut dyn Write,
) -> Result<Done> {
    if args.suite == mutants::SUITE {
        return mutants::hunt_all(args, out);
    }
    let suite = suite(args)?;
    let options = Options {
        integrators: args.integrators.clone(),
        scenes: args.scenes.clone(),
        level: args.level,
    };
    let pool = pool(args.threads)?;
    if let Some(dir) = &args.output {
        fs::create_dir_all(dir)
            .with_context(|| format!("{}: cannot make directory", dir.display()))?;
    }
    interrupt::install();
    interrupt::keep();
    let progress = Progress::new();
    let mut watch = |at: &suites::Progress<'_>| {
        progress.set(at.done as f64 / at.tests.max(1) as f64, || at.what.to_owned());
        if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let report = pool.install(|| suites::run(&suite, registry, &options, &mut watch));
    drop(progress);
    let report = report?;
    let failures: Vec<FailureReport> =
        report.failures().into_iter().map(|f| told(f, args)).collect();
    tell(&report, &failures, out)?;
    let object = Object {
        threads: pool.current_num_threads(),
        passed: report.passed(),
        failures,
        report: &report,
    };
    if let Some(dir) = &args.output {
        write(&dir.join("report.json"), &serde_json::to_string(&object)?)?;
        let replays: Vec<String> = object.failures.iter().map(|t| t.replay.clone()).collect();
        write(&dir.join("report.html"), &report.page(&replays)?)?;
        writeln!(out, "report in {}", dir.display())?;
    }
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&object)?)?;
    }
    if !report.passed() {
        return Ok(Done::Differ);
    }
    if !report.complete {
        bail!(Interrupted(
            "interrupted: nothing is wrong in what was done, but tests are missing".into()
        ));
    }
    Ok(Done::Well)
}

/// The suite with what the command line changes.
fn suite(args: &ValidateArgs) -> Result<Suite> {
    let mut suite = Suite::find(&args.suite).ok_or_else(|| {
        let known: Vec<&str> = Suite::list().iter().map(|s| s.name).collect();
        let hint = did_you_mean(&args.suite, known.iter().copied());
        anyhow!("'{}' is no suite ({}){hint}", args.suite, known.join(", "))
    })?;
    let config = &mut suite.config;
    config.seed = args.seed;
    if let Some(alpha) = args.alpha {
        config.alpha = alpha;
    }
    if let Some(k) = args.replicates {
        config.replicates = k as usize;
    }
    if args.sequential {
        config.stopping = StoppingRule::Sequential { batch: 8, most: 4 * config.replicates };
    }
    if let Some(effort) = args.effort {
        suite = suite.with_effort(effort);
    }
    Ok(suite)
}

/// Writes a file whole or not at all.
fn write(path: &Path, text: &str) -> Result<()> {
    let partial = path.with_extension("partial");
    fs::write(&partial, text)
        .and_then(|()| fs::rename(&partial, path))
        .with_context(|| format!("{}: cannot write", path.display()))
}

/// The same scene and integrators alone, with the level that the test had.
fn told(failure: Failure, args: &ValidateArgs) -> FailureReport {
    let mut replay = format!("{} validate {}", program(), args.suite);
    for integrator in &failure.integrators {
        // The second of two equal ones is asked for by the same spec again.
        let spec = integrator.split('#').next().unwrap_or(integrator);
        replay += &format!(" -i {}", quoted(spec));
    }
    replay += &format!(" --scene {} --seed {}", quoted(&failure.scene), failure.seed);
    replay += &format!(" --level {:e}", failure.level);
    if let Some(k) = args.replicates {
        replay += &format!(" --replicates {k}");
    }
    if let Some(effort) = args.effort {
        replay += &format!(" --effort {effort}");
    }
    if args.sequential {
        replay += " --sequential";
    }
    FailureReport { failure, replay }
}

fn tell(report: &Report, failures: &[FailureReport], out: &mut dyn Write) -> Result<()> {
    for scene in &report.scenes {
        tell_scene(scene, out)?;
    }
    for kind in ["exact", "chains", "numbers", "hard"] {
        let checks: Vec<&Check> = report.checks.iter().filter(|c| c.kind == kind).collect();
        if !checks.is_empty() {
            tell_checks(kind, &checks, out)?;
        }
    }
    for check in report.checks.iter().filter(|c| c.kind == "calibration") {
        let reason = check.reason.as_deref().unwrap_or("");
        writeln!(out, "{} {}, {}: {reason}", outcome(check), check.scene, check.subject)?;
    }
    for (scene, who, why) in report.skips() {
        writeln!(out, "left out: {who} on {scene}: {why}")?;
    }
    if !report.complete {
        writeln!(out, "interrupted: what stands above is all that was done")?;
    }
    for FailureReport { failure, replay } in failures {
        writeln!(out, "\nWRONG on {}: {}\n  again: {replay}", failure.scene, failure.message)?;
    }
    let [well, wrong, open] = report.tally();
    writeln!(
        out,
        "\n{}{} of {} comparisons conclusive, {open} need more samples; seed {}, \
         probability of any false alarm {:.0e}, {:.0} s",
        match (failures.len(), report.complete) {
            (0, true) => "No error found: ".into(),
            (0, false) => "Interrupted, no error found so far: ".into(),
            (1, _) => "AN ERROR FOUND: ".to_owned(),
            (n, _) => format!("{n} ERRORS FOUND: "),
        },
        well + wrong,
        well + wrong + open,
        report.config.seed,
        report.config.alpha,
        report.seconds
    )?;
    Ok(())
}

/// The matrix of a scene: verdict and minimum detectable bias of each pair, of the image and of a
/// tile.
fn tell_scene(scene: &SceneReport, out: &mut dyn Write) -> Result<()> {
    let [width, height] = scene.size;
    writeln!(out, "{}: {width}×{height}, {:.1} s", scene.scene, scene.seconds)?;
    let methods: Vec<_> =
        scene.integrators.iter().filter(|a| a.state == MethodState::Rendered).collect();
    let numbers: Vec<String> = (1..methods.len()).map(|n| n.to_string()).collect();
    let mut heading = vec!["", "samples"];
    heading.extend(numbers.iter().map(String::as_str));
    let mut table = Table::new(&heading, &[0]);
    for (i, method) in methods.iter().enumerate() {
        let name = format!("{} {}", i + 1, method.integrator);
        let mut row = vec![name, format!("{}×{}", method.replicates, method.samples)];
        for other in &methods[..i] {
            let of =
                |p: &&PairReport| p.last.a == other.integrator && p.last.b == method.integrator;
            row.push(scene.pairs.iter().find(of).map_or("—".into(), |p| {
                format!("{} {}{}", mark(p.outcome), percent(p.last.mdb), tile_mdb(p))
            }));
        }
        table.row(row);
    }
    table.write("  ", out)?;
    writeln!(out)?;
    Ok(())
}

/// The minimum detectable bias of a typical tile, behind that of the image.
fn tile_mdb(pair: &PairReport) -> String {
    match &pair.last.tiles {
        Some(tiles) if tiles.mdb.is_finite() => format!("/{}", percent(tiles.mdb)),
        _ => String::new(),
    }
}

fn mark(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Agree => "✓",
        Verdict::Differ => "✗",
        Verdict::Inconclusive => "?",
    }
}

/// A matrix of checks: scene × integrator, the longer list downwards.
fn tell_checks(kind: &str, checks: &[&Check], out: &mut dyn Write) -> Result<()> {
    let mut subjects: Vec<&str> = Vec::new();
    let mut scenes: Vec<&str> = Vec::new();
    for check in checks {
        if !subjects.contains(&check.subject.as_str()) {
            subjects.push(&check.subject);
        }
        if !scenes.contains(&check.scene.as_str()) {
            scenes.push(&check.scene);
        }
    }
    let across = subjects.len() <= scenes.len();
    let (down, columns) = if across { (scenes, subjects) } else { (subjects, scenes) };
    let mut table = Table::new(&[&[kind][..], &columns].concat(), &[0]);
    for name in down {
        let mut row = vec![name.to_owned()];
        for column in &columns {
            let (scene, subject) = if across { (name, *column) } else { (*column, name) };
            let of = |c: &&&Check| c.scene == scene && c.subject == subject;
            row.push(checks.iter().find(of).map_or(String::new(), |c| outcome(c)));
        }
        table.row(row);
    }
    table.write("  ", out)?;
    writeln!(out)?;
    Ok(())
}

fn outcome(check: &Check) -> String {
    let mdb = check.mdb.map_or(String::new(), |m| format!(" {}", percent(m)));
    match check.outcome {
        CheckOutcome::Passed => format!("✓{mdb}"),
        CheckOutcome::Failed => "✗".into(),
        CheckOutcome::Inconclusive => format!("?{mdb}"),
        CheckOutcome::Skipped => "–".into(),
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::super::args::{Cli, Command};
    use super::*;

    fn parse<'a>(words: impl IntoIterator<Item = &'a str>) -> ValidateArgs {
        match Cli::try_parse_from(words).unwrap().command {
            Some(Command::Validate(args)) => args,
            other => panic!("{other:?}"),
        }
    }

    /// Words of a command as a shell sees them, where quotes are around whole words.
    fn words(line: &str) -> Vec<&str> {
        let pieces = line.split('\'').enumerate();
        pieces
            .flat_map(|(i, piece)| match i % 2 {
                0 => piece.split_whitespace().collect(),
                _ => vec![piece],
            })
            .collect()
    }

    #[test]
    fn what_replays_a_failure_is_a_command() {
        let asked = ["pathspace", "validate", "calibration", "--effort", "0.5", "--seed", "7"];
        let failure = Failure {
            scene: "glass in a furnace, from inside".into(),
            integrators: vec!["pt:max_depth=4".into(), "pt:max_depth=4#2".into()],
            length: None,
            tile: None,
            seed: 7,
            message: String::new(),
            level: 1.25e-7,
        };
        let told = told(failure, &parse(asked));
        let again = parse(words(&told.replay));
        assert_eq!((again.suite.as_str(), again.seed), ("calibration", 7));
        assert_eq!((again.level, again.effort), (Some(1.25e-7), Some(0.5)));
        assert_eq!(again.scenes, ["glass in a furnace, from inside"]);
        let specs: Vec<String> = again.integrators.iter().map(ToString::to_string).collect();
        assert_eq!(specs, ["pt:max_depth=4", "pt:max_depth=4"]);
    }
}
