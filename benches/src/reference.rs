//! Reference images: two agreeing unbiased integrators, in two independent halves, with their own
//! error.
//!
//! Halves, because (A−R₁)(A−R₂) has no noise of the reference in its mean; two integrators, because
//! a reference that is wrong makes everything wrong. The light that different families of
//! techniques can make is kept apart, so that an integrator which can not make all of it is
//! measured on what it can.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use exr::prelude::{FlatSamples, read_all_flat_layers_from_file};
use pathspace_core::color::luminance;
use pathspace_core::film::Families;
use pathspace_validation::stats::error::relative_epsilon;
use thiserror::Error;

use crate::experiment::Cell;
use crate::metrics::{Against, errors};
use crate::output::{Metadata, NamedLayer, Output, OutputError, Picture, exposure};
use crate::results::Reference;

/// Why there is no reference.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReferenceError {
    /// The file is there and is no reference, or one of another film.
    #[error("{}: {reason}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// It cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// A reference: for each set of families that can make the same paths, both halves.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceImage {
    planes: BTreeMap<u8, [Vec<f32>; 2]>,
    pixels: usize,
    integrators: Vec<String>,
    /// Its file, relative to the results where that can be said.
    pub file: String,
}

/// Replicates of one integrator for a reference.
pub struct Part<'a> {
    /// Its name.
    pub name: &'a str,
    /// Families that it uses.
    pub families: Families,
    /// Its replicates.
    pub cells: &'a [Cell],
}

impl ReferenceImage {
    /// Even replicates to the first half, odd ones to the second; integrators weighted wherever
    /// they can make the light.
    ///
    /// The weight is the inverse of the variance that the first `pilot` replicates show, which are
    /// in neither half: weights from the same replicates would tie the halves to each other, and
    /// favour those that missed rare light. All weigh the same without a pilot.
    pub fn of(parts: &[Part<'_>], pilot: usize, pixels: usize) -> Self {
        let weights: Vec<f64> = parts.iter().map(|p| weight(p, pilot, pixels)).collect();
        let mut seen = BTreeSet::new();
        for cell in parts.iter().flat_map(|p| p.cells) {
            seen.extend(cell.parts(Families::ALL));
        }
        let mut planes = BTreeMap::new();
        for bits in seen {
            let half = |h: usize| {
                let mut sum = vec![0.0_f64; 3 * pixels];
                let mut total = 0.0;
                for (part, weight) in parts.iter().zip(&weights) {
                    let cells = part.cells.iter().skip(pilot + h).step_by(2);
                    let n = cells.len();
                    if n == 0 || !Families::from_bits(bits).intersects(part.families) {
                        continue;
                    }
                    total += weight;
                    for cell in cells {
                        cell.add_plane(bits, weight / n as f64, &mut sum);
                    }
                }
                let total = if total > 0.0 { total } else { 1.0 };
                sum.into_iter().map(|v| (v / total) as f32).collect::<Vec<f32>>()
            };
            planes.insert(bits, [half(0), half(1)]);
        }
        let integrators = parts.iter().map(|p| p.name.to_owned()).collect();
        ReferenceImage { planes, pixels, integrators, file: String::new() }
    }

    /// Both halves of what `a` and `b` can both make.
    pub fn halves(&self, a: Families, b: Families) -> [Vec<f32>; 2] {
        [0, 1].map(|h| {
            let mut sum = vec![0.0_f32; 3 * self.pixels];
            for (bits, halves) in &self.planes {
                let families = Families::from_bits(*bits);
                if families.intersects(a) && families.intersects(b) {
                    for (s, v) in sum.iter_mut().zip(&halves[h]) {
                        *s += v;
                    }
                }
            }
            sum
        })
    }

    /// √relMSE of the mean of both halves, from ¼(R₁−R₂)².
    pub fn relative_error(&self) -> f64 {
        let [one, two] = self.halves(Families::ALL, Families::ALL);
        let mean: Vec<f64> =
            one.iter().zip(&two).map(|(a, b)| 0.5 * (f64::from(*a) + f64::from(*b))).collect();
        let (pixels, _) = mean.as_chunks::<3>();
        let y = pixels.iter().map(luminance).sum::<f64>() / self.pixels.max(1) as f64;
        let epsilon = relative_epsilon(y);
        let error = |(i, m): (usize, &f64)| {
            let d = 0.5 * (f64::from(one[i]) - f64::from(two[i]));
            if d == 0.0 { 0.0 } else { d * d / (m * m + epsilon) }
        };
        let sum: f64 = mean.iter().enumerate().map(error).sum();
        (sum / mean.len().max(1) as f64).sqrt()
    }

    /// What results say about it.
    pub fn summary(&self) -> Reference {
        Reference {
            image: self.file.clone(),
            integrators: self.integrators.clone(),
            relative_error: self.relative_error(),
        }
    }

    /// Writes the mean as the image, with the halves as layers; the PNG beside it is for looking
    /// at.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn write(
        &self,
        path: &Path,
        film: pathspace_core::description::FilmDescription,
        metadata: Metadata,
    ) -> Result<(), ReferenceError> {
        let [one, two] = self.halves(Families::ALL, Families::ALL);
        let mean: Vec<f32> = one.iter().zip(&two).map(|(a, b)| 0.5 * (a + b)).collect();
        let mut layers = Vec::new();
        for (bits, halves) in &self.planes {
            for (h, half) in halves.iter().enumerate() {
                layers.push(NamedLayer { name: layer_name(h, *bits), pixels: wide(half) });
            }
        }
        let pixels = wide(&mean);
        let metadata = Metadata { integrator: self.integrators.join(" + "), ..metadata };
        let picture = Picture { film, pixels: &pixels, layers: &layers, metadata };
        Ok(Output::open(path)?.write(&picture, exposure(&pixels))?)
    }

    /// Reads what [`ReferenceImage::write`] has written; it must have as many pixels.
    ///
    /// # Errors
    /// Where the file is something else.
    pub fn read(path: &Path, pixels: usize) -> Result<Self, ReferenceError> {
        let bad = |reason: String| ReferenceError::File { path: path.to_path_buf(), reason };
        let image = read_all_flat_layers_from_file(path).map_err(|e| bad(e.to_string()))?;
        let layer = image.layer_data.first().ok_or_else(|| bad("no image in it".into()))?;
        let integrators = layer.attributes.other.iter().find_map(|(key, value)| match value {
            exr::prelude::AttributeValue::Text(t) if key == "pathspace.integrator" => {
                Some(t.to_string().split(" + ").map(str::to_owned).collect())
            }
            _ => None,
        });
        let mut planes: BTreeMap<u8, [Vec<f32>; 2]> = BTreeMap::new();
        for channel in &layer.channel_data.list {
            let name = channel.name.to_string();
            let Some((half, bits, c)) = parse_layer(&name) else { continue };
            let FlatSamples::F32(values) = &channel.sample_data else { continue };
            if values.len() != pixels {
                return Err(bad(format!("{} pixels, not {pixels}", values.len())));
            }
            let plane = planes.entry(bits).or_insert_with(|| [0, 1].map(|_| vec![0.0; 3 * pixels]));
            for (to, from) in plane[half].iter_mut().skip(c).step_by(3).zip(values) {
                *to = *from;
            }
        }
        if planes.is_empty() {
            return Err(bad("no reference: it has no halves".into()));
        }
        let file = path.display().to_string();
        Ok(ReferenceImage { planes, pixels, integrators: integrators.unwrap_or_default(), file })
    }
}

/// The place of a scene's reference in a folder: by its name to the eye, by hash to the program.
pub fn reference_path(folder: &Path, name: &str, key: &str) -> PathBuf {
    let plain = |c: char| if c.is_alphanumeric() || "-.".contains(c) { c } else { '_' };
    let stem: String = name.chars().map(plain).collect();
    let hash = blake3::hash(key.as_bytes()).to_hex();
    folder.join(format!("{stem}-{}.exr", &hash[..16]))
}

/// Inverse of the variance of a replicate, by the first `pilot` of them; 1 where it has no noise or
/// nothing is known.
fn weight(part: &Part<'_>, pilot: usize, pixels: usize) -> f64 {
    let cells = &part.cells[..pilot.min(part.cells.len())];
    let images: Vec<Vec<f32>> = cells.iter().map(|c| c.image(Families::ALL, pixels)).collect();
    let views: Vec<&[f32]> = images.iter().map(Vec::as_slice).collect();
    match errors(&views, Against::Replicates) {
        Ok(e) if e.mse.mse > 0.0 => 1.0 / e.mse.mse,
        Ok(_) | Err(_) => 1.0,
    }
}

fn wide(image: &[f32]) -> Vec<[f64; 3]> {
    let (pixels, _) = image.as_chunks::<3>();
    pixels.iter().map(|p| p.map(f64::from)).collect()
}

fn layer_name(half: usize, bits: u8) -> String {
    format!("half{}.families{bits:02}", half + 1)
}

/// Half, families and channel of `half1.families03.R`.
fn parse_layer(name: &str) -> Option<(usize, u8, usize)> {
    let (half, rest) = name.strip_prefix("half")?.split_once(".families")?;
    let (bits, channel) = rest.split_once('.')?;
    let half = half.parse::<usize>().ok()?.checked_sub(1).filter(|h| *h < 2)?;
    Some((half, bits.parse().ok()?, ["R", "G", "B"].iter().position(|c| *c == channel)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pathspace_core::description::FilmDescription;
    use pathspace_validation::pairs::Tiles;

    fn cells(values: &[f32], families: Families) -> Vec<Cell> {
        let tiles = Tiles::new(2, 1);
        values.iter().map(|v| Cell::of_image(vec![*v; 6], families, 0, &tiles)).collect()
    }

    #[test]
    fn halves_are_even_and_odd_replicates_weighted_by_precision() {
        // Variances 8 and 2 of the pilots, with two replicates each: weights 1 to 4.
        let a = cells(&[11.0, 15.0, 1.0, 5.0], Families::S0);
        let b = cells(&[12.0, 14.0, 2.0, 4.0], Families::S0);
        let part = |name, cells| Part { name, families: Families::S0, cells };
        let r = ReferenceImage::of(&[part("a", &a), part("b", &b)], 2, 2);
        let [one, two] = r.halves(Families::ALL, Families::ALL);
        assert!((one[0] - 1.8).abs() < 1e-6 && (two[0] - 4.2).abs() < 1e-6, "{one:?} {two:?}");
        // ¼(R₁−R₂)² = 1.44 over 9 + 0.09.
        assert!((r.relative_error() - (1.44f64 / 9.09).sqrt()).abs() < 1e-6);
    }

    #[test]
    fn what_one_of_two_can_not_make_comes_from_the_other() {
        let (a, b) = (cells(&[1.0, 1.0], Families::S0), cells(&[2.0, 2.0], Families::T1));
        let r = ReferenceImage::of(
            &[
                Part { name: "a", families: Families::S0, cells: &a },
                Part { name: "b", families: Families::T1, cells: &b },
            ],
            0,
            2,
        );
        assert_eq!(r.halves(Families::ALL, Families::ALL)[0], [3.0; 6]);
        assert_eq!(r.halves(Families::S0, Families::ALL)[1], [1.0; 6]);
        assert_eq!(r.halves(Families::S0, Families::T1)[1], [0.0; 6]);
    }

    #[test]
    fn a_reference_survives_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let a = cells(&[1.0, 2.0], Families::S0 | Families::T1);
        let part = Part { name: "bdpt:s=1", families: Families::ALL, cells: &a };
        let mut r = ReferenceImage::of(&[part], 0, 2);
        let path = reference_path(folder.path(), "a b", "key");
        r.write(&path, FilmDescription::new(2, 1), Metadata::default()).unwrap();
        r.file = path.display().to_string();
        assert_eq!(ReferenceImage::read(&path, 2).unwrap(), r);
        assert!(ReferenceImage::read(&path, 3).is_err());
    }
}
