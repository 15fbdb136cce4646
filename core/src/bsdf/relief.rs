//! Models about a normal that varies over the surface: normal and bump maps.

use glam::Vec3;

use super::{
    Bsdf, BsdfError, BsdfSample, Component, Event, ScatterPdf, SpecularLaw, SpecularSample,
    TransportMode, lobes,
};
use crate::color::Rgb;
use crate::description::MaterialKind;
use crate::math::Frame;
use crate::measure::{Density, Mass, SolidAngle};
use crate::random::{PrimarySample, nearest_coordinate_in};

/// A model f_p in the frame of a normal n_p, seen from the frame of n_s:
///
/// f = f_p |ω_l·n_p|/|ω_l·n_s| S(ω_l), ω_l towards the light, where ω_l lies on the same side of
/// both normals, else 0.
///
/// S is the shadowing function of Estevez et al. 2019 ("A Microfacet-Based Shadowing Function to
/// Solve the Bump Terminator Problem"). Where the direction ω_c towards the sensor lies on
/// different sides of n_p and n_s, n_p is turned half round n_s, so that what is seen faces the
/// viewer. Both as in Mitsuba 3. The roles of light and sensor differ: not reciprocal.
///
/// Walks take the normal that their known direction asks for, and with a small probability the
/// other one, because the walk from a light does not know ω_c yet. Specular components about the
/// turned normal are components of their own.
#[derive(Clone, Debug, PartialEq)]
pub struct Relief {
    model: Bsdf,
    /// About n_p, and about n_p turned half round n_s.
    frames: [Frame; 2],
    flips: bool,
    shadows: bool,
    /// α² of the shadowing function: min(1, tan²/8) of the angle between the normals.
    alpha2: f32,
    /// Probability of the other normal.
    other: f32,
}

impl Relief {
    /// A model about n_s, until `set_normal` says otherwise.
    ///
    /// # Errors
    /// Where the model can not be built.
    pub fn new(model: &MaterialKind, flips: bool, shadows: bool) -> Result<Self, BsdfError> {
        let model = Bsdf::new(model)?;
        let flat = Frame { s: Vec3::X, t: Vec3::Y, n: Vec3::Z };
        let frames = [flat; 2];
        Ok(Relief { model, frames, flips, shadows, alpha2: 0.0, other: 0.0 })
    }

    /// Sets n_p in the frame of n_s; a vector without length counts as n_s.
    pub(super) fn set_normal(&mut self, n: Vec3) {
        let n = n.normalize_or(Vec3::Z);
        let about = |n: Vec3| Frame::from_normal_and_tangent(n, Vec3::X);
        self.frames = [about(n), about(Vec3::new(-n.x, -n.y, n.z))];
        let (sin2, cos2) = (n.truncate().length_squared(), n.z * n.z);
        self.alpha2 = if sin2 < 8.0 * cos2 { 0.125 * sin2 / cos2 } else { 1.0 };
        self.other = if self.flips { 0.25 * sin2.min(1.0) } else { 0.0 };
    }

    /// The frame about n_p.
    pub(super) fn frame(&self) -> &Frame {
        &self.frames[0]
    }

    pub(super) fn model(&self) -> &Bsdf {
        &self.model
    }

    pub(super) fn model_mut(&mut self) -> &mut Bsdf {
        &mut self.model
    }

    pub(super) fn components(&self) -> u8 {
        self.model.components().saturating_mul(2)
    }

    /// The normal that the direction towards the sensor asks for.
    #[inline]
    fn facing(&self, c: Vec3) -> usize {
        usize::from(self.flips && c.z * c.dot(self.frames[0].n) <= 0.0)
    }

    /// The model's component, and the normal it is about; `None` where there is no such component.
    #[inline]
    fn own(&self, component: Component) -> Option<(usize, Component)> {
        let n = self.model.components();
        (component.0 < self.components())
            .then(|| (usize::from(component.0 >= n), Component(component.0 % n)))
    }

    #[inline]
    fn own_frame(&self, component: Component) -> (&Frame, Component) {
        let (which, inner) = self.own(component).unwrap_or((0, component));
        (&self.frames[which], inner)
    }

    pub(super) fn specular_law(&self, w: Vec3, component: Component) -> SpecularLaw {
        let (frame, inner) = self.own_frame(component);
        self.model.specular_law(frame.to_local(w), inner)
    }

    pub(super) fn relative_ior(&self, w: Vec3, component: Component) -> f32 {
        let (frame, inner) = self.own_frame(component);
        self.model.relative_ior(frame.to_local(w), inner)
    }

    #[inline]
    pub(super) fn is_connectible(&self, w: Vec3) -> bool {
        self.frames.iter().any(|f| self.model.is_connectible(f.to_local(w)))
    }

    /// S(ω_l) |ω_l·n_p|/|ω_l·n_s|; 0 where ω_l lies on different sides.
    #[inline]
    fn factor(&self, l: Vec3, l_p: Vec3) -> f32 {
        if l.z * l_p.z <= 0.0 {
            return 0.0;
        }
        let ratio = l_p.z / l.z;
        if !self.shadows {
            return ratio;
        }
        let tan2 = l.truncate().length_squared() / (l.z * l.z);
        ratio * 2.0 / (1.0 + (1.0 + self.alpha2 * tan2).sqrt())
    }

    pub(super) fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Rgb {
        let (c, l) = match mode {
            TransportMode::Radiance => (wo, wi),
            TransportMode::Importance => (wi, wo),
        };
        let frame = &self.frames[self.facing(c)];
        let factor = self.factor(l, frame.to_local(l));
        if factor == 0.0 {
            return Rgb::BLACK;
        }
        self.model.eval(frame.to_local(wo), frame.to_local(wi), mode) * factor
    }

    /// Probability that a walk with the known direction `wo` takes a normal.
    #[inline]
    fn probability(&self, wo: Vec3, which: usize) -> f32 {
        if self.facing(wo) == which { 1.0 - self.other } else { self.other }
    }

    #[inline]
    fn density(&self, wo: Vec3, wi: Vec3, which: usize) -> f64 {
        let probability = self.probability(wo, which);
        if probability == 0.0 {
            return 0.0;
        }
        let frame = &self.frames[which];
        let pdf = self.model.pdf(frame.to_local(wo), frame.to_local(wi));
        pdf.value() * f64::from(probability)
    }

    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> Density<SolidAngle> {
        Density::new(self.density(wo, wi, 0) + self.density(wo, wi, 1))
    }

    pub(super) fn sample(
        &self,
        wo: Vec3,
        u_lobe: f32,
        u: [f32; 2],
        mode: TransportMode,
    ) -> Option<BsdfSample> {
        let shares = [self.probability(wo, 0), self.probability(wo, 1)];
        let (which, inner) = lobes::pick(&shares, u_lobe);
        let frame = &self.frames[which];
        let sample = self.model.sample(frame.to_local(wo), inner, u, mode)?;
        let wi = frame.to_world(sample.wi).normalize();
        match sample.pdf {
            ScatterPdf::NonSpecular(_) => {
                lobes::sampled(wo, wi, self.eval(wo, wi, mode), self.pdf(wo, wi))
            }
            ScatterPdf::Specular(component, _) => {
                let component = Component(component.0 + which as u8 * self.model.components());
                let SpecularSample { wi, value, mass } = self.specular(wo, component, mode)?;
                (!value.is_black()).then(|| BsdfSample {
                    wi,
                    weight: value * (1.0 / mass.value() as f32),
                    pdf: ScatterPdf::Specular(component, mass),
                    value,
                    ..sample
                })
            }
        }
    }

    pub(super) fn specular(
        &self,
        wo: Vec3,
        component: Component,
        mode: TransportMode,
    ) -> Option<SpecularSample> {
        let (which, inner) = self.own(component)?;
        let probability = self.probability(wo, which);
        if probability == 0.0 {
            return None;
        }
        let frame = &self.frames[which];
        let wo_p = frame.to_local(wo);
        let sample = self.model.specular(wo_p, inner, mode)?;
        let wi = frame.to_world(sample.wi).normalize();
        let (c, l, l_p) = match mode {
            TransportMode::Radiance => (wo, wi, sample.wi),
            TransportMode::Importance => (wi, wo, wo_p),
        };
        let lit = self.facing(c) == which;
        // The factor has |ω_l·n_p|/|ω_l·n_s| in it: of a coefficient, that is the path's own
        // affair, but for the walk from a light.
        let factor = self.factor(l, l_p);
        let factor = match mode {
            _ if !lit || factor == 0.0 => 0.0,
            TransportMode::Radiance => factor * l.z / l_p.z,
            TransportMode::Importance => factor * (wi.z / sample.wi.z).abs(),
        };
        let mass = sample.mass * Mass::new(f64::from(probability));
        Some(SpecularSample { wi, value: sample.value * factor, mass })
    }

    pub(super) fn invert<U: PrimarySample>(
        &self,
        wo: Vec3,
        wi: Vec3,
        event: Event,
        free: &mut U,
    ) -> Option<[f32; 3]> {
        let (which, inner) = match event {
            Event::Specular(component) => {
                let (which, component) = self.own(component)?;
                (which, Event::Specular(component))
            }
            Event::NonSpecular => {
                let densities = [self.density(wo, wi, 0), self.density(wo, wi, 1)];
                let number = f64::from(free.next()) * (densities[0] + densities[1]);
                if densities[0] + densities[1] <= 0.0 {
                    return None;
                }
                (usize::from(number >= densities[0]), event)
            }
        };
        let probability = f64::from(self.probability(wo, which));
        if probability == 0.0 {
            return None;
        }
        let frame = &self.frames[which];
        let [lobe, u, v] =
            self.model.invert(frame.to_local(wo), frame.to_local(wi), inner, free)?;
        let low = if which == 1 { f64::from(self.probability(wo, 0)) } else { 0.0 };
        let number = low + f64::from(lobe) * probability;
        Some([nearest_coordinate_in(low, low + probability, number)?, u, v])
    }
}
