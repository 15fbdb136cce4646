//! Image files: EXR with layers and metadata, and a tone-mapped PNG beside it.
//!
//! A file appears whole or not at all: it is written under a temporary name beside its place, flushed to the disk and then
//! renamed. [`Output::open`] finds out before the rendering whether the place can be written at all.

mod exr;
mod png;
mod sheet;
pub(crate) mod whole;

use std::io;
use std::path::{Path, PathBuf};

use pathspace_core::description::FilmDescription;
use thiserror::Error;

pub use png::{exposure, tone_map};
pub use sheet::{Weighting, technique_sheet};
use whole::{probe, write_whole};

/// Why an image was not written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The name does not end in `.exr`.
    #[error("{}: the name of an image must end in .exr", path.display())]
    Name {
        /// The name.
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

/// A place for an image that could be written when it was opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    exr: PathBuf,
}

impl Output {
    /// Checks that `path` ends in `.exr`, and that it and the PNG beside it can be written. Leaves nothing behind.
    ///
    /// # Errors
    /// [`OutputError`], with the system's reason.
    pub fn open(path: &Path) -> Result<Output, OutputError> {
        let exr = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
        if !exr || path.file_stem().is_none() {
            return Err(OutputError::Name { path: path.to_path_buf() });
        }
        let output = Output { exr: path.to_path_buf() };
        for target in [output.exr().to_path_buf(), output.png()] {
            probe(&target).map_err(|e| failed(&target, &e))?;
        }
        Ok(output)
    }

    /// Path of the EXR file.
    pub fn exr(&self) -> &Path {
        &self.exr
    }

    /// Path of the PNG file.
    pub fn png(&self) -> PathBuf {
        self.exr.with_extension("png")
    }

    /// Writes the EXR file and the PNG, the latter with radiance multiplied by `exposure`.
    ///
    /// # Errors
    /// [`OutputError`], with the system's reason.
    pub fn write(&self, picture: &Picture<'_>, exposure: f64) -> Result<(), OutputError> {
        let bytes = exr::encode(picture).map_err(|e| failed(&self.exr, &e))?;
        write_bytes(&self.exr, &bytes).map_err(|e| failed(&self.exr, &e))?;
        let png = self.png();
        let bytes = png::encode(picture, exposure).map_err(|e| failed(&png, &e))?;
        write_bytes(&png, &bytes).map_err(|e| failed(&png, &e))
    }
}

impl Output {
    /// Writes a picture beside the EXR file, under its name with `suffix`: `out.exr`, `out.techniques.png`.
    ///
    /// # Errors
    /// [`OutputError`], with the system's reason.
    pub fn write_beside(&self, suffix: &str, picture: &image::RgbImage) -> Result<(), OutputError> {
        let path = self.exr.with_extension(suffix);
        let bytes = png::encode_rgb(picture).map_err(|e| failed(&path, &e))?;
        write_bytes(&path, &bytes).map_err(|e| failed(&path, &e))
    }
}

fn failed(path: &Path, error: &io::Error) -> OutputError {
    OutputError::Write { path: path.to_path_buf(), reason: error.to_string() }
}

pub(crate) fn write_bytes(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write_whole(path, |file| file.write_all(bytes))
}
