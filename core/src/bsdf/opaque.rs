//! The models that do not transmit.

use glam::Vec3;

use super::{BsdfError, BsdfSample, Conductor, Diffuse, RoughConductor};
use crate::color::Rgb;
use crate::description::{MaterialKind, Parameter};
use crate::math::warp;
use crate::measure::{Density, Mass, SolidAngle};
use crate::random::PrimarySample;

/// A model that scatters in front (z > 0) and is black behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Opaque {
    /// Lambert.
    Diffuse(Diffuse),
    /// Smooth conductor.
    Conductor(Conductor),
    /// Rough conductor.
    RoughConductor(RoughConductor),
}

impl Opaque {
    /// Sets a parameter; nothing where the model does not have it.
    pub(super) fn set(&mut self, parameter: Parameter, colour: Rgb) {
        match (self, parameter) {
            (Opaque::Diffuse(model), Parameter::Reflectance) => model.set_reflectance(colour),
            (Opaque::Conductor(model), Parameter::SpecularReflectance) => model.set_factor(colour),
            (Opaque::RoughConductor(model), Parameter::SpecularReflectance) => {
                model.set_factor(colour)
            }
            _ => {}
        }
    }

    /// Builds the opaque model that `kind` describes.
    ///
    /// # Errors
    /// [`BsdfError`] where a parameter is out of range, and for the models that transmit or have
    /// two sides themselves.
    pub fn new(kind: &MaterialKind) -> Result<Self, BsdfError> {
        match kind {
            MaterialKind::Textured { model, .. } => Opaque::new(model),
            MaterialKind::Diffuse { reflectance } => {
                Ok(Opaque::Diffuse(Diffuse::new(*reflectance)?))
            }
            MaterialKind::Conductor { eta, k, specular_reflectance } => {
                Ok(Opaque::Conductor(Conductor::new(*eta, *k, *specular_reflectance)?))
            }
            MaterialKind::RoughConductor {
                distribution,
                alpha_u,
                alpha_v,
                sample_visible,
                eta,
                k,
                specular_reflectance,
            } => Ok(Opaque::RoughConductor(RoughConductor::new(
                *distribution,
                [*alpha_u, *alpha_v],
                *sample_visible,
                *eta,
                *k,
                *specular_reflectance,
            )?)),
            MaterialKind::Dielectric { .. } => Err(BsdfError::NotOpaque { model: "dielectric" }),
            MaterialKind::Null => Err(BsdfError::NotOpaque { model: "null" }),
            MaterialKind::TwoSided { .. } => {
                Err(BsdfError::NotOpaque { model: "another twosided" })
            }
        }
    }

    #[inline]
    pub(super) fn is_delta(&self) -> bool {
        matches!(self, Opaque::Conductor(_))
    }

    #[inline]
    pub(super) fn is_anisotropic(&self) -> bool {
        match self {
            Opaque::RoughConductor(model) => model.is_anisotropic(),
            Opaque::Diffuse(_) | Opaque::Conductor(_) => false,
        }
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        match self {
            Opaque::Diffuse(model) => model.eval(wo, wi),
            Opaque::Conductor(_) => Rgb::BLACK,
            Opaque::RoughConductor(model) => model.eval(wo, wi),
        }
    }

    #[inline]
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> Density<SolidAngle> {
        match self {
            Opaque::Diffuse(model) => model.pdf(wo, wi),
            Opaque::Conductor(_) => Density::ZERO,
            Opaque::RoughConductor(model) => model.pdf(wo, wi),
        }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<BsdfSample> {
        match self {
            Opaque::Diffuse(model) => model.sample(wo, u),
            Opaque::Conductor(model) => model.sample(wo),
            Opaque::RoughConductor(model) => model.sample(wo, u),
        }
    }

    /// Numbers by which [`Opaque::sample`] takes `wo` to `wi`.
    pub(super) fn invert<U: PrimarySample>(
        &self,
        wo: Vec3,
        wi: Vec3,
        free: &mut U,
    ) -> Option<[f32; 2]> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        match self {
            Opaque::Diffuse(_) => Some(warp::cosine_hemisphere_inverse(wi)),
            Opaque::Conductor(_) => Some(free.next2()),
            Opaque::RoughConductor(model) => Some(model.invert(wo, wi)),
        }
    }

    pub(super) fn delta_event(&self, wo: Vec3, wi: Vec3) -> Option<(Rgb, Mass)> {
        match self {
            Opaque::Conductor(model) => model.delta_event(wo, wi),
            Opaque::Diffuse(_) | Opaque::RoughConductor(_) => None,
        }
    }
}
