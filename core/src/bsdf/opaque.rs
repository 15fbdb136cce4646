//! The models that do not transmit.

use glam::Vec3;

use super::{
    BsdfError, BsdfSample, Component, Conductor, Diffuse, Event, Phong, Plastic, RoughConductor,
    RoughDiffuse, RoughPlastic, SpecularSample, Ward,
};
use crate::color::Rgb;
use crate::description::{MaterialKind, Parameter};
use crate::math::warp;
use crate::measure::{Density, SolidAngle};
use crate::random::PrimarySample;

/// A model that scatters in front (z > 0) and is black behind.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Opaque {
    /// Lambert.
    Diffuse(Diffuse),
    /// Smooth conductor.
    Conductor(Conductor),
    /// Rough conductor.
    RoughConductor(RoughConductor),
    /// Smooth plastic.
    Plastic(Plastic),
    /// Rough plastic.
    RoughPlastic(Box<RoughPlastic>),
    /// Oren and Nayar.
    RoughDiffuse(RoughDiffuse),
    /// Phong.
    Phong(Phong),
    /// Ward.
    Ward(Ward),
}

impl Opaque {
    /// Sets a parameter; nothing where the model does not have it.
    pub(super) fn set(&mut self, parameter: Parameter, colour: Rgb) {
        match (self, parameter) {
            (Opaque::Diffuse(model), Parameter::Reflectance) => model.set_reflectance(colour),
            (Opaque::Conductor(model), Parameter::SpecularReflectance) => model.set_factor(colour),
            (Opaque::RoughConductor(model), parameter) => model.set(parameter, colour),
            (Opaque::RoughPlastic(model), parameter) => model.set(parameter, colour),
            (Opaque::RoughDiffuse(model), parameter) => model.set(parameter, colour),
            (Opaque::Phong(model), parameter) => model.set(parameter, colour),
            (Opaque::Ward(model), parameter) => model.set(parameter, colour),
            (Opaque::Plastic(model), Parameter::Reflectance) => model.set_reflectance(colour),
            (Opaque::Plastic(model), Parameter::SpecularReflectance) => model.set_factor(colour),
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
            MaterialKind::Plastic {
                int_ior,
                ext_ior,
                diffuse_reflectance,
                specular_reflectance,
                nonlinear,
            } => Ok(Opaque::Plastic(Plastic::new(
                *int_ior,
                *ext_ior,
                *diffuse_reflectance,
                *specular_reflectance,
                *nonlinear,
            )?)),
            MaterialKind::RoughPlastic {
                distribution,
                alpha,
                sample_visible,
                int_ior,
                ext_ior,
                diffuse_reflectance,
                specular_reflectance,
                nonlinear,
            } => Ok(Opaque::RoughPlastic(Box::new(RoughPlastic::new(
                *distribution,
                *alpha,
                *sample_visible,
                [*int_ior, *ext_ior],
                *diffuse_reflectance,
                *specular_reflectance,
                *nonlinear,
            )?))),
            MaterialKind::RoughDiffuse { reflectance, alpha, fast } => {
                Ok(Opaque::RoughDiffuse(RoughDiffuse::new(*reflectance, *alpha, *fast)?))
            }
            MaterialKind::Phong { exponent, diffuse_reflectance, specular_reflectance } => {
                let phong = Phong::new(*exponent, *diffuse_reflectance, *specular_reflectance)?;
                Ok(Opaque::Phong(phong))
            }
            MaterialKind::Ward {
                variant,
                alpha_u,
                alpha_v,
                diffuse_reflectance,
                specular_reflectance,
            } => Ok(Opaque::Ward(Ward::new(
                *variant,
                [*alpha_u, *alpha_v],
                *diffuse_reflectance,
                *specular_reflectance,
            )?)),
            MaterialKind::Dielectric { .. } => Err(BsdfError::NotOpaque { model: "dielectric" }),
            MaterialKind::Null => Err(BsdfError::NotOpaque { model: "null" }),
            MaterialKind::TwoSided { .. } => {
                Err(BsdfError::NotOpaque { model: "another twosided" })
            }
            _ => Err(BsdfError::NotOpaque { model: "one that is made of others" }),
        }
    }

    /// True for the kinds that [`Opaque::new`] builds.
    pub(super) fn is_one(kind: &MaterialKind) -> bool {
        match kind {
            MaterialKind::Textured { model, .. } => Opaque::is_one(model),
            MaterialKind::Diffuse { .. }
            | MaterialKind::Conductor { .. }
            | MaterialKind::RoughConductor { .. }
            | MaterialKind::Plastic { .. }
            | MaterialKind::RoughPlastic { .. }
            | MaterialKind::RoughDiffuse { .. }
            | MaterialKind::Phong { .. }
            | MaterialKind::Ward { .. } => true,
            _ => false,
        }
    }

    /// True where there is a non-specular component.
    #[inline]
    pub(super) fn is_non_specular(&self) -> bool {
        !matches!(self, Opaque::Conductor(_))
    }

    #[inline]
    pub(super) fn is_anisotropic(&self) -> bool {
        match self {
            Opaque::RoughConductor(model) => model.is_anisotropic(),
            Opaque::Ward(model) => model.is_anisotropic(),
            _ => false,
        }
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        match self {
            Opaque::Diffuse(model) => model.eval(wo, wi),
            Opaque::Conductor(_) => Rgb::BLACK,
            Opaque::RoughConductor(model) => model.eval(wo, wi),
            Opaque::Plastic(model) => model.eval(wo, wi),
            Opaque::RoughPlastic(model) => model.eval(wo, wi),
            Opaque::RoughDiffuse(model) => model.eval(wo, wi),
            Opaque::Phong(model) => model.eval(wo, wi),
            Opaque::Ward(model) => model.eval(wo, wi),
        }
    }

    #[inline]
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> Density<SolidAngle> {
        match self {
            Opaque::Diffuse(model) => model.pdf(wo, wi),
            Opaque::Conductor(_) => Density::ZERO,
            Opaque::RoughConductor(model) => model.pdf(wo, wi),
            Opaque::Plastic(model) => model.pdf(wo, wi),
            Opaque::RoughPlastic(model) => model.pdf(wo, wi),
            Opaque::RoughDiffuse(model) => model.pdf(wo, wi),
            Opaque::Phong(model) => model.pdf(wo, wi),
            Opaque::Ward(model) => model.pdf(wo, wi),
        }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        match self {
            Opaque::Diffuse(model) => model.sample(wo, u),
            Opaque::Conductor(model) => model.sample(wo),
            Opaque::RoughConductor(model) => model.sample(wo, u),
            Opaque::Plastic(model) => model.sample(wo, u_lobe, u),
            Opaque::RoughPlastic(model) => model.sample(wo, u_lobe, u),
            Opaque::RoughDiffuse(model) => model.sample(wo, u),
            Opaque::Phong(model) => model.sample(wo, u_lobe, u),
            Opaque::Ward(model) => model.sample(wo, u_lobe, u),
        }
    }

    /// Numbers (`u_lobe`, `u`) by which [`Opaque::sample`] takes `wo` to `wi` by `event`.
    pub(super) fn invert<U: PrimarySample>(
        &self,
        wo: Vec3,
        wi: Vec3,
        event: Event,
        free: &mut U,
    ) -> Option<[f32; 3]> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        match (self, event) {
            (Opaque::RoughPlastic(model), Event::NonSpecular) => return model.invert(wo, wi, free),
            (Opaque::Phong(model), Event::NonSpecular) => return model.invert(wo, wi, free),
            (Opaque::Ward(model), Event::NonSpecular) => return model.invert(wo, wi, free),
            _ => {}
        }
        let lobe = match self {
            Opaque::Plastic(model) => model.invert_lobe(wo, event, free.next())?,
            _ => free.next(),
        };
        let [u, v] = match (self, event) {
            (Opaque::Diffuse(_) | Opaque::RoughDiffuse(_), Event::NonSpecular) => {
                warp::cosine_hemisphere_inverse(wi)
            }
            (Opaque::Conductor(_), Event::Specular(_)) => free.next2(),
            (Opaque::RoughConductor(model), Event::NonSpecular) => model.invert(wo, wi),
            (Opaque::Plastic(_), Event::NonSpecular) => warp::cosine_hemisphere_inverse(wi),
            (Opaque::Plastic(_), Event::Specular(_)) => free.next2(),
            _ => return None,
        };
        Some([lobe, u, v])
    }

    pub(super) fn specular(&self, wo: Vec3, component: Component) -> Option<SpecularSample> {
        match self {
            Opaque::Conductor(model) => model.specular(wo, component),
            Opaque::Plastic(model) => model.specular(wo, component),
            _ => None,
        }
    }
}
