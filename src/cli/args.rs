//! What can be said on the command line.

use std::path::PathBuf;

use clap::{ArgGroup, Args, Parser, Subcommand};
use pathspace_benches::{Budget, Goal, Shard};
use pathspace_core::description::Crop;
use pathspace_core::film::Layers;
use pathspace_integrators::Spec;

use super::agree::AgreeArgs;
use super::image::Stops;

/// Light transport by path-space integrators, rendered and compared.
///
/// Without a command: compare all integrators on the scene cornell-caustic, with images in ./out.
#[derive(Debug, Parser)]
#[command(name = "pathspace", version, disable_help_subcommand = true)]
pub(super) struct Cli {
    /// Say more: every pair of a comparison, all that was read over in a scene file.
    #[arg(short, long, global = true)]
    pub(super) verbose: bool,
    #[command(subcommand)]
    pub(super) command: Option<Command>,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Render a scene with one integrator.
    Render(RenderArgs),
    /// Put the shards of a render together.
    Merge(MergeArgs),
    /// Compare integrators on scenes: do they agree, and how fast are they?
    Compare(Box<CompareArgs>),
    /// Do two sets of images, of any renderers, show the same expectation?
    Agree(AgreeArgs),
    /// Build a reference image from two integrators that agree.
    Reference(ReferenceArgs),
    /// Hold integrators to each other and to exact answers: are they right?
    Validate(ValidateArgs),
    /// Say what is in a scene, and which integrators can see all of it.
    Inspect(InspectArgs),
    /// Split an image into its bounces: L_e, KL_e, K²L_e, …, and their partial sums.
    Neumann(NeumannArgs),
    /// Print the paths of one sample, vertex by vertex.
    Replay(ReplayArgs),
    /// Show a comparison again, and write its page, from its results.json.
    Report(ReportArgs),
    /// List the scenes of the library, or write one to a directory.
    Scenes(ScenesArgs),
    /// Write a crate that adds an integrator of your own to this command.
    NewPlugin(NewPluginArgs),
    /// Print completions for a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Write manual pages into a directory.
    Man {
        /// Directory, created where it does not exist.
        dir: PathBuf,
    },
}

#[derive(Clone, Debug, Args)]
pub(super) struct SceneArgs {
    /// Scene file in Mitsuba's XML, or the name of a library scene.
    pub(super) scene: String,
    #[command(flatten)]
    pub(super) options: SceneOptions,
    /// Refuse a scene file in which anything is not known, instead of a warning.
    #[arg(long)]
    pub(super) strict: bool,
    /// Which of several sensors of the file, from 0.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) sensor: usize,
}

/// Options read as if they stood in the arguments themselves.
impl std::ops::Deref for SceneArgs {
    type Target = SceneOptions;

    fn deref(&self) -> &SceneOptions {
        &self.options
    }
}

/// What can be changed of a scene, and how it is rendered.
#[derive(Clone, Debug, Args)]
pub(super) struct SceneOptions {
    /// Size of the film, such as 640x480; the horizontal angle of view stays.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(super) size: Option<(u32, u32)>,
    /// Render only this window of the film.
    #[arg(long, value_name = "x,y,w,h", value_parser = crop)]
    pub(super) crop: Option<Crop>,
    /// Longest path in edges: 1 is emission only, -1 unlimited.
    #[arg(long, value_name = "D", allow_negative_numbers = true, value_parser = clap::value_parser!(i32).range(-1..=16383))]
    pub(super) max_depth: Option<i32>,
    /// Value for $key in the scene file; may be given again.
    #[arg(short = 'D', value_name = "key=value", value_parser = define)]
    pub(super) define: Vec<(String, String)>,
    /// Worker threads; all processors unless given. The image does not depend on it.
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
    /// Seed of the random numbers.
    #[arg(long, value_name = "K", default_value_t = 1)]
    pub(super) seed: u64,
}

/// When a render ends: with one budget, with an error, or with both, whichever comes first; as the
/// scene file says unless given.
#[derive(Clone, Debug, Args)]
#[command(group(ArgGroup::new("goal").multiple(true)))]
pub(super) struct GoalArgs {
    /// Samples per pixel; those of the scene file unless given.
    #[arg(long, value_name = "N", group = "goal", conflicts_with = "seconds", value_parser = clap::value_parser!(u64).range(1..=1 << 40))]
    pub(super) spp: Option<u64>,
    /// Seconds of rendering.
    #[arg(long, value_name = "S", group = "goal", value_parser = seconds)]
    pub(super) seconds: Option<f64>,
    /// Relative error of the image, such as 0.01: noise of a pixel (root mean square) over mean
    /// brightness. With --spp or --seconds, these are limits.
    #[arg(long, value_name = "E", group = "goal", value_parser = relative_error)]
    pub(super) error: Option<f64>,
}

impl GoalArgs {
    pub(super) fn goal(&self) -> Goal {
        let budget = match (self.spp, self.seconds) {
            (Some(n), _) => Some(Budget::Samples(n)),
            (None, seconds) => seconds.map(Budget::Seconds),
        };
        Goal { budget, error: self.error }
    }
}

#[derive(Clone, Debug, Args)]
pub(super) struct RenderArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Integrator with its options; that of the scene file unless given.
    #[arg(short, long, value_name = "NAME[:key=value,…]")]
    pub(super) integrator: Option<Spec>,
    #[command(flatten)]
    pub(super) goal: GoalArgs,
    /// Image to write: .exr (with a PNG beside it), .png, .pfm or .npy; SCENE.exr here unless
    /// given.
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// Replace files of other programs, too.
    #[arg(long)]
    pub(super) force: bool,
    /// Write no image: only measure.
    #[arg(long, conflicts_with = "output")]
    pub(super) no_image: bool,
    /// Exposure of the PNG in stops, or auto; a radiance of 1 is nearly white at 0.
    #[arg(long, value_name = "EV", allow_negative_numbers = true, default_value = "0")]
    pub(super) exposure: Stops,
    /// Layers of the image file: length, st, unweighted, emitter.
    #[arg(long, value_name = "LAYERS", value_parser = layers, default_value = "")]
    pub(super) layers: Layers,
    #[command(flatten)]
    pub(super) checkpoint: CheckpointArgs,
    /// Render the share i of n, counted from 1; `pathspace merge` puts the shares together.
    #[arg(long, value_name = "i/n", conflicts_with = "error")]
    pub(super) shard: Option<Shard>,
    /// Show the image in the viewer tev while it is being rendered.
    #[arg(long, value_name = "HOST[:PORT]")]
    pub(super) tev: Option<String>,
    /// Print one JSON object as the last line.
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Clone, Debug, Args)]
pub(super) struct InspectArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
}

#[derive(Clone, Debug, Args)]
pub(super) struct NeumannArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Integrator with its options; that of the scene file unless given.
    #[arg(short, long, value_name = "NAME[:key=value,…]")]
    pub(super) integrator: Option<Spec>,
    /// Terms of the series.
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u16).range(1..=32))]
    pub(super) terms: u16,
    #[command(flatten)]
    pub(super) goal: GoalArgs,
    /// Image to write, with a layer for each term and each sum; SCENE.neumann.exr here unless
    /// given.
    #[arg(short, long, value_name = "FILE.exr")]
    pub(super) output: Option<PathBuf>,
    /// Replace files of other programs, too.
    #[arg(long)]
    pub(super) force: bool,
    /// Exposure of the sheet in stops; that of the brightest twentieth unless given.
    #[arg(long, value_name = "EV", allow_negative_numbers = true, default_value = "auto")]
    pub(super) exposure: Stops,
}

#[derive(Clone, Debug, Args)]
pub(super) struct ReplayArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Integrator with its options; that of the scene file unless given.
    #[arg(short, long, value_name = "NAME[:key=value,…]")]
    pub(super) integrator: Option<Spec>,
    /// Step of the render; one step is one sample per pixel, counted from 0.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) step: u64,
    /// Work item of the step: pixels row by row, from 0.
    #[arg(long, value_name = "M", default_value_t = 0, conflicts_with = "pixel")]
    pub(super) item: u64,
    /// The same by the pixel.
    #[arg(long, value_name = "x,y", value_parser = pixel)]
    pub(super) pixel: Option<[u32; 2]>,
}

#[derive(Clone, Debug, Args)]
pub(super) struct CheckpointArgs {
    /// File to save the rendering in, again and again; goes on from it where it is there already.
    #[arg(long, value_name = "FILE")]
    pub(super) checkpoint: Option<PathBuf>,
    /// Seconds between checkpoints.
    #[arg(long, value_name = "S", default_value_t = 60.0, value_parser = seconds)]
    pub(super) checkpoint_every: f64,
    /// Checkpoint to go on from, which must be there; checkpoints go on in it unless --checkpoint
    /// names another file.
    #[arg(long, value_name = "FILE")]
    pub(super) resume: Option<PathBuf>,
}

impl CheckpointArgs {
    /// True where nothing is saved.
    pub(super) fn is_none(&self) -> bool {
        self.checkpoint.is_none() && self.resume.is_none()
    }
}

#[derive(Clone, Debug, Args)]
pub(super) struct MergeArgs {
    /// Images of shards (their sums stand beside them as .film), or the .film files themselves.
    #[arg(required = true, value_name = "FILE")]
    pub(super) shards: Vec<PathBuf>,
    /// Image to write; a PNG and the sums are written beside it.
    #[arg(short, long, value_name = "FILE.exr")]
    pub(super) output: PathBuf,
    /// Write the image also where shards are missing or have not reached what they were to reach.
    #[arg(long)]
    pub(super) partial: bool,
    /// Print one JSON object as the last line.
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Clone, Debug, Args)]
pub(super) struct CompareArgs {
    /// Scene files in Mitsuba's XML, or names of library scenes.
    #[arg(value_name = "SCENE", required_unless_present = "experiment")]
    pub(super) scenes: Vec<String>,
    /// Experiment as a TOML file, instead of everything but -o, --json, --threads and --references.
    #[arg(long, value_name = "FILE.toml", conflicts_with_all = ["scenes", "integrators", "spp", "seconds", "sweep", "replicates",
        "size", "crop", "max_depth", "define", "baseline", "target_error"])]
    pub(super) experiment: Option<PathBuf>,
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// Integrator with its options, or another renderer (mitsuba, luxcore, external); may be given
    /// again. All of our own unless given.
    #[arg(short, long = "integrator", value_name = "NAME[:key=value,…]")]
    pub(super) integrators: Vec<Spec>,
    /// Samples per pixel of each render.
    #[arg(long, value_name = "N", group = "budget", value_parser = clap::value_parser!(u64).range(1..=1 << 40))]
    pub(super) spp: Option<u64>,
    /// Seconds of each render.
    #[arg(long, value_name = "S", group = "budget", value_parser = seconds)]
    pub(super) seconds: Option<f64>,
    /// Budgets 2^A to 2^B times the one given, or samples per pixel where none is.
    #[arg(long, value_name = "A..B")]
    pub(super) sweep: Option<String>,
    /// Independent renders of each integrator; 16 unless given.
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    pub(super) replicates: Option<u32>,
    /// Integrator that ratios are relative to; the first unless given.
    #[arg(long, value_name = "NAME[:key=value,…]")]
    pub(super) baseline: Option<Spec>,
    /// Ask how long it takes to this relMSE.
    #[arg(long, value_name = "E", value_parser = positive)]
    pub(super) target_error: Option<f64>,
    /// Folder of references that errors are measured against, where it has one of a scene; see
    /// 'pathspace reference'.
    #[arg(long, value_name = "DIR")]
    pub(super) references: Option<PathBuf>,
    /// Directory for results and images; finished renders are kept there until all are done.
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Directory for the charts as SVG and PDF.
    #[arg(long, value_name = "DIR")]
    pub(super) plots: Option<PathBuf>,
    /// Exposure of the pictures in stops, or auto; the same for all of a scene.
    #[arg(long, value_name = "EV", allow_negative_numbers = true, default_value = "0")]
    pub(super) exposure: Stops,
    /// Print one JSON object as the last line.
    #[arg(long)]
    pub(super) json: bool,
}

impl CompareArgs {
    /// What `pathspace` does without arguments, with this many integrators: all for the same time,
    /// 40 s in total.
    pub(super) fn demonstration(integrators: usize) -> Self {
        let replicates = 16;
        let seconds = 40.0 / (f64::from(replicates) * integrators.max(1) as f64);
        // In tenths, as it is told.
        let seconds = (10.0 * seconds).round().max(1.0) / 10.0;
        CompareArgs {
            scenes: vec!["cornell-caustic".into()],
            experiment: None,
            scene: SceneOptions {
                size: Some((128, 128)),
                crop: None,
                max_depth: None,
                define: Vec::new(),
                threads: None,
                seed: 1,
            },
            integrators: Vec::new(),
            spp: None,
            seconds: Some(seconds),
            sweep: None,
            replicates: Some(replicates),
            baseline: None,
            target_error: None,
            references: None,
            output: Some("out".into()),
            plots: None,
            exposure: Stops::default(),
            json: false,
        }
    }
}

#[derive(Clone, Debug, Args)]
pub(super) struct ReferenceArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// The two integrators that have to agree.
    #[arg(short, long = "integrator", value_name = "NAME[:key=value,…]", num_args = 1)]
    pub(super) integrators: Vec<Spec>,
    /// Go on until the relative error √relMSE of the reference is below this.
    #[arg(long, value_name = "E", value_parser = positive, required_unless_present = "results")]
    pub(super) error: Option<f64>,
    /// Go on until the error is below a share of the smallest in this results.json.
    #[arg(long = "for", value_name = "results.json", conflicts_with = "error")]
    pub(super) results: Option<PathBuf>,
    /// That share.
    #[arg(long, value_name = "F", value_parser = positive, default_value_t = 0.1)]
    pub(super) fraction: f64,
    /// Seconds of one replicate.
    #[arg(long, value_name = "S", value_parser = seconds, default_value_t = 1.0)]
    pub(super) seconds: f64,
    /// Give up after this many seconds of rendering.
    #[arg(long, value_name = "S", value_parser = seconds, default_value_t = 3600.0)]
    pub(super) limit: f64,
    /// Folder of references.
    #[arg(short, long, value_name = "DIR", default_value = "references")]
    pub(super) output: PathBuf,
    /// Print one JSON object as the last line.
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Clone, Debug, Args)]
pub(super) struct ValidateArgs {
    /// What to hold to what: quick, pairs, exact, chains, variants, hard or all; calibration of the
    /// tests themselves; or mutants, deliberate bugs that the tests must find.
    #[arg(default_value = "quick")]
    pub(super) suite: String,
    /// Integrator with its options; may be given again. All there are unless given.
    #[arg(short, long = "integrator", value_name = "NAME[:key=value,…]")]
    pub(super) integrators: Vec<Spec>,
    /// Scene or case of the suite; may be given again. All of them unless given.
    #[arg(long = "scene", value_name = "NAME")]
    pub(super) scenes: Vec<String>,
    /// Seed of the random numbers; another one is another experiment.
    #[arg(long, value_name = "K", default_value_t = 1)]
    pub(super) seed: u64,
    /// Independent renders of each integrator in a round.
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(16..=100_000))]
    pub(super) replicates: Option<u32>,
    /// Most work, in units of the suite's own.
    #[arg(long, value_name = "X", value_parser = positive)]
    pub(super) effort: Option<f64>,
    /// Probability of any false alarm that is accepted, over all tests together.
    #[arg(long, value_name = "P", value_parser = probability)]
    pub(super) alpha: Option<f64>,
    /// Level of each single test, instead of a share of alpha: what a failure says to replay it.
    #[arg(long, value_name = "P", value_parser = probability, conflicts_with = "alpha")]
    pub(super) level: Option<f64>,
    /// Look after every few replicates and stop as soon as a pair is decided.
    #[arg(long)]
    pub(super) sequential: bool,
    /// Seeds with which each mutant is hunted.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub(super) seeds: u64,
    /// Source tree that mutants are planted in a copy of; the one around the current directory
    /// unless given.
    #[arg(long, value_name = "DIR")]
    pub(super) source: Option<PathBuf>,
    /// Run the tests of the mutants in this very program, without any copy: none should fail.
    #[arg(long)]
    pub(super) here: bool,
    /// Worker threads; all processors unless given. The figures do not depend on it.
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
    /// Directory for report.html and report.json.
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Print one JSON object as the last line.
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Clone, Debug, Args)]
pub(super) struct NewPluginArgs {
    /// Name of the integrator and of its crate.
    pub(super) name: String,
    /// Directory of the crate, new or empty.
    pub(super) dir: PathBuf,
    /// Source tree of pathspace to build upon; the one this program was built from, or its version,
    /// unless given.
    #[arg(long, value_name = "DIR")]
    pub(super) pathspace: Option<PathBuf>,
}

#[derive(Clone, Debug, Args)]
pub(super) struct ReportArgs {
    /// Directory with results.json; report.html is written beside it.
    pub(super) dir: PathBuf,
    /// Directory for the charts as SVG and PDF.
    #[arg(long, value_name = "DIR")]
    pub(super) plots: Option<PathBuf>,
}

#[derive(Clone, Debug, Args)]
pub(super) struct ScenesArgs {
    #[command(subcommand)]
    pub(super) command: Option<ScenesCommand>,
}

#[derive(Clone, Debug, Subcommand)]
pub(super) enum ScenesCommand {
    /// Write a library scene as files that Mitsuba 3 loads as well.
    Export {
        /// Name of the scene.
        name: String,
        /// Directory, created where it does not exist.
        dir: PathBuf,
    },
}

pub(super) fn size(text: &str) -> Result<(u32, u32), String> {
    let size = text
        .split_once(['x', 'X', '×'])
        .and_then(|(w, h)| Some((w.parse::<u32>().ok()?, h.parse::<u32>().ok()?)));
    size.filter(|(w, h)| *w > 0 && *h > 0).ok_or_else(|| "expected WxH, such as 640x480".into())
}

fn pixel(text: &str) -> Result<[u32; 2], String> {
    let pixel = text
        .split_once(',')
        .and_then(|(x, y)| Some([x.trim().parse().ok()?, y.trim().parse().ok()?]));
    pixel.ok_or_else(|| "expected x,y in pixels".into())
}

pub(super) fn crop(text: &str) -> Result<Crop, String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, width, height]) if width > 0 && height > 0 => Ok(Crop { x, y, width, height }),
        _ => Err("expected x,y,w,h in pixels with w and h over 0".into()),
    }
}

fn define(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.is_empty() => Ok((key.into(), value.into())),
        _ => Err("expected key=value".into()),
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok();
    // A century; it also keeps out infinity and NaN.
    value.filter(|s| *s > 0.0 && *s < 3.2e9).ok_or_else(|| "expected a number over 0".into())
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok();
    value.filter(|v| *v > 0.0 && *v < 1e6).ok_or_else(|| "expected a number over 0".into())
}

pub(super) fn probability(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok();
    value.filter(|p| *p > 0.0 && *p < 1.0).ok_or_else(|| "expected a number in (0, 1)".into())
}

fn relative_error(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok();
    let error = value.filter(|e| *e > 0.0 && *e < 1.0);
    error.ok_or_else(|| "expected a number between 0 and 1, such as 0.01".into())
}

fn layers(text: &str) -> Result<Layers, String> {
    let mut layers = Layers::NONE;
    for name in text.split(',').filter(|n| !n.is_empty()) {
        match name {
            "length" => layers.length = true,
            "st" => layers.technique = true,
            "unweighted" => layers.unweighted = true,
            "emitter" => layers.emitter = true,
            _ => {
                return Err(format!(
                    "unknown layer '{name}' (known: length, st, unweighted, emitter)"
                ));
            }
        }
    }
    Ok(layers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn sizes_and_windows_are_read_or_refused() {
        assert_eq!(size("640x480"), Ok((640, 480)));
        assert_eq!(crop("1,2,3,4"), Ok(Crop { x: 1, y: 2, width: 3, height: 4 }));
        for bad in ["", "640", "640x", "x480", "0x4", "-1x4", "640x480x2", "1e3x4"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        for bad in ["", "1,2,3", "1,2,3,4,5", "1,2,0,4", "-1,2,3,4", "a,b,c,d"] {
            assert!(crop(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn seconds_are_positive_and_finite() {
        assert_eq!(seconds("0.5"), Ok(0.5));
        for bad in ["0", "-1", "inf", "nan", "1s", ""] {
            assert!(seconds(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn errors_are_shares() {
        assert_eq!(relative_error("0.01"), Ok(0.01));
        for bad in ["0", "-0.1", "1", "2", "1%", "nan", ""] {
            assert!(relative_error(bad).is_err(), "{bad}");
        }
    }
}
