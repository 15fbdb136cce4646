//! `pathspace compare`.

mod firmer;
pub(super) mod screen;
mod setup;
pub(super) mod tell;

use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result, bail};
use pathspace_benches::analysis::{Analysed, Questions, analyse, overall};
use pathspace_benches::experiment::{
    ChangedScene, Config, ExperimentStatus, Many, Plan, SceneConfig, Store,
};
use pathspace_benches::output::read_text;
use pathspace_benches::plots;
use pathspace_benches::record::{self, Pictures};
use pathspace_benches::reference::{ReferenceImage, reference_path};
use pathspace_benches::report;
use pathspace_benches::results::{Machine, Results, SCHEMA};
use pathspace_integrators::Registry;
use serde::Serialize;

use super::args::CompareArgs;
use super::image::Stops;
use super::interrupt::{self, Interrupted};
use super::progress::Progress;
use super::scene::pool;
use super::{Done, say};
use setup::Scenes;
use tell::{Report, tell_curves, tell_details, tell_overall};

/// The page in the folder of the results.
const PAGE: &str = "report.html";
/// Replicates unless asked for otherwise.
const REPLICATES: u32 = 16;
/// Folder of finished renders in that of the results.
const CELLS: &str = "cells";

/// Several scenes in one object; see docs/json.md.
#[derive(Debug, Serialize)]
struct Reports<'a> {
    scenes: Vec<Report<'a>>,
    overall: &'a [pathspace_benches::results::Overall],
    complete: bool,
    version: &'a str,
}

/// Compares integrators on scenes.
pub(super) fn compare(
    registry: &Registry,
    args: &CompareArgs,
    verbose: bool,
    out: &mut dyn Write,
) -> Result<Done> {
    interrupt::install();
    let mut config = config(args)?;
    let pool = pool(config.threads)?;
    config.threads = u16::try_from(pool.current_num_threads()).ok();
    let mut scenes = Scenes::open(registry, &config, verbose)?;
    if let Some(dir) = &args.output {
        record::prepare(dir)?;
    }
    let store = match &args.output {
        Some(dir) => Store::open(&dir.join(CELLS))?,
        None => Store::temporary()?,
    };
    let mut plan = Plan {
        setups: std::mem::take(&mut scenes.setups),
        budgets: config.budgets()?,
        replicates: config.replicates,
        seed: config.seed,
        threads: pool.current_num_threads(),
        failures: Vec::new(),
    };
    interrupt::keep();
    let complete = render(&mut plan, &store, &pool)?;
    for failure in &plan.failures {
        say(failure);
    }
    scenes.notes.append(&mut plan.failures);
    let references = references(&plan, &config)?;
    let questions = Questions {
        baseline: config.baseline.clone(),
        target_error: config.target_error,
        ..Questions::default()
    };
    let mut analysed = Vec::new();
    for (setup, reference) in plan.setups.iter().zip(&references) {
        let fewest = fewest(&plan, &store, setup);
        if !complete && fewest < 2 {
            if analysed.is_empty() {
                let there = if args.output.is_some() { "; the same command goes on" } else { "" };
                bail!(Interrupted(format!(
                    "interrupted after {fewest} replicates; a comparison needs 2 at least{there}"
                )));
            }
            break;
        }
        let done = pool.install(|| analyse(&plan, &store, setup, reference.as_ref(), &questions));
        let done = done.with_context(|| setup.name.clone())?;
        for note in &done.notes {
            say(&format!("warning: {note}"));
        }
        scenes.notes.extend(done.notes.iter().cloned());
        analysed.push(done);
    }
    if let Some(dir) = &args.output {
        let progress = Progress::new();
        let pictures = Pictures {
            folder: dir,
            plan: &plan,
            store: &store,
            exposure: args.exposure.factor(),
            stop: interrupt::requested,
        };
        for (n, (setup, one)) in plan.setups.iter().zip(&mut analysed).enumerate() {
            progress.set(n as f64 / plan.setups.len() as f64, || "pictures".into());
            let light = pool.install(|| pictures.draw(setup, references[n].as_ref(), one))?;
            if args.exposure == Stops::Auto {
                say(&format!("{}: exposure {:+.1} EV", setup.name, light.log2()));
            }
        }
    }
    let results = results(&config, &scenes, &analysed, complete);
    if let Some(dir) = &args.output {
        record::write_results(dir, &results)?;
        report::write(&results, dir, &dir.join(PAGE))?;
        if complete {
            store.remove();
        }
    }
    finish(&plan, &scenes, &analysed, &results, (args, verbose), out)
}

/// The first screen, details where asked for, warnings, paths and the object of `--json`.
fn finish(
    plan: &Plan,
    scenes: &Scenes,
    analysed: &[Analysed],
    results: &Results,
    (args, verbose): (&CompareArgs, bool),
    out: &mut dyn Write,
) -> Result<Done> {
    for (name, count, example) in analysed.iter().flat_map(|a| &a.nonfinite) {
        let first = example.as_ref().map_or(String::new(), |e| format!("; the first: {e}"));
        say(&format!(
            "warning: {name}: {count} contributions were not finite and are left out{first}"
        ));
    }
    let reports: Vec<Report<'_>> = (analysed.iter().zip(&scenes.asked))
        .map(|(one, asked)| Report {
            scene: asked,
            scene_hash: &one.results.hash,
            seed: plan.seed,
            threads: plan.threads,
            width: one.results.width,
            height: one.results.height,
            replicates: one.comparison.integrators.iter().map(|i| i.replicates).min().unwrap_or(0),
            complete: results.complete,
            comparison: &one.comparison,
            version: env!("CARGO_PKG_VERSION"),
        })
        .collect();
    screen::tell(results, out)?;
    for scene in &results.scenes {
        tell_curves(scene, out)?;
    }
    tell_overall(&results.overall, out)?;
    if verbose {
        tell_details(results, out)?;
    }
    for note in &results.notes {
        writeln!(out, "\n{note}")?;
    }
    if let Some(dir) = &args.plots {
        let files = plots::write(results, dir)?;
        writeln!(out, "\nCharts  {} files in {}", files.len(), dir.display())?;
    }
    firmer::tell(args, verbose, results.complete, out)?;
    if args.json {
        let text = match reports.as_slice() {
            [one] => serde_json::to_string(one)?,
            _ => serde_json::to_string(&Reports {
                scenes: reports,
                overall: &results.overall,
                complete: results.complete,
                version: env!("CARGO_PKG_VERSION"),
            })?,
        };
        writeln!(out, "{text}")?;
    }
    if !results.complete {
        return Ok(Done::Interrupted);
    }
    let differ = analysed.iter().any(|a| a.comparison.any_differ());
    Ok(if differ { Done::Differ } else { Done::Well })
}

/// The experiment that the command line describes, or the file that it names.
fn config(args: &CompareArgs) -> Result<Config> {
    if let Some(path) = &args.experiment {
        let text = read_text(path).with_context(|| format!("{}: cannot read", path.display()))?;
        let mut config = Config::parse(&text).with_context(|| path.display().to_string())?;
        config.threads = args.scene.threads.or(config.threads);
        config.references = args.references.clone().or(config.references);
        return Ok(config);
    }
    let options = &args.scene;
    let changed = options.crop.is_some() || !options.define.is_empty();
    let scene = |name: &String| {
        if !changed {
            return SceneConfig::Name(name.clone());
        }
        SceneConfig::Changed(ChangedScene {
            scene: name.clone(),
            size: None,
            crop: options.crop.map(|c| format!("{},{},{},{}", c.x, c.y, c.width, c.height)),
            max_depth: None,
            define: options.define.iter().cloned().collect(),
        })
    };
    let config = Config {
        scenes: args.scenes.iter().map(scene).collect(),
        integrators: args.integrators.iter().map(ToString::to_string).collect(),
        spp: args.spp.map(Many::One),
        seconds: args.seconds.map(Many::One),
        sweep: args.sweep.clone(),
        replicates: args.replicates.unwrap_or(REPLICATES),
        seed: options.seed,
        threads: options.threads,
        size: options.size.map(|(w, h)| format!("{w}x{h}")),
        max_depth: options.max_depth,
        baseline: args.baseline.as_ref().map(ToString::to_string),
        target_error: args.target_error,
        references: args.references.clone(),
    };
    if args.spp.is_none() && args.seconds.is_none() && args.sweep.is_none() {
        bail!("a budget is missing: --spp, --seconds or --sweep");
    }
    config.check()?;
    Ok(config)
}

/// Renders what is not there yet; false where it was interrupted.
fn render(plan: &mut Plan, store: &Store, pool: &rayon::ThreadPool) -> Result<bool> {
    let progress = Progress::new();
    let replicates = plan.replicates;
    let mut watch = |status: &ExperimentStatus<'_>| {
        let what = || {
            let ExperimentStatus { scene, integrator, replicate, .. } = status;
            format!("{scene}: replicate {} of {replicates}, {integrator}", replicate + 1)
        };
        progress.set(status.done, what);
        if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    Ok(pool.install(|| plan.run(store, &mut watch))?)
}

fn fewest(plan: &Plan, store: &Store, setup: &pathspace_benches::experiment::Setup) -> usize {
    let budget = plan.budgets[plan.budgets.len() - 1];
    let finished = setup.contestants.iter().map(|(n, _)| plan.cells(store, setup, n, budget).len());
    finished.min().unwrap_or(0)
}

/// The reference of every scene that has one in the folder.
fn references(plan: &Plan, config: &Config) -> Result<Vec<Option<ReferenceImage>>> {
    let one = |setup: &pathspace_benches::experiment::Setup| {
        let Some(folder) = &config.references else { return Ok(None) };
        let path = reference_path(folder, &setup.name, &setup.key);
        if !path.is_file() {
            say(&format!(
                "no reference of {} in {}: its errors are the variance across replicates",
                setup.name,
                folder.display()
            ));
            return Ok(None);
        }
        Ok(Some(ReferenceImage::read(&path, setup.pixels())?))
    };
    plan.setups.iter().map(one).collect()
}

fn results(config: &Config, scenes: &Scenes, analysed: &[Analysed], complete: bool) -> Results {
    let scenes_of: Vec<_> = analysed.iter().map(|a| a.results.clone()).collect();
    let version = env!("CARGO_PKG_VERSION");
    let words: Vec<String> = std::env::args().skip(1).collect();
    Results {
        schema: SCHEMA,
        version: version.into(),
        citation: format!(
            "The pathspace authors: pathspace {version}, a framework for research in bidirectional and Metropolis light \
             transport. Scene hashes and seeds are those of this file."
        ),
        machine: Machine {
            cpu: cpu(),
            threads: config.threads.map_or(0, usize::from),
            os: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        },
        command: std::iter::once("pathspace".to_owned()).chain(words).collect::<Vec<_>>().join(" "),
        experiment: config.to_toml(),
        seed: config.seed,
        complete,
        overall: overall(&scenes_of),
        scenes: scenes_of,
        notes: scenes.notes.clone(),
    }
}

/// Model of the processor, where the system tells.
fn cpu() -> String {
    let text = std::fs::read_to_string(Path::new("/proc/cpuinfo")).unwrap_or_default();
    let line = text.lines().find_map(|l| l.strip_prefix("model name"));
    line.and_then(|l| l.split_once(':')).map_or(String::new(), |(_, name)| name.trim().to_owned())
}
