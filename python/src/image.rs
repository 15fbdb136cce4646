//! Images from files, into files, and for the eye.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::PathBuf;

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use numpy::{IntoPyArray, PyArray3, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
use pathspace::benches::input;
use pathspace::benches::output::{self, Metadata, NamedLayer, Output, Picture, tone_map};
use pathspace::core::description::{Crop, FilmDescription};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::error::failed;

/// Pixels as an array (h, w, 3), without a copy.
pub(crate) fn array<'py>(
    py: Python<'py>,
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    pixels.into_flattened().into_pyarray(py).reshape([height, width, 3])
}

/// As many digits as files hold.
pub(crate) fn narrow(pixels: &[[f64; 3]]) -> Vec<[f32; 3]> {
    pixels.iter().map(|p| p.map(|v| v as f32)).collect()
}

fn wide(image: &PyReadonlyArray3<'_, f32>) -> PyResult<Vec<[f64; 3]>> {
    if image.shape()[2] != 3 {
        return Err(PyValueError::new_err("an image has three channels"));
    }
    let values = image.as_array();
    let row = values.outer_iter().flat_map(|row| {
        row.outer_iter().map(|p| [0, 1, 2].map(|c| f64::from(p[c]))).collect::<Vec<_>>()
    });
    Ok(row.collect())
}

/// Reads an image (.exr, .pfm, .npy): its array, and the seconds of rendering where the file names
/// them.
#[pyfunction]
pub(crate) fn read_image(
    py: Python<'_>,
    path: PathBuf,
) -> PyResult<(Bound<'_, PyArray3<f32>>, Option<f64>)> {
    let image = py.detach(|| input::read(&path)).map_err(failed)?;
    Ok((array(py, image.width, image.height, image.pixels)?, image.seconds))
}

/// Writes an EXR file with layers, and a PNG beside it.
#[pyfunction]
pub(crate) fn write_image(
    path: PathBuf,
    image: PyReadonlyArray3<'_, f32>,
    layers: Vec<(String, PyReadonlyArray3<'_, f32>)>,
    window: Option<[u32; 6]>,
    text: HashMap<String, String>,
    figures: HashMap<String, f64>,
    exposure: Option<f64>,
) -> PyResult<Vec<PathBuf>> {
    let pixels = wide(&image)?;
    let (height, width) = (image.shape()[0] as u32, image.shape()[1] as u32);
    let film = match window {
        Some([w, h, x, y, width, height]) => {
            let crop = Crop { x, y, width, height };
            FilmDescription { crop, ..FilmDescription::new(w, h) }
        }
        None => FilmDescription::new(width, height),
    };
    if (film.crop.width, film.crop.height) != (width, height) {
        return Err(PyValueError::new_err("the window is not that of the image"));
    }
    let mut named = Vec::new();
    for (name, layer) in &layers {
        if layer.shape() != image.shape() {
            return Err(PyValueError::new_err(format!("layer {name} is not of the image's shape")));
        }
        named.push(NamedLayer { name: name.clone(), pixels: wide(layer)? });
    }
    let said = |key: &str| text.get(key).cloned().unwrap_or_default();
    let figure = |key: &str| figures.get(key).copied().unwrap_or(0.0);
    let metadata = Metadata {
        scene: said("scene"),
        scene_hash: said("scene_hash"),
        integrator: said("integrator"),
        seed: said("seed").parse().unwrap_or(0),
        samples_per_pixel: figure("samples_per_pixel"),
        replicates: 1,
        seconds: figure("seconds"),
        version: env!("CARGO_PKG_VERSION").into(),
    };
    let output = Output::open(&path).map_err(failed)?;
    let exposure = exposure.unwrap_or_else(|| output::exposure(&pixels));
    let picture = Picture { film, pixels: &pixels, layers: &named, metadata };
    output.write(&picture, exposure).map_err(failed)?;
    Ok(output.files())
}

/// The exposure that the command chooses for a PNG.
#[pyfunction]
pub(crate) fn exposure(image: PyReadonlyArray3<'_, f32>) -> PyResult<f64> {
    Ok(output::exposure(&wide(&image)?))
}

/// An image as a tone-mapped PNG.
#[pyfunction]
pub(crate) fn png(image: PyReadonlyArray3<'_, f32>, exposure: f64) -> PyResult<Vec<u8>> {
    let bytes: Vec<u8> = wide(&image)?.iter().flat_map(|p| tone_map(*p, exposure)).collect();
    let (height, width) = (image.shape()[0] as u32, image.shape()[1] as u32);
    let mut out = Cursor::new(Vec::new());
    PngEncoder::new(&mut out)
        .write_image(&bytes, width, height, ExtendedColorType::Rgb8)
        .map_err(failed)?;
    Ok(out.into_inner())
}
