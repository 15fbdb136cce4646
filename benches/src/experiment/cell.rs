//! A cell of an experiment: one replicate of one integrator on one scene with one budget, boiled
//! down to what is measured on it.

use std::collections::{BTreeMap, BTreeSet};

use pathspace_core::film::{Families, Film, LayerKey, NonFinite};
use pathspace_validation::pairs::{ClassMean, Observation, PathClass, Tiles};
use serde::{Deserialize, Serialize};

use crate::session::Exposure;

/// One replicate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Its seed.
    pub seed: u64,
    /// Samples per pixel done.
    pub spp: f64,
    /// Wall-clock seconds of rendering.
    pub seconds: f64,
    /// Processor seconds of all threads; NaN where nobody told.
    pub cpu_seconds: f64,
    /// Seconds that another renderer took to load and compile before it; 0 for ours.
    pub startup_seconds: f64,
    /// Rays traced; 0 where nobody told.
    pub rays: u64,
    /// Contributions that were not finite.
    pub nonfinite: u64,
    /// How to make the first of them again.
    pub nonfinite_example: Option<String>,
    /// Means of path classes: length, families, mean of the image, means of tiles.
    classes: Vec<(u16, u8, f64, Vec<f64>)>,
    /// The paths that the same families can make, all lengths together: families, `[r, g, b]` of
    /// every pixel.
    planes: Vec<(u8, Vec<f32>)>,
}

impl Cell {
    /// What is measured on a finished render with [`Observation::LAYERS`].
    pub fn of(exposure: &Exposure, seed: u64, tiles: &Tiles) -> Self {
        let film = &exposure.film;
        let class = |(class, mean): (PathClass, ClassMean)| {
            (class.length, class.families.bits(), mean.mean, mean.tiles)
        };
        Cell {
            seed,
            spp: film.samples_per_pixel(),
            seconds: exposure.spent.seconds,
            cpu_seconds: exposure.spent.cpu_seconds,
            startup_seconds: 0.0,
            rays: exposure.work.rays,
            nonfinite: film.nonfinite(),
            nonfinite_example: film.nonfinite_examples().first().map(replay),
            classes: Observation::of(film, tiles).classes.into_iter().map(class).collect(),
            planes: planes(film),
        }
    }

    /// What is measured on the image of another renderer, which says of all its paths together
    /// which families could make them.
    pub fn of_image(image: Vec<f32>, families: Families, seed: u64, tiles: &Tiles) -> Self {
        let (pixels, _) = image.as_chunks::<3>();
        let pixels: Vec<[f64; 3]> = pixels.iter().map(|p| p.map(f64::from)).collect();
        let means = tiles.means(&pixels);
        // Tiles have not all the same size; the image has.
        let mean = pixels.iter().map(pathspace_core::color::luminance).sum::<f64>()
            / pixels.len().max(1) as f64;
        Cell {
            seed,
            spp: 0.0,
            seconds: 0.0,
            cpu_seconds: f64::NAN,
            startup_seconds: 0.0,
            rays: 0,
            nonfinite: image.iter().filter(|v| !v.is_finite()).count() as u64,
            nonfinite_example: None,
            classes: vec![(0, families.bits(), mean, means)],
            planes: vec![(families.bits(), image)],
        }
    }

    /// Means over image and tiles of every path class.
    pub fn observation(&self) -> Observation {
        let class = |(length, families, mean, tiles): &(u16, u8, f64, Vec<f64>)| {
            let key = PathClass { length: *length, families: Families::from_bits(*families) };
            (key, ClassMean { mean: *mean, tiles: tiles.clone(), ..ClassMean::default() })
        };
        Observation { classes: self.classes.iter().map(class).collect(), samples: 0 }
    }

    /// [`Cell::observation`] with all that `others` could make as well as one class, which is how
    /// another renderer is observed.
    pub fn observation_as_one(&self, others: Families) -> Observation {
        let mut sum: Option<ClassMean> = None;
        for (_, families, mean, tiles) in &self.classes {
            if !Families::from_bits(*families).intersects(others) {
                continue;
            }
            let sum = sum.get_or_insert_with(|| ClassMean {
                tiles: vec![0.0; tiles.len()],
                ..ClassMean::default()
            });
            sum.mean += mean;
            for (s, t) in sum.tiles.iter_mut().zip(tiles) {
                *s += t;
            }
        }
        let key = PathClass { length: 0, families: Families::ALL };
        Observation { classes: sum.into_iter().map(|sum| (key, sum)).collect(), samples: 0 }
    }

    /// Families of the planes that the image of the part that `families` can make consists of.
    pub fn parts(&self, families: Families) -> BTreeSet<u8> {
        let bits = self.planes.iter().map(|(bits, _)| *bits);
        bits.filter(|bits| Families::from_bits(*bits).intersects(families)).collect()
    }

    /// Adds `weight` times the plane of one set of families to `sum`.
    pub fn add_plane(&self, bits: u8, weight: f64, sum: &mut [f64]) {
        for (_, plane) in self.planes.iter().filter(|(own, _)| *own == bits) {
            for (s, v) in sum.iter_mut().zip(plane) {
                *s += weight * f64::from(*v);
            }
        }
    }

    /// The part of the image that `families` can make, `[r, g, b]` of `pixels` pixels.
    pub fn image(&self, families: Families, pixels: usize) -> Vec<f32> {
        let mut sum = vec![0.0_f64; 3 * pixels];
        for (bits, plane) in &self.planes {
            if Families::from_bits(*bits).intersects(families) {
                for (s, v) in sum.iter_mut().zip(plane) {
                    *s += f64::from(*v);
                }
            }
        }
        sum.into_iter().map(|v| v as f32).collect()
    }
}

/// Sums over the lengths of the class layers of a film.
fn planes(film: &Film) -> Vec<(u8, Vec<f32>)> {
    let k = 1.0 / film.samples_per_pixel();
    let mut sums: BTreeMap<u8, Vec<f64>> = BTreeMap::new();
    for (key, plane) in film.planes() {
        if let LayerKey::Class { families, .. } = key {
            let values = plane.sums().as_flattened();
            let sum = sums.entry(families.bits()).or_insert_with(|| vec![0.0; values.len()]);
            for (s, v) in sum.iter_mut().zip(values) {
                *s += v * k;
            }
        }
    }
    let single = |(bits, sum): (u8, Vec<f64>)| (bits, sum.into_iter().map(|v| v as f32).collect());
    sums.into_iter().map(single).collect()
}

/// Where a contribution that was not finite came from, so that it can be made again.
pub fn replay(n: &NonFinite) -> String {
    let (a, c) = (n.address, n.contribution);
    format!(
        "seed {}, step {}, item {}, technique ({},{}), value {:?}",
        a.seed,
        a.step,
        a.item,
        c.s,
        c.t,
        c.value.to_array()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell() -> Cell {
        let tiles = Tiles::new(2, 1);
        let mut cell = Cell::of_image(vec![1.0; 6], Families::S0, 7, &tiles);
        cell.classes.push((3, Families::T1.bits(), 2.0, vec![1.0, 3.0]));
        cell.planes.push((Families::T1.bits(), vec![2.0; 6]));
        cell
    }

    #[test]
    fn images_hold_what_the_families_can_make() {
        let cell = cell();
        assert_eq!(cell.image(Families::S0, 2), [1.0; 6]);
        assert_eq!(cell.image(Families::ALL, 2), [3.0; 6]);
        assert_eq!(cell.image(Families::INNER, 2), [0.0; 6]);
        assert_eq!(cell.parts(Families::ALL).len(), 2);
    }

    #[test]
    fn classes_are_summed_into_one() {
        let cell = cell();
        let both = cell.observation_as_one(Families::S0.or(Families::T1));
        let (key, mean) = both.classes.iter().next().unwrap();
        assert_eq!((both.classes.len(), key.length), (1, 0));
        assert!((mean.mean - 3.0).abs() < 1e-12 && (mean.tiles[1] - 4.0).abs() < 1e-12);
        assert!(cell.observation_as_one(Families::INNER).classes.is_empty());
    }
}
