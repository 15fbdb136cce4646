//! `pathspace render`.

use std::io::Write;
use std::ops::ControlFlow;

use anyhow::{Result, bail};
use pathspace_benches::checkpoint::{Identity, Shards};
use pathspace_benches::output::{Metadata, Output};
use pathspace_benches::precision::CONFIDENCE;
use pathspace_benches::preview::Preview;
use pathspace_benches::{Budget, Exposure, Plan, RelativeError, Session, Shard, Status};
use pathspace_core::film::{Film, Layers, NonFinite};
use pathspace_integrators::Registry;
use serde::Serialize;

use super::args::RenderArgs;
use super::checkpoint::Keeper;
use super::image;
use super::progress::Progress;
use super::scene::{pool, prepare};
use super::{Done, interrupt, say};

/// What `--json` prints; see docs/json.md.
#[derive(Debug, Serialize)]
struct Report<'a> {
    scene: &'a str,
    scene_hash: &'a str,
    integrator: &'a str,
    seed: u64,
    shard: Option<String>,
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
    error: Option<Noise>,
    checkpoint: Option<String>,
    resumed_at: Option<f64>,
    output: Option<String>,
    version: &'a str,
}

/// The relative error of the image, where it was asked for.
#[derive(Debug, Serialize)]
struct Noise {
    target: f64,
    confidence: f64,
    /// `None` where too little is known.
    #[serde(flatten)]
    found: Option<RelativeError>,
    batches: u64,
    batch_samples_per_pixel: f64,
}

impl Noise {
    fn of(session: &Session<'_>, target: Option<f64>) -> Option<Noise> {
        let (target, precision) = target.zip(session.precision())?;
        Some(Noise {
            target,
            confidence: CONFIDENCE,
            found: session.error(),
            batches: precision.batches(),
            batch_samples_per_pixel: precision.batch_samples_per_pixel(),
        })
    }

    /// One line for people.
    fn tell(&self) -> String {
        let Noise { target, confidence, batches, .. } = self;
        let Some(RelativeError { value, low, high }) = self.found else {
            return format!("relative error: unknown after {batches} batches");
        };
        let percent =
            |v: f64| if v.is_finite() { format!("{:.3} %", 100.0 * v) } else { "∞".into() };
        let reached = if high <= *target { "not above" } else { "not yet surely below" };
        format!(
            "relative error {} ({} to {} with {:.0} % confidence from {batches} batches), {reached} {}",
            percent(value),
            percent(low),
            percent(high),
            100.0 * confidence,
            percent(*target)
        )
    }
}

/// Renders a scene with one integrator.
pub(super) fn render(registry: &Registry, args: &RenderArgs, out: &mut dyn Write) -> Result<Done> {
    let prepared = prepare(&args.scene)?;
    let integrator = prepared.integrator(registry, args.integrator.as_ref())?;
    let shard = args.shard.unwrap_or(Shard::WHOLE);
    let goal = args.goal.goal();
    if goal.budget.map(|b| shard.share_of(b)) == Some(Budget::Samples(0)) {
        bail!("nothing is left for shard {shard}: there are fewer samples per pixel than shards");
    }
    let pool = pool(args.scene.threads)?;
    let output = args.output.as_deref().map(Output::open).transpose()?;
    let spec = integrator.spec();
    let identity = Identity {
        version: env!("CARGO_PKG_VERSION").into(),
        scene: args.scene.scene.clone(),
        scene_hash: prepared.hash.clone(),
        integrator: spec.clone(),
        rules: prepared.defaults.rules,
        seed: args.scene.seed,
        film: *prepared.scene.film(),
        layers: args.layers,
        shards: Shards::from(shard),
    };
    let (mut keeper, found) = Keeper::open(&args.checkpoint, output.as_ref(), &identity)?;
    if let Some(found) = &found
        && found.progress.precision.is_some() != goal.error.is_some()
    {
        let (was, is) =
            if goal.error.is_some() { ("without", "with") } else { ("with", "without") };
        bail!("{}: was rendered {was} --error, and can not go on {is}", keeper.from());
    }
    let resumed_at = found.as_ref().map(|c| c.film.samples_per_pixel());
    let shown = output.as_ref().map_or_else(
        || format!("{} by {spec}", args.scene.scene),
        |output| output.exr().display().to_string(),
    );
    let mut preview = match &args.tev {
        None => None,
        Some(address) => {
            let film = Film::new(prepared.scene.film(), Layers::NONE);
            Some(Preview::open(address, &shown, &film)?)
        }
    };
    interrupt::install();
    let progress = Progress::new();
    let plan = Plan {
        integrator: &*integrator,
        scene: &prepared.scene,
        layers: args.layers,
        seed: args.scene.seed,
        shard,
    };
    let rendered = pool.install(|| -> Result<(Exposure, Result<()>, Option<Noise>)> {
        let mut session = match found {
            None => Session::start(plan)?,
            Some(c) => Session::resume(plan, &c.progress, c.film)?,
        };
        let complete = session.run(goal, &mut |session, status: &Status| {
            progress.set(status.used, || format!("{} spp", status.samples_per_pixel));
            keeper.now_and_then(session);
            if let Some(p) = &mut preview
                && let Some(gone) = p.now_and_then(session.film())
            {
                say(&format!("warning: {gone}"));
            }
            if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        let kept = keeper.at_the_end(&session);
        let noise = Noise::of(&session, goal.error);
        Ok((session.finish(complete), kept, noise))
    });
    drop(progress);
    let (exposed, kept, noise) = rendered?;
    if let Some(gone) = preview.and_then(|p| p.finish(&exposed.film)) {
        say(&format!("warning: {gone}"));
    }
    if let Some(output) = &output {
        let metadata = Metadata {
            scene: args.scene.scene.clone(),
            scene_hash: prepared.hash.clone(),
            integrator: spec.clone(),
            seed: args.scene.seed,
            samples_per_pixel: exposed.film.samples_per_pixel(),
            replicates: 1,
            seconds: exposed.spent.seconds,
            version: env!("CARGO_PKG_VERSION").into(),
        };
        image::write(output, &exposed.film, metadata)?;
    }
    tell_nonfinite(&spec, exposed.film.nonfinite(), exposed.film.nonfinite_examples());
    // After the image, which is not to be lost over it.
    kept?;

    let film = &exposed.film;
    let written = output.map(|o| o.exr().display().to_string());
    let report = Report {
        scene: &args.scene.scene,
        scene_hash: &prepared.hash,
        integrator: &spec,
        seed: args.scene.seed,
        shard: args.shard.map(|s| s.to_string()),
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
        error: noise,
        checkpoint: keeper.path(),
        resumed_at,
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
    let early = if report.complete || !interrupt::requested() { "" } else { "interrupted: " };
    let shard = report.shard.as_ref().map_or(String::new(), |s| format!(" (shard {s})"));
    let rate = report.rays as f64 / seconds / 1e6;
    writeln!(
        out,
        "{early}{scene} by {integrator}{shard}: {width}×{height}, {samples_per_pixel} samples per pixel \
         in {seconds:.2} s ({rate:.2} Mrays/s), seed {}",
        report.seed
    )?;
    if let Some(noise) = &report.error {
        writeln!(out, "{}", noise.tell())?;
    }
    match &report.output {
        Some(path) => writeln!(out, "wrote {path}")?,
        None => writeln!(out, "no image written (ask with -o FILE.exr)")?,
    }
    if let (Some(path), false) = (&report.checkpoint, report.complete) {
        writeln!(out, "to go on: the same command with --resume {path}")?;
    }
    Ok(())
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
