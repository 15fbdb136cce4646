//! From the name on the command line to a scene that is ready to render.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Result, anyhow, bail};
use pathspace_core::Scene;
use pathspace_core::description::{Crop, FilterKind};
use pathspace_core::integrator::Integrator;
use pathspace_core::path::WalkRules;
use pathspace_integrators::{Defaults, Registry, Spec};
use pathspace_scenes::{LoadedScene, library};

use super::args::SceneArgs;
use super::say;

/// A scene with what its file and the command line say about rendering it.
pub(super) struct Prepared {
    /// Name in the library, or of the file.
    pub(super) name: String,
    pub(super) scene: Arc<Scene>,
    /// Hash of its content.
    pub(super) hash: String,
    /// The hash with what was changed of film, filter and depth.
    pub(super) key: String,
    /// Name of the integrator that the file asks for; path tracing where it does not.
    pub(super) integrator: Spec,
    pub(super) defaults: Defaults,
}

/// Reads, adjusts and builds the scene; notes of the reader go to stderr.
pub(super) fn prepare(args: &SceneArgs) -> Result<Prepared> {
    prepare_with(args, false)
}

/// [`prepare`] with the box filter, which all renderers share, where asked for.
pub(super) fn prepare_with(args: &SceneArgs, box_filter: bool) -> Result<Prepared> {
    let mut loaded = load(args)?;
    for note in &loaded.notes {
        say(&format!("note: {note}"));
    }
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
    let scene = Scene::new(&loaded.description).map_err(|e| anyhow!("{}: {e}", args.scene))?;
    let file = loaded.defaults;
    let max_length = match args.max_depth {
        None => file.max_depth,
        Some(depth) => u32::try_from(depth).ok(),
    };
    let name = file.integrator.unwrap_or_else(|| "pt".into());
    Ok(Prepared {
        name: loaded.name,
        scene: Arc::new(scene),
        key: format!("{} {film:?} {max_length:?}", loaded.hash),
        hash: loaded.hash,
        integrator: name.parse()?,
        defaults: Defaults { rules: WalkRules { max_length, rr_depth: file.rr_depth } },
    })
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
        let known: Vec<&str> = library::all().iter().map(|s| s.name).collect();
        bail!("{}: no such file, and no scene of the library ({})", args.scene, known.join(", "));
    }
    Ok(pathspace_scenes::load(path, &args.define)?)
}

impl Prepared {
    /// The integrator of a spec, or of the scene file.
    pub(super) fn integrator(
        &self,
        registry: &Registry,
        spec: Option<&Spec>,
    ) -> Result<Box<dyn Integrator>> {
        Ok(registry.create(spec.unwrap_or(&self.integrator), &self.defaults)?)
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
