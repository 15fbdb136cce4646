//! Smooth boundary between two dielectrics.

use glam::Vec3;

use super::error::{BsdfError, check, check_factor};
use super::{
    BsdfSample, Component, ScatterPdf, ScatterSide, SpecularSample, TransportMode, fresnel,
    reflect_about_z,
};
use crate::color::Rgb;
use crate::description::Parameter;
use crate::measure::Mass;
use crate::random::coordinate_between;

/// Fresnel reflection and refraction by Snell's law; the normal points to the side of `ext_ior`.
///
/// A walk takes reflection with probability F, refraction with 1 − F.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// n_int/n_ext and its inverse.
    eta: f64,
    inverse_eta: f64,
    specular_reflectance: Rgb,
    specular_transmittance: Rgb,
}

/// The two directions that ω_o can go to.
struct Split {
    /// F.
    reflectance: f64,
    /// Refracted direction; meaningless where F = 1.
    refracted: Vec3,
    /// n_i/n_o: index on the far side over the index on the side of ω_o.
    eta: f64,
}

impl Dielectric {
    /// Takes the value that a texture has at a point, in \[0, 1\].
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) {
        match parameter {
            Parameter::SpecularReflectance => self.specular_reflectance = value,
            Parameter::SpecularTransmittance => self.specular_transmittance = value,
            _ => {}
        }
    }

    /// A boundary with the indices behind (`int_ior`) and in front (`ext_ior`) of the normal and
    /// factors on its two lobes.
    ///
    /// # Errors
    /// Where an index is not finite and positive or a factor is not finite or negative.
    pub fn new(
        int_ior: f32,
        ext_ior: f32,
        specular_reflectance: Rgb,
        specular_transmittance: Rgb,
    ) -> Result<Self, BsdfError> {
        let expected = "between 0.0001 and 10000";
        let valid = |v| (1e-4..=1e4).contains(&v);
        let int_ior = f64::from(check("int_ior", int_ior, expected, valid)?);
        let ext_ior = f64::from(check("ext_ior", ext_ior, expected, valid)?);
        check_factor("specular_reflectance", specular_reflectance)?;
        check_factor("specular_transmittance", specular_transmittance)?;
        Ok(Dielectric {
            eta: int_ior / ext_ior,
            inverse_eta: ext_ior / int_ior,
            specular_reflectance,
            specular_transmittance,
        })
    }

    /// n_int/n_ext.
    #[inline]
    pub(super) fn relative_ior(&self) -> f32 {
        self.eta as f32
    }

    #[inline]
    fn split(&self, wo: Vec3) -> Split {
        let (eta, inverse) =
            if wo.z >= 0.0 { (self.eta, self.inverse_eta) } else { (self.inverse_eta, self.eta) };
        let f = fresnel::dielectric(f64::from(wo.z.abs()).min(1.0), eta);
        let inverse = inverse as f32;
        let cos_t = f.cos_t as f32;
        let refracted = Vec3::new(-wo.x * inverse, -wo.y * inverse, -cos_t.copysign(wo.z));
        Split { reflectance: f.reflectance, refracted, eta }
    }

    /// Change of what is transported across the boundary. Radiance is compressed into the solid
    /// angle: L_o = (n_o/n_i)² L_i (Veach 1997, eq. 5.2); importance is not (eq. 5.14 and §5.2.2).
    /// This is the only place of that factor.
    #[inline]
    fn compression(eta: f64, mode: TransportMode) -> f32 {
        match mode {
            TransportMode::Radiance => (1.0 / (eta * eta)) as f32,
            TransportMode::Importance => 1.0,
        }
    }

    /// Weight of the refracted lobe: its coefficient over its mass 1 − F.
    #[inline]
    fn transmission_weight(&self, eta: f64, mode: TransportMode) -> Rgb {
        self.specular_transmittance * Self::compression(eta, mode)
    }

    pub(super) fn specular(
        &self,
        wo: Vec3,
        component: Component,
        mode: TransportMode,
    ) -> Option<SpecularSample> {
        let split = self.split(wo);
        let (r, t) = (split.reflectance, 1.0 - split.reflectance);
        match component {
            Component::REFLECTION => (r > 0.0).then(|| SpecularSample {
                wi: reflect_about_z(wo),
                value: self.specular_reflectance * r as f32,
                mass: Mass::new(r),
            }),
            Component::TRANSMISSION => (t > 0.0).then(|| SpecularSample {
                wi: split.refracted,
                value: self.transmission_weight(split.eta, mode) * t as f32,
                mass: Mass::new(t),
            }),
            _ => None,
        }
    }

    /// A number that makes [`Dielectric::sample`] take `component`.
    pub(super) fn invert(&self, wo: Vec3, component: Component, u: f32) -> Option<f32> {
        let r = self.split(wo).reflectance;
        match component {
            Component::REFLECTION => coordinate_between(0.0, r, u),
            _ => coordinate_between(r, 1.0, u),
        }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, mode: TransportMode) -> BsdfSample {
        let split = self.split(wo);
        let (r, t) = (split.reflectance, 1.0 - split.reflectance);
        // u < F, never where F = 0 and always where F = 1.
        if f64::from(u_lobe) < r {
            BsdfSample {
                wi: reflect_about_z(wo),
                weight: self.specular_reflectance,
                pdf: ScatterPdf::Specular(Component::REFLECTION, Mass::new(r)),
                value: self.specular_reflectance * r as f32,
                side: ScatterSide::Reflection,
                eta: 1.0,
            }
        } else {
            let weight = self.transmission_weight(split.eta, mode);
            BsdfSample {
                wi: split.refracted,
                weight,
                pdf: ScatterPdf::Specular(Component::TRANSMISSION, Mass::new(t)),
                value: weight * t as f32,
                side: ScatterSide::Transmission,
                eta: split.eta as f32,
            }
        }
    }
}
