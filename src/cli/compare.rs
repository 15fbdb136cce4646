//! `pathspace compare`.

use std::fs;
use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result, bail};
use pathspace_benches::compare::{Comparison, PairSummary};
use pathspace_benches::output::{Metadata, NamedLayer, Output, Picture, exposure};
use pathspace_benches::replicate::{self, Arm, Experiment, ExperimentStatus, Replicates};
use pathspace_core::integrator::Integrator;
use pathspace_integrators::{Registry, Spec};
use pathspace_validation::pairs::LengthSummary;
use pathspace_validation::stats::{CompareConfig, Reason};
use serde::Serialize;

use super::args::CompareArgs;
use super::progress::Progress;
use super::render::tell_nonfinite;
use super::scene::{Prepared, pool, prepare};
use super::table::{Table, figure, p_value, percent};
use super::{Done, interrupt};

/// What `--json` prints; see docs/json.md.
#[derive(Debug, Serialize)]
struct Report<'a> {
    scene: &'a str,
    scene_hash: &'a str,
    seed: u64,
    threads: usize,
    width: u32,
    height: u32,
    replicates: usize,
    complete: bool,
    #[serde(flatten)]
    comparison: &'a Comparison,
    version: &'a str,
}

/// Compares integrators on a scene.
pub(super) fn compare(
    registry: &Registry,
    args: &CompareArgs,
    out: &mut dyn Write,
) -> Result<Done> {
    let prepared = prepare(&args.scene)?;
    let integrators = integrators(registry, args, &prepared)?;
    let pool = pool(args.scene.threads)?;
    let outputs = args.output.as_deref().map(|dir| open(dir, &integrators)).transpose()?;
    interrupt::install();
    let progress = Progress::new();
    let mut watch = |status: &ExperimentStatus| {
        let what = || {
            let name = integrators[status.integrator].spec();
            format!("replicate {} of {}, {name}", status.replicate + 1, args.replicates)
        };
        progress.set(status.done, what);
        if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let experiment = Experiment {
        scene: prepared.scene.clone(),
        integrators: &integrators,
        budget: args.budget.budget(),
        replicates: args.replicates,
        seed: args.scene.seed,
    };
    let config = CompareConfig::default();
    let judged = pool.install(|| -> Result<(Replicates, Comparison)> {
        let replicates = replicate::run(&experiment, &mut watch)?;
        let least = replicates.arms.iter().map(|a| a.replicates.len()).min().unwrap_or(0);
        if least < 2 {
            bail!("interrupted after {least} replicates; a comparison needs 2 at least");
        }
        let comparison = pathspace_benches::compare::compare(&replicates, &config)?;
        Ok((replicates, comparison))
    });
    drop(progress);
    let (replicates, mut comparison) = judged?;
    if let Some(outputs) = &outputs {
        write(outputs, args, &prepared, &replicates, &mut comparison)?;
    }
    for arm in &replicates.arms {
        let count = arm.replicates.iter().map(|r| r.nonfinite).sum();
        tell_nonfinite(arm.name(), count, &arm.nonfinite_examples);
    }

    let crop = prepared.scene.film().crop;
    let report = Report {
        scene: &args.scene.scene,
        scene_hash: &prepared.hash,
        seed: args.scene.seed,
        threads: pool.current_num_threads(),
        width: crop.width,
        height: crop.height,
        replicates: replicates.arms.iter().map(|a| a.replicates.len()).min().unwrap_or(0),
        complete: replicates.complete,
        comparison: &comparison,
        version: env!("CARGO_PKG_VERSION"),
    };
    tell(&report, out)?;
    if let Some(dir) = &args.output {
        writeln!(out, "\nimages in {}", dir.display())?;
    }
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&report)?)?;
    }
    Ok(if comparison.any_differ() { Done::Differ } else { Done::Well })
}

fn integrators(
    registry: &Registry,
    args: &CompareArgs,
    prepared: &Prepared,
) -> Result<Vec<Box<dyn Integrator>>> {
    let mut specs: Vec<Spec> = args.integrators.clone();
    if specs.is_empty() {
        for (name, _) in registry.list() {
            specs.push(name.parse()?);
        }
    }
    specs.iter().map(|spec| prepared.integrator(registry, Some(spec))).collect()
}

/// One image for each integrator, in a directory that is made where it does not exist.
fn open(dir: &Path, integrators: &[Box<dyn Integrator>]) -> Result<Vec<Output>> {
    fs::create_dir_all(dir).with_context(|| format!("{}: cannot make directory", dir.display()))?;
    let mut names: Vec<String> = Vec::new();
    for integrator in integrators {
        let plain = |c: char| if c.is_alphanumeric() || "-=.".contains(c) { c } else { '_' };
        let name: String = integrator.spec().chars().map(plain).collect();
        let same = names.iter().filter(|n| **n == name).count();
        let number = if same == 0 { String::new() } else { format!("_{}", same + 1) };
        names.push(name.clone());
        names.push(format!("{name}{number}"));
    }
    let unique = names.iter().skip(1).step_by(2);
    unique.map(|name| Ok(Output::open(&dir.join(format!("{name}.exr")))?)).collect()
}

/// Mean images, all with the exposure of the first, and their variance.
fn write(
    outputs: &[Output],
    args: &CompareArgs,
    prepared: &Prepared,
    replicates: &Replicates,
    comparison: &mut Comparison,
) -> Result<()> {
    let shared = replicates.arms.first().map_or(1.0, |arm| exposure(arm.whole.mean()));
    let summaries = &mut comparison.integrators;
    for ((output, arm), summary) in outputs.iter().zip(&replicates.arms).zip(summaries) {
        let metadata = Metadata {
            scene: args.scene.scene.clone(),
            scene_hash: prepared.hash.clone(),
            integrator: arm.name().to_owned(),
            seed: args.scene.seed,
            samples_per_pixel: total(arm, |r| r.samples_per_pixel),
            replicates: arm.whole.count(),
            seconds: total(arm, |r| r.spent.seconds),
            version: env!("CARGO_PKG_VERSION").into(),
        };
        // Of the mean, which is what the file shows.
        let n = arm.whole.count() as f64;
        let pixels = arm.whole.variance().iter().map(|p| p.map(|v| v / n)).collect();
        let layers = [NamedLayer { name: "variance".into(), pixels }];
        let film = *prepared.scene.film();
        let picture = Picture { film, pixels: arm.whole.mean(), layers: &layers, metadata };
        output.write(&picture, shared)?;
        summary.output = Some(output.exr().display().to_string());
    }
    Ok(())
}

fn total(arm: &Arm, f: impl Fn(&replicate::Replicate) -> f64) -> f64 {
    arm.replicates.iter().map(f).sum()
}

fn tell(report: &Report<'_>, out: &mut dyn Write) -> Result<()> {
    if !report.complete {
        writeln!(out, "interrupted: what follows is from {} replicates", report.replicates)?;
    }
    writeln!(
        out,
        "{}: {}×{}, {} replicates of each integrator, seed {}, {} threads\n",
        report.scene, report.width, report.height, report.replicates, report.seed, report.threads
    )?;
    let mut table = Table::new(
        &["integrator", "spp", "seconds", "cpu s", "MSE", "relMSE", "efficiency", "Mrays/s"],
        &[0],
    );
    for i in &report.comparison.integrators {
        table.row(vec![
            i.integrator.clone(),
            figure(i.spp),
            figure(i.seconds),
            figure(i.cpu_seconds),
            figure(i.mse),
            figure(i.relmse),
            figure(i.efficiency),
            figure(i.rays / i.seconds / 1e6),
        ]);
    }
    table.write("", out)?;
    writeln!(
        out,
        "Figures of one replicate. MSE is the variance across replicates, averaged over the pixels of all that the\n\
         integrator can make; efficiency is 1/(MSE·seconds)."
    )?;
    for pair in &report.comparison.pairs {
        tell_pair(pair, out)?;
    }
    Ok(())
}

fn tell_pair(summary: &PairSummary, out: &mut dyn Write) -> Result<()> {
    let pair = &summary.judgement;
    let (a, b, verdict) = (&pair.a, &pair.b, pair.verdict);
    writeln!(out, "\n{a} and {b}: {}", verdict.as_str().to_uppercase())?;
    for u in &pair.unseen {
        writeln!(
            out,
            "  {} can not make {} of {}'s image ({}): left out here",
            u.integrator,
            percent(u.fraction),
            u.of,
            u.reason
        )?;
    }
    if pair.lengths.is_empty() {
        writeln!(out, "  there is no light that both can make")?;
        return Ok(());
    }
    let mean_a = format!("mean {a}");
    let mean_b = format!("mean {b}");
    let mut table =
        Table::new(&["path length", &mean_a, &mean_b, "p", "detectable bias", "verdict"], &[0, 5]);
    let size = |l: &LengthSummary| l.mean_a.abs().max(l.mean_b.abs());
    let mut dim = Vec::new();
    for l in &pair.lengths {
        let shown = size(l) >= 1e-3 * size(&pair.image);
        if !shown && l.verdict.as_str() != "differ" {
            dim.push(l);
            continue;
        }
        table.row(cells(l));
    }
    table.row(cells(&pair.image));
    table.write("  ", out)?;
    if !dim.is_empty() {
        let share = dim.iter().map(|l| size(l)).sum::<f64>() / size(&pair.image);
        writeln!(
            out,
            "  and {} more with {} of the light, none of which differs",
            dim.len(),
            percent(share)
        )?;
    }
    if let Some(t) = &pair.tiles {
        writeln!(
            out,
            "  {}×{} tiles by kind of path, merged to {} groups: p = {}, {}",
            t.columns,
            t.rows,
            t.groups,
            p_value(t.p),
            t.verdict
        )?;
    }
    writeln!(
        out,
        "  efficiency of {a} over {b} on what both make: {}",
        figure(summary.efficiency_ratio)
    )?;
    Ok(())
}

fn cells(l: &LengthSummary) -> Vec<String> {
    let why = match l.reason {
        Reason::BothZero => " (no light)",
        Reason::Resolved | Reason::Significant => "",
        Reason::TooNoisy => " (noise)",
        Reason::NeverSampled => " (one never finds it)",
        Reason::FewContributions => " (too few hits to judge)",
        Reason::HeavyTail => " (infinite variance)",
    };
    vec![
        l.length.map_or("image".into(), |k| k.to_string()),
        figure(l.mean_a),
        figure(l.mean_b),
        p_value(l.p),
        percent(l.mdb),
        format!("{}{why}", l.verdict),
    ]
}
