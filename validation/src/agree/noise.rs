//! Noise of the images, and what it costs.

use pathspace_core::color::luminance;
use serde::Serialize;

use super::ImageSet;
use crate::stats::error::{Others, half_variance, mean, relative_epsilon};
use crate::stats::{Estimate, StatsError, efficiency_ratio};

/// Noise of one image, from the images of its side alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Noise {
    /// MSE of one image against the expectation of its side: variance between images, the mean over
    /// pixels and channels.
    pub mse: f64,
    /// relMSE: variance/(mean² + ε), ε = 10⁻²·(mean luminance)²; NaN for black images with noise.
    pub relmse: f64,
    /// MSE of each image with the others as its reference; with two images both are ½(A₁−A₂)².
    #[serde(skip)]
    pub per_image: Vec<f64>,
    /// relMSE of each image.
    #[serde(skip)]
    pub relative_per_image: Vec<f64>,
}

impl Noise {
    pub(super) fn of(images: &[Vec<[f32; 3]>]) -> Result<Noise, StatsError> {
        let flat: Vec<&[f32]> = images.iter().map(|i| i.as_flattened()).collect();
        let (maps, center) = if flat.len() == 2 {
            let map = half_variance(flat[0], flat[1])?;
            let center = flat[0].iter().zip(flat[1]).map(|(a, b)| 0.5 * f64::from(a + b));
            (vec![map.clone(), map], center.collect::<Vec<f64>>())
        } else {
            let others = Others::of(&flat)?;
            let maps = flat.iter().map(|f| others.map(f)).collect::<Result<Vec<_>, _>>()?;
            (maps, others.mean().to_vec())
        };
        let light = center.chunks_exact(3).map(|p| luminance(&[p[0], p[1], p[2]])).sum::<f64>();
        let epsilon = relative_epsilon(light / (center.len() / 3) as f64);
        let relative = |map: &Vec<f64>| -> Result<f64, StatsError> {
            let scaled = map
                .iter()
                .zip(&center)
                .map(|(e, r)| if *e == 0.0 { 0.0 } else { e / (r * r + epsilon) });
            mean(&scaled.collect::<Vec<_>>())
        };
        let per_image = maps.iter().map(|m| mean(m)).collect::<Result<Vec<_>, _>>()?;
        let relative_per_image = maps.iter().map(relative).collect::<Result<Vec<_>, _>>()?;
        Ok(Noise {
            mse: mean(&per_image)?,
            relmse: mean(&relative_per_image)?,
            per_image,
            relative_per_image,
        })
    }
}

/// Efficiency of A over that of B; `None` without seconds, with two images on a side, and without
/// noise.
pub(super) fn ratio(
    sides: [ImageSet<'_>; 2],
    errors: [&[f64]; 2],
) -> Result<Option<Estimate>, StatsError> {
    let costs = [0, 1].map(|i| -> Vec<f64> {
        errors[i].iter().zip(sides[i].seconds).map(|(e, s)| e * s).collect()
    });
    let known = |c: &Vec<f64>| c.len() > 2 && c.iter().sum::<f64>() > 0.0;
    if !costs.iter().all(known) {
        return Ok(None);
    }
    efficiency_ratio(&costs[0], &costs[1], 0.95).map(Some)
}
