//! The test for images of any renderer.

use numpy::{PyReadonlyArray3, PyUntypedArrayMethods};
use pathspace::validation::agree::{AgreeConfig, ImageSet, agree as test};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::error::failed;

type Image = Vec<[f32; 3]>;

/// Tests whether two lists of images (h, w, 3) show the same expectation; the answer is JSON.
#[pyfunction]
pub(crate) fn agree(
    py: Python<'_>,
    a: Vec<PyReadonlyArray3<'_, f32>>,
    b: Vec<PyReadonlyArray3<'_, f32>>,
    alpha: f64,
    limit: f64,
    seconds: [Vec<f64>; 2],
) -> PyResult<String> {
    let shape = match a.first() {
        Some(one) => [one.shape()[0], one.shape()[1]],
        None => return Err(PyValueError::new_err("there are no images")),
    };
    let [a, b] = [pixels(&a, shape)?, pixels(&b, shape)?];
    let config = AgreeConfig { alpha, limit, ..AgreeConfig::default() };
    let found = py.detach(|| {
        let sets = [
            ImageSet { images: &a, seconds: &seconds[0] },
            ImageSet { images: &b, seconds: &seconds[1] },
        ];
        test(shape[1], shape[0], sets[0], sets[1], &config)
    });
    serde_json::to_string(&found.map_err(failed)?).map_err(failed)
}

fn pixels(images: &[PyReadonlyArray3<'_, f32>], shape: [usize; 2]) -> PyResult<Vec<Image>> {
    let one = |image: &PyReadonlyArray3<'_, f32>| {
        let found = image.shape();
        if found != [shape[0], shape[1], 3] {
            let text =
                format!("an image has shape {found:?}, the first one {shape:?} and 3 channels");
            return Err(PyValueError::new_err(text));
        }
        let values =
            image.as_slice().map_err(|_| PyValueError::new_err("images must be contiguous"))?;
        Ok(values.as_chunks::<3>().0.to_vec())
    };
    images.iter().map(one).collect()
}
