//! From the name on the command line to a scene that is ready to render.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Result, anyhow, bail};
use pathspace_core::Scene;
use pathspace_core::description::{
    Crop, EmitterDescription, FilmDescription, FilterKind, SceneDescription,
};
use pathspace_core::integrator::Integrator;
use pathspace_core::path::WalkRules;
use pathspace_integrators::{Defaults, Registry, Spec};
use pathspace_scenes::source::Disk;
use pathspace_scenes::{LoadOptions, LoadedScene, Note, library};

use super::args::SceneArgs;
use super::say;
use super::words::did_you_mean;

/// A scene with what its file and the command line say about rendering it.
pub(super) struct Prepared {
    /// Name in the library, or of the file.
    pub(super) name: String,
    pub(super) scene: Arc<Scene>,
    /// What the scene was built of, with what the command line changed.
    pub(super) description: SceneDescription,
    /// Hash of its content.
    pub(super) hash: String,
    /// The hash with what was changed of film, filter and depth.
    pub(super) key: String,
    /// Name of the integrator that the file asks for; path tracing where it does not.
    pub(super) integrator: Spec,
    pub(super) defaults: Defaults,
    /// Samples per pixel that the file asks for.
    pub(super) spp: Option<u32>,
}

/// Reads, adjusts and builds the scene. Notes of the reader that may change the image and warnings
/// of the scene go to stderr; other notes too where asked for.
pub(super) fn prepare(args: &SceneArgs, verbose: bool) -> Result<Prepared> {
    prepare_with(args, verbose, false)
}

/// [`prepare`] with the box filter, which all renderers share, where asked for.
pub(super) fn prepare_with(args: &SceneArgs, verbose: bool, box_filter: bool) -> Result<Prepared> {
    let mut loaded = load(args)?;
    tell_notes(&loaded.notes, verbose);
    let film = &mut loaded.description.film;
    if let Some((width, height)) = args.size {
        (film.width, film.height) = (width, height);
        film.crop = Crop { x: 0, y: 0, width, height };
    }
    if let Some(crop) = args.crop {
        film.crop = crop;
    }
    if box_filter {
        film.filter = FilterKind::Box;
    }
    let film = *film;
    if let Some(problem) = film.problem().or_else(|| no_room(&film)) {
        bail!("{}: film: {problem}", args.scene);
    }
    tell_empty(&args.scene, &loaded.description);
    let scene = Scene::new(&loaded.description).map_err(|e| anyhow!("{}: {e}", args.scene))?;
    for warning in scene.warnings() {
        say(&format!("warning: {}: {warning}", args.scene));
    }
    let file = loaded.defaults;
    let max_length = match args.max_depth {
        None => file.max_depth,
        Some(depth) => u32::try_from(depth).ok(),
    };
    let name = file.integrator.unwrap_or_else(|| "pt".into());
    Ok(Prepared {
        name: loaded.name,
        scene: Arc::new(scene),
        description: loaded.description,
        key: format!("{} {film:?} {max_length:?}", loaded.hash),
        hash: loaded.hash,
        integrator: name.parse()?,
        defaults: Defaults { rules: WalkRules { max_length, rr_depth: file.rr_depth } },
        spp: file.spp,
    })
}

/// Bytes of a pixel at the end of a render: sums, the image made of them, and what is encoded of
/// it.
const BYTES: usize = 96;

/// Says that a film does not fit the memory, before anything is rendered.
fn no_room(film: &FilmDescription) -> Option<String> {
    let Crop { width, height, .. } = film.crop;
    let bytes = (width as usize).saturating_mul(height as usize).saturating_mul(BYTES);
    let mut room: Vec<u8> = Vec::new();
    room.try_reserve_exact(bytes).err().map(|_| {
        format!("{width}×{height} pixels need {:.1} GB, which cannot be had", bytes as f64 / 1e9)
    })
}

/// Scenes whose image is black whatever is done are more often mistakes than wishes.
fn tell_empty(name: &str, description: &SceneDescription) {
    let lit = !description.emitters.is_empty()
        || description.shapes.iter().any(|shape| shape.emission.is_some());
    if !lit {
        say(&format!("warning: {name}: the scene has no emitter, and the image will be black"));
    } else if description.shapes.is_empty() && !description.emitters.iter().any(is_seen) {
        say(&format!("warning: {name}: the scene has no shape, and the image will be black"));
    }
}

/// True for emitters that a camera sees without a shape.
fn is_seen(emitter: &EmitterDescription) -> bool {
    !matches!(
        emitter,
        EmitterDescription::Point { .. }
            | EmitterDescription::Spot { .. }
            | EmitterDescription::Projector { .. }
            | EmitterDescription::Directional { .. }
    )
}

/// A line for each note that may change the image; one for all the others, which every file has,
/// where asked for.
fn tell_notes(notes: &[Note], verbose: bool) {
    let (serious, harmless): (Vec<&Note>, Vec<&Note>) =
        notes.iter().partition(|n| n.kind.is_error_when_strict());
    for note in serious {
        say(&format!("warning: {note}"));
    }
    if verbose && !harmless.is_empty() {
        let texts: Vec<String> = harmless.iter().map(ToString::to_string).collect();
        say(&format!("note: without effect on the image: {}", texts.join("; ")));
    }
}

fn load(args: &SceneArgs) -> Result<LoadedScene> {
    if let Some(scene) = library::find(&args.scene) {
        return Ok(scene.load(&args.define)?);
    }
    let path = Path::new(&args.scene);
    if path.is_dir() {
        bail!("{}: is a directory, not a scene file", args.scene);
    }
    if !path.exists() {
        let known = || library::all().iter().map(|s| s.name);
        bail!(
            "{}: no such file, and no scene of the library ({}){}",
            args.scene,
            known().collect::<Vec<_>>().join(", "),
            did_you_mean(&args.scene, known())
        );
    }
    if !path.is_file() {
        bail!("{}: is no regular file", args.scene);
    }
    let options =
        LoadOptions { params: args.define.clone(), strict: args.strict, sensor: args.sensor };
    Ok(pathspace_scenes::load_with(&Disk, path, &options)?)
}

/// A name of Mitsuba, ours, and an option with its value.
type Alias = (&'static str, &'static str, Option<(&'static str, &'static str)>);

/// Names that integrators have in Mitsuba 3, with what they are here.
const ALIASES: [Alias; 4] = [
    ("path", "pt", None),
    ("volpath", "pt", None),
    ("ptracer", "lt", None),
    // Emission and one bounce.
    ("direct", "pt", Some(("max_depth", "2"))),
];

/// The spec with the name that an integrator has here, where it has Mitsuba's and no plug-in is
/// called so.
pub(super) fn own_name(registry: &Registry, spec: &Spec) -> Result<Spec> {
    let alias = ALIASES.iter().find(|(alias, ..)| *alias == spec.name);
    let Some((_, name, extra)) = alias.filter(|_| registry.all().all(|(n, _)| n != spec.name))
    else {
        return Ok(spec.clone());
    };
    let mut options: Vec<String> = spec.pairs().map(|(k, v)| format!("{k}={v}")).collect();
    if let Some((key, value)) = extra.filter(|(key, _)| spec.pairs().all(|(k, _)| k != *key)) {
        options.push(format!("{key}={value}"));
    }
    let colon = if options.is_empty() { "" } else { ":" };
    Ok(format!("{name}{colon}{}", options.join(",")).parse()?)
}

impl Prepared {
    /// The integrator of a spec, or of the scene file.
    pub(super) fn integrator(
        &self,
        registry: &Registry,
        spec: Option<&Spec>,
    ) -> Result<Box<dyn Integrator>> {
        let spec = own_name(registry, spec.unwrap_or(&self.integrator))?;
        Ok(registry.create(&spec, &self.defaults)?)
    }
}

/// Worker threads: as many as asked for, or as there are processors.
pub(super) fn pool(threads: Option<u16>) -> Result<rayon::ThreadPool> {
    let threads = match threads {
        Some(n) => usize::from(n),
        None => std::thread::available_parallelism().map_or(1, usize::from),
    };
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| anyhow!("cannot start {threads} threads: {e}"))
}
