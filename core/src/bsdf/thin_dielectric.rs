//! A pane of glass.

use glam::Vec3;

use super::error::{BsdfError, check_factor};
use super::rough_dielectric::check_indices;
use super::{
    BsdfSample, Component, ScatterPdf, ScatterSide, SpecularSample, fresnel, reflect_about_z,
};
use crate::color::Rgb;
use crate::description::Parameter;
use crate::measure::Mass;
use crate::random::coordinate_between;

/// Two parallel smooth boundaries with all reflections between them: R = 2F/(1 + F) is mirrored and
/// 1 − R goes straight on, from either side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinDielectric {
    eta: f32,
    specular_reflectance: Rgb,
    specular_transmittance: Rgb,
}

impl ThinDielectric {
    /// A pane of index `int_ior` in a medium of index `ext_ior`, and factors on its two lobes.
    ///
    /// # Errors
    /// Where an index is not finite and positive or a factor is negative.
    pub fn new(
        int_ior: f32,
        ext_ior: f32,
        specular_reflectance: Rgb,
        specular_transmittance: Rgb,
    ) -> Result<Self, BsdfError> {
        let eta = check_indices(int_ior, ext_ior)?;
        check_factor("specular_reflectance", specular_reflectance)?;
        check_factor("specular_transmittance", specular_transmittance)?;
        Ok(ThinDielectric { eta, specular_reflectance, specular_transmittance })
    }

    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) {
        match parameter {
            Parameter::SpecularReflectance => self.specular_reflectance = value,
            Parameter::SpecularTransmittance => self.specular_transmittance = value,
            _ => {}
        }
    }

    /// R.
    #[inline]
    fn reflectance(&self, wo: Vec3) -> f64 {
        let cos = f64::from(wo.z.abs()).min(1.0);
        let f = fresnel::dielectric(cos, f64::from(self.eta)).reflectance;
        2.0 * f / (1.0 + f)
    }

    pub(super) fn specular(&self, wo: Vec3, component: Component) -> Option<SpecularSample> {
        let r = self.reflectance(wo);
        let (wi, factor, mass) = match component {
            Component::REFLECTION => (reflect_about_z(wo), self.specular_reflectance, r),
            Component::TRANSMISSION => (-wo, self.specular_transmittance, 1.0 - r),
            _ => return None,
        };
        (mass > 0.0).then(|| SpecularSample {
            wi,
            value: factor * mass as f32,
            mass: Mass::new(mass),
        })
    }

    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32) -> Option<BsdfSample> {
        let r = self.reflectance(wo);
        let (component, weight, side) = if f64::from(u_lobe) < r {
            (Component::REFLECTION, self.specular_reflectance, ScatterSide::Reflection)
        } else {
            (Component::TRANSMISSION, self.specular_transmittance, ScatterSide::Transmission)
        };
        let SpecularSample { wi, value, mass } = self.specular(wo, component)?;
        let pdf = ScatterPdf::Specular(component, mass);
        Some(BsdfSample { wi, weight, pdf, value, side, eta: 1.0 })
    }

    pub(super) fn invert(&self, wo: Vec3, component: Component, u: f32) -> Option<f32> {
        let r = self.reflectance(wo);
        match component {
            Component::REFLECTION => coordinate_between(0.0, r, u),
            Component::TRANSMISSION => coordinate_between(r, 1.0, u),
            _ => None,
        }
    }
}
