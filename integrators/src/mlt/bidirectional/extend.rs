//! New vertices from either side, and the connection.

use glam::Vec3;
use pathspace_core::Scene;
use pathspace_core::bsdf::TransportMode;
use pathspace_core::math::Ray;
use pathspace_core::path::Vertex;
use pathspace_core::random::{PrimarySample, RandomStream};

use super::super::emission;
use super::super::mutator::Kept;
use super::super::path::MltPath;

/// The path that keeps `kept` of `x` and has `added` new vertices between, those up to x_{s−1} sampled from the emitter
/// side, the others from the sensor side; `None` where a walk ends early, hits what it should not, or is hidden from the other.
pub(super) fn join(
    scene: &Scene,
    x: &MltPath,
    kept: Kept,
    s: usize,
    added: usize,
    u: &mut RandomStream,
) -> Option<MltPath> {
    let n = kept.light + kept.sensor + added;
    let t = n - s;
    let mut light: Vec<Vertex> = Vec::with_capacity(n);
    light.extend_from_slice(&x.vertices()[..kept.light]);
    // x_k first.
    let mut sensor: Vec<Vertex> = x.vertices().iter().rev().take(kept.sensor).copied().collect();
    extend_sensor(scene, &mut sensor, t, s == 0, u)?;
    if s == 1 && kept.light == 0 && t >= 2 {
        let reference = sensor[t - 1].position()?;
        light.push(scene.sample_direct(reference, u.next(), u.next2())?.vertex);
    } else {
        extend_light(scene, &mut light, s, t == 0, u)?;
    }
    if s > 0 && t > 0 {
        let (y, z) = (light[s - 1], sensor[t - 1]);
        // An emitter far away and the eye of a beam that does not meet: no edge.
        if y.position().is_none() && z.position().is_none() {
            return None;
        }
        light.extend(sensor.iter().rev());
        // What carries nothing needs no ray. A delta vertex at the connection carries nothing, though it may have a lobe on that side.
        let path = MltPath::new(scene, light).filter(|path| path.samplable(s))?;
        return scene.visible(&y, &z).then_some(path);
    }
    light.extend(sensor.iter().rev());
    MltPath::new(scene, light)
}

/// Extends a sensor subpath x_k, x_{k−1}, … to `t` vertices, the last of them on an emitter if `to_emitter`.
fn extend_sensor(
    scene: &Scene,
    sensor: &mut Vec<Vertex>,
    t: usize,
    to_emitter: bool,
    u: &mut RandomStream,
) -> Option<()> {
    let lens = scene.sensor();
    if sensor.is_empty() && t > 0 {
        let (vertex, _) = lens.sample_vertex(if lens.is_pinhole() { [0.0; 2] } else { u.next2() });
        sensor.push(vertex);
    }
    while sensor.len() < t {
        let ray = match sensor.as_slice() {
            [Vertex::Sensor { p, .. }] => {
                let film = lens.film_point(u.next2());
                Ray::new(*p, lens.direction(*p, film))
            }
            [.., before, Vertex::Surface(point)] => {
                let from = before.direction_from(point.p);
                let (lobe, d) = (u.next(), u.next2());
                let mode = TransportMode::Radiance;
                point.spawn(scene.sample_scatter(point, from, mode, lobe, d)?.direction)
            }
            _ => return None,
        };
        let last = to_emitter && sensor.len() + 1 == t;
        sensor.push(match scene.intersect(&ray) {
            Some(point) => Vertex::Surface(point),
            None if last => emission::background(scene, ray.d)?,
            None => return None,
        });
    }
    Some(())
}

/// Extends a light subpath x₀, x₁, … to `s` vertices, the last of them on the lens if `to_lens`.
fn extend_light(
    scene: &Scene,
    light: &mut Vec<Vertex>,
    s: usize,
    to_lens: bool,
    u: &mut RandomStream,
) -> Option<()> {
    let mut first = None;
    if light.is_empty() && s > 0 {
        let emission = scene.sample_emission(u.next(), u.next2(), u.next2())?;
        light.push(emission.vertex);
        first = Some(emission.ray);
    }
    while light.len() < s {
        let ray = match light.as_slice() {
            [x0] => match first {
                Some(ray) => ray,
                None => emission::ray_from(scene, x0, u.next2())?,
            },
            [.., before, Vertex::Surface(point)] => {
                let from = before.direction_from(point.p);
                let (lobe, d) = (u.next(), u.next2());
                let mode = TransportMode::Importance;
                point.spawn(scene.sample_scatter(point, from, mode, lobe, d)?.direction)
            }
            _ => return None,
        };
        let hit = scene.intersect(&ray);
        let vertex = if to_lens && light.len() + 1 == s {
            let length = hit.map_or(f32::INFINITY, |h| h.p.distance(ray.o));
            on_lens(scene, &ray, length)?
        } else {
            Vertex::Surface(hit?)
        };
        light.push(vertex);
    }
    Some(())
}

/// Where a ray crosses the lens before `length`.
fn on_lens(scene: &Scene, ray: &Ray, length: f32) -> Option<Vertex> {
    let p: Vec3 = scene.sensor().hit_lens(ray, length)?;
    Some(Vertex::Sensor { p, n: scene.sensor().axis() })
}
