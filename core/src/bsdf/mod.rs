//! Scattering models in the local shading frame (z = n_s).
//!
//! Directions are unit vectors that point away from the surface. `wo` is the known direction, the
//! one a walk comes from; `wi` is the other, sampled one. [`TransportMode`] says which of them
//! leads to the sensor. Values are BSDFs f without cosine, in 1/sr; the adjoint factor of shading
//! normals is not part of them (it belongs to the path, which knows both normals).
//!
//! Models and parameters mean what they mean in Mitsuba 3, so that one file renders the same.
//!
//! | model | lobes | sampled density |
//! | --- | --- | --- |
//! | [`Diffuse`] | ρ/π in front | cos θ/π |
//! | [`RoughConductor`] | F D G/(4 cos θ_o cos θ_i) in front | visible or all microfacet normals |
//! | [`Conductor`] | mirror direction in front | mass 1 |
//! | [`Plastic`] | mirror direction and a diffuse base in front | mass of the mirror, cos θ/π times the rest |
//! | [`Dielectric`] | mirror and refracted direction | masses F and 1 − F |
//! | [`Bsdf::Null`] | straight on | mass 1 |
//! | [`RoughPlastic`] | microfacets and a diffuse base in front | visible or all normals, cos θ/π |
//! | [`RoughDielectric`] | microfacet reflection and refraction | visible or all normals |
//! | [`ThinDielectric`] | mirror direction and straight on | masses R and 1 − R |
//! | [`RoughDiffuse`] | Oren and Nayar in front | cos θ/π |
//! | [`Phong`], [`Ward`] | a glossy and a diffuse lobe in front | each lobe its own |
//! | [`Principled`], [`PrincipledThin`] | diffuse, specular, coat, transmission | each lobe its own |
//! | [`Mixture`] | weighted sum of models | weighted sum of densities |
//! | [`Relief`] | a model about another normal | that of the model |
//! | [`Sides`] | a model for each side | that of the model |
//!
//! A model has components, specular and not, several of them on one side. A specular component has
//! a coefficient c: it scatters c·L(ω_i), so that c stands where f·|cos θ_i| dσ stands for the
//! others, and its probability is a [`Mass`]. Which of them a path takes at a vertex is its
//! [`Event`].

mod beckmann;
mod burley;
mod compound;
mod conductor;
mod dielectric;
mod diffuse;
mod error;
mod event;
pub mod fresnel;
mod half;
mod lobes;
pub(crate) mod memo;
pub mod microfacet;
mod mixture;
mod opaque;
mod phong;
mod plastic;
mod principled;
mod principled_thin;
mod relief;
mod rough_conductor;
mod rough_dielectric;
mod rough_diffuse;
mod rough_plastic;
mod sides;
mod textured;
mod thin_dielectric;
mod transmittance;
mod ward;

use glam::Vec3;

pub use compound::Compound;
pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use error::BsdfError;
pub use event::{Component, Event};
pub use mixture::Mixture;
pub use opaque::Opaque;
pub use phong::Phong;
pub use plastic::Plastic;
pub use principled::Principled;
pub use principled_thin::PrincipledThin;
pub use relief::Relief;
pub use rough_conductor::RoughConductor;
pub use rough_dielectric::RoughDielectric;
pub use rough_diffuse::RoughDiffuse;
pub use rough_plastic::RoughPlastic;
pub use sides::Sides;
pub use textured::Resolved;
pub(crate) use textured::{Here, Tangents, Textures};
pub use thin_dielectric::ThinDielectric;
pub use ward::Ward;

use crate::color::Rgb;
use crate::description::{MaterialKind, Parameter};
use crate::measure::{Density, Mass, SolidAngle};
use crate::random::PrimarySample;

/// What a walk transports (Veach 1997, §4.4 and §5.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TransportMode {
    /// Radiance is gathered: `wo` leads to the sensor, `wi` towards the light.
    Radiance,
    /// Importance is gathered (light is spread): `wo` leads to the light, `wi` towards the sensor.
    Importance,
}

impl TransportMode {
    /// The mode of the walk from the other side.
    #[inline]
    pub fn opposite(self) -> Self {
        match self {
            TransportMode::Radiance => TransportMode::Importance,
            TransportMode::Importance => TransportMode::Radiance,
        }
    }
}

/// Side of the surface on which `wi` leaves, seen from `wo`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ScatterSide {
    /// The same side.
    Reflection,
    /// The other side.
    Transmission,
}

/// Probability of a sampled direction, in the measure of its component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScatterPdf {
    /// Density per solid angle of the non-specular components.
    NonSpecular(Density<SolidAngle>),
    /// Probability of a specular component.
    Specular(Component, Mass),
}

/// A direction sampled by [`Bsdf::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// The sampled direction.
    pub wi: Vec3,
    /// f |cos θ_i|/p, or coefficient/mass of a specular component.
    pub weight: Rgb,
    /// Density or mass of `wi`.
    pub pdf: ScatterPdf,
    /// f in 1/sr, or the coefficient of a specular component.
    pub value: Rgb,
    /// Reflection or transmission.
    pub side: ScatterSide,
    /// n on the side of `wi` over n on the side of `wo`; 1 for reflection. In radiance mode a
    /// throughput times the product of η² is free of the compression of radiance (for roulette).
    pub eta: f32,
}

impl BsdfSample {
    /// Which component was taken.
    #[inline]
    pub fn event(&self) -> Event {
        match self.pdf {
            ScatterPdf::NonSpecular(_) => Event::NonSpecular,
            ScatterPdf::Specular(component, _) => Event::Specular(component),
        }
    }
}

/// A scattering model: a closed set, without indirection for the plain ones.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Bsdf {
    /// An opaque model in front, black behind.
    OneSided(Opaque),
    /// Opaque models on both sides; the back one sees the frame mirrored (z → −z).
    TwoSided {
        /// Seen from the side of the normal.
        front: Opaque,
        /// Seen from behind.
        back: Opaque,
    },
    /// Smooth boundary between dielectrics.
    Dielectric(Dielectric),
    /// No boundary: straight on, with coefficient and mass 1.
    Null,
    /// What is large or made of others.
    Compound(Box<Compound>),
}

impl Bsdf {
    /// Sets a parameter; nothing where the model does not have it.
    pub(crate) fn set(&mut self, parameter: Parameter, colour: Rgb) {
        match self {
            Bsdf::OneSided(model) => model.set(parameter, colour),
            Bsdf::Dielectric(model) => model.set(parameter, colour),
            Bsdf::Compound(model) => model.set(parameter, colour),
            Bsdf::TwoSided { .. } | Bsdf::Null => {}
        }
    }

    /// Builds the model that `kind` describes.
    ///
    /// # Errors
    /// [`BsdfError`] where a parameter is out of range or `twosided` holds a model that transmits.
    pub fn new(kind: &MaterialKind) -> Result<Bsdf, BsdfError> {
        Ok(match kind {
            MaterialKind::Textured { model, .. } => Bsdf::new(model)?,
            plain if Opaque::is_one(plain) => Bsdf::OneSided(Opaque::new(plain)?),
            MaterialKind::TwoSided { front, back }
                if Opaque::is_one(front) && Opaque::is_one(back) =>
            {
                Bsdf::TwoSided { front: Opaque::new(front)?, back: Opaque::new(back)? }
            }
            MaterialKind::Dielectric {
                int_ior,
                ext_ior,
                specular_reflectance,
                specular_transmittance,
            } => Bsdf::Dielectric(Dielectric::new(
                *int_ior,
                *ext_ior,
                *specular_reflectance,
                *specular_transmittance,
            )?),
            MaterialKind::Null => Bsdf::Null,
            other => Bsdf::Compound(Box::new(Compound::new(other)?)),
        })
    }

    /// Number of specular components that a path may name; some may have no probability.
    pub(crate) fn components(&self) -> u8 {
        match self {
            Bsdf::Compound(model) => model.components(),
            _ => 2,
        }
    }

    /// True where light may pass from one side to the other.
    pub fn transmits(&self) -> bool {
        match self {
            Bsdf::OneSided(_) | Bsdf::TwoSided { .. } => false,
            Bsdf::Dielectric(_) | Bsdf::Null => true,
            Bsdf::Compound(model) => model.transmits(),
        }
    }

    /// True where the law of a specular component refers to n_s: its half vector is normal to the
    /// surface.
    pub fn follows_normal(&self, component: Component) -> bool {
        match self {
            Bsdf::Compound(model) => model.follows_normal(component),
            _ => true,
        }
    }

    /// True where the side of `wo` has a non-specular component: a connection may end there.
    #[inline]
    pub fn is_connectible(&self, wo: Vec3) -> bool {
        match (self.facing(wo), self) {
            (Some((model, _)), _) => model.is_non_specular(),
            (None, Bsdf::Compound(model)) => model.is_connectible(wo),
            (None, _) => false,
        }
    }

    /// True where f(ω_o → ω_i) = f(ω_i → ω_o) for the non-specular components.
    #[inline]
    pub fn is_reciprocal(&self) -> bool {
        match self {
            Bsdf::Compound(model) => model.is_reciprocal(),
            _ => true,
        }
    }

    /// Refractive index on the side of `w` over the index on the side of the normal, for the model
    /// that a specular component belongs to; 1 where the surface is no boundary between media.
    #[inline]
    pub fn relative_ior(&self, w: Vec3, component: Component) -> f32 {
        match self {
            Bsdf::Dielectric(model) if w.z < 0.0 => model.relative_ior(),
            Bsdf::Compound(model) => model.relative_ior(w, component),
            _ => 1.0,
        }
    }

    /// What makes a density of the probability of a specular component: m n²|ω·n_c|, relative to
    /// the common delta function.
    #[inline]
    pub fn specular_law(&self, w: Vec3, component: Component) -> SpecularLaw {
        match self {
            Bsdf::Compound(model) => model.specular_law(w, component),
            _ => SpecularLaw { n: self.relative_ior(w, component), cos: w.z.abs() },
        }
    }

    /// True where the azimuth of the shading frame matters (anisotropic roughness).
    #[inline]
    pub fn needs_tangent(&self) -> bool {
        match self {
            Bsdf::OneSided(model) => model.is_anisotropic(),
            Bsdf::TwoSided { front, back } => front.is_anisotropic() || back.is_anisotropic(),
            Bsdf::Dielectric(_) | Bsdf::Null => false,
            Bsdf::Compound(model) => model.needs_tangent(),
        }
    }

    /// The opaque model that `wo` sees, and the sign of its z axis.
    #[inline]
    fn facing(&self, wo: Vec3) -> Option<(&Opaque, f32)> {
        match self {
            Bsdf::OneSided(model) => Some((model, 1.0)),
            Bsdf::TwoSided { front, back } => {
                Some(if wo.z >= 0.0 { (front, 1.0) } else { (back, -1.0) })
            }
            Bsdf::Dielectric(_) | Bsdf::Null | Bsdf::Compound(_) => None,
        }
    }

    /// f(ω_o, ω_i) in 1/sr, without cosine, of the non-specular components. f is that of light
    /// which comes from the side that leads to the emitter: `eval(c, l, Radiance)` and `eval(l, c,
    /// Importance)` are one value, [`Bsdf::is_reciprocal`] or not.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Rgb {
        match (self.facing(wo), self) {
            (Some((model, side)), _) => model.eval(mirror(wo, side), mirror(wi, side)),
            (None, Bsdf::Compound(model)) => model.eval(wo, wi, mode),
            (None, _) => Rgb::BLACK,
        }
    }

    /// Density with which [`Bsdf::sample`] takes `wi` by a non-specular component; its integral is
    /// the probability of those.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> Density<SolidAngle> {
        match (self.facing(wo), self) {
            (Some((model, side)), _) => model.pdf(mirror(wo, side), mirror(wi, side)),
            (None, Bsdf::Compound(model)) => model.pdf(wo, wi),
            (None, _) => Density::ZERO,
        }
    }

    /// Samples a direction: `u_lobe` in \[0, 1) chooses the component, `u` in \[0, 1)² the
    /// direction in it. `None` where nothing is scattered (behind an opaque model) or the sampled
    /// direction falls below the surface; such samples count, with value 0.
    #[inline]
    pub fn sample(
        &self,
        wo: Vec3,
        u_lobe: f32,
        u: [f32; 2],
        mode: TransportMode,
    ) -> Option<BsdfSample> {
        match self {
            Bsdf::Dielectric(model) => Some(model.sample(wo, u_lobe, mode)),
            Bsdf::Null => Some(BsdfSample {
                wi: -wo,
                weight: Rgb::WHITE,
                pdf: ScatterPdf::Specular(Component::TRANSMISSION, Mass::ONE),
                value: Rgb::WHITE,
                side: ScatterSide::Transmission,
                eta: 1.0,
            }),
            Bsdf::Compound(model) => model.sample(wo, u_lobe, u, mode),
            Bsdf::OneSided(_) | Bsdf::TwoSided { .. } => {
                let (model, side) = self.facing(wo)?;
                let sample = model.sample(mirror(wo, side), u_lobe, u)?;
                Some(BsdfSample { wi: mirror(sample.wi, side), ..sample })
            }
        }
    }

    /// Numbers (`u_lobe`, `u`) by which [`Bsdf::sample`] takes `wo` to `wi` by `event`: a
    /// probabilistic inverse (Bitterli et al. 2017, §4). Those that the outcome does not depend on
    /// are drawn from `free`, the number of a choice uniformly from all that make it, and which of
    /// several non-specular components it was by their share of the density. `None` where no
    /// numbers do.
    ///
    /// Where a specular component leads is not checked.
    pub fn invert<U: PrimarySample>(
        &self,
        wo: Vec3,
        wi: Vec3,
        event: Event,
        free: &mut U,
    ) -> Option<[f32; 3]> {
        match (self, event) {
            (Bsdf::Dielectric(model), Event::Specular(component)) => {
                let [u, v] = free.next2();
                Some([model.invert(wo, component, free.next())?, u, v])
            }
            (Bsdf::Null, Event::Specular(_)) => {
                (wo.z * wi.z < 0.0).then(|| [free.next(), free.next(), free.next()])
            }
            (Bsdf::Dielectric(_) | Bsdf::Null, Event::NonSpecular) => None,
            (Bsdf::Compound(model), _) => model.invert(wo, wi, event, free),
            (Bsdf::OneSided(_) | Bsdf::TwoSided { .. }, _) => {
                let (model, side) = self.facing(wo)?;
                model.invert(mirror(wo, side), mirror(wi, side), event, free)
            }
        }
    }

    /// Where a specular component leads from `wo`, its coefficient and its probability; `None`
    /// where it leads nowhere (total reflection, a side without it).
    pub fn specular(
        &self,
        wo: Vec3,
        component: Component,
        mode: TransportMode,
    ) -> Option<SpecularSample> {
        match self {
            Bsdf::Dielectric(model) => model.specular(wo, component, mode),
            Bsdf::Null => (component == Component::TRANSMISSION).then_some(SpecularSample {
                wi: -wo,
                value: Rgb::WHITE,
                mass: Mass::ONE,
            }),
            Bsdf::Compound(model) => model.specular(wo, component, mode),
            Bsdf::OneSided(_) | Bsdf::TwoSided { .. } => {
                let (model, side) = self.facing(wo)?;
                let sample = model.specular(mirror(wo, side), component)?;
                Some(SpecularSample { wi: mirror(sample.wi, side), ..sample })
            }
        }
    }
}

/// A specular component as one direction ω sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpecularLaw {
    /// Refractive index on the side of ω ([`Bsdf::relative_ior`]).
    pub n: f32,
    /// |ω·n_c|, n_c the normal that the component is about: n_s but for [`Relief`].
    pub cos: f32,
}

/// A specular component at one direction ω_o.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpecularSample {
    /// Where it leads.
    pub wi: Vec3,
    /// Coefficient.
    pub value: Rgb,
    /// Probability that [`Bsdf::sample`] takes it, positive.
    pub mass: Mass,
}

#[inline]
fn mirror(w: Vec3, side: f32) -> Vec3 {
    Vec3::new(w.x, w.y, w.z * side)
}

#[inline]
fn reflect_about_z(w: Vec3) -> Vec3 {
    Vec3::new(-w.x, -w.y, w.z)
}
