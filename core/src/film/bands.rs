//! A film in bands of rows, to which several threads add at once.
//!
//! Every pixel belongs to one band, and every band takes chunks in the order of their index. The
//! order of additions to a pixel is then that of the work items, whatever the number of bands and
//! threads: sums are the same to the bit.

use std::collections::BTreeMap;
use std::ops::Range;

use super::chunk::{Chunk, NonFinite};
use super::layer::LayerKey;
use super::sink::Contribution;
use super::{Film, MAX_NONFINITE_EXAMPLES, Plane, Raster};
use crate::color::Rgb;

/// Some rows of a film with all their layers.
pub(crate) struct Band<'a> {
    rows: Range<usize>,
    beauty: &'a mut [[f64; 3]],
    planes: BTreeMap<LayerKey, &'a mut [[f64; 3]]>,
    /// Layers that the film did not have before.
    fresh: BTreeMap<LayerKey, Vec<[f64; 3]>>,
}

/// What bands leave behind for [`Film::rejoin`].
pub(crate) struct Fresh {
    rows: Range<usize>,
    planes: BTreeMap<LayerKey, Vec<[f64; 3]>>,
}

/// A chunk with the records of each band.
pub(crate) struct Sorted {
    chunk: Chunk,
    /// Indices of records, band by band, in their order; empty where there is one band, which has
    /// all of them.
    order: Vec<u32>,
    /// Where the indices of each band begin.
    begins: Vec<u32>,
}

impl Raster {
    /// Rows that a contribution can add to; it is the filter's reach, whether or not the weight
    /// there is 0.
    fn rows(&self, c: &Contribution) -> Range<usize> {
        let y = c.film.y as f64 - self.description.crop.y as f64;
        if self.filter.is_box() {
            let row = y.max(0.0) as usize;
            let height = self.height();
            return row.min(height)..(row + 1).min(height);
        }
        self.reach(y, self.height())
    }

    /// Pixels along one axis of n that a filter at `v` reaches.
    fn reach(&self, v: f64, n: usize) -> Range<usize> {
        let r = self.filter.radius();
        let lo = (v - 0.5 - r).ceil().max(0.0) as usize;
        let hi = ((v - 0.5 + r).floor() + 1.0).clamp(0.0, n as f64) as usize;
        lo..hi
    }

    /// Sorts the records of a chunk by the bands, of `band_rows` rows each, that they add to.
    pub(crate) fn sort(&self, chunk: Chunk, bands: usize, band_rows: usize) -> Sorted {
        if bands <= 1 {
            return Sorted { chunk, order: Vec::new(), begins: Vec::new() };
        }
        let touched = |c: &Contribution| {
            let rows = self.rows(c);
            if rows.is_empty() {
                return 0..0;
            }
            rows.start / band_rows..(rows.end - 1) / band_rows + 1
        };
        // Counting sort: stable, in two passes.
        let mut begins = vec![0_u32; bands + 1];
        for c in chunk.records() {
            touched(c).for_each(|band| begins[band + 1] += 1);
        }
        (0..bands).for_each(|band| begins[band + 1] += begins[band]);
        let mut at = begins.clone();
        let mut order = vec![0; begins[bands] as usize];
        for (index, c) in chunk.records().iter().enumerate() {
            for band in touched(c) {
                order[at[band] as usize] = index as u32;
                at[band] += 1;
            }
        }
        Sorted { chunk, order, begins }
    }

    /// Calls `add(pixel, weight)` for every pixel under the filter in these rows.
    fn splat(&self, c: &Contribution, rows: &Range<usize>, mut add: impl FnMut(usize, f64)) {
        let crop = self.description.crop;
        let width = crop.width as usize;
        let (x, y) = (c.film.x as f64 - crop.x as f64, c.film.y as f64 - crop.y as f64);
        if self.filter.is_box() {
            // Positions are inside the window but for rounding; `as` saturates below 0 and drops
            // NaN to 0.
            if x < 0.0 || y < 0.0 || x >= width as f64 || y >= crop.height as f64 {
                return;
            }
            if rows.contains(&(y as usize)) {
                add(y as usize * width + x as usize, 1.0);
            }
            return;
        }
        let reached = self.reach(y, crop.height as usize);
        for py in reached.start.max(rows.start)..reached.end.min(rows.end) {
            let wy = self.filter.eval(y - (py as f64 + 0.5)) * self.norm_y[py];
            for px in self.reach(x, width) {
                let w = wy * self.filter.eval(x - (px as f64 + 0.5)) * self.norm_x[px];
                if w != 0.0 {
                    add(py * width + px, w);
                }
            }
        }
    }
}

impl Band<'_> {
    /// Adds what band number `band`, which this is, has of a chunk.
    pub(crate) fn apply(&mut self, raster: &Raster, sorted: &Sorted, band: usize) {
        let records = sorted.chunk.records();
        if sorted.begins.is_empty() {
            records.iter().for_each(|c| self.add(raster, c));
            return;
        }
        let range = sorted.begins[band] as usize..sorted.begins[band + 1] as usize;
        for &index in &sorted.order[range] {
            self.add(raster, &records[index as usize]);
        }
    }

    /// Adds one contribution to every pixel of the band that is under the filter.
    pub(super) fn add(&mut self, raster: &Raster, c: &Contribution) {
        let first = self.rows.start * raster.width();
        let pixels = self.beauty.len();
        let rows = self.rows.clone();
        raster.splat(c, &rows, |pixel, w| {
            let i = pixel - first;
            accumulate(&mut self.beauty[i], c.value, w);
            for key in raster.layers.keys(c) {
                let w = if key.is_unweighted() { w / c.weight as f64 } else { w };
                let plane = match self.planes.get_mut(&key) {
                    Some(plane) => &mut **plane,
                    None => self.fresh.entry(key).or_insert_with(|| vec![[0.0; 3]; pixels]),
                };
                accumulate(&mut plane[i], c.value, w);
            }
        });
    }

    pub(crate) fn into_fresh(self) -> Fresh {
        Fresh { rows: self.rows, planes: self.fresh }
    }
}

fn accumulate(sum: &mut [f64; 3], value: Rgb, w: f64) {
    sum[0] += value.r as f64 * w;
    sum[1] += value.g as f64 * w;
    sum[2] += value.b as f64 * w;
}

impl Sorted {
    /// Contributions that were not finite.
    pub(crate) fn nonfinite(&self) -> (u64, &[NonFinite]) {
        (self.chunk.nonfinite_count(), self.chunk.nonfinite())
    }
}

impl Film {
    /// The film in bands of `band_rows` rows.
    pub(crate) fn bands(&mut self, band_rows: usize) -> (&Raster, Vec<Band<'_>>) {
        let (width, height) = (self.raster.width(), self.raster.height());
        let size = (band_rows * width).max(1);
        let mut bands: Vec<Band<'_>> = self
            .beauty
            .0
            .chunks_mut(size)
            .enumerate()
            .map(|(band, beauty)| Band {
                rows: band * band_rows..((band + 1) * band_rows).min(height),
                beauty,
                planes: BTreeMap::new(),
                fresh: BTreeMap::new(),
            })
            .collect();
        for (key, plane) in &mut self.planes {
            for (band, part) in bands.iter_mut().zip(plane.0.chunks_mut(size)) {
                band.planes.insert(*key, part);
            }
        }
        (&self.raster, bands)
    }

    /// Takes in the layers that bands have begun.
    pub(crate) fn rejoin(&mut self, fresh: Vec<Fresh>) {
        let (pixels, width) = (self.beauty.0.len(), self.raster.width());
        for Fresh { rows, planes } in fresh {
            for (key, sums) in planes {
                let plane = self.planes.entry(key).or_insert_with(|| Plane::new(pixels));
                plane.0[rows.start * width..rows.end * width].copy_from_slice(&sums);
            }
        }
    }

    /// Counts contributions that were not finite; the first ones are kept.
    pub(crate) fn add_nonfinite(&mut self, count: u64, examples: &[NonFinite]) {
        self.nonfinite += count;
        let room = MAX_NONFINITE_EXAMPLES.saturating_sub(self.nonfinite_examples.len());
        self.nonfinite_examples.extend(examples.iter().take(room));
    }
}
