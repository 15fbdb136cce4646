//! Replicates: whole renders with seeds of their own, several integrators in turn.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;

use pathspace_core::Scene;
pub use pathspace_core::color::luminance;
use pathspace_core::film::{Families, Film, LayerKey, Layers, NonFinite, Plane};
use pathspace_core::integrator::{Integrator, IntegratorError};
use pathspace_core::random::derive_seed;

use crate::budget::{Budget, Status, expose};
use crate::clock::Spent;
use crate::moments::ImageMoments;

/// Most tiles along a side of the image.
pub const TILES: usize = 16;

/// What is rendered, by whom, for how long and how often.
pub struct Experiment<'a> {
    /// The scene.
    pub scene: Arc<Scene>,
    /// The integrators.
    pub integrators: &'a [Box<dyn Integrator>],
    /// Budget of one replicate.
    pub budget: Budget,
    /// Replicates of each integrator.
    pub replicates: u32,
    /// Seed from which those of the replicates are derived.
    pub seed: u64,
}

/// Where an experiment is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExperimentStatus {
    /// Replicate under way, from 0.
    pub replicate: u32,
    /// Index of the integrator under way.
    pub integrator: usize,
    /// Share of the whole experiment that is done.
    pub done: f64,
    /// The run under way.
    pub run: Status,
}

/// Paths of one length that the same families can make: a cell of [`LayerKey::Class`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PathClass {
    /// Path length in edges.
    pub length: u16,
    /// Families that can make the path.
    pub families: Families,
}

/// What one replicate gave in one path class.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassMean {
    /// Mean over the image.
    pub mean: [f64; 3],
    /// Mean luminance of each tile, row by row.
    pub tiles: Vec<f64>,
}

/// One replicate of one integrator.
#[derive(Clone, Debug, PartialEq)]
pub struct Replicate {
    /// Its seed.
    pub seed: u64,
    /// Steps done.
    pub steps: u64,
    /// Samples per pixel done.
    pub samples_per_pixel: f64,
    /// Time spent on rendering.
    pub spent: Spent,
    /// Rays traced.
    pub rays: u64,
    /// Contributions that were not finite.
    pub nonfinite: u64,
    /// Means over the image and over tiles.
    pub classes: BTreeMap<PathClass, ClassMean>,
}

/// The replicates of one integrator.
pub struct Arm {
    /// Its spec; with `#2`, `#3`, … where the same spec is there more than once.
    pub name: String,
    /// Families of techniques that it uses on the scene.
    pub families: Families,
    /// Replicate after replicate.
    pub replicates: Vec<Replicate>,
    /// The first contributions that were not finite.
    pub nonfinite_examples: Vec<NonFinite>,
    /// Moments of all that it sees.
    pub whole: ImageMoments,
    /// For every arm: moments of what both see.
    pub common: Vec<ImageMoments>,
}

/// What an experiment gave.
pub struct Replicates {
    /// The arms in the order of the integrators.
    pub arms: Vec<Arm>,
    /// The grid of tiles.
    pub tiles: Tiles,
    /// False where it was stopped early.
    pub complete: bool,
}

/// Renders every replicate of every integrator: replicate by replicate, with the order of the integrators turned round every
/// time, so that a machine that slows down slows all alike.
///
/// The seed of replicate r of integrator a is derived from (seed, a, r). `watch` is called after every step;
/// where it says to stop, the replicate under way is dropped.
///
/// # Errors
/// Where an integrator does not render the scene.
pub fn run(
    experiment: &Experiment<'_>,
    watch: &mut dyn FnMut(&ExperimentStatus) -> ControlFlow<()>,
) -> Result<Replicates, IntegratorError> {
    let Experiment { scene, integrators, budget, replicates, seed } = experiment;
    let film = scene.film().crop;
    let pixels = film.width as usize * film.height as usize;
    let tiles = Tiles::new(film.width as usize, film.height as usize);
    let mut arms: Vec<Arm> = Vec::new();
    for integrator in *integrators {
        arms.push(Arm {
            name: unique_name(&arms, integrator.spec()),
            families: integrator.families(scene),
            replicates: Vec::new(),
            nonfinite_examples: Vec::new(),
            whole: ImageMoments::new(pixels),
            common: vec![ImageMoments::new(pixels); integrators.len()],
        });
    }
    let all_families: Vec<Families> = arms.iter().map(|a| a.families).collect();
    let total = f64::from(*replicates) * integrators.len() as f64;
    let mut done = 0.0;
    for replicate in 0..*replicates {
        let mut order: Vec<usize> = (0..integrators.len()).collect();
        if replicate % 2 == 1 {
            order.reverse();
        }
        for index in order {
            let own_seed = derive_seed(derive_seed(*seed, index as u64), replicate.into());
            let layers = Layers { class: true, ..Layers::NONE };
            let mut watch_run = |run: &Status| {
                watch(&ExperimentStatus {
                    replicate,
                    integrator: index,
                    done: (done + run.used) / total,
                    run: *run,
                })
            };
            let integrator = &*integrators[index];
            let e = expose(integrator, scene, layers, own_seed, *budget, &mut watch_run)?;
            if !e.complete {
                return Ok(Replicates { arms, tiles, complete: false });
            }
            done += 1.0;
            let arm = &mut arms[index];
            arm.replicates.push(Replicate {
                seed: own_seed,
                steps: e.steps,
                samples_per_pixel: e.film.samples_per_pixel(),
                spent: e.spent,
                rays: e.work.rays,
                nonfinite: e.film.nonfinite(),
                classes: class_means(&e.film, &tiles),
            });
            arm.add_images(&e.film, index, &all_families);
        }
    }
    Ok(Replicates { arms, tiles, complete: true })
}

/// The spec, numbered where it is there already.
fn unique_name(arms: &[Arm], spec: String) -> String {
    let taken = |name: &str| arms.iter().any(|a| a.name == name);
    if !taken(&spec) {
        return spec;
    }
    let mut n = 2;
    while taken(&format!("{spec}#{n}")) {
        n += 1;
    }
    format!("{spec}#{n}")
}

impl Arm {
    /// Seconds of one replicate, on average.
    pub fn seconds(&self) -> f64 {
        self.average(|r| r.spent.seconds)
    }

    /// The average over replicates of a figure; NaN without replicates.
    pub fn average(&self, f: impl Fn(&Replicate) -> f64) -> f64 {
        self.replicates.iter().map(f).sum::<f64>() / self.replicates.len() as f64
    }

    fn add_images(&mut self, film: &Film, own: usize, families: &[Families]) {
        let room = room_beside(self.nonfinite_examples.len());
        self.nonfinite_examples.extend(film.nonfinite_examples().iter().take(room));
        let image = film.image();
        self.whole.push(&image);
        for (other, &theirs) in families.iter().enumerate() {
            if other == own {
                continue;
            }
            self.common[other].push(&common_image(film, theirs));
        }
    }
}

/// How many more examples are kept beside `n`.
fn room_beside(n: usize) -> usize {
    const MOST: usize = 16;
    MOST.saturating_sub(n)
}

/// The part of the image that `families` can make as well.
fn common_image(film: &Film, families: Families) -> Vec<[f64; 3]> {
    let k = 1.0 / film.samples_per_pixel();
    let mut image = vec![[0.0; 3]; film.width() * film.height()];
    for (key, plane) in film.planes() {
        if let LayerKey::Class { families: class, .. } = key
            && class.intersects(families)
        {
            for (sum, v) in image.iter_mut().zip(plane.sums()) {
                for c in 0..3 {
                    sum[c] += v[c] * k;
                }
            }
        }
    }
    image
}

fn class_means(film: &Film, tiles: &Tiles) -> BTreeMap<PathClass, ClassMean> {
    let k = 1.0 / film.samples_per_pixel();
    let mean = |plane: &Plane| {
        let mut sum = [0.0; 3];
        for p in plane.sums() {
            for c in 0..3 {
                sum[c] += p[c];
            }
        }
        sum.map(|v| v * k / plane.sums().len() as f64)
    };
    let classes = film.planes().iter().filter_map(|(key, plane)| match *key {
        LayerKey::Class { length, families } => {
            let tiles = tiles.means(plane.sums()).iter().map(|v| v * k).collect();
            Some((PathClass { length, families }, ClassMean { mean: mean(plane), tiles }))
        }
        _ => None,
    });
    classes.collect()
}

/// A grid of nearly equal tiles over the image, at most [`TILES`] along a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tiles {
    width: usize,
    height: usize,
    /// Tiles in a row.
    pub columns: usize,
    /// Rows of tiles.
    pub rows: usize,
}

impl Tiles {
    /// Tiles of an image.
    pub fn new(width: usize, height: usize) -> Self {
        Tiles { width, height, columns: width.clamp(1, TILES), rows: height.clamp(1, TILES) }
    }

    /// Calls `f(tile, pixel)` for every pixel.
    fn for_each(&self, mut f: impl FnMut(usize, usize)) {
        for y in 0..self.height {
            let row = y * self.rows / self.height;
            for x in 0..self.width {
                f(row * self.columns + x * self.columns / self.width, y * self.width + x);
            }
        }
    }

    /// Mean luminance of each tile.
    fn means(&self, image: &[[f64; 3]]) -> Vec<f64> {
        let mut sums = vec![(0.0, 0.0); self.columns * self.rows];
        self.for_each(|tile, pixel| {
            sums[tile].0 += luminance(&image[pixel]);
            sums[tile].1 += 1.0;
        });
        sums.iter().map(|(sum, n)| sum / n).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_partition_the_image() {
        for (w, h) in [(1, 1), (5, 40), (256, 17), (100, 100)] {
            let tiles = Tiles::new(w, h);
            let mut hits = vec![0; w * h];
            let mut used = vec![0; tiles.columns * tiles.rows];
            tiles.for_each(|tile, pixel| {
                hits[pixel] += 1;
                used[tile] += 1;
            });
            assert!(hits.iter().all(|n| *n == 1) && used.iter().all(|n| *n > 0), "{w}×{h}");
        }
    }

    #[test]
    fn a_constant_image_has_that_mean_in_every_tile() {
        let tiles = Tiles::new(37, 21);
        let means = tiles.means(&[[2.0; 3]; 37 * 21]);
        assert!(means.iter().all(|m| (m - 2.0).abs() < 1e-12));
    }
}
