//! The models that stand behind one pointer: large ones, and those made of others.

use glam::Vec3;

use super::{
    BsdfError, BsdfSample, Component, Event, Mixture, Principled, PrincipledThin, Relief,
    RoughDielectric, Sides, SpecularLaw, SpecularSample, ThinDielectric, TransportMode,
};
use crate::color::Rgb;
use crate::description::{MaterialKind, Parameter};
use crate::measure::{Density, SolidAngle};
use crate::random::PrimarySample;

/// A model that [`super::Bsdf`] keeps in a box.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Compound {
    /// Rough boundary between dielectrics.
    RoughDielectric(RoughDielectric),
    /// A pane.
    ThinDielectric(ThinDielectric),
    /// Burley's model.
    Principled(Principled),
    /// Burley's model of sheets.
    PrincipledThin(PrincipledThin),
    /// A weighted sum.
    Mixture(Mixture),
    /// A model about another normal.
    Relief(Relief),
    /// A model for each side.
    Sides(Sides),
}

impl Compound {
    /// Builds the model that `kind` describes.
    ///
    /// # Errors
    /// [`BsdfError`] where a parameter is out of range, and for the models that are kept without a
    /// box.
    pub fn new(kind: &MaterialKind) -> Result<Self, BsdfError> {
        Ok(match kind {
            MaterialKind::RoughDielectric {
                distribution,
                alpha_u,
                alpha_v,
                sample_visible,
                int_ior,
                ext_ior,
                specular_reflectance,
                specular_transmittance,
            } => Compound::RoughDielectric(RoughDielectric::new(
                *distribution,
                [*alpha_u, *alpha_v],
                *sample_visible,
                [*int_ior, *ext_ior],
                *specular_reflectance,
                *specular_transmittance,
            )?),
            MaterialKind::ThinDielectric {
                int_ior,
                ext_ior,
                specular_reflectance,
                specular_transmittance,
            } => Compound::ThinDielectric(ThinDielectric::new(
                *int_ior,
                *ext_ior,
                *specular_reflectance,
                *specular_transmittance,
            )?),
            MaterialKind::Principled(kind) => Compound::Principled(Principled::new(kind)?),
            MaterialKind::PrincipledThin(kind) => {
                Compound::PrincipledThin(PrincipledThin::new(kind)?)
            }
            MaterialKind::Mixture { models } => Compound::Mixture(Mixture::new(models)?),
            MaterialKind::Mask { opacity, model } => {
                Compound::Mixture(Mixture::mask(*opacity, model)?)
            }
            MaterialKind::Relief { model, flip_invalid_normals, use_shadowing, .. } => {
                Compound::Relief(Relief::new(model, *flip_invalid_normals, *use_shadowing)?)
            }
            MaterialKind::TwoSided { front, back } => Compound::Sides(Sides::new(front, back)?),
            _ => return Err(BsdfError::NotOpaque { model: "one without parts" }),
        })
    }

    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) {
        match self {
            Compound::RoughDielectric(model) => model.set(parameter, value),
            Compound::ThinDielectric(model) => model.set(parameter, value),
            Compound::Principled(model) => model.set(parameter, value),
            Compound::PrincipledThin(model) => model.set(parameter, value),
            Compound::Mixture(model) => model.set(parameter, value),
            Compound::Relief(_) | Compound::Sides(_) => {}
        }
    }

    pub(super) fn components(&self) -> u8 {
        match self {
            Compound::ThinDielectric(_) => 2,
            Compound::Mixture(model) => model.components(),
            Compound::Relief(model) => model.components(),
            Compound::Sides(model) => model.components(),
            _ => 0,
        }
    }

    pub(super) fn transmits(&self) -> bool {
        match self {
            Compound::RoughDielectric(_)
            | Compound::ThinDielectric(_)
            | Compound::PrincipledThin(_) => true,
            Compound::Principled(model) => model.transmits(),
            Compound::Mixture(model) => model.models().any(|m| m.transmits()),
            Compound::Relief(model) => model.model().transmits(),
            Compound::Sides(_) => false,
        }
    }

    pub(super) fn follows_normal(&self, component: Component) -> bool {
        match self {
            Compound::Mixture(model) => {
                model.part_of(component).is_none_or(|(m, c)| m.follows_normal(c))
            }
            Compound::Relief(_) => false,
            Compound::Sides(model) => model.models().iter().all(|m| m.follows_normal(component)),
            _ => true,
        }
    }

    pub(super) fn is_connectible(&self, wo: Vec3) -> bool {
        match self {
            Compound::RoughDielectric(_) | Compound::PrincipledThin(_) => true,
            Compound::ThinDielectric(_) => false,
            Compound::Principled(model) => model.faces(wo),
            Compound::Mixture(model) => model.models().any(|m| m.is_connectible(wo)),
            Compound::Relief(model) => model.is_connectible(wo),
            Compound::Sides(model) => model.of(wo, |m, w| m.is_connectible(w)),
        }
    }

    pub(super) fn is_reciprocal(&self) -> bool {
        match self {
            Compound::ThinDielectric(_) => true,
            Compound::PrincipledThin(model) => model.is_reciprocal(),
            Compound::RoughDielectric(_) | Compound::Relief(_) => false,
            Compound::Principled(model) => !model.transmits(),
            Compound::Mixture(model) => model.models().all(|m| m.is_reciprocal()),
            Compound::Sides(model) => model.models().iter().all(|m| m.is_reciprocal()),
        }
    }

    pub(super) fn needs_tangent(&self) -> bool {
        match self {
            Compound::RoughDielectric(model) => model.is_anisotropic(),
            Compound::ThinDielectric(_) => false,
            Compound::Principled(model) => model.is_anisotropic(),
            Compound::PrincipledThin(model) => model.is_anisotropic(),
            Compound::Mixture(model) => model.models().any(|m| m.needs_tangent()),
            Compound::Relief(_) => true,
            Compound::Sides(model) => model.models().iter().any(|m| m.needs_tangent()),
        }
    }

    pub(super) fn relative_ior(&self, w: Vec3, component: Component) -> f32 {
        match self {
            Compound::Mixture(model) => {
                model.part_of(component).map_or(1.0, |(m, c)| m.relative_ior(w, c))
            }
            Compound::Relief(model) => model.relative_ior(w, component),
            _ => 1.0,
        }
    }

    pub(super) fn specular_law(&self, w: Vec3, component: Component) -> SpecularLaw {
        let plain = SpecularLaw { n: 1.0, cos: w.z.abs() };
        match self {
            Compound::Mixture(model) => {
                model.part_of(component).map_or(plain, |(m, c)| m.specular_law(w, c))
            }
            Compound::Relief(model) => model.specular_law(w, component),
            Compound::Sides(model) => model.of(w, |m, w| m.specular_law(w, component)),
            _ => plain,
        }
    }

    pub(super) fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Rgb {
        match self {
            Compound::RoughDielectric(model) => model.eval(wo, wi, mode),
            Compound::ThinDielectric(_) => Rgb::BLACK,
            Compound::Principled(model) => model.eval(wo, wi, mode),
            Compound::PrincipledThin(model) => model.eval(wo, wi, mode),
            Compound::Mixture(model) => model.eval(wo, wi, mode),
            Compound::Relief(model) => model.eval(wo, wi, mode),
            Compound::Sides(model) => model.eval(wo, wi, mode),
        }
    }

    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> Density<SolidAngle> {
        match self {
            Compound::RoughDielectric(model) => model.pdf(wo, wi),
            Compound::ThinDielectric(_) => Density::ZERO,
            Compound::Principled(model) => model.pdf(wo, wi),
            Compound::PrincipledThin(model) => model.pdf(wo, wi),
            Compound::Mixture(model) => model.pdf(wo, wi),
            Compound::Relief(model) => model.pdf(wo, wi),
            Compound::Sides(model) => model.pdf(wo, wi),
        }
    }

    pub(super) fn sample(
        &self,
        wo: Vec3,
        u_lobe: f32,
        u: [f32; 2],
        mode: TransportMode,
    ) -> Option<BsdfSample> {
        match self {
            Compound::RoughDielectric(model) => model.sample(wo, u_lobe, u, mode),
            Compound::ThinDielectric(model) => model.sample(wo, u_lobe),
            Compound::Principled(model) => model.sample(wo, u_lobe, u, mode),
            Compound::PrincipledThin(model) => model.sample(wo, u_lobe, u, mode),
            Compound::Mixture(model) => model.sample(wo, u_lobe, u, mode),
            Compound::Relief(model) => model.sample(wo, u_lobe, u, mode),
            Compound::Sides(model) => model.sample(wo, u_lobe, u, mode),
        }
    }

    pub(super) fn invert<U: PrimarySample>(
        &self,
        wo: Vec3,
        wi: Vec3,
        event: Event,
        free: &mut U,
    ) -> Option<[f32; 3]> {
        match (self, event) {
            (Compound::Mixture(model), _) => model.invert(wo, wi, event, free),
            (Compound::Relief(model), _) => model.invert(wo, wi, event, free),
            (Compound::Sides(model), _) => model.invert(wo, wi, event, free),
            (Compound::ThinDielectric(model), Event::Specular(component)) => {
                let [u, v] = free.next2();
                Some([model.invert(wo, component, free.next())?, u, v])
            }
            (Compound::RoughDielectric(model), Event::NonSpecular) => model.invert(wo, wi, free),
            (Compound::Principled(model), Event::NonSpecular) => model.invert(wo, wi, free),
            (Compound::PrincipledThin(model), Event::NonSpecular) => model.invert(wo, wi, free),
            _ => None,
        }
    }

    pub(super) fn specular(
        &self,
        wo: Vec3,
        component: Component,
        mode: TransportMode,
    ) -> Option<SpecularSample> {
        match self {
            Compound::ThinDielectric(model) => model.specular(wo, component),
            Compound::Mixture(model) => model.specular(wo, component, mode),
            Compound::Relief(model) => model.specular(wo, component, mode),
            Compound::Sides(model) => model.specular(wo, component, mode),
            _ => None,
        }
    }
}
