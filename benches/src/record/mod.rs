//! The folder of an experiment: results.json, results.csv, experiment.toml and
//! SCENE/INTEGRATOR/{mean.exr, mean.png, …}.

mod pictures;

use std::fs;
use std::path::{Path, PathBuf};

use pathspace_core::film::{Families, LayerKey, Layers};
use thiserror::Error;

use crate::ImageMoments;
use crate::analysis::Analysed;
use crate::budget::Budget;
use crate::csv::csv;
use crate::experiment::{Cell, Config, Contestant, Plan, Setup, Store};
use crate::expose::expose;
use crate::output::{
    Metadata, NamedLayer, Output, OutputError, Picture, Weighting, exposure, technique_sheet,
};
use crate::reference::ReferenceImage;
use crate::results::{Images, Results};

use pictures::{error_map, sigma_map, tone_mapped, write_png};

/// Longest path that has a picture of its own.
const LENGTHS: u16 = 8;
/// Most samples per pixel of the render that pictures of techniques come from.
const PORTRAIT: u64 = 256;

/// Why results were not written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecordError {
    /// A file or folder cannot be written.
    #[error("{}: {reason}", path.display())]
    Write {
        /// Where.
        path: PathBuf,
        /// The system's reason.
        reason: String,
    },
    /// An image cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Makes the folder and finds out whether it can be written.
///
/// # Errors
/// With the system's reason.
pub fn prepare(folder: &Path) -> Result<(), RecordError> {
    fs::create_dir_all(folder).map_err(|e| failed(folder, "cannot make directory", &e))?;
    let probe = folder.join(format!(".results.{}.part", std::process::id()));
    fs::write(&probe, b"").map_err(|e| failed(folder, "cannot write", &e))?;
    fs::remove_file(&probe).map_err(|e| failed(folder, "cannot write", &e))
}

/// Writes results.json, results.csv and experiment.toml.
///
/// # Errors
/// With the system's reason.
pub fn write_results(folder: &Path, results: &Results) -> Result<(), RecordError> {
    let json = serde_json::to_string_pretty(results)
        .map_err(|e| failed(folder, "results.json", &std::io::Error::other(e)))?;
    for (name, text) in [
        ("experiment.toml", &results.experiment),
        ("results.csv", &csv(results)),
        ("results.json", &json),
    ] {
        let path = folder.join(name);
        // The file that the experiment was read from may be this one, with its author's comments.
        if name == "experiment.toml" && is_same_experiment(&path, text) {
            continue;
        }
        crate::output::write_bytes(&path, text.as_bytes())
            .map_err(|e| failed(&path, "cannot write", &e))?;
    }
    Ok(())
}

/// True where a file says the same as `text`, in whatever words.
fn is_same_experiment(path: &Path, text: &str) -> bool {
    let there = crate::output::read_text(path).ok().and_then(|text| Config::parse(&text).ok());
    there.is_some() && there == Config::parse(text).ok()
}

/// How the pictures of an experiment are drawn.
#[derive(Clone, Copy)]
pub struct Pictures<'a> {
    /// Where to; each scene has a folder of its own there.
    pub folder: &'a Path,
    /// The experiment.
    pub plan: &'a Plan,
    /// Its renders.
    pub store: &'a Store,
    /// What radiance is multiplied by; that of the reference unless given, or of the first
    /// integrator.
    pub exposure: Option<f64>,
    /// Asked between pictures.
    pub stop: fn() -> bool,
}

impl Pictures<'_> {
    /// Draws those of one scene and puts their names into the results. All share one exposure,
    /// which is the answer.
    ///
    /// # Errors
    /// With the system's reason.
    pub fn draw(
        &self,
        setup: &Setup,
        reference: Option<&ReferenceImage>,
        analysed: &mut Analysed,
    ) -> Result<f64, RecordError> {
        let Pictures { folder, plan, store, .. } = *self;
        let own = PathBuf::from(slug(&setup.name));
        let mut shared = self.exposure.or_else(|| reference.map(brightness));
        let mut taken: Vec<String> = Vec::new();
        for index in 0..analysed.results.methods.len() {
            let name = analysed.results.methods[index].integrator.clone();
            let Some((_, contestant)) = setup.contestants.iter().find(|(n, _)| *n == name) else {
                continue;
            };
            let mut place = slug(&name);
            while taken.contains(&place) {
                place.push('_');
            }
            taken.push(place.clone());
            let easel = Easel { folder, place: own.join(place), plan, store, setup, reference };
            let dir = folder.join(&easel.place);
            fs::create_dir_all(&dir).map_err(|e| failed(&dir, "cannot make directory", &e))?;
            let budget = plan.budgets[plan.budgets.len() - 1];
            let cells = plan.cells(store, setup, &name, budget);
            let moments = moments(&cells, setup.pixels());
            let light = *shared.get_or_insert_with(|| exposure(moments.mean()));
            let method = &mut analysed.results.methods[index];
            method.images = easel.mean(&name, &cells, &moments, light)?;
            analysed.comparison.integrators[index].output =
                Some(folder.join(&method.images.mean).display().to_string());
            (method.frames, method.error_pngs) = easel.frames(&name, &moments, light)?;
            if let (Contestant::Own(integrator), false) = (contestant, (self.stop)()) {
                easel.portrait(&**integrator, &cells, light, &mut method.images)?;
            }
        }
        Ok(shared.unwrap_or(1.0))
    }
}

/// The exposure of a reference.
fn brightness(reference: &ReferenceImage) -> f64 {
    let [one, two] = reference.halves(Families::ALL, Families::ALL);
    exposure(&wide(&one.iter().zip(&two).map(|(a, b)| 0.5 * (a + b)).collect::<Vec<_>>()))
}

/// Where the pictures of one integrator are drawn.
struct Easel<'a> {
    folder: &'a Path,
    /// Relative to the folder.
    place: PathBuf,
    plan: &'a Plan,
    store: &'a Store,
    setup: &'a Setup,
    reference: Option<&'a ReferenceImage>,
}

impl Easel<'_> {
    /// Name of a file, as results have it.
    fn name(&self, file: &str) -> String {
        let parts: Vec<_> = self.place.iter().map(|p| p.to_string_lossy().into_owned()).collect();
        format!("{}/{file}", parts.join("/"))
    }

    fn put(&self, file: &str, picture: &image::RgbImage) -> Result<String, RecordError> {
        let path = self.folder.join(&self.place).join(file);
        write_png(&path, picture).map_err(|e| failed(&path, "cannot write", &e))?;
        Ok(self.name(file))
    }

    fn mean(
        &self,
        name: &str,
        cells: &[Cell],
        moments: &ImageMoments,
        light: f64,
    ) -> Result<Images, RecordError> {
        let film = *self.setup.scene.film();
        let n = moments.count() as f64;
        let variance = moments.variance();
        // Of the mean, which is what the file shows.
        let pixels = variance.iter().map(|p| p.map(|v| v / n)).collect();
        let layers = [NamedLayer { name: "variance".into(), pixels }];
        let metadata = Metadata {
            scene: self.setup.name.clone(),
            scene_hash: self.setup.hash.clone(),
            integrator: name.to_owned(),
            seed: self.plan.seed,
            samples_per_pixel: cells.iter().map(|c| c.spp).sum(),
            replicates: moments.count(),
            seconds: cells.iter().map(|c| c.seconds).sum(),
            version: env!("CARGO_PKG_VERSION").into(),
        };
        let picture = Picture { film, pixels: moments.mean(), layers: &layers, metadata };
        Output::open(&self.folder.join(&self.place).join("mean.exr"))?.write(&picture, light)?;
        let sigma = sigma_map(moments.mean(), &variance, film.crop.width, film.crop.height);
        Ok(Images {
            mean: self.name("mean.exr"),
            png: self.name("mean.png"),
            sigma_png: self.put("sigma.png", &sigma)?,
            techniques: None,
            lengths: Vec::new(),
        })
    }

    /// The first replicate at each budget, and its error.
    fn frames(
        &self,
        name: &str,
        moments: &ImageMoments,
        light: f64,
    ) -> Result<(Vec<String>, Vec<String>), RecordError> {
        let crop = self.setup.scene.film().crop;
        let truth = match (self.reference, self.setup.contestants.iter().find(|(n, _)| n == name)) {
            (Some(r), Some((_, c))) => {
                let [one, two] = r.halves(c.families(&self.setup.scene), Families::ALL);
                wide(&one.iter().zip(&two).map(|(a, b)| 0.5 * (a + b)).collect::<Vec<_>>())
            }
            _ => moments.mean().to_vec(),
        };
        let (mut frames, mut errors) = (Vec::new(), Vec::new());
        for (n, budget) in self.plan.budgets.iter().enumerate() {
            let cells = self.plan.cells(self.store, self.setup, name, *budget);
            let Some(first) = cells.first() else { continue };
            let image = wide(&first.image(Families::ALL, self.setup.pixels()));
            let frame = tone_mapped(&image, crop.width, crop.height, light);
            frames.push(self.put(&format!("frame.{n}.png"), &frame)?);
            let error = error_map(&image, &truth, crop.width, crop.height);
            errors.push(self.put(&format!("error.{n}.png"), &error)?);
        }
        Ok((frames, errors))
    }

    /// Pictures that need layers which a measured render does not keep, from a render of their own
    /// as long as a replicate.
    fn portrait(
        &self,
        integrator: &dyn pathspace_core::integrator::Integrator,
        cells: &[Cell],
        light: f64,
        images: &mut Images,
    ) -> Result<(), RecordError> {
        let spp = cells.iter().map(|c| c.spp).sum::<f64>() / cells.len().max(1) as f64;
        let budget = Budget::Samples((spp as u64).clamp(1, PORTRAIT));
        let layers = Layers { length: true, technique: true, ..Layers::NONE };
        let go_on = &mut |_: &_| std::ops::ControlFlow::Continue(());
        let seed = pathspace_core::random::derive_seed(self.plan.seed, 0x0070_6963_7475_7265);
        // It has rendered this scene before.
        let Ok(e) = expose(integrator, &self.setup.scene, layers, seed, budget, go_on) else {
            return Ok(());
        };
        if let Some(sheet) = technique_sheet(&e.film, Weighting::Weighted) {
            images.techniques = Some(self.put("techniques.png", &sheet)?);
        }
        let crop = self.setup.scene.film().crop;
        for length in 1..=LENGTHS {
            let Some(image) = e.film.layer_image(LayerKey::Length(length)) else { continue };
            let picture = tone_mapped(&image, crop.width, crop.height, light);
            let file = self.put(&format!("length.{length:02}.png"), &picture)?;
            images.lengths.push((u32::from(length), file));
        }
        Ok(())
    }
}

/// A name that every file system takes.
pub(crate) fn slug(name: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() || "-=.".contains(c) { c } else { '_' };
    let slug: String = name.chars().map(plain).collect();
    // No hidden folder, and none above.
    slug.trim_start_matches('.').to_owned()
}

fn moments(cells: &[Cell], pixels: usize) -> ImageMoments {
    let mut moments = ImageMoments::new(pixels);
    for cell in cells {
        moments.push(&wide(&cell.image(Families::ALL, pixels)));
    }
    moments
}

fn wide(image: &[f32]) -> Vec<[f64; 3]> {
    let (pixels, _) = image.as_chunks::<3>();
    pixels.iter().map(|p| p.map(f64::from)).collect()
}

pub(crate) fn failed(path: &Path, what: &str, error: &std::io::Error) -> RecordError {
    let reason = format!("{what}: {error}");
    RecordError::Write { path: path.to_path_buf(), reason }
}
