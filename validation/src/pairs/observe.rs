//! What a replicate says about each path class.

use std::collections::{BTreeMap, BTreeSet};

use pathspace_core::color::luminance;
use pathspace_core::film::{Families, Film, LayerKey, Layers};

/// Most tiles along a side of the image.
pub const TILES: usize = 16;

/// Paths of one length that the same families can make: a cell of [`LayerKey::Class`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PathClass {
    /// Path length in edges.
    pub length: u16,
    /// Families that can make the path.
    pub families: Families,
}

/// Luminance that one replicate gave in one path class.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassMean {
    /// Mean over the image.
    pub mean: f64,
    /// Mean of each tile, row by row.
    pub tiles: Vec<f64>,
}

/// One replicate of one integrator, boiled down to path classes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observation {
    /// The classes it met.
    pub classes: BTreeMap<PathClass, ClassMean>,
}

/// The replicates of one integrator.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// Its spec; see [`unique_name`].
    pub name: String,
    /// Families of techniques that it uses on the scene.
    pub families: Families,
    /// Replicate after replicate.
    pub replicates: Vec<Observation>,
}

impl Observation {
    /// Layers that a film has to keep to be observed.
    pub const LAYERS: Layers = Layers { class: true, ..Layers::NONE };

    /// Means over image and tiles of a film with [`Observation::LAYERS`].
    pub fn of(film: &Film, tiles: &Tiles) -> Self {
        let k = 1.0 / film.samples_per_pixel();
        let classes = film.planes().iter().filter_map(|(key, plane)| match *key {
            LayerKey::Class { length, families } => {
                let mut sum = [0.0; 3];
                for p in plane.sums() {
                    for c in 0..3 {
                        sum[c] += p[c];
                    }
                }
                let mean = luminance(&sum.map(|v| v * k / plane.sums().len() as f64));
                let tiles = tiles.means(plane.sums()).iter().map(|v| v * k).collect();
                Some((PathClass { length, families }, ClassMean { mean, tiles }))
            }
            _ => None,
        });
        Observation { classes: classes.collect() }
    }
}

impl Arm {
    /// An arm without replicates.
    pub fn new(name: String, families: Families) -> Self {
        Arm { name, families, replicates: Vec::new() }
    }

    /// Mean luminance of a class in every replicate.
    pub(super) fn class_column(&self, class: &PathClass) -> Vec<f64> {
        self.replicates.iter().map(|r| r.classes.get(class).map_or(0.0, |c| c.mean)).collect()
    }

    /// Mean luminance of each of `tiles` tiles in every replicate, over one class.
    pub(super) fn class_tiles(&self, class: &PathClass, tiles: usize) -> Vec<Vec<f64>> {
        let row = |r: &Observation| match r.classes.get(class) {
            Some(c) => c.tiles.clone(),
            None => vec![0.0; tiles],
        };
        self.replicates.iter().map(row).collect()
    }
}

/// Path classes that both arms can make and at least one has met.
pub(super) fn common_classes(a: &Arm, b: &Arm) -> BTreeSet<PathClass> {
    let met = [a, b].into_iter().flat_map(|arm| &arm.replicates).flat_map(|r| r.classes.keys());
    let both =
        |c: &&PathClass| c.families.intersects(a.families) && c.families.intersects(b.families);
    met.filter(both).copied().collect()
}

/// The spec, numbered `#2`, `#3`, … where it is taken already.
pub fn unique_name(spec: String, taken: impl Fn(&str) -> bool) -> String {
    if !taken(&spec) {
        return spec;
    }
    let mut n = 2;
    while taken(&format!("{spec}#{n}")) {
        n += 1;
    }
    format!("{spec}#{n}")
}

/// A grid of nearly equal tiles over the image.
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
    /// Tiles of an image, at most [`TILES`] along a side.
    pub fn new(width: usize, height: usize) -> Self {
        Tiles::at_most(TILES, width, height)
    }

    /// Tiles of an image, at most `side` (and one at least) along a side.
    pub fn at_most(side: usize, width: usize, height: usize) -> Self {
        let side = side.max(1);
        Tiles { width, height, columns: width.clamp(1, side), rows: height.clamp(1, side) }
    }

    /// Number of tiles.
    pub fn count(&self) -> usize {
        self.columns * self.rows
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

    /// Mean luminance of each tile of an image, rows from top to bottom.
    pub fn means(&self, image: &[[f64; 3]]) -> Vec<f64> {
        let mut sums = vec![(0.0, 0.0); self.count()];
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
            let mut used = vec![0; tiles.count()];
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

    #[test]
    fn names_that_are_taken_get_numbers() {
        let taken = ["pt", "pt#2", "lt"];
        let name = |spec: &str| unique_name(spec.into(), |n| taken.contains(&n));
        assert_eq!([name("pt"), name("lt"), name("bdpt")], ["pt#3", "lt#2", "bdpt"]);
    }
}
