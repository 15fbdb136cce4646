//! Images of a results folder as numbers.

use std::path::Path;

use exr::prelude::{FlatImage, read_all_flat_layers_from_file};
use pathspace_core::color::luminance;

/// An image of linear radiance with what is known of its noise.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Radiance {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Red, green and blue.
    pub(super) planes: Vec<Vec<f32>>,
    /// Standard deviation of luminance; channels of one pixel go up and down together.
    pub(super) sigma: Option<Vec<f32>>,
    /// False where it was read from a tone-mapped picture, and highlights are cut.
    pub(super) linear: bool,
}

impl Radiance {
    /// Reads an EXR file: `R`, `G`, `B` and, where it is there, the layer `variance`.
    pub(super) fn from_exr(path: &Path) -> Result<Radiance, String> {
        let image = read_all_flat_layers_from_file(path).map_err(|e| e.to_string())?;
        let layer = image.layer_data.first().ok_or("it has no layer")?;
        let (width, height) = (layer.size.0, layer.size.1);
        let rgb = ["R", "G", "B"].map(|c| channel(&image, c));
        let [Some(r), Some(g), Some(b)] = rgb else {
            return Err("it has no channels R, G, B".into());
        };
        let variance = ["variance.R", "variance.G", "variance.B"].map(|c| channel(&image, c));
        let sigma = match variance {
            [Some(r), Some(g), Some(b)] => {
                let root = |v: &f32| f64::from(v.max(0.0)).sqrt();
                let channels = r.iter().zip(&g).zip(&b).map(|((r, g), b)| [r, g, b].map(root));
                Some(channels.map(|c| luminance(&c) as f32).collect())
            }
            _ => None,
        };
        Ok(Radiance { width, height, planes: vec![r, g, b], sigma, linear: true })
    }

    /// Reads a picture of 8 bits and undoes sRGB's transfer curve.
    pub(super) fn from_picture(path: &Path) -> Result<Radiance, String> {
        let image = image::open(path).map_err(|e| e.to_string())?.to_rgb32f();
        let (width, height) = (image.width() as usize, image.height() as usize);
        let plane = |c: usize| image.pixels().map(|p| linear(p.0[c])).collect();
        let planes = (0..3).map(plane).collect();
        Ok(Radiance { width, height, planes, sigma: None, linear: false })
    }

    /// Means over blocks of `factor`² pixels; σ becomes that of the means of independent pixels.
    pub(super) fn shrunk(&self, factor: usize) -> Radiance {
        if factor <= 1 {
            return self.clone();
        }
        let (width, height) = (self.width.div_ceil(factor), self.height.div_ceil(factor));
        let blocks = |plane: &Vec<f32>, power: i32| -> Vec<f32> {
            let mut sums = vec![(0.0_f64, 0.0_f64); width * height];
            for (i, v) in plane.iter().enumerate() {
                let (x, y) = (i % self.width / factor, i / self.width / factor);
                let sum = &mut sums[y * width + x];
                sum.0 += f64::from(*v).powi(power);
                sum.1 += 1.0;
            }
            sums.iter()
                .map(|(sum, n)| if power == 1 { sum / n } else { sum.sqrt() / n } as f32)
                .collect()
        };
        Radiance {
            width,
            height,
            planes: self.planes.iter().map(|p| blocks(p, 1)).collect(),
            sigma: self.sigma.as_ref().map(|s| blocks(s, 2)),
            linear: self.linear,
        }
    }

    /// Multiplies everything by `scale`.
    pub(super) fn scaled(mut self, scale: f32) -> Radiance {
        for v in self.planes.iter_mut().chain(&mut self.sigma).flatten() {
            *v *= scale;
        }
        self
    }

    /// Pixels as triples.
    pub(super) fn pixels(&self) -> Vec<[f64; 3]> {
        let pixel = |i| [0, 1, 2].map(|c: usize| f64::from(self.planes[c][i]));
        (0..self.width * self.height).map(pixel).collect()
    }
}

/// sRGB's transfer curve inverted (IEC 61966-2-1).
fn linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// The channel of this name in the first layer.
fn channel(image: &FlatImage, name: &str) -> Option<Vec<f32>> {
    let channels = &image.layer_data.first()?.channel_data.list;
    let found = channels.iter().find(|c| c.name == *name)?;
    Some(found.sample_data.values_as_f32().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shrinking_keeps_the_mean_and_divides_the_noise() {
        let plane: Vec<f32> = (0..16).map(|i| i as f32).collect();
        let image = Radiance {
            width: 4,
            height: 4,
            planes: vec![plane.clone(), plane.clone(), plane],
            sigma: Some(vec![3.0; 16]),
            linear: true,
        };
        let small = image.shrunk(2);
        assert_eq!((small.width, small.height), (2, 2));
        assert_eq!(small.planes[0], [2.5, 4.5, 10.5, 12.5]);
        assert_eq!(small.sigma.unwrap(), [1.5; 4]);
        assert_eq!(image.shrunk(3).planes[0].len(), 4);
    }

    #[test]
    fn the_transfer_curve_is_undone() {
        assert!((linear(0.5) - 0.214).abs() < 1e-3 && linear(0.0) == 0.0 && linear(1.0) == 1.0);
    }
}
