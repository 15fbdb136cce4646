//! Participating media: absorption and scattering in volumes.
//!
//! | symbol | meaning | here |
//! | --- | --- | --- |
//! | σ_t | extinction per length, per channel | [`Medium::extinction`] |
//! | σ_s = albedo σ_t | scattering | [`Medium::scattering`] |
//! | ρ | phase function | [`Phase`] |
//! | T(x, y) = exp(−∫σ_t) | transmittance of an edge | [`Scene::transmittance`](crate::Scene::transmittance) |
//!
//! A vertex of a path is a point of a surface (dA) or of a medium (dV). At a point of a medium σ_s
//! ρ stands for the BSDF and 1 for |cos θ| in the geometry term, and every edge carries T (Pauly,
//! Kollig and Keller 2000; Jakob 2013, §3).
//!
//! A walk draws the distance to the next vertex by T of one channel, which it picks with
//! probability P_c = 1/3. The density of a point y of the medium is the mixture p_σ Σ P_c
//! σ_{t,c}(y) T_c / ‖x−y‖², that of a surface behind the medium p_σ Σ P_c T_c |cos θ_y| / ‖x−y‖².
//! Fixed probabilities make it local: the density from the other side has the same form.

mod phase;

use glam::Vec3;

pub use phase::Phase;

use crate::color::Rgb;
use crate::description::{MediumDescription, MediumKind};

/// Index of a medium of a scene, or that of empty space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MediumIndex(u16);

impl MediumIndex {
    /// Empty space.
    pub const NONE: MediumIndex = MediumIndex(u16::MAX);

    /// The medium at this place of the description; `None` beyond the largest number.
    pub fn new(index: usize) -> Option<Self> {
        u16::try_from(index).ok().filter(|i| *i != u16::MAX).map(MediumIndex)
    }

    /// True in empty space.
    #[inline]
    pub fn is_none(self) -> bool {
        self == MediumIndex::NONE
    }

    /// The place in the description.
    pub fn number(self) -> u32 {
        self.0.into()
    }

    /// The place in a list; beyond every list in empty space.
    #[inline]
    pub(crate) fn get(self) -> usize {
        usize::from(self.0)
    }
}

/// A point in a medium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MediumPoint {
    /// Position in the normalised scene.
    pub p: Vec3,
    /// The medium.
    pub medium: MediumIndex,
}

/// A medium in normalised units.
#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    name: String,
    extinction: [f64; 3],
    scattering: Rgb,
    /// Largest channel of the albedo: what roulette goes by.
    albedo: f32,
    phase: Phase,
}

impl Medium {
    /// `scale`: normalised lengths per length of the description.
    ///
    /// # Errors
    /// What is wrong with a value, in words.
    pub(crate) fn new(description: &MediumDescription, scale: f64) -> Result<Self, String> {
        let MediumKind::Homogeneous { extinction, albedo } = description.kind;
        if let Some(v) = extinction.iter().find(|v| !(**v >= 0.0 && v.is_finite())) {
            return Err(format!("the extinction {v} is not a number ≥ 0"));
        }
        if let Some(v) = albedo.to_array().iter().find(|v| !(0.0..=1.0).contains(*v)) {
            return Err(format!("the albedo {v} is not in [0, 1]"));
        }
        let extinction = extinction.map(|v| v / scale);
        let at = |c: usize| (f64::from(albedo[c]) * extinction[c]) as f32;
        Ok(Medium {
            name: description.name.clone(),
            extinction,
            scattering: Rgb::new(at(0), at(1), at(2)),
            albedo: albedo.max_channel(),
            phase: Phase::new(&description.phase)?,
        })
    }

    /// Name for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// σ_t per normalised length.
    #[inline]
    pub fn extinction(&self) -> &[f64; 3] {
        &self.extinction
    }

    /// σ_s per normalised length.
    #[inline]
    pub fn scattering(&self) -> Rgb {
        self.scattering
    }

    /// Largest channel of σ_s/σ_t.
    #[inline]
    pub fn largest_albedo(&self) -> f32 {
        self.albedo
    }

    /// ρ.
    #[inline]
    pub fn phase(&self) -> &Phase {
        &self.phase
    }
}
