//! Image files: EXR with layers and metadata and a tone-mapped PNG beside it; or PNG, PFM or NPY
//! alone.
//!
//! A file appears whole or not at all: it is written under a temporary name beside its place,
//! flushed to the disk and then renamed. [`Output::open`] finds out before the rendering whether
//! the place can be written at all.

mod exr;
mod plain;
mod png;
mod sheet;
mod sigma;
pub(crate) mod whole;

use std::io::{self, Read};
use std::path::{Path, PathBuf};

use pathspace_core::description::FilmDescription;
use thiserror::Error;

pub use png::{exposure, tone_map};
pub use sheet::{SheetRow, Weighting, labelled_sheet, technique_sheet};
pub use sigma::{FULL_SIGMA, sigma_picture};
pub use whole::{is_same_file, read_file, read_text};
use whole::{probe, write_whole};

/// Why an image was not written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The name does not end in that of a format.
    #[error("{}: the name of an image must end in .exr, .png, .pfm or .npy", path.display())]
    Name {
        /// The name.
        path: PathBuf,
    },
    /// There is a file of another program where nobody asked to write.
    #[error("{}: is there already, and pathspace did not write it", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// The file cannot be written: no such directory, no permission, no space, …
    #[error("{}: cannot write: {reason}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        reason: String,
    },
}

/// What a file says about how its image was made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// Name of the scene.
    pub scene: String,
    /// Hash of the scene's content.
    pub scene_hash: String,
    /// Spec of the integrator.
    pub integrator: String,
    /// Seed of the run.
    pub seed: u64,
    /// Samples per pixel.
    pub samples_per_pixel: f64,
    /// Replicates that the image is the mean of.
    pub replicates: u64,
    /// Seconds of rendering.
    pub seconds: f64,
    /// Version of the program.
    pub version: String,
}

/// A named layer: pixels in rows from top to bottom.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedLayer {
    /// Name without the channel, such as `length.03`.
    pub name: String,
    /// Its pixels.
    pub pixels: Vec<[f64; 3]>,
}

/// An image with its layers.
#[derive(Clone, Debug)]
pub struct Picture<'a> {
    /// Size and crop window; the pixels are those of the window.
    pub film: FilmDescription,
    /// The image.
    pub pixels: &'a [[f64; 3]],
    /// What is kept beside it.
    pub layers: &'a [NamedLayer],
    /// How it was made.
    pub metadata: Metadata,
}

/// What an image file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Linear radiance with layers and metadata; a PNG stands beside it.
    Exr,
    /// Tone-mapped, 8 bits.
    Png,
    /// Linear radiance, portable float map.
    Pfm,
    /// Linear radiance, an array of NumPy: `float32[height, width, 3]`.
    Npy,
}

impl Format {
    fn of(path: &Path) -> Option<Format> {
        let end = path.extension()?.to_str()?.to_ascii_lowercase();
        path.file_stem()?;
        match end.as_str() {
            "exr" => Some(Format::Exr),
            "png" => Some(Format::Png),
            "pfm" => Some(Format::Pfm),
            "npy" => Some(Format::Npy),
            _ => None,
        }
    }
}

/// A place for an image that could be written when it was opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    path: PathBuf,
    format: Format,
}

impl Output {
    /// Checks that `path` ends in `.exr`, `.png`, `.pfm` or `.npy`, and that all [`Output::files`]
    /// can be written. Leaves nothing behind, and removes what killed processes have left of their
    /// writing to them.
    ///
    /// # Errors
    /// [`OutputError`], with the system's reason.
    pub fn open(path: &Path) -> Result<Output, OutputError> {
        let bad = || OutputError::Name { path: path.to_path_buf() };
        let format = Format::of(path).ok_or_else(bad)?;
        let output = Output { path: path.to_path_buf(), format };
        for target in output.files() {
            probe(&target).map_err(|e| failed(&target, &e))?;
        }
        Ok(output)
    }

    /// Path of the image.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its format.
    pub fn format(&self) -> Format {
        self.format
    }

    /// The file among those that may be written here which is also `path`, if any: it would be
    /// overwritten.
    pub fn overwrites(&self, path: &Path) -> Option<PathBuf> {
        let beside = ["techniques.png", "unweighted.png"].map(|s| self.path.with_extension(s));
        self.files().into_iter().chain(beside).find(|own| is_same_file(own, path))
    }

    /// The files that [`Output::write`] writes: the image, and beside an EXR file a PNG.
    pub fn files(&self) -> Vec<PathBuf> {
        let beside = (self.format == Format::Exr).then(|| self.path.with_extension("png"));
        std::iter::once(self.path.clone()).chain(beside).collect()
    }

    /// Refuses to replace files that are not by this program, those of `spared` excepted.
    ///
    /// # Errors
    /// [`OutputError::Foreign`].
    pub fn keep_foreign(&self, spared: Option<&Path>) -> Result<(), OutputError> {
        let foreign = |p: &PathBuf| Some(p.as_path()) != spared && p.exists() && !is_ours(p);
        match self.files().into_iter().find(foreign) {
            Some(path) => Err(OutputError::Foreign { path }),
            None => Ok(()),
        }
    }

    /// Writes [`Output::files`]; where one is a PNG, radiance is multiplied by `exposure` in it.
    ///
    /// # Errors
    /// [`OutputError`], with the system's reason.
    pub fn write(&self, picture: &Picture<'_>, exposure: f64) -> Result<(), OutputError> {
        for path in self.files() {
            let bytes = match Format::of(&path) {
                Some(Format::Exr) => exr::encode(picture),
                Some(Format::Pfm) => Ok(plain::pfm(picture)),
                Some(Format::Npy) => Ok(plain::npy(picture)),
                Some(Format::Png) | None => png::encode(picture, exposure),
            };
            bytes.and_then(|b| write_bytes(&path, &b)).map_err(|e| failed(&path, &e))?;
        }
        Ok(())
    }

    /// Writes a picture beside the image, under its name with `suffix`: `out.exr`,
    /// `out.techniques.png`. Returns its path.
    ///
    /// # Errors
    /// [`OutputError`], with the system's reason.
    pub fn write_beside(
        &self,
        suffix: &str,
        picture: &image::RgbImage,
    ) -> Result<PathBuf, OutputError> {
        let path = self.path.with_extension(suffix);
        let bytes = png::encode_rgb(picture).map_err(|e| failed(&path, &e))?;
        write_bytes(&path, &bytes).map_err(|e| failed(&path, &e))?;
        Ok(path)
    }
}

/// How much of a file is looked at for the name of who wrote it.
const HEAD: u64 = 1 << 16;

/// True where a file says that this program wrote it, as its EXR and PNG files do.
fn is_ours(path: &Path) -> bool {
    let name = b"pathspace";
    let mut head = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    read.is_ok() && head.windows(name.len()).any(|w| w == name)
}

/// Writes a picture as PNG.
///
/// # Errors
/// [`OutputError`], with the system's reason.
pub fn write_png(path: &Path, picture: &image::RgbImage) -> Result<(), OutputError> {
    let bytes = png::encode_rgb(picture).map_err(|e| failed(path, &e))?;
    write_bytes(path, &bytes).map_err(|e| failed(path, &e))
}

fn failed(path: &Path, error: &io::Error) -> OutputError {
    OutputError::Write { path: path.to_path_buf(), reason: error.to_string() }
}

pub(crate) fn write_bytes(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write_whole(path, |file| file.write_all(bytes))
}
