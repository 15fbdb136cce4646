//! Emitters as ends of mutated subpaths.

use glam::{DVec3, Vec2, Vec3};
use pathspace_core::Scene;
use pathspace_core::math::{Frame, Ray, warp};
use pathspace_core::path::Vertex;

/// x₀ for a ray that left the scene in direction `d`; `None` without an environment.
pub(super) fn background(scene: &Scene, d: Vec3) -> Option<Vertex> {
    let emitter = scene.emitters().background()?;
    Some(Vertex::InfiniteEmitter { emitter, to: d })
}

/// The ray of a light subpath that leaves a given x₀, distributed as that of
/// [`Scene::sample_emission`] given its x₀.
pub(super) fn ray_from(scene: &Scene, x0: &Vertex, u: [f32; 2]) -> Option<Ray> {
    Some(match x0 {
        Vertex::Surface(point) => {
            let local = warp::cosine_hemisphere(u);
            point.spawn(Frame::from_normal(point.n_g).to_world(local))
        }
        Vertex::PointEmitter { p, .. } => Ray::new(*p, warp::uniform_sphere(u)),
        Vertex::InfiniteEmitter { to, .. } => {
            let frame = Frame::from_normal(*to);
            let disk = warp::concentric_disk(u) * scene.ball().radius;
            let middle = across(*to, scene.ball().center).as_vec3();
            beam_ray(scene, *to, middle + frame.s * disk.x + frame.t * disk.y)
        }
        Vertex::Medium(_) | Vertex::Sensor { .. } => return None,
    })
}

/// The ray of a parallel beam from direction `to` at `across` from the origin.
pub(super) fn beam_ray(scene: &Scene, to: Vec3, across: Vec3) -> Ray {
    let ball = scene.ball();
    Ray::new(to * (to.dot(ball.center) + 2.0 * ball.radius) + across, -to)
}

/// Where a beam from `to` crosses the plane through the origin, moved by `offset`, for the beam
/// that meets `p`.
pub(super) fn moved_across(to: Vec3, p: Vec3, offset: Vec2) -> Vec3 {
    let frame = Frame::from_normal(to);
    across(to, p).as_vec3() + frame.s * offset.x + frame.t * offset.y
}

/// Distance between two points as seen along the beam.
pub(super) fn distance_across(to: Vec3, p: Vec3, q: Vec3) -> f64 {
    across(to, p).distance(across(to, q))
}

fn across(to: Vec3, p: Vec3) -> DVec3 {
    let (to, p) = (to.as_dvec3(), p.as_dvec3());
    p - to * to.dot(p)
}
