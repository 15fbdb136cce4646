//! Two-stage targets: chains that spend their time evenly over the image instead of in proportion
//! to its brightness (Veach and Guibas 1997, §6.3; Hoberock and Hart 2010, "Arbitrary Importance
//! Functions for Metropolis Light Transport").

use glam::Vec2;
use pathspace_core::Scene;
use pathspace_core::color::luminance;
use pathspace_core::description::Crop;
use pathspace_core::film::{Contribution, Sink};
use pathspace_core::integrator::PathEstimator;
use pathspace_core::random::{Address, RandomStream};
use rayon::prelude::*;

/// A positive function of the film position that luminance is multiplied with: f* = Σ_j lum(f_j)
/// h(film). Any such function leaves the image unbiased, because contributions are divided by the
/// same f*.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageWeight {
    crop: Crop,
    size: [usize; 2],
    /// Row by row; empty for h = 1.
    cells: Vec<f64>,
}

/// Samples per cell of the pilot image.
const PER_CELL: u64 = 64;
/// Part of the mean luminance that is added everywhere, so that h is bounded by its inverse.
const FLOOR: f64 = 0.1;
/// Pilot samples in a parallel task.
const BATCH: u64 = 256;

impl ImageWeight {
    /// h = 1: the target is luminance.
    pub fn uniform(scene: &Scene) -> Self {
        ImageWeight { crop: scene.film().crop, size: [0; 2], cells: Vec::new() }
    }

    /// h = Ī/(Ĩ + 0.1 Ī), Ĩ a coarse, blurred pilot image of luminance, Ī its mean; `samples`
    /// samples of `estimator` on the current rayon pool, the same for any number of threads. Its
    /// seed must be apart from those of bootstrap and chains.
    pub fn pilot<E: PathEstimator>(scene: &Scene, estimator: &E, seed: u64, samples: u64) -> Self {
        let mut weight = ImageWeight::uniform(scene);
        let Crop { width, height, .. } = weight.crop;
        let cells = (samples / PER_CELL).clamp(1, u64::from(width) * u64::from(height)) as f64;
        let columns = (cells * f64::from(width) / f64::from(height)).sqrt().round().max(1.0);
        weight.size = [columns as usize, (cells / columns).round().max(1.0) as usize];
        let records: Vec<Vec<(usize, f64)>> = (0..samples.div_ceil(BATCH))
            .into_par_iter()
            .map(|batch| {
                let mut sink = Splats { weight: &weight, list: Vec::new() };
                for item in batch * BATCH..((batch + 1) * BATCH).min(samples) {
                    let mut u = RandomStream::new(Address { seed, step: 0, item });
                    estimator.estimate(scene, None, &mut u, &mut sink);
                }
                sink.list
            })
            .collect();
        let mut image = vec![0.0; weight.size[0] * weight.size[1]];
        for (cell, value) in records.into_iter().flatten() {
            image[cell] += value;
        }
        let mean = image.iter().sum::<f64>() / image.len() as f64;
        if !(mean > 0.0 && mean.is_finite()) {
            return ImageWeight::uniform(scene);
        }
        let blurred = blur(&blur(&image, weight.size), weight.size);
        weight.cells = blurred.iter().map(|v| mean / (v + FLOOR * mean)).collect();
        weight
    }

    /// h at a film position.
    #[inline]
    pub fn at(&self, film: Vec2) -> f64 {
        if self.cells.is_empty() { 1.0 } else { self.cells[self.cell(film)] }
    }

    /// lum(f_j) of one contribution.
    #[inline]
    pub fn luminance(c: &Contribution) -> f64 {
        luminance(&c.value.to_array().map(f64::from))
    }

    fn cell(&self, film: Vec2) -> usize {
        let [columns, rows] = self.size;
        let at = |v: f32, origin: u32, length: u32, n: usize| {
            let x = (v as f64 - origin as f64) / length as f64 * n as f64;
            (x as usize).min(n - 1)
        };
        let Crop { x, y, width, height } = self.crop;
        at(film.x, x, width, columns) + columns * at(film.y, y, height, rows)
    }
}

/// Mean over 3 × 3 cells, as many of them as there are.
fn blur(image: &[f64], [columns, rows]: [usize; 2]) -> Vec<f64> {
    let around = |i: usize, n: usize| i.saturating_sub(1)..=(i + 1).min(n - 1);
    (0..columns * rows)
        .map(|i| {
            let (mut sum, mut count) = (0.0, 0.0);
            for y in around(i / columns, rows) {
                for x in around(i % columns, columns) {
                    sum += image[y * columns + x];
                    count += 1.0;
                }
            }
            sum / count
        })
        .collect()
}

struct Splats<'a> {
    weight: &'a ImageWeight,
    list: Vec<(usize, f64)>,
}

impl Sink for Splats<'_> {
    fn add(&mut self, c: Contribution) {
        let value = ImageWeight::luminance(&c);
        if value > 0.0 && value.is_finite() && c.film.is_finite() {
            self.list.push((self.weight.cell(c.film), value));
        }
    }
}
