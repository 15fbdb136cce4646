//! Smooth conductor.

use glam::Vec3;

use super::error::{BsdfError, check_factor, check_rgb};
use super::{
    BsdfSample, Component, ScatterPdf, ScatterSide, SpecularSample, fresnel, reflect_about_z,
};
use crate::color::Rgb;
use crate::measure::Mass;

/// Complex index of refraction η + ik relative to the outside, per channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ConductorIndex {
    eta: Rgb,
    k: Rgb,
}

impl ConductorIndex {
    pub(super) fn new(eta: Rgb, k: Rgb) -> Result<Self, BsdfError> {
        // Beyond 10⁴ the squares of Fresnel's formula leave the range of f32 at grazing angles;
        // metals stay below 100.
        let valid = |v| (0.0..=1e4).contains(&v);
        check_rgb("conductor eta", eta, "values in [0, 10000]", valid)?;
        check_rgb("conductor k", k, "values in [0, 10000]", valid)?;
        let absent = |c: usize| eta[c] == 0.0 && k[c] == 0.0;
        if (0..3).any(absent) {
            return Err(BsdfError::Parameter {
                parameter: "conductor eta and k",
                value: "0 in one channel".into(),
                expected: "at least one of them positive in each channel",
            });
        }
        Ok(ConductorIndex { eta, k })
    }

    /// Fresnel reflectance at the cosine `cos_i` in \[0, 1\].
    #[inline]
    pub(super) fn reflectance(&self, cos_i: f32) -> Rgb {
        fresnel::conductor(cos_i.min(1.0), self.eta, self.k)
    }
}

/// Mirror reflection with the Fresnel reflectance of a conductor; black behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    index: ConductorIndex,
    specular_reflectance: Rgb,
}

impl Conductor {
    /// Takes the value that a texture has at a point, in \[0, 1\].
    #[inline]
    pub(super) fn set_factor(&mut self, value: Rgb) {
        self.specular_reflectance = value;
    }

    /// A conductor of index η + ik and a factor on its reflection.
    ///
    /// # Errors
    /// Where a value is not finite, negative, or η = k = 0 in a channel.
    pub fn new(eta: Rgb, k: Rgb, specular_reflectance: Rgb) -> Result<Self, BsdfError> {
        let index = ConductorIndex::new(eta, k)?;
        check_factor("specular_reflectance", specular_reflectance)?;
        Ok(Conductor { index, specular_reflectance })
    }

    #[inline]
    fn coefficient(&self, cos: f32) -> Rgb {
        self.index.reflectance(cos) * self.specular_reflectance
    }

    #[inline]
    pub(super) fn specular(&self, wo: Vec3, component: Component) -> Option<SpecularSample> {
        (wo.z > 0.0 && component == Component::REFLECTION).then(|| SpecularSample {
            wi: reflect_about_z(wo),
            value: self.coefficient(wo.z),
            mass: Mass::ONE,
        })
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let coefficient = self.coefficient(wo.z);
        Some(BsdfSample {
            wi: reflect_about_z(wo),
            weight: coefficient,
            pdf: ScatterPdf::Specular(Component::REFLECTION, Mass::ONE),
            value: coefficient,
            side: ScatterSide::Reflection,
            eta: 1.0,
        })
    }
}
