//! `pathspace reference`.

use std::io::Write;
use std::ops::ControlFlow;

use anyhow::{Context, Result, anyhow, bail};
use pathspace_benches::Budget;
use pathspace_benches::analysis::{Questions, analyse};
use pathspace_benches::experiment::{Cell, Contestant, ExperimentStatus, Plan, Setup, Store};
use pathspace_benches::output::{Metadata, read_text};
use pathspace_benches::reference::{Part, ReferenceImage, reference_path};
use pathspace_benches::results::Results;
use pathspace_integrators::{Registry, Spec};
use pathspace_validation::stats::Verdict;
use serde::Serialize;

use super::Done;
use super::args::ReferenceArgs;
use super::interrupt::{self, Interrupted};
use super::progress::Progress;
use super::scene::{Prepared, pool, prepare};
use super::table::{figure, percent};

/// Integrators of a reference unless others are named.
const PAIR: [&str; 2] = ["bdpt", "pt"];
/// Replicates of each integrator in a round; enough for all tests on the pair.
const ROUND: u32 = 16;

/// What `--json` prints; see docs/json.md.
#[derive(Debug, Serialize)]
struct Report<'a> {
    scene: &'a str,
    scene_hash: &'a str,
    image: String,
    integrators: Vec<String>,
    verdict: Option<Verdict>,
    p: Option<f64>,
    relative_error: f64,
    wanted: f64,
    seconds: f64,
    replicates: u32,
    cached: bool,
}

/// Builds the reference of a scene, or finds that there is one that is good enough.
pub(super) fn reference(
    registry: &Registry,
    args: &ReferenceArgs,
    verbose: bool,
    out: &mut dyn Write,
) -> Result<Done> {
    let prepared = prepare(&args.scene, verbose)?;
    let setup = setup(registry, args, &prepared)?;
    let wanted = wanted(args, &setup)?;
    let path = reference_path(&args.output, &setup.name, &setup.key);
    let mut report = Report {
        scene: &args.scene.scene,
        scene_hash: &prepared.hash,
        image: path.display().to_string(),
        integrators: setup.contestants.iter().map(|c| c.0.clone()).collect(),
        verdict: None,
        p: None,
        relative_error: f64::NAN,
        wanted,
        seconds: 0.0,
        replicates: 0,
        cached: true,
    };
    if path.is_file() {
        let there = ReferenceImage::read(&path, setup.pixels())?;
        report.relative_error = there.relative_error();
        report.integrators = there.summary().integrators;
    }
    if !(report.relative_error <= wanted) {
        report.cached = false;
        std::fs::create_dir_all(&args.output)
            .with_context(|| format!("{}: cannot make directory", args.output.display()))?;
        build(args, &prepared, setup, &mut report)?;
    }
    writeln!(
        out,
        "{}: {} by {}{}: relative error {}, asked for {}",
        report.scene,
        report.image,
        report.integrators.join(" and "),
        if report.cached { ", already there" } else { "" },
        percent(report.relative_error),
        percent(wanted)
    )?;
    if let (Some(verdict), Some(p)) = (report.verdict, report.p) {
        let seconds = figure(report.seconds);
        writeln!(out, "they {verdict} (p = {p:.3}) after {seconds} s of rendering")?;
    }
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&report)?)?;
    }
    Ok(Done::Well)
}

/// Round after round until the error is small enough, the pair differs or the time is up.
fn build(
    args: &ReferenceArgs,
    prepared: &Prepared,
    setup: Setup,
    report: &mut Report<'_>,
) -> Result<()> {
    let pool = pool(args.scene.threads)?;
    let store = Store::temporary()?;
    let budget = Budget::Seconds(args.seconds);
    let mut plan = Plan {
        setups: vec![setup],
        budgets: vec![budget],
        // The first round tells the weights, and is in no reference.
        replicates: ROUND,
        seed: args.scene.seed,
        threads: pool.current_num_threads(),
        failures: Vec::new(),
    };
    interrupt::install();
    let progress = Progress::new();
    loop {
        plan.replicates += ROUND;
        let mut watch = |status: &ExperimentStatus<'_>| {
            progress.set(status.done, || format!("replicate {}", status.replicate + 1));
            if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        if !pool.install(|| plan.run(&store, &mut watch))? {
            bail!(Interrupted("interrupted: no reference was written".into()));
        }
        let setup = &plan.setups[0];
        let found = pool.install(|| analyse(&plan, &store, setup, None, &Questions::default()))?;
        let judgement = &found.results.pairs[0].judgement;
        (report.verdict, report.p) = (Some(judgement.verdict), Some(judgement.p));
        report.replicates = plan.replicates;
        if judgement.verdict == Verdict::Differ {
            bail!(
                "{}: {} and {} differ (p = {:.1e}): no reference",
                setup.name,
                judgement.a,
                judgement.b,
                judgement.p
            );
        }
        let cells: Vec<Vec<Cell>> =
            setup.contestants.iter().map(|(n, _)| plan.cells(&store, setup, n, budget)).collect();
        let parts: Vec<Part<'_>> = (setup.contestants.iter().zip(&cells))
            .map(|((name, c), cells)| Part { name, families: c.families(&setup.scene), cells })
            .collect();
        let image = ReferenceImage::of(&parts, ROUND as usize, setup.pixels());
        report.relative_error = image.relative_error();
        report.seconds = cells.iter().flatten().map(|c| c.seconds).sum();
        if report.relative_error <= report.wanted && judgement.verdict == Verdict::Agree {
            let used = || cells.iter().flat_map(|c| c.iter().skip(ROUND as usize));
            let metadata = Metadata {
                scene: args.scene.scene.clone(),
                scene_hash: prepared.hash.clone(),
                integrator: String::new(),
                seed: plan.seed,
                samples_per_pixel: used().map(|c| c.spp).sum(),
                replicates: used().count() as u64,
                seconds: report.seconds,
                version: env!("CARGO_PKG_VERSION").into(),
            };
            image.write(std::path::Path::new(&report.image), *setup.scene.film(), metadata)?;
            return Ok(());
        }
        if report.seconds > args.limit {
            bail!(
                "{}: after {} s the relative error is {}, asked for {}, and the verdict {} (detectable bias {}): no reference; \
                 see --limit",
                setup.name,
                figure(report.seconds),
                percent(report.relative_error),
                percent(report.wanted),
                judgement.verdict,
                percent(judgement.mdb)
            );
        }
    }
}

fn setup(registry: &Registry, args: &ReferenceArgs, prepared: &Prepared) -> Result<Setup> {
    let mut specs: Vec<Spec> = args.integrators.clone();
    if specs.is_empty() {
        specs = PAIR.iter().map(|name| name.parse()).collect::<Result<_, _>>()?;
    }
    if specs.len() != 2 || specs[0] == specs[1] {
        bail!("a reference needs two different integrators, {} given", specs.len());
    }
    let mut contestants = Vec::new();
    for spec in &specs {
        let integrator = prepared.integrator(registry, Some(spec))?;
        contestants.push((integrator.spec(), Contestant::Own(integrator)));
    }
    Ok(Setup {
        name: prepared.name.clone(),
        hash: prepared.hash.clone(),
        key: prepared.key.clone(),
        scene: prepared.scene.clone(),
        contestants,
    })
}

/// The error that is good enough: as asked for, or a share of the smallest that is to be compared.
fn wanted(args: &ReferenceArgs, setup: &Setup) -> Result<f64> {
    let Some(path) = &args.results else {
        return args.error.ok_or_else(|| anyhow!("--error or --for is missing"));
    };
    let text = read_text(path).with_context(|| format!("{}: cannot read", path.display()))?;
    let results: Results =
        serde_json::from_str(&text).with_context(|| format!("{}: no results", path.display()))?;
    let scenes = results.scenes.iter().filter(|s| s.hash == setup.hash);
    let points = scenes.flat_map(|s| &s.methods).flat_map(|a| &a.points);
    let smallest = points.map(|p| p.relmse).filter(|e| *e > 0.0).fold(f64::INFINITY, f64::min);
    if !smallest.is_finite() {
        bail!("{}: no errors on this scene", path.display());
    }
    Ok(args.fraction * smallest.sqrt())
}
