//! `pathspace render`.

use std::io::Write;
use std::ops::ControlFlow;

use anyhow::Result;
use pathspace_benches::output::{
    Metadata, NamedLayer, Output, Picture, Weighting, exposure, technique_sheet,
};
use pathspace_benches::{Exposure, Status, expose};
use pathspace_core::film::{Film, NonFinite};
use pathspace_integrators::Registry;
use serde::Serialize;

use super::args::RenderArgs;
use super::progress::Progress;
use super::scene::{Prepared, pool, prepare};
use super::{Done, interrupt, say};

/// What `--json` prints; see docs/json.md.
#[derive(Debug, Serialize)]
struct Report<'a> {
    scene: &'a str,
    scene_hash: &'a str,
    integrator: &'a str,
    seed: u64,
    threads: usize,
    width: u32,
    height: u32,
    samples_per_pixel: f64,
    samples: u64,
    seconds: f64,
    cpu_seconds: f64,
    rays: u64,
    nonfinite: u64,
    mean: [f64; 3],
    complete: bool,
    output: Option<String>,
    version: &'a str,
}

/// Renders a scene with one integrator.
pub(super) fn render(registry: &Registry, args: &RenderArgs, out: &mut dyn Write) -> Result<Done> {
    let prepared = prepare(&args.scene)?;
    let integrator = prepared.integrator(registry, args.integrator.as_ref())?;
    let pool = pool(args.scene.threads)?;
    let output = args.output.as_deref().map(Output::open).transpose()?;
    interrupt::install();
    let progress = Progress::new();
    let mut watch = |status: &Status| {
        progress.set(status.used, || format!("{} spp", status.samples_per_pixel));
        if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let rendered = pool.install(|| {
        let budget = args.budget.budget();
        expose(&*integrator, &prepared.scene, args.layers, args.scene.seed, budget, &mut watch)
    });
    drop(progress);
    let exposed = rendered?;
    let spec = integrator.spec();
    if let Some(output) = &output {
        write(output, args, &prepared, &spec, &exposed)?;
    }
    tell_nonfinite(&spec, exposed.film.nonfinite(), exposed.film.nonfinite_examples());

    let film = &exposed.film;
    let written = output.map(|o| o.exr().display().to_string());
    let report = Report {
        scene: &args.scene.scene,
        scene_hash: &prepared.hash,
        integrator: &spec,
        seed: args.scene.seed,
        threads: pool.current_num_threads(),
        width: film.description().crop.width,
        height: film.description().crop.height,
        samples_per_pixel: film.samples_per_pixel(),
        samples: film.samples(),
        seconds: exposed.spent.seconds,
        cpu_seconds: exposed.spent.cpu_seconds,
        rays: exposed.work.rays,
        nonfinite: film.nonfinite(),
        mean: film.mean(),
        complete: exposed.complete,
        output: written,
        version: env!("CARGO_PKG_VERSION"),
    };
    tell(&report, out)?;
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&report)?)?;
    }
    Ok(Done::Well)
}

fn tell(report: &Report<'_>, out: &mut dyn Write) -> Result<()> {
    let Report { scene, integrator, width, height, samples_per_pixel, seconds, .. } = report;
    let early = if report.complete { "" } else { "interrupted: " };
    let rate = report.rays as f64 / seconds / 1e6;
    writeln!(
        out,
        "{early}{scene} by {integrator}: {width}×{height}, {samples_per_pixel} samples per pixel \
         in {seconds:.2} s ({rate:.2} Mrays/s), seed {}",
        report.seed
    )?;
    match &report.output {
        Some(path) => writeln!(out, "wrote {path}")?,
        None => writeln!(out, "no image written (ask with -o FILE.exr)")?,
    }
    Ok(())
}

fn write(
    output: &Output,
    args: &RenderArgs,
    prepared: &Prepared,
    spec: &str,
    exposed: &Exposure,
) -> Result<()> {
    let film = &exposed.film;
    let pixels = film.image();
    let layers = named_layers(film);
    let metadata = Metadata {
        scene: args.scene.scene.clone(),
        scene_hash: prepared.hash.clone(),
        integrator: spec.to_owned(),
        seed: args.scene.seed,
        samples_per_pixel: film.samples_per_pixel(),
        replicates: 1,
        seconds: exposed.spent.seconds,
        version: env!("CARGO_PKG_VERSION").into(),
    };
    let picture = Picture { film: *film.description(), pixels: &pixels, layers: &layers, metadata };
    output.write(&picture, exposure(&pixels))?;
    for (weighting, suffix) in
        [(Weighting::Weighted, "techniques.png"), (Weighting::Unweighted, "unweighted.png")]
    {
        if let Some(sheet) = technique_sheet(film, weighting) {
            output.write_beside(suffix, &sheet)?;
        }
    }
    Ok(())
}

fn named_layers(film: &Film) -> Vec<NamedLayer> {
    let layer = |key: &pathspace_core::film::LayerKey| {
        film.layer_image(*key).map(|pixels| NamedLayer { name: key.name(), pixels })
    };
    film.planes().keys().filter_map(layer).collect()
}

/// A film with contributions that were left out is wrong: says so, and how to make them again.
pub(super) fn tell_nonfinite(spec: &str, count: u64, examples: &[NonFinite]) {
    if count == 0 {
        return;
    }
    let first = examples.first().map_or(String::new(), |n| {
        let (a, c) = (n.address, n.contribution);
        format!(
            "; the first: seed {}, step {}, item {}, technique ({},{}), value {:?}",
            a.seed,
            a.step,
            a.item,
            c.s,
            c.t,
            c.value.to_array()
        )
    });
    say(&format!("warning: {spec}: {count} contributions were not finite and are left out{first}"));
}
