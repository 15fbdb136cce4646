//! A model for each side of a surface.

use glam::Vec3;

use super::{Bsdf, BsdfError, BsdfSample, Component, Event, SpecularSample, TransportMode, mirror};
use crate::color::Rgb;
use crate::description::MaterialKind;
use crate::measure::{Density, SolidAngle};
use crate::random::PrimarySample;

/// Two models of which none lets light pass; the back one sees the frame mirrored (z → −z).
/// [`Bsdf::TwoSided`] is the same for the simple ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Sides {
    /// Seen from the side of the normal, and from behind.
    models: [Bsdf; 2],
}

impl Sides {
    /// The models in front and behind.
    ///
    /// # Errors
    /// Where one can not be built or lets light pass.
    pub fn new(front: &MaterialKind, back: &MaterialKind) -> Result<Self, BsdfError> {
        let opaque = |kind: &MaterialKind| {
            let refuse = |model| Err(BsdfError::NotOpaque { model });
            match kind {
                MaterialKind::Dielectric { .. } => refuse("dielectric"),
                MaterialKind::Null => refuse("null"),
                MaterialKind::TwoSided { .. } => refuse("another twosided"),
                _ => match Bsdf::new(kind)? {
                    model if model.transmits() => refuse("one that lets light through"),
                    model => Ok(model),
                },
            }
        };
        Ok(Sides { models: [opaque(front)?, opaque(back)?] })
    }

    pub(super) fn models(&self) -> &[Bsdf; 2] {
        &self.models
    }

    pub(super) fn models_mut(&mut self) -> &mut [Bsdf; 2] {
        &mut self.models
    }

    pub(super) fn components(&self) -> u8 {
        self.models[0].components().max(self.models[1].components())
    }

    /// What `wo` sees, and the sign of its z axis.
    #[inline]
    fn facing(&self, wo: Vec3) -> (&Bsdf, f32) {
        if wo.z >= 0.0 { (&self.models[0], 1.0) } else { (&self.models[1], -1.0) }
    }

    /// What a function says of the model that `w` sees, in its frame.
    #[inline]
    pub(super) fn of<T>(&self, w: Vec3, f: impl FnOnce(&Bsdf, Vec3) -> T) -> T {
        let (model, side) = self.facing(w);
        f(model, mirror(w, side))
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Rgb {
        let (model, side) = self.facing(wo);
        if wo.z * wi.z <= 0.0 {
            return Rgb::BLACK;
        }
        model.eval(mirror(wo, side), mirror(wi, side), mode)
    }

    #[inline]
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> Density<SolidAngle> {
        let (model, side) = self.facing(wo);
        model.pdf(mirror(wo, side), mirror(wi, side))
    }

    pub(super) fn sample(
        &self,
        wo: Vec3,
        u_lobe: f32,
        u: [f32; 2],
        mode: TransportMode,
    ) -> Option<BsdfSample> {
        let (model, side) = self.facing(wo);
        let sample = model.sample(mirror(wo, side), u_lobe, u, mode)?;
        Some(BsdfSample { wi: mirror(sample.wi, side), ..sample })
    }

    pub(super) fn specular(
        &self,
        wo: Vec3,
        component: Component,
        mode: TransportMode,
    ) -> Option<SpecularSample> {
        let (model, side) = self.facing(wo);
        let sample = model.specular(mirror(wo, side), component, mode)?;
        Some(SpecularSample { wi: mirror(sample.wi, side), ..sample })
    }

    pub(super) fn invert<U: PrimarySample>(
        &self,
        wo: Vec3,
        wi: Vec3,
        event: Event,
        free: &mut U,
    ) -> Option<[f32; 3]> {
        let (model, side) = self.facing(wo);
        model.invert(mirror(wo, side), mirror(wi, side), event, free)
    }
}
