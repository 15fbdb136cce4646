//! Weighted sums of models: blends and masks.

use glam::Vec3;

use super::{
    Bsdf, BsdfError, BsdfSample, Component, Event, ScatterPdf, SpecularSample, TransportMode, lobes,
};
use crate::color::Rgb;
use crate::description::{MaterialKind, Parameter};
use crate::measure::{Density, Mass, SolidAngle};
use crate::random::{PrimarySample, nearest_coordinate_in};

/// f = Σ w_i f_i; a model is taken with probability w_i/Σ w_j. The specular components of each
/// model are components of their own.
#[derive(Clone, Debug, PartialEq)]
pub struct Mixture {
    parts: Vec<Part>,
}

#[derive(Clone, Debug, PartialEq)]
struct Part {
    weight: f32,
    probability: f32,
    /// Number of its first specular component.
    first: u8,
    model: Bsdf,
}

impl Mixture {
    /// Models with their weights.
    ///
    /// # Errors
    /// Where a weight is negative, their sum over 1, or there is no model.
    pub fn new(models: &[(f32, MaterialKind)]) -> Result<Self, BsdfError> {
        let models = models
            .iter()
            .map(|(weight, kind)| Ok((*weight, Bsdf::new(kind)?)))
            .collect::<Result<Vec<_>, _>>()?;
        Mixture::of(models)
    }

    /// A model that covers `opacity` of the surface, and nothing else.
    ///
    /// # Errors
    /// Where the opacity is not in \[0, 1\] or the model can not be built.
    pub fn mask(opacity: f32, model: &MaterialKind) -> Result<Self, BsdfError> {
        Mixture::of(vec![(1.0 - opacity, Bsdf::Null), (opacity, Bsdf::new(model)?)])
    }

    fn of(models: Vec<(f32, Bsdf)>) -> Result<Self, BsdfError> {
        let refuse = |value: String, expected| {
            Err(BsdfError::Parameter { parameter: "weight", value, expected })
        };
        let sum: f32 = models.iter().map(|(w, _)| w).sum();
        if models.is_empty() {
            return refuse("missing".into(), "one for each model");
        }
        if let Some((w, _)) = models.iter().find(|(w, _)| !(0.0..=1.0).contains(w)) {
            return refuse(w.to_string(), "between 0 and 1");
        }
        if sum > 1.0 + 1e-4 {
            return refuse(sum.to_string(), "at most 1 in the sum");
        }
        let mut parts: Vec<Part> = Vec::with_capacity(models.len());
        let mut first = 0;
        for (weight, model) in models {
            parts.push(Part { weight, probability: 0.0, first, model: model.clone() });
            first = model.components().checked_add(first).ok_or(BsdfError::Parameter {
                parameter: "models",
                value: "over 255 specular components".into(),
                expected: "fewer",
            })?;
        }
        let mut mixture = Mixture { parts };
        mixture.choose();
        Ok(mixture)
    }

    /// Probabilities from weights; the same for all where all are 0.
    fn choose(&mut self) {
        let sum: f32 = self.parts.iter().map(|p| p.weight).sum();
        let even = 1.0 / self.parts.len() as f32;
        for part in &mut self.parts {
            part.probability = if sum > 0.0 { part.weight / sum } else { even };
        }
    }

    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) {
        if let (Parameter::Weight, [first, second]) = (parameter, self.parts.as_mut_slice()) {
            second.weight = value.r.clamp(0.0, 1.0);
            first.weight = 1.0 - second.weight;
            self.choose();
        }
    }

    /// The models, for those who change their parameters.
    pub(super) fn models_mut(&mut self) -> impl Iterator<Item = &mut Bsdf> {
        self.parts.iter_mut().map(|p| &mut p.model)
    }

    /// The models.
    pub(super) fn models(&self) -> impl Iterator<Item = &Bsdf> {
        self.parts.iter().map(|p| &p.model)
    }

    /// Number of specular components.
    pub(super) fn components(&self) -> u8 {
        self.parts.last().map_or(0, |p| p.first + p.model.components())
    }

    /// The part that a component belongs to, and its number there.
    pub(super) fn part_of(&self, component: Component) -> Option<(&Bsdf, Component)> {
        let (part, inner) = self.own(component)?;
        Some((&part.model, inner))
    }

    fn own(&self, component: Component) -> Option<(&Part, Component)> {
        let part = self.parts.iter().rev().find(|p| p.first <= component.0)?;
        let inner = component.0 - part.first;
        (inner < part.model.components()).then_some((part, Component(inner)))
    }

    pub(super) fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Rgb {
        let weighted = |p: &Part| {
            if p.weight > 0.0 { p.model.eval(wo, wi, mode) * p.weight } else { Rgb::BLACK }
        };
        self.parts.iter().map(weighted).fold(Rgb::BLACK, |a, b| a + b)
    }

    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> Density<SolidAngle> {
        let weighted = |p: &Part| self.density(p, wo, wi);
        Density::new(self.parts.iter().map(weighted).sum())
    }

    fn density(&self, part: &Part, wo: Vec3, wi: Vec3) -> f64 {
        if part.probability > 0.0 {
            part.model.pdf(wo, wi).value() * f64::from(part.probability)
        } else {
            0.0
        }
    }

    pub(super) fn sample(
        &self,
        wo: Vec3,
        u_lobe: f32,
        u: [f32; 2],
        mode: TransportMode,
    ) -> Option<BsdfSample> {
        let last = self.parts.iter().rposition(|p| p.probability > 0.0)?;
        let mut low = 0.0;
        for (i, part) in self.parts.iter().enumerate() {
            if i < last && u_lobe >= low + part.probability {
                low += part.probability;
                continue;
            }
            let inner = lobes::within(u_lobe, low, part.probability);
            let sample = part.model.sample(wo, inner, u, mode)?;
            return match sample.pdf {
                ScatterPdf::NonSpecular(_) => {
                    let (value, pdf) = (self.eval(wo, sample.wi, mode), self.pdf(wo, sample.wi));
                    lobes::sampled(wo, sample.wi, value, pdf)
                }
                ScatterPdf::Specular(component, mass) => {
                    let component = Component(component.0 + part.first);
                    let mass = mass * Mass::new(f64::from(part.probability));
                    Some(BsdfSample {
                        weight: sample.weight * (part.weight / part.probability),
                        pdf: ScatterPdf::Specular(component, mass),
                        value: sample.value * part.weight,
                        ..sample
                    })
                }
            };
        }
        None
    }

    pub(super) fn specular(
        &self,
        wo: Vec3,
        component: Component,
        mode: TransportMode,
    ) -> Option<SpecularSample> {
        let (part, inner) = self.own(component)?;
        if part.probability <= 0.0 {
            return None;
        }
        let sample = part.model.specular(wo, inner, mode)?;
        let mass = sample.mass * Mass::new(f64::from(part.probability));
        Some(SpecularSample { value: sample.value * part.weight, mass, ..sample })
    }

    pub(super) fn invert<U: PrimarySample>(
        &self,
        wo: Vec3,
        wi: Vec3,
        event: Event,
        free: &mut U,
    ) -> Option<[f32; 3]> {
        let (part, inner) = match event {
            Event::Specular(component) => {
                let (part, component) = self.own(component)?;
                (part, Event::Specular(component))
            }
            Event::NonSpecular => {
                let densities: Vec<f64> =
                    self.parts.iter().map(|p| self.density(p, wo, wi)).collect();
                let number = f64::from(free.next()) * densities.iter().sum::<f64>();
                (&self.parts[lobes::among(&densities, number)?], event)
            }
        };
        if part.probability <= 0.0 {
            return None;
        }
        let before = self.parts.iter().take_while(|p| !std::ptr::eq(*p, part));
        let low: f32 = before.map(|p| p.probability).sum();
        let [lobe, u, v] = part.model.invert(wo, wi, inner, free)?;
        let (low, width) = (f64::from(low), f64::from(part.probability));
        let number = nearest_coordinate_in(low, low + width, low + f64::from(lobe) * width)?;
        Some([number, u, v])
    }
}
