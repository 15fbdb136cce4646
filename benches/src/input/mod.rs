//! Images of any renderer from files: OpenEXR, PFM and NPY.

mod npy;

use std::io;
use std::path::{Path, PathBuf};

use pathspace_scenes::floats;
use thiserror::Error;

/// The attribute in which our own files hold the seconds of rendering.
const SECONDS: &str = "pathspace.seconds";

/// An image in linear sRGB.
#[derive(Clone, Debug, PartialEq)]
pub struct InputImage {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `[r, g, b]` in rows from top to bottom.
    pub pixels: Vec<[f32; 3]>,
    /// Seconds of rendering, where the file says so; our own do.
    pub seconds: Option<f64>,
}

/// Why an image was not read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum InputError {
    /// The file cannot be read.
    #[error("{}: cannot read: {reason}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        reason: io::Error,
    },
    /// The name ends in nothing that is known.
    #[error("{}: not an image that can be read (known: .exr, .pfm, .npy)", path.display())]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// The content is not what the name says, or no image.
    #[error("{}: {reason}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// Another size than that of the images before.
    #[error(
        "{}: has {}×{} pixels, but {} has {}×{}",
        path.display(), found.0, found.1, first.display(), expected.0, expected.1
    )]
    Size {
        /// The file.
        path: PathBuf,
        /// Its width and height.
        found: (usize, usize),
        /// The first image.
        first: PathBuf,
        /// Its width and height.
        expected: (usize, usize),
    },
}

/// Reads an image; the end of its name tells the format.
///
/// EXR and PFM are read as [`floats::decode`] says. NPY: shape (h, w), (h, w, 1), (h, w, 3) or (h,
/// w, 4) of 16-, 32- or 64-bit floats; the first row is the top.
///
/// # Errors
/// [`InputError`], naming the file; also where a value is not finite.
pub fn read(path: &Path) -> Result<InputImage, InputError> {
    let suffix = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let decode = match suffix.as_str() {
        "exr" | "pfm" => decode,
        "npy" => npy::decode,
        _ => return Err(InputError::Format { path: path.into() }),
    };
    let bytes =
        std::fs::read(path).map_err(|reason| InputError::Read { path: path.into(), reason })?;
    let content = |reason| InputError::Content { path: path.into(), reason };
    let image = decode(&bytes).map_err(content)?;
    let bad = image.pixels.iter().position(|p| p.iter().any(|v| !v.is_finite()));
    match bad {
        None => Ok(image),
        Some(i) => {
            let (x, y) = (i % image.width, i / image.width);
            Err(content(format!("pixel ({x}, {y}) is {:?}", image.pixels[i])))
        }
    }
}

/// Reads images that must have one size.
///
/// # Errors
/// [`InputError`], naming the file.
pub fn read_all<P: AsRef<Path>>(paths: &[P]) -> Result<Vec<InputImage>, InputError> {
    let mut images: Vec<InputImage> = Vec::with_capacity(paths.len());
    for path in paths.iter().map(AsRef::as_ref) {
        let image = read(path)?;
        let found = (image.width, image.height);
        if let Some(one) = images.first()
            && (one.width, one.height) != found
        {
            let (first, expected) = (paths[0].as_ref().into(), (one.width, one.height));
            return Err(InputError::Size { path: path.into(), found, first, expected });
        }
        images.push(image);
    }
    Ok(images)
}

fn decode(bytes: &[u8]) -> Result<InputImage, String> {
    let image = floats::decode(bytes).ok_or("is neither an OpenEXR nor a PFM file")??;
    Ok(InputImage {
        width: image.width as usize,
        height: image.height as usize,
        pixels: pixels(&image.values, image.channels as usize),
        seconds: image.numbers.iter().find(|(name, _)| name == SECONDS).map(|(_, s)| *s),
    })
}

/// Grey or colour as colour.
fn pixels(values: &[f32], channels: usize) -> Vec<[f32; 3]> {
    let pixel = |p: &[f32]| if channels < 3 { [p[0]; 3] } else { [p[0], p[1], p[2]] };
    values.chunks_exact(channels).map(pixel).collect()
}

/// A size that memory can hold.
fn area(width: usize, height: usize, channels: usize) -> Result<usize, String> {
    let values = width.checked_mul(height).and_then(|n| n.checked_mul(channels));
    let values = values.filter(|n| (1..=1 << 32).contains(n));
    values.ok_or_else(|| format!("has an impossible size: {width}×{height}"))
}

#[cfg(test)]
mod tests;
