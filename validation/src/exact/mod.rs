//! Scenes with exact answers, per path length.
//!
//! Each scene's film sees only what the closed form is about, so that the observable is the mean of
//! the whole film: its luminance over paths of one length ([`ExactLength`]). All light and all
//! materials are grey.
//!
//! | scene | closed form | file |
//! | --- | --- | --- |
//! | furnaces, integrating spheres, concentric spheres | Neumann series of enclosures | [`enclosures`] |
//! | glass in a furnace, slabs | Fresnel's equations along the only path | [`glass`] |
//! | sphere, disk and polygon lights, parallel, perpendicular and coaxial plates | irradiance and view factors | [`receivers`] |
//! | refractive caustic | flux through a circle | [`caustics`] |
//! | slab and ball that absorb, furnaces of fog, single scattering | Beer and Lambert, conservation, quadrature | [`media`] |
//! | nephroid and cardioid of a cylindrical mirror | flux through rectangles about cusp and fold | [`cup`] |

pub mod caustics;
pub mod cup;
pub mod enclosures;
pub mod forms;
pub mod glass;
mod made;
mod measure;
pub mod media;
mod quadrature;
pub mod receivers;

pub use made::Made;
pub use measure::{ExactError, Measured, Plan, measure};

use pathspace_core::color::luminance;
use pathspace_core::description::SceneDescription;
use pathspace_core::film::{Families, Film, LayerKey};
use pathspace_core::path::WalkRules;

use crate::stats::Cell;

/// A scene whose mean image is known.
#[derive(Clone, Debug)]
pub struct ExactScene {
    /// Short name, unique among [`all`].
    pub name: &'static str,
    /// The scene.
    pub description: SceneDescription,
    /// The length cap that the values refer to; roulette may be chosen freely.
    pub rules: WalkRules,
    /// What is known.
    pub expected: Vec<ExactLength>,
}

/// One known number: the mean over the film's pixels of the luminance that paths of one length
/// bring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactLength {
    /// Path length in edges; `None` for all lengths together.
    pub length: Option<u32>,
    /// The exact mean.
    pub mean: f64,
    /// Bound on its error (model, not rounding), in the same unit.
    pub uncertainty: f64,
    /// Families of techniques each of which can make all paths that matter here.
    pub families: Families,
}

impl ExactLength {
    /// Paths of `length` edges bring exactly `mean`.
    pub fn new(length: u32, mean: f64, families: Families) -> Self {
        ExactLength { length: Some(length), mean, uncertainty: 0.0, families }
    }

    /// All paths together bring exactly `mean`.
    pub fn total(mean: f64, families: Families) -> Self {
        ExactLength { length: None, mean, uncertainty: 0.0, families }
    }

    /// The cell of a report that holds this number.
    pub fn cell(&self) -> Cell {
        match self.length {
            None => Cell::image(),
            Some(k) => Cell { decisive: true, ..Cell::length(k) },
        }
    }

    /// The same number measured: from a film with the layer of lengths.
    pub fn observe(&self, film: &Film) -> f64 {
        match self.length {
            None => luminance(&film.mean()),
            Some(k) => {
                let key = LayerKey::Length(u16::try_from(k).unwrap_or(u16::MAX));
                let Some(image) = film.layer_image(key) else { return 0.0 };
                image.iter().map(luminance).sum::<f64>() / image.len() as f64
            }
        }
    }
}

impl ExactScene {
    /// What an integrator that uses `families` can be held to.
    pub fn seen_by(&self, families: Families) -> Vec<ExactLength> {
        self.expected.iter().copied().filter(|e| e.families.intersects(families)).collect()
    }
}

/// Length cap without roulette, so that short series have no needless variance.
fn up_to(length: u32) -> WalkRules {
    WalkRules { max_length: Some(length), rr_depth: u32::MAX }
}

/// Every exact scene.
pub fn all() -> Vec<ExactScene> {
    let mut scenes = enclosures::all();
    scenes.extend(glass::all());
    scenes.extend(receivers::all());
    scenes.extend(caustics::all());
    scenes.extend(cup::all());
    scenes.extend(media::all());
    scenes
}
