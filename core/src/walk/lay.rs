//! Subpaths along given vertices.

use glam::Vec3;

use super::subpath::{OpenEdge, Subpath, Walk, WalkVertex};
use crate::bsdf::TransportMode;
use crate::color::Rgb;
use crate::math::Ray;
use crate::path::Path;
use crate::scene::NextDensity;
use crate::scene::Scene;

impl Walk {
    /// The subpath of this walk along the vertices of a path, from its own end on, with the
    /// densities and events that it would have had; throughputs are 1. It ends before the first
    /// vertex that the walk can not reach.
    pub fn lay(&self, scene: &Scene, path: &Path) -> Subpath {
        let k = path.length();
        // Walk order.
        let at = |j: usize| if self.mode == TransportMode::Radiance { k - j } else { j };
        let vertex = |j: usize| path.vertices[at(j)];
        let first = match self.mode {
            TransportMode::Radiance => scene.sensor().pdf_vertex(),
            TransportMode::Importance => scene.pdf_emission_vertex(&vertex(0)),
        };
        let mut subpath = vec![WalkVertex::first(vertex(0), first)];
        for j in 1..=k {
            let d = vertex(j - 1).edge_to(&vertex(j)).direction();
            let next = match (j, self.mode) {
                (1, TransportMode::Radiance) => {
                    Some(NextDensity::Direction(scene.sensor().pdf_direction(d)))
                }
                (1, TransportMode::Importance) => scene.next_of(&vertex(0), d),
                _ => self.next_along(scene, &mut subpath[j - 1], d, path.events[at(j - 1)], j - 1),
            };
            let Some(next) = next else { break };
            let connectible = scene.connects_at(&vertex(j), -d);
            let transmittance = scene.transmittance(&vertex(j - 1), &vertex(j));
            let ray = Ray::new(Vec3::ZERO, d);
            let edge = OpenEdge { transmittance, ..OpenEdge::new(ray, Rgb::WHITE, next) };
            if !self.push(scene, &mut subpath, vertex(j), &edge, connectible) {
                break;
            }
        }
        subpath
    }

    /// Lets `event` happen at a vertex and gives the density of direction `d`.
    fn next_along(
        &self,
        scene: &Scene,
        last: &mut WalkVertex,
        d: Vec3,
        event: crate::bsdf::Event,
        index: usize,
    ) -> Option<NextDensity> {
        let (pdf, q) = scene.event_at(&last.vertex, last.from, d, self.mode, event)?;
        last.event = event;
        Some(NextDensity::Direction(if self.roulette(index) { pdf * q } else { pdf }))
    }
}
