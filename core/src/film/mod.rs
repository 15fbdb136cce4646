//! The film: I_j = ∫_Ω f_j(x̄) dμ(x̄) for every pixel j, and everything that is kept beside it.

mod bands;
mod chunk;
mod filter;
mod layer;
mod parts;
mod sink;

pub use crate::path::Families;
pub(crate) use bands::{Band, Fresh, Sorted};
pub use chunk::{Chunk, NonFinite};
pub use filter::Filter;
pub use layer::{LayerKey, Layers};
pub use parts::{FilmError, FilmParts};
pub use sink::{Contribution, RecordingSink, Sink};

use std::collections::BTreeMap;

use crate::description::{Crop, FilmDescription};

/// Sums of contributions in `f64`, one cell per pixel of the crop window.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane(Vec<[f64; 3]>);

impl Plane {
    fn new(pixels: usize) -> Self {
        Plane(vec![[0.0; 3]; pixels])
    }

    /// The sums, rows from top to bottom.
    pub fn sums(&self) -> &[[f64; 3]] {
        &self.0
    }
}

/// A film under exposure. Pixels are sums over contributions; [`Film::image`] divides by the
/// samples per pixel.
///
/// Pixel j is ∫ h_j(u) L(u) du with h_j(u) = h(u − c_j) / ∫_window h(v − c_j) dv: the filter about
/// the pixel's centre, normalised over the crop window, so that camera samples (uniform on the
/// window) and splats have the same expectation up to the border.
#[derive(Clone, Debug)]
pub struct Film {
    raster: Raster,
    beauty: Plane,
    planes: BTreeMap<LayerKey, Plane>,
    samples: u64,
    nonfinite: u64,
    nonfinite_examples: Vec<NonFinite>,
}

/// All of a film but what it has collected.
#[derive(Clone, Debug)]
pub(crate) struct Raster {
    description: FilmDescription,
    filter: Filter,
    layers: Layers,
    norm_x: Vec<f64>,
    norm_y: Vec<f64>,
}

impl Raster {
    fn width(&self) -> usize {
        self.description.crop.width as usize
    }

    fn height(&self) -> usize {
        self.description.crop.height as usize
    }
}

/// How many non-finite contributions are kept with their replay data.
const MAX_NONFINITE_EXAMPLES: usize = 16;

impl Film {
    /// An unexposed film that also keeps the given layers.
    pub fn new(description: &FilmDescription, layers: Layers) -> Self {
        let Crop { x, y, width, height } = description.crop;
        let filter = Filter::new(description.filter);
        let norm = |origin: u32, n: u32| -> Vec<f64> {
            let (lo, hi) = (f64::from(origin), f64::from(origin) + f64::from(n));
            (0..n)
                .map(|i| {
                    let c = lo + i as f64 + 0.5;
                    1.0 / filter.integral(lo - c, hi - c)
                })
                .collect()
        };
        let (norm_x, norm_y) = (norm(x, width), norm(y, height));
        Film {
            raster: Raster { description: *description, filter, layers, norm_x, norm_y },
            beauty: Plane::new(width as usize * height as usize),
            planes: BTreeMap::new(),
            samples: 0,
            nonfinite: 0,
            nonfinite_examples: Vec::new(),
        }
    }

    /// Size, crop and filter.
    pub fn description(&self) -> &FilmDescription {
        &self.raster.description
    }

    /// Columns of the crop window.
    pub fn width(&self) -> usize {
        self.raster.width()
    }

    /// Rows of the crop window.
    pub fn height(&self) -> usize {
        self.raster.height()
    }

    /// Pixels of the crop window: the work items of a step of one sample per pixel.
    pub fn pixels(&self) -> u64 {
        self.width() as u64 * self.height() as u64
    }

    /// Which layers are kept.
    pub fn layers(&self) -> Layers {
        self.raster.layers
    }

    /// Samples so far: camera paths, light paths or mutations.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Samples per pixel, the divisor of every pixel's sum.
    pub fn samples_per_pixel(&self) -> f64 {
        self.samples as f64 / self.pixels() as f64
    }

    /// Number of contributions that were not finite. They are left out of the sums: a film with any
    /// is wrong.
    pub fn nonfinite(&self) -> u64 {
        self.nonfinite
    }

    /// The first non-finite contributions, each with what replays it.
    pub fn nonfinite_examples(&self) -> &[NonFinite] {
        &self.nonfinite_examples
    }

    /// The raw sums of the image.
    pub fn sums(&self) -> &Plane {
        &self.beauty
    }

    /// The raw sums of the layers.
    pub fn planes(&self) -> &BTreeMap<LayerKey, Plane> {
        &self.planes
    }

    /// The estimate of the image in `f64`, rows from top to bottom.
    pub fn image(&self) -> Vec<[f64; 3]> {
        self.scaled(&self.beauty)
    }

    /// The estimate of one layer; `None` where nothing fell into it.
    pub fn layer_image(&self, key: LayerKey) -> Option<Vec<[f64; 3]>> {
        self.planes.get(&key).map(|p| self.scaled(p))
    }

    fn scaled(&self, plane: &Plane) -> Vec<[f64; 3]> {
        let spp = self.samples_per_pixel();
        let k = if spp > 0.0 { 1.0 / spp } else { 0.0 };
        plane.0.iter().map(|p| p.map(|v| v * k)).collect()
    }

    /// Mean of the image over its pixels.
    pub fn mean(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for p in &self.beauty.0 {
            for c in 0..3 {
                sum[c] += p[c];
            }
        }
        sum.map(|v| if self.samples > 0 { v / self.samples as f64 } else { 0.0 })
    }

    /// Counts finished samples; the driver calls it once a step.
    pub fn add_samples(&mut self, n: u64) {
        self.samples += n;
    }

    /// Applies the contributions of a chunk in their order.
    pub fn apply(&mut self, chunk: &Chunk) {
        self.add_nonfinite(chunk.nonfinite_count(), chunk.nonfinite());
        let (raster, bands) = self.bands(self.raster.height());
        let add = |mut band: Band<'_>| {
            chunk.records().iter().for_each(|c| band.add(raster, c));
            band.into_fresh()
        };
        let fresh = bands.into_iter().map(add).collect();
        self.rejoin(fresh);
    }
}

#[cfg(test)]
mod tests;
