//! Scenes.

use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::HashMap;
use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pathspace::core::Scene as World;
use pathspace::core::description::{
    Crop, EmitterDescription, FilmDescription, FilterKind, MaterialKind, MediumDescription,
    MediumKind, ReliefMap, SceneDescription, ShapeGeometry,
};
use pathspace::core::path::WalkRules;
use pathspace::scenes::{
    self, LoadedScene,
    source::{Disk, FileSource, Memory},
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::bad_scene;

/// A scene that is ready to render. Immutable; renders share it.
#[pyclass(frozen, module = "pathspace._native")]
pub struct Scene {
    pub(crate) world: Arc<World>,
    pub(crate) rules: WalkRules,
    /// Name in the library, or of the file.
    #[pyo3(get)]
    name: String,
    /// As it was asked for.
    #[pyo3(get)]
    pub(crate) asked: String,
    /// Hash of its content.
    #[pyo3(get)]
    pub(crate) hash: String,
    /// The hash with what was changed of film, filter and depth.
    #[pyo3(get)]
    pub(crate) key: String,
    /// What the reader ignored or mended and what may change the image, one line each.
    #[pyo3(get)]
    warnings: Vec<String>,
    /// What it ignored without effect on the image.
    #[pyo3(get)]
    notes: Vec<String>,
    /// The integrator that the file asks for; `None` where it does not.
    #[pyo3(get)]
    integrator: Option<String>,
    /// Samples per pixel that the file asks for.
    #[pyo3(get)]
    spp: Option<u32>,
    contents: Contents,
}

/// What is in a scene, counted.
struct Contents {
    shapes: usize,
    triangles: usize,
    emitters: Vec<&'static str>,
    materials: Vec<&'static str>,
    media: Vec<&'static str>,
    bytes: usize,
}

/// What a caller changes of a scene's film and depth, a dictionary; what is `None` stays.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Changes {
    size: Option<[u32; 2]>,
    crop: Option<[u32; 4]>,
    max_depth: Option<i32>,
    box_filter: Option<bool>,
}

type Params = Vec<(String, String)>;

#[pymethods]
impl Scene {
    /// Reads a file.
    #[staticmethod]
    fn from_file(
        py: Python<'_>,
        path: PathBuf,
        params: Params,
        changes: Changes,
    ) -> PyResult<Self> {
        let asked = path.display().to_string();
        if path.is_dir() {
            return Err(bad_scene(format!("{asked}: is a directory, not a scene file")));
        }
        Scene::read(py, asked, &changes, || scenes::load(&path, &params))
    }

    /// Reads a text; `file` is its name in messages, files that it refers to are looked for in the
    /// folder of `file`.
    #[staticmethod]
    fn from_text(
        py: Python<'_>,
        text: &str,
        file: &str,
        params: Params,
        changes: Changes,
    ) -> PyResult<Self> {
        let name = Path::new(file).file_name().map(|n| n.to_string_lossy().into_owned());
        Scene::read(py, name.unwrap_or_else(|| file.into()), &changes, || {
            scenes::load_str(text, file, &Disk, &params)
        })
    }

    /// Takes a scene of the library.
    #[staticmethod]
    fn from_library(
        py: Python<'_>,
        name: &str,
        params: Params,
        changes: Changes,
    ) -> PyResult<Self> {
        let Some(scene) = scenes::library::find(name) else {
            let known: Vec<&str> = scenes::library::all().iter().map(|s| s.name).collect();
            let known = known.join(", ");
            return Err(bad_scene(format!("no scene '{name}' in the library ({known})")));
        };
        Scene::read(py, name.into(), &changes, || scene.load(&params))
    }

    /// Builds a scene from files in memory, such as those of [`Scene::files`].
    #[staticmethod]
    fn from_files(
        py: Python<'_>,
        files: HashMap<String, Vec<u8>>,
        path: &str,
        params: Params,
        changes: Changes,
    ) -> PyResult<Self> {
        Scene::read(py, path.into(), &changes, || {
            let mut source = Memory::new();
            files.into_iter().for_each(|(name, bytes)| source.insert(name, bytes));
            scenes::load_from(&source, Path::new(path), &params)
        })
    }

    /// All files that a scene is read from, by the names under which [`Scene::from_files`] finds
    /// them; `text` stands for the main file where it is none.
    #[staticmethod]
    fn files(
        py: Python<'_>,
        path: &str,
        text: Option<&str>,
        params: Params,
    ) -> PyResult<HashMap<String, Cow<'static, [u8]>>> {
        let read = py.detach(|| {
            let seen = Recorder::default();
            match text {
                None => scenes::load_from(&seen, Path::new(path), &params),
                Some(text) => scenes::load_str(text, path, &seen, &params),
            }
            .map_err(bad_scene)?;
            let mut files = seen.files.into_inner();
            if let Some(text) = text {
                files.insert(path.into(), text.as_bytes().to_vec());
            }
            Ok::<_, PyErr>(files)
        })?;
        let named =
            |(path, bytes): (PathBuf, Vec<u8>)| (path.display().to_string(), Cow::Owned(bytes));
        Ok(read.into_iter().map(named).collect())
    }

    /// Columns and rows of the image: of the crop window, where there is one.
    #[getter]
    fn size(&self) -> (u32, u32) {
        let crop = self.world.film().crop;
        (crop.width, crop.height)
    }

    /// Column and row of the whole film where the image begins.
    #[getter]
    fn origin(&self) -> (u32, u32) {
        let crop = self.world.film().crop;
        (crop.x, crop.y)
    }

    /// Longest path in edges; `None` is unlimited.
    #[getter]
    fn max_depth(&self) -> Option<u32> {
        self.rules.max_length
    }

    /// What is in it, counted.
    fn info<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let info = PyDict::new(py);
        let c = &self.contents;
        info.set_item("name", &self.name)?;
        info.set_item("hash", &self.hash)?;
        info.set_item("size", self.size())?;
        info.set_item("shapes", c.shapes)?;
        info.set_item("triangles", c.triangles)?;
        info.set_item("emitters", counted(py, &c.emitters)?)?;
        info.set_item("bsdfs", counted(py, &c.materials)?)?;
        info.set_item("media", counted(py, &c.media)?)?;
        info.set_item("memory", c.bytes)?;
        info.set_item("max_depth", self.rules.max_length)?;
        info.set_item("integrator", &self.integrator)?;
        info.set_item("spp", self.spp)?;
        info.set_item("warnings", &self.warnings)?;
        info.set_item("notes", &self.notes)?;
        Ok(info)
    }
}

impl Scene {
    /// What `load` gives, with the changes, made while other threads of Python go on.
    fn read<E: Display>(
        py: Python<'_>,
        asked: String,
        changes: &Changes,
        load: impl FnOnce() -> Result<LoadedScene, E> + Send,
    ) -> PyResult<Self> {
        py.detach(|| Scene::build(asked, load().map_err(bad_scene)?, changes))
    }

    fn build(asked: String, mut loaded: LoadedScene, changes: &Changes) -> PyResult<Self> {
        let film = &mut loaded.description.film;
        if let Some([width, height]) = changes.size {
            let whole = Crop { x: 0, y: 0, width, height };
            *film = FilmDescription { width, height, crop: whole, ..*film };
        }
        if let Some([x, y, width, height]) = changes.crop {
            film.crop = Crop { x, y, width, height };
        }
        if changes.box_filter == Some(true) {
            film.filter = FilterKind::Box;
        }
        let film = *film;
        if let Some(problem) = film.problem() {
            return Err(bad_scene(format!("{asked}: film: {problem}")));
        }
        let world =
            World::new(&loaded.description).map_err(|e| bad_scene(format!("{asked}: {e}")))?;
        let max_length = match changes.max_depth {
            None => loaded.defaults.max_depth,
            Some(depth) => u32::try_from(depth).ok(),
        };
        let told = |serious: bool| {
            let of = loaded.notes.iter().filter(|n| n.kind.is_error_when_strict() == serious);
            of.map(ToString::to_string).collect()
        };
        Ok(Scene {
            rules: WalkRules { max_length, rr_depth: loaded.defaults.rr_depth },
            key: format!("{} {film:?} {max_length:?}", loaded.hash),
            contents: Contents::of(&loaded.description, &world),
            world: Arc::new(world),
            name: loaded.name,
            asked,
            hash: loaded.hash,
            warnings: told(true),
            notes: told(false),
            integrator: loaded.defaults.integrator,
            spp: loaded.defaults.spp,
        })
    }
}

impl Contents {
    fn of(scene: &SceneDescription, world: &World) -> Self {
        let triangles = |geometry: &ShapeGeometry| match geometry {
            ShapeGeometry::Mesh(mesh) => mesh.triangles.len(),
            ShapeGeometry::Rectangle => 2,
            ShapeGeometry::Cube => 12,
            _ => 0,
        };
        let area = scene.shapes.iter().filter(|s| s.emission.is_some()).map(|_| "area");
        let other = scene.emitters.iter().map(|e| match e {
            EmitterDescription::Point { .. } => "point",
            EmitterDescription::Spot { .. } => "spot",
            EmitterDescription::Projector { .. } => "projector",
            EmitterDescription::Directional { .. } => "directional",
            EmitterDescription::Constant { .. } => "constant",
            EmitterDescription::Environment { .. } => "envmap",
            _ => "other",
        });
        let medium = |m: &MediumDescription| match m.kind {
            MediumKind::Homogeneous { .. } => "homogeneous",
            _ => "other",
        };
        Contents {
            shapes: scene.shapes.len(),
            triangles: scene.shapes.iter().map(|s| triangles(&s.geometry)).sum(),
            emitters: area.chain(other).collect(),
            materials: scene.materials.iter().map(|m| model(&m.kind)).collect(),
            media: scene.media.media.iter().map(medium).collect(),
            bytes: world.accel().stats().bytes,
        }
    }
}

fn model(kind: &MaterialKind) -> &'static str {
    match kind {
        MaterialKind::Diffuse { .. } => "diffuse",
        MaterialKind::Dielectric { .. } => "dielectric",
        MaterialKind::Conductor { .. } => "conductor",
        MaterialKind::RoughConductor { .. } => "roughconductor",
        MaterialKind::Plastic { .. } => "plastic",
        MaterialKind::RoughPlastic { .. } => "roughplastic",
        MaterialKind::RoughDielectric { .. } => "roughdielectric",
        MaterialKind::ThinDielectric { .. } => "thindielectric",
        MaterialKind::RoughDiffuse { .. } => "roughdiffuse",
        MaterialKind::Phong { .. } => "phong",
        MaterialKind::Ward { .. } => "ward",
        MaterialKind::Principled(_) => "principled",
        MaterialKind::PrincipledThin(_) => "principledthin",
        MaterialKind::Mixture { .. } => "blendbsdf",
        MaterialKind::Mask { .. } => "mask",
        MaterialKind::Relief { map: ReliefMap::Normals(_), .. } => "normalmap",
        MaterialKind::Relief { .. } => "bumpmap",
        MaterialKind::TwoSided { front, .. } => model(front),
        MaterialKind::Textured { model: textured, .. } => model(textured),
        MaterialKind::Null => "null",
        _ => "other",
    }
}

/// How often each name occurs.
fn counted<'py>(py: Python<'py>, names: &[&str]) -> PyResult<Bound<'py, PyDict>> {
    let counts = PyDict::new(py);
    for name in names {
        let count = names.iter().filter(|n| *n == name).count();
        counts.set_item(name, count)?;
    }
    Ok(counts)
}

/// The disk, with a memory of what was read from it.
#[derive(Default)]
struct Recorder {
    files: RefCell<HashMap<PathBuf, Vec<u8>>>,
}

impl FileSource for Recorder {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let bytes = Disk.read(path)?;
        self.files.borrow_mut().insert(path.to_path_buf(), bytes.clone());
        Ok(bytes)
    }

    fn is_file(&self, path: &Path) -> bool {
        Disk.is_file(path)
    }

    fn is_dir(&self, path: &Path) -> bool {
        Disk.is_dir(path)
    }
}

/// Names and summaries of the scenes of the library.
#[pyfunction]
pub(crate) fn library() -> Vec<(&'static str, &'static str)> {
    scenes::library::all().iter().map(|s| (s.name, s.summary)).collect()
}
