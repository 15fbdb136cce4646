//! Films taken apart and put together: for checkpoints, and for sums of films that were exposed
//! apart.

use std::collections::BTreeMap;

use thiserror::Error;

use super::layer::{LayerKey, Layers};
use super::{Film, MAX_NONFINITE_EXAMPLES, NonFinite, Plane};
use crate::description::FilmDescription;

/// All that a film has collected, without what follows from its description.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FilmParts {
    /// Samples: camera paths, light paths or mutations.
    pub samples: u64,
    /// Contributions that were not finite.
    pub nonfinite: u64,
    /// The first of them.
    pub nonfinite_examples: Vec<NonFinite>,
    /// Sums of the image, rows from top to bottom.
    pub sums: Vec<[f64; 3]>,
    /// Sums of the layers.
    pub planes: BTreeMap<LayerKey, Vec<[f64; 3]>>,
}

/// Why films do not fit together.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FilmError {
    /// There is no such film.
    #[error("{0}")]
    Description(String),
    /// A plane has another number of pixels than the window.
    #[error("{plane} has {found} pixels, the window {expected}")]
    Pixels {
        /// The image or the layer.
        plane: String,
        /// Its pixels.
        found: usize,
        /// Pixels of the window.
        expected: usize,
    },
    /// A layer that the film does not keep.
    #[error("the film does not keep the layer {0}")]
    Layer(String),
    /// Size, window, filter or layers differ.
    #[error("the films differ in size, window, filter or layers")]
    Different,
}

impl Film {
    /// A film as it was when `parts` were taken from it, to the bit.
    ///
    /// # Errors
    /// [`FilmError`], where the parts are not of such a film.
    pub fn from_parts(
        description: &FilmDescription,
        layers: Layers,
        parts: FilmParts,
    ) -> Result<Film, FilmError> {
        if let Some(problem) = description.problem() {
            return Err(FilmError::Description(problem));
        }
        // Before there is room made for as many pixels as a header says.
        let pixels = description.crop.width as usize * description.crop.height as usize;
        let plane = |name: &dyn Fn() -> String, sums: Vec<[f64; 3]>| {
            if sums.len() != pixels {
                return Err(FilmError::Pixels {
                    plane: name(),
                    found: sums.len(),
                    expected: pixels,
                });
            }
            Ok(Plane(sums))
        };
        let beauty = plane(&|| "the image".into(), parts.sums)?;
        let mut film = Film::new(description, layers);
        film.beauty = beauty;
        for (key, sums) in parts.planes {
            if !key.is_of(layers) {
                return Err(FilmError::Layer(key.name()));
            }
            film.planes.insert(key, plane(&|| key.name(), sums)?);
        }
        film.samples = parts.samples;
        film.nonfinite = parts.nonfinite;
        film.nonfinite_examples = parts.nonfinite_examples;
        film.nonfinite_examples.truncate(MAX_NONFINITE_EXAMPLES);
        Ok(film)
    }

    /// Adds what another film has collected: sums and samples, so that each film weighs by its
    /// samples.
    ///
    /// Sums are added in `f64`, pixel by pixel: the same films in the same order give the same
    /// bits.
    ///
    /// # Errors
    /// [`FilmError::Different`], where the other one is no film of the same window, filter and
    /// layers; nothing is added then.
    pub fn merge(&mut self, other: &Film) -> Result<(), FilmError> {
        if self.description() != other.description() || self.layers() != other.layers() {
            return Err(FilmError::Different);
        }
        let add = |plane: &mut Plane, other: &Plane| {
            for (sum, v) in plane.0.iter_mut().zip(&other.0) {
                for c in 0..3 {
                    sum[c] += v[c];
                }
            }
        };
        add(&mut self.beauty, &other.beauty);
        let pixels = self.beauty.0.len();
        for (key, plane) in &other.planes {
            add(self.planes.entry(*key).or_insert_with(|| Plane::new(pixels)), plane);
        }
        self.samples += other.samples;
        self.nonfinite += other.nonfinite;
        let room = MAX_NONFINITE_EXAMPLES.saturating_sub(self.nonfinite_examples.len());
        self.nonfinite_examples.extend(other.nonfinite_examples.iter().take(room));
        Ok(())
    }
}
