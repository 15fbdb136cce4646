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

/// What one replicate gave in one path class.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClassMean {
    /// Mean luminance over the image.
    pub mean: f64,
    /// Mean red, green and blue over the image; all 0 where only the luminance is known.
    pub channels: [f64; 3],
    /// Mean luminance of each tile, row by row.
    pub tiles: Vec<f64>,
    /// The light of each emitter; empty where that is unknown.
    pub sources: BTreeMap<u16, Source>,
}

/// What one replicate gave in one path class from one emitter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Source {
    /// Mean luminance over the image.
    pub mean: f64,
    /// Pixels that each family of techniques lit: so many contributions it made, or more.
    pub lit: BTreeMap<Families, u64>,
}

/// One replicate of one integrator, boiled down to path classes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observation {
    /// The classes it met.
    pub classes: BTreeMap<PathClass, ClassMean>,
    /// Samples that the replicate took; 0 where that is unknown.
    pub samples: u64,
}

/// The replicates of one integrator.
#[derive(Clone, Debug, PartialEq)]
pub struct Method {
    /// Its spec; see [`unique_name`].
    pub name: String,
    /// Families of techniques that it uses on the scene.
    pub families: Families,
    /// Replicate after replicate.
    pub replicates: Vec<Observation>,
}

impl Observation {
    /// Layers that a film has to keep to be observed.
    pub const LAYERS: Layers = Layers { class: true, emitter: true, ..Layers::NONE };

    /// Means over image and tiles of a film with [`Observation::LAYERS`]; with the layer of classes
    /// alone nothing is known of sources.
    pub fn of(film: &Film, tiles: &Tiles) -> Self {
        let k = 1.0 / film.samples_per_pixel();
        let mut classes: BTreeMap<PathClass, ClassMean> = BTreeMap::new();
        for (key, plane) in film.planes() {
            let pixels = plane.sums();
            let mean = || {
                let mut sum = [0.0; 3];
                for p in pixels {
                    for c in 0..3 {
                        sum[c] += p[c];
                    }
                }
                sum.map(|v| v * k / pixels.len() as f64)
            };
            match *key {
                LayerKey::Class { length, families } => {
                    let class = classes.entry(PathClass { length, families }).or_default();
                    class.channels = mean();
                    class.mean = luminance(&class.channels);
                    class.tiles = tiles.means(pixels).iter().map(|v| v * k).collect();
                }
                LayerKey::Source { length, families, emitter, made_by } => {
                    let class = classes.entry(PathClass { length, families }).or_default();
                    let source = class.sources.entry(emitter).or_default();
                    source.mean += luminance(&mean());
                    let lit = pixels.iter().filter(|p| **p != [0.0; 3]).count() as u64;
                    *source.lit.entry(made_by).or_default() += lit;
                }
                _ => {}
            }
        }
        Observation { classes, samples: film.samples() }
    }
}

impl Method {
    /// An method without replicates.
    pub fn new(name: String, families: Families) -> Self {
        Method { name, families, replicates: Vec::new() }
    }

    /// Mean luminance of a class in every replicate.
    pub(super) fn class_column(&self, class: &PathClass) -> Vec<f64> {
        self.replicates.iter().map(|r| r.classes.get(class).map_or(0.0, |c| c.mean)).collect()
    }

    /// Mean of one channel of a class in every replicate.
    pub(super) fn channel_column(&self, class: &PathClass, channel: usize) -> Vec<f64> {
        let of = |r: &Observation| r.classes.get(class).map_or(0.0, |c| c.channels[channel]);
        self.replicates.iter().map(of).collect()
    }

    /// Mean luminance from one emitter of a class in every replicate.
    pub(super) fn source_column(&self, class: &PathClass, emitter: u16) -> Vec<f64> {
        let of = |r: &Observation| {
            r.classes.get(class).and_then(|c| c.sources.get(&emitter)).map_or(0.0, |s| s.mean)
        };
        self.replicates.iter().map(of).collect()
    }

    /// Contributions of a class that techniques of `families` made over all replicates, at least:
    /// from one emitter, or from all.
    pub(super) fn made(&self, class: &PathClass, emitter: Option<u16>, families: Families) -> u64 {
        let sources = self.replicates.iter().filter_map(|r| r.classes.get(class));
        let sources = sources.flat_map(|c| &c.sources);
        let wanted = sources.filter(|(e, _)| emitter.is_none_or(|emitter| emitter == **e));
        let lit = wanted.flat_map(|(_, s)| &s.lit);
        lit.filter(|(family, _)| family.intersects(families)).map(|(_, n)| n).sum()
    }

    /// Samples of all replicates.
    pub(super) fn samples(&self) -> u64 {
        self.replicates.iter().map(|r| r.samples).sum()
    }

    /// True where replicates of different seeds are the same to the bit although the image has a
    /// structure: whatever made them did not use its seed, and their spread says nothing of their
    /// error. An image without structure may be free of noise.
    pub fn ignores_its_seed(&self) -> bool {
        let [first, others @ ..] = self.replicates.as_slice() else { return false };
        let structure = |c: &ClassMean| c.tiles.iter().any(|t| *t != c.tiles[0]);
        !others.is_empty()
            && others.iter().all(|r| r.classes == first.classes)
            && first.classes.values().any(structure)
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

/// Path classes that both methods can make and at least one has met.
pub(super) fn common_classes(a: &Method, b: &Method) -> BTreeSet<PathClass> {
    let met =
        [a, b].into_iter().flat_map(|method| &method.replicates).flat_map(|r| r.classes.keys());
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
