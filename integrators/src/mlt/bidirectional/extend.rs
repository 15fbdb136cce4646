//! New vertices from either side, and the connection.

use glam::Vec3;
use pathspace_core::Scene;
use pathspace_core::bsdf::{Event, TransportMode};
use pathspace_core::color::Rgb;
use pathspace_core::math::Ray;
use pathspace_core::path::{Path, Vertex};
use pathspace_core::random::{PrimarySample, RandomStream};
use pathspace_core::walk;

use super::super::emission;
use super::super::mutator::Kept;
use super::super::path::MltPath;

/// The path that keeps `kept` of `x` and has `added` new vertices between, those up to x_{s−1}
/// sampled from the emitter side, the others from the sensor side; `None` where a walk ends early,
/// hits what it should not, or is hidden from the other.
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
    let mut light = Part::new(x, 0..kept.light, n);
    // x_k first.
    let all = x.vertices().len();
    let mut sensor = Part::new(x, (all - kept.sensor..all).rev(), n);
    extend_sensor(scene, &mut sensor, t, s == 0, u)?;
    if s == 1 && kept.light == 0 && t >= 2 {
        let reference = sensor.vertices[t - 1].position()?;
        light.push(scene.sample_direct(reference, u.next(), u.next2())?.vertex);
    } else {
        extend_light(scene, &mut light, s, t == 0, u)?;
    }
    // Both ends of the connection, or what was hit.
    let (y, z) = (light.end(), sensor.end());
    light.vertices.extend(sensor.vertices.iter().rev());
    light.events.extend(sensor.events.iter().rev());
    let path = Path::new(light.vertices, light.events);
    let (Some(y), Some(z)) = (y, z) else { return MltPath::new(scene, path) };
    // An emitter far away and the eye of a beam that does not meet: no edge.
    if y.position().is_none() && z.position().is_none() {
        return None;
    }
    // What carries nothing needs no ray.
    let path = MltPath::new(scene, path).filter(|path| path.samplable(s))?;
    scene.visible(&y, &z).then_some(path)
}

/// Vertices from one end of a path on and what happens at them, in the order of a walk.
struct Part {
    vertices: Vec<Vertex>,
    events: Vec<Event>,
}

impl Part {
    /// The vertices of `x` with these indices, with room for `room`.
    fn new(x: &MltPath, kept: impl Iterator<Item = usize>, room: usize) -> Self {
        let mut part =
            Part { vertices: Vec::with_capacity(room), events: Vec::with_capacity(room) };
        for i in kept {
            part.vertices.push(x.vertices()[i]);
            part.events.push(x.event(i));
        }
        part
    }

    fn push(&mut self, vertex: Vertex) {
        self.vertices.push(vertex);
        self.events.push(Event::NonSpecular);
    }

    /// The last vertex, if there is one, with the event that a connection needs.
    fn end(&mut self) -> Option<Vertex> {
        *self.events.last_mut()? = Event::NonSpecular;
        self.vertices.last().copied()
    }

    /// Draws an event at the last vertex, a surface that the walk came to, and gives the ray on.
    fn scatter(&mut self, scene: &Scene, mode: TransportMode, u: &mut RandomStream) -> Option<Ray> {
        let [.., before, last] = self.vertices.as_slice() else { return None };
        let from = before.direction_from(last.position()?);
        let (edge, sample) = walk::scatter(scene, last, from, Rgb::WHITE, mode, false, u)?;
        *self.events.last_mut()? = sample.event;
        Some(edge.ray)
    }
}

/// Extends a sensor subpath x_k, x_{k−1}, … to `t` vertices, the last of them on an emitter if
/// `to_emitter`.
fn extend_sensor(
    scene: &Scene,
    sensor: &mut Part,
    t: usize,
    to_emitter: bool,
    u: &mut RandomStream,
) -> Option<()> {
    let lens = scene.sensor();
    if sensor.vertices.is_empty() && t > 0 {
        let (vertex, _) = lens.sample_vertex(if lens.is_pinhole() { [0.0; 2] } else { u.next2() });
        sensor.push(vertex);
    }
    while sensor.vertices.len() < t {
        let ray = match sensor.vertices.as_slice() {
            [Vertex::Sensor { p, .. }] => {
                let film = lens.film_point(u.next2());
                Ray::new(*p, lens.direction(*p, film))
            }
            _ => sensor.scatter(scene, TransportMode::Radiance, u)?,
        };
        let last = to_emitter && sensor.vertices.len() + 1 == t;
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
    light: &mut Part,
    s: usize,
    to_lens: bool,
    u: &mut RandomStream,
) -> Option<()> {
    let mut first = None;
    if light.vertices.is_empty() && s > 0 {
        let emission = scene.sample_emission(u.next(), u.next2(), u.next2())?;
        light.push(emission.vertex);
        first = Some(emission.ray);
    }
    while light.vertices.len() < s {
        let ray = match light.vertices.as_slice() {
            [x0] => match first {
                Some(ray) => ray,
                None => emission::ray_from(scene, x0, u.next2())?,
            },
            _ => light.scatter(scene, TransportMode::Importance, u)?,
        };
        let hit = scene.intersect(&ray);
        let vertex = if to_lens && light.vertices.len() + 1 == s {
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
