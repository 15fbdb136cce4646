//! `pathspace render`.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow, bail};
use pathspace_benches::checkpoint::{Identity, Shards};
use pathspace_benches::output::{Format, Metadata, Output, OutputError};
use pathspace_benches::precision::CONFIDENCE;
use pathspace_benches::preview::Preview;
use pathspace_benches::{Budget, Exposure, Plan, RelativeError, Session, Shard, Status, program};
use pathspace_core::film::{Film, Layers, NonFinite};
use pathspace_integrators::Registry;
use serde::Serialize;

use super::args::RenderArgs;
use super::checkpoint::Keeper;
use super::image::{self, Written};
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
    files: Vec<String>,
    exposure: Option<f64>,
    version: &'a str,
}

/// Samples per pixel where neither the command line nor the scene file says.
const SAMPLES: u64 = 16;

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
pub(super) fn render(
    registry: &Registry,
    args: &RenderArgs,
    verbose: bool,
    out: &mut dyn Write,
) -> Result<Done> {
    interrupt::install();
    let prepared = prepare(&args.scene, verbose)?;
    let integrator = prepared.integrator(registry, args.integrator.as_ref())?;
    let shard = args.shard.unwrap_or(Shard::WHOLE);
    let mut goal = args.goal.goal();
    if goal.budget.is_none() && goal.error.is_none() {
        goal.budget = Some(Budget::Samples(prepared.spp.map_or(SAMPLES, u64::from)));
    }
    if goal.budget.map(|b| shard.share_of(b)) == Some(Budget::Samples(0)) {
        bail!("nothing is left for shard {shard}: there are fewer samples per pixel than shards");
    }
    let pool = pool(args.scene.threads)?;
    let output = place(args, &prepared.name)?;
    if let Some(output) = &output {
        spare(output, args)?;
    } else if args.layers != Layers::NONE && args.checkpoint.is_none() {
        bail!("--layers names layers of an image file, and --no-image asks for none");
    }
    let spec = integrator.spec();
    let identity = Identity {
        version: env!("CARGO_PKG_VERSION").into(),
        // Reading the program takes a moment, and nobody asks without a file.
        program: if args.checkpoint.is_none() && args.shard.is_none() {
            String::new()
        } else {
            program().into()
        },
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
        |output| output.path().display().to_string(),
    );
    let mut preview = match &args.tev {
        None => None,
        Some(address) => {
            let film = Film::new(prepared.scene.film(), Layers::NONE);
            Some(Preview::open(address, &shown, &film)?)
        }
    };
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
            None => Session::start(plan),
            Some(c) => Session::resume(plan, &c.progress, c.film),
        }
        .map_err(|e| anyhow!("{}: {e}", args.scene.scene))?;
        session.run(goal, &mut |session, status: &Status| {
            // Before the first step is done there is nothing that the checkpoint does not have.
            interrupt::keep();
            progress.set(status.used, || format!("{} spp", status.samples_per_pixel));
            keeper.now_and_then(session);
            if let Some(p) = &mut preview
                && let Some(gone) = p.now_and_then(session.film())
            {
                say(&format!("warning: {gone}"));
            }
            if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        interrupt::keep();
        let kept = keeper.at_the_end(&session);
        let noise = Noise::of(&session, goal.error);
        Ok((session.finish(), kept, noise))
    });
    drop(progress);
    let (exposed, kept, noise) = rendered?;
    if let Some(gone) = preview.and_then(|p| p.finish(&exposed.film)) {
        say(&format!("warning: {gone}"));
    }
    let mut written = None;
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
        written = Some(image::write(output, &exposed.film, metadata, args.exposure)?);
    }
    tell_nonfinite(&spec, exposed.film.nonfinite(), exposed.film.nonfinite_examples());
    // After the image, which is not to be lost over it.
    kept?;

    let film = &exposed.film;
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
        output: output.map(|o| o.path().display().to_string()),
        files: written.iter().flat_map(|w| &w.files).map(|p| p.display().to_string()).collect(),
        exposure: written.as_ref().map(|w| w.stops),
        version: env!("CARGO_PKG_VERSION"),
    };
    tell(&report, written.as_ref(), out)?;
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&report)?)?;
    }
    Ok(if stopped(&report) { Done::Interrupted } else { Done::Well })
}

/// Makes sure that no file that is read is written over.
fn spare(output: &Output, args: &RenderArgs) -> Result<()> {
    let scene = Path::new(&args.scene.scene);
    let checkpoints = [&args.checkpoint.checkpoint, &args.checkpoint.resume];
    let mut read = checkpoints.into_iter().flatten().map(|p| (p.as_path(), "the checkpoint"));
    let eaten = read.find(|(path, _)| output.overwrites(path).is_some());
    let scene = output.overwrites(scene).map(|_| (scene, "the scene"));
    if let Some((path, what)) = eaten.or(scene) {
        bail!(
            "{}: is {what}, and the image {} would be written over it",
            path.display(),
            output.path().display()
        );
    }
    Ok(())
}

/// True where a signal came before the goal was reached.
fn stopped(report: &Report<'_>) -> bool {
    !report.complete && interrupt::requested()
}

/// Where the image goes: as asked for, or beside where the command was called under the name of the
/// scene. What nobody asked to write must be free, or by this program.
fn place(args: &RenderArgs, name: &str) -> Result<Option<Output>> {
    if args.no_image {
        return Ok(None);
    }
    let share =
        args.shard.map_or(String::new(), |s| format!(".{}", s.to_string().replace('/', "-of-")));
    let own = || PathBuf::from(format!("{name}{share}.exr"));
    let output = Output::open(&args.output.clone().unwrap_or_else(own))?;
    if args.layers != Layers::NONE && output.format() != Format::Exr {
        bail!("{}: layers need an EXR file", output.path().display());
    }
    if args.shard.is_some() && output.format() != Format::Exr {
        bail!("{}: a shard needs an EXR file", output.path().display());
    }
    if !args.force {
        output.keep_foreign(args.output.as_deref()).map_err(|e| match e {
            OutputError::Foreign { .. } => {
                anyhow!("{e}: take another name with -o, or --force to replace it")
            }
            other => other.into(),
        })?;
    }
    Ok(Some(output))
}

fn tell(report: &Report<'_>, written: Option<&Written>, out: &mut dyn Write) -> Result<()> {
    let Report { scene, integrator, width, height, samples_per_pixel, seconds, .. } = report;
    let early = if stopped(report) { "interrupted: " } else { "" };
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
    if let Some(written) = written {
        writeln!(out, "wrote {}", written.names())?;
        if let Some(note) = &written.note {
            writeln!(out, "{note}")?;
        }
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
