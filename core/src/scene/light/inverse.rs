//! Inverses of the sampling of emitters: from x₀ and x₁ to the numbers that make them.
//!
//! They are probabilistic inverses (Bitterli, Jakob, Novák and Jarosz 2017, §4): a number that the
//! outcome does not depend on is drawn anew, and one that makes a choice is drawn uniformly from
//! all that make the same one. `free` gives the numbers for both.

use glam::Vec3;

use super::cone::Cone;
use crate::emitter::Emitter;
use crate::math::{Frame, warp};
use crate::random::PrimarySample;
use crate::scene::{Scene, ShapeKind};
use crate::vertex::Vertex;

impl Scene {
    /// Numbers (pick, u) by which [`Scene::sample_direct`] takes the emitter vertex x₀ for
    /// `reference`. `None` where there are none.
    pub fn invert_direct<U: PrimarySample>(
        &self,
        reference: Vec3,
        vertex: &Vertex,
        free: &mut U,
    ) -> Option<[f32; 3]> {
        let emitter = vertex.emitter()?;
        let pick = self.emitters().invert_pick(emitter, free.next())?;
        let [u, v] = match (self.emitters().get(emitter), vertex) {
            (Emitter::Area { shape, .. }, Vertex::Surface(point)) => {
                let seen = match self.shapes()[*shape as usize].kind {
                    ShapeKind::Sphere { center, radius, .. } => {
                        Cone::new(reference, center, radius)
                    }
                    _ => None,
                };
                match seen {
                    Some(cone) => cone.invert(point.p),
                    None => self.invert_area(point)?,
                }
            }
            (
                Emitter::Constant { .. } | Emitter::Environment { .. },
                Vertex::InfiniteEmitter { to, .. },
            ) => self.emitters().invert_background(*to)?,
            _ => free.next2(),
        };
        Some([pick, u, v])
    }

    /// Numbers (pick, position) by which [`Scene::sample_emission`] takes the emitter vertex x₀.
    /// `None` where there are none.
    pub fn invert_emission_vertex<U: PrimarySample>(
        &self,
        vertex: &Vertex,
        free: &mut U,
    ) -> Option<[f32; 3]> {
        let emitter = vertex.emitter()?;
        let pick = self.emitters().invert_pick(emitter, free.next())?;
        let [u, v] = match (self.emitters().get(emitter), vertex) {
            (Emitter::Area { .. }, Vertex::Surface(point)) => self.invert_area(point)?,
            (
                Emitter::Constant { .. } | Emitter::Environment { .. },
                Vertex::InfiniteEmitter { to, .. },
            ) => self.emitters().invert_background(*to)?,
            _ => free.next2(),
        };
        Some([pick, u, v])
    }

    /// Numbers (direction) by which [`Scene::sample_emission`] goes on from x₀ to x₁. `None` where
    /// there are none.
    pub fn invert_emission_next(&self, vertex: &Vertex, next: &Vertex) -> Option<[f32; 2]> {
        match vertex {
            Vertex::Surface(point) => {
                let local = Frame::from_normal(point.n_g).to_local(point.aim(next));
                (local.z > 0.0).then(|| warp::cosine_hemisphere_inverse(local))
            }
            Vertex::PointEmitter { emitter, .. } => {
                let d = vertex.edge_to(next).direction();
                if let Emitter::Beam { beam, .. } = *self.emitters().get(*emitter) {
                    return self.emitters().beam(beam).invert(d);
                }
                Some(warp::uniform_sphere_inverse(d))
            }
            Vertex::InfiniteEmitter { to, .. } => {
                let frame = Frame::from_normal(*to);
                let p = (next.position()? - self.ball().center) / self.ball().radius;
                let across = glam::Vec2::new(frame.s.dot(p), frame.t.dot(p));
                Some(warp::concentric_disk_inverse(across))
            }
            Vertex::Medium(_) | Vertex::Sensor { .. } => None,
        }
    }
}
