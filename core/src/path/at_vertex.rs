//! Scattering at any vertex: on a surface by its BSDF, in a medium by σ_s ρ.

use glam::Vec3;

use super::scatter::survival;
use super::{ScatterSample, ScatterValue, TwoWayScatter, Vertex};
use crate::bsdf::{Event, TransportMode};
use crate::color::Rgb;
use crate::measure::{Density, Mass, SolidAngle};
use crate::medium::{Medium, MediumPoint};
use crate::scene::Scene;

/// σ_s ρ(from, to) and its density.
fn phase(medium: &Medium, from: Vec3, to: Vec3) -> (Rgb, Density<SolidAngle>) {
    let pdf = medium.phase().pdf(from, to);
    (medium.scattering() * pdf.value() as f32, pdf)
}

/// Survival goes by the albedo, which is the same both ways.
fn goes_on(medium: &Medium) -> Mass {
    survival(medium.largest_albedo())
}

impl Scene {
    fn scatters_at(&self, point: &MediumPoint) -> Option<&Medium> {
        self.medium(point.medium).filter(|m| !m.scattering().is_black())
    }

    /// True where a connection may end at a vertex that is seen from `w`: [`Scene::is_connectible`]
    /// at surfaces.
    #[inline]
    pub fn connects_at(&self, vertex: &Vertex, w: Vec3) -> bool {
        match vertex {
            Vertex::Surface(point) => self.is_connectible(point, w),
            Vertex::Medium(point) => self.scatters_at(point).is_some(),
            _ => true,
        }
    }

    /// f̄(ω_l, ω_c) of the non-specular components.
    #[inline]
    pub fn scatter_at(&self, vertex: &Vertex, to_light: Vec3, to_sensor: Vec3) -> Rgb {
        match vertex {
            Vertex::Surface(point) => self.scatter(point, to_light, to_sensor),
            Vertex::Medium(point) => {
                self.scatters_at(point).map_or(Rgb::BLACK, |m| phase(m, to_light, to_sensor).0)
            }
            _ => Rgb::BLACK,
        }
    }

    /// [`Scene::sample_scatter`] at any vertex. At a point of a medium `weight` is σ_s.
    #[inline]
    pub fn sample_at(
        &self,
        vertex: &Vertex,
        from: Vec3,
        mode: TransportMode,
        component: f32,
        u: [f32; 2],
    ) -> Option<ScatterSample> {
        match vertex {
            Vertex::Surface(point) => self.sample_scatter(point, from, mode, component, u),
            Vertex::Medium(point) => {
                let medium = self.scatters_at(point)?;
                let (direction, pdf) = medium.phase().sample(from, component, u);
                let (weight, survival) = (medium.scattering(), goes_on(medium));
                let event = Event::NonSpecular;
                Some(ScatterSample { direction, weight, pdf, event, survival })
            }
            _ => None,
        }
    }

    /// [`Scene::evaluate_scatter`] at any vertex.
    #[inline]
    pub fn evaluate_at(
        &self,
        vertex: &Vertex,
        from: Vec3,
        to: Vec3,
        mode: TransportMode,
    ) -> Option<ScatterValue> {
        match vertex {
            Vertex::Surface(point) => self.evaluate_scatter(point, from, to, mode),
            Vertex::Medium(point) => {
                let medium = self.scatters_at(point)?;
                let (value, pdf) = phase(medium, from, to);
                Some(ScatterValue { value, pdf, survival: goes_on(medium) })
            }
            _ => None,
        }
    }

    /// [`Scene::connect_scatter`] at any vertex.
    #[inline]
    pub fn connect_at(
        &self,
        vertex: &Vertex,
        from: Vec3,
        to: Vec3,
        mode: TransportMode,
    ) -> Option<TwoWayScatter> {
        match vertex {
            Vertex::Surface(point) => self.connect_scatter(point, from, to, mode),
            Vertex::Medium(point) => {
                let medium = self.scatters_at(point)?;
                let (value, pdf) = phase(medium, from, to);
                let q = goes_on(medium);
                Some(TwoWayScatter {
                    value,
                    forward: pdf,
                    backward: pdf,
                    survival_forward: q,
                    survival_backward: q,
                })
            }
            _ => None,
        }
    }

    /// [`Scene::scatter_event`] at any vertex.
    #[inline]
    pub fn event_at(
        &self,
        vertex: &Vertex,
        from: Vec3,
        to: Vec3,
        mode: TransportMode,
        event: Event,
    ) -> Option<(Density<SolidAngle>, Mass)> {
        match vertex {
            Vertex::Surface(point) => self.scatter_event(point, from, to, mode, event),
            Vertex::Medium(point) => {
                let medium = self.scatters_at(point)?;
                Some((phase(medium, from, to).1, goes_on(medium)))
            }
            _ => None,
        }
    }

    /// [`Scene::scatter_value`] at any vertex.
    pub fn value_at(&self, vertex: &Vertex, to_light: Vec3, to_sensor: Vec3, event: Event) -> Rgb {
        match vertex {
            Vertex::Surface(point) => self.scatter_value(point, to_light, to_sensor, event),
            _ => self.scatter_at(vertex, to_light, to_sensor),
        }
    }
}
