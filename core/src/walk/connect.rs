//! Every technique (s, t): a path out of a light and a sensor subpath, f/p without visibility, and
//! what its weight needs.
//!
//! | technique | s, t | f/p | x₀ … x_{s−1} and x_s … x_k come from |
//! | --- | --- | --- | --- |
//! | hit of an emitter | s = 0 | α_z L_e | the sensor subpath alone |
//! | next-event estimation | s = 1 | α_z f̄ G V L_e / p_direct | [`WalkVertex::next_event`] |
//! | light tracing | t = 1 | α_y f̄ G V W_e / p_lens | [`WalkVertex::on_lens`] |
//! | hit of the lens | t = 0 | α_y W_e | the light subpath alone |
//! | connection | s, t ≥ 2 | α_y f̄ G V f̄ α_z | both |
//!
//! α is the throughput of Veach 1997, §10.2.1: everything before the scattering at a subpath's last
//! vertex over its density.

use glam::Vec2;

use super::start::Walks;
use super::subpath::{Walk, WalkVertex};
use super::verify::verify;
use super::weight::Side;
use crate::color::Rgb;
use crate::film::{Contribution, Sink};
use crate::measure::{Area, Density, Edge, Mass, SolidAngle};
use crate::path::{Origin, Path, PathRecord, Technique, TwoWayScatter, Vertex, WalkClass};
use crate::scene::DirectSample;
use crate::scene::Scene;

/// A path made by one technique, visibility of its connecting edge not looked at yet.
#[derive(Clone, Copy)]
pub struct Connection<'a> {
    /// f/p without V.
    pub value: Rgb,
    /// Where the path lands on the film: known for t ≤ 1, else the film position of the sensor
    /// subpath.
    pub film: Option<Vec2>,
    /// Index of the emitter.
    pub emitter: u32,
    origin: Origin,
    light: Side<'a>,
    sensor: Side<'a>,
    /// d of the technique itself ([`super::weight`]).
    own: f64,
}

impl WalkVertex {
    /// x₀ of next-event estimation: sampled for the vertex that it is connected to.
    pub fn next_event(scene: &Scene, direct: &DirectSample) -> Self {
        let emission = scene.pdf_emission_vertex(&direct.vertex);
        let mut x0 = WalkVertex::first(direct.vertex, emission);
        x0.throughput = Rgb::WHITE * (1.0 / direct.pdf.value()) as f32;
        x0.weight.direct = direct.pdf / emission;
        x0
    }

    /// x_k of light tracing: a point of the lens, sampled with density `pdf`.
    pub fn on_lens(vertex: Vertex, pdf: Density<Area>) -> Self {
        WalkVertex::first(vertex, pdf)
    }
}

/// Joins the first `s` vertices of a light subpath and the first `t` of a sensor subpath. `None`
/// where the technique does not take part, can not make the path or the path carries nothing;
/// visibility is the caller's ([`Connection::is_visible`]).
///
/// For s = 1 with t ≥ 2 the light subpath is one vertex of [`WalkVertex::next_event`]; for t = 1
/// the sensor subpath is one of [`WalkVertex::on_lens`].
#[inline]
pub fn connect<'a>(
    scene: &Scene,
    walks: &Walks,
    light: &'a [WalkVertex],
    sensor: &'a [WalkVertex],
) -> Option<Connection<'a>> {
    let (s, t) = (light.len(), sensor.len());
    if !walks.light.weights.takes_part(s, t) || s + t < 2 {
        return None;
    }
    let x0 = light.first().or(sensor.last())?;
    let emitter = x0.vertex.emitter()?;
    let origin = Origin::from(scene.emitters().get(emitter));
    // A delta emitter has no image: it is never seen directly.
    if s + t == 2 && origin.delta {
        return None;
    }
    match (s, t) {
        (0, _) => hit_emitter(scene, sensor, emitter, origin),
        (_, 0) => hit_lens(scene, light, emitter, origin),
        _ => join(scene, walks, light, sensor, emitter, origin),
    }
}

/// s = 0: the last vertex of the sensor subpath lies on the emitter.
fn hit_emitter<'a>(
    scene: &Scene,
    sensor: &'a [WalkVertex],
    emitter: u32,
    origin: Origin,
) -> Option<Connection<'a>> {
    let [.., x1, x0] = sensor else { return None };
    let radiance = scene.emitted_from(&x0.vertex, x0.from);
    if radiance.is_black() {
        return None;
    }
    let emission = scene.pdf_emission_vertex(&x0.vertex);
    let direct = match x1.vertex.position() {
        Some(p) if sensor.len() >= 3 => scene.pdf_direct(p, &x0.vertex) / emission,
        _ => 1.0,
    };
    let side = Side {
        vertices: sensor,
        last: emission,
        before: arriving(
            scene,
            &x1.vertex,
            x0.transmittance,
            scene.pdf_emission_next(&x0.vertex, &x0.vertex.edge_to(&x1.vertex)),
        ),
        connectible: true,
        merges: false,
        direct,
    };
    Some(Connection {
        value: x0.throughput * radiance,
        film: None,
        emitter,
        origin,
        light: Side::empty(),
        sensor: side,
        own: 1.0,
    })
}

/// t = 0: the last vertex of the light subpath lies on the lens.
fn hit_lens<'a>(
    scene: &Scene,
    light: &'a [WalkVertex],
    emitter: u32,
    origin: Origin,
) -> Option<Connection<'a>> {
    let sensor = scene.sensor();
    let [.., before, lens] = light else { return None };
    let into_scene = lens.from;
    let film = sensor.film_position(lens.vertex.position()?, into_scene)?;
    let side = Side {
        vertices: light,
        last: sensor.pdf_vertex(),
        before: lens.back_to(scene, &before.vertex, sensor.pdf_direction(into_scene)),
        connectible: true,
        merges: false,
        // A path of one edge has no next-event estimation.
        direct: 1.0,
    };
    Some(Connection {
        value: lens.throughput * sensor.importance(into_scene) as f32,
        film: Some(film),
        emitter,
        origin,
        light: side,
        sensor: Side::empty(),
        own: 1.0,
    })
}

/// What one end of a connecting edge sends along it.
struct Sent {
    /// f̄ at an inner vertex, L_e at x₀.
    value: Rgb,
    /// W_e/p at the lens, else 1.
    importance: f64,
    /// Density of the other end by the walk that came here.
    on: Density<Area>,
    /// Density by the opposite walk of the vertex before this end.
    before: Density<Area>,
}

/// s ≥ 1 and t ≥ 1: the edge between the last vertices of both subpaths.
fn join<'a>(
    scene: &Scene,
    walks: &Walks,
    light: &'a [WalkVertex],
    sensor: &'a [WalkVertex],
    emitter: u32,
    origin: Origin,
) -> Option<Connection<'a>> {
    let (y, z) = (light.last()?, sensor.last()?);
    if !y.connectible || !z.connectible {
        return None;
    }
    let edge = y.vertex.edge_to(&z.vertex);
    let back = z.vertex.edge_to(&y.vertex);
    let through = scene.transmittance(&y.vertex, &z.vertex);
    let mut film = None;
    let at_z = match sensor {
        [lens] => {
            let into_scene = back.direction();
            let Vertex::Sensor { p, .. } = lens.vertex else { return None };
            film = Some(scene.sensor().film_position(p, into_scene)?);
            Sent {
                value: Rgb::WHITE,
                importance: scene.sensor().importance(into_scene) / lens.pdf.value(),
                on: arriving(
                    scene,
                    &y.vertex,
                    through,
                    back.to_area(scene.sensor().pdf_direction(into_scene)),
                ),
                before: Density::ZERO,
            }
        }
        _ => scattered(scene, &walks.sensor, sensor, (&back, &y.vertex, through))?,
    };
    let next_event = light.len() == 1 && sensor.len() >= 2;
    let at_y = match light {
        [x0] => {
            let emitted = scene.emitted_from(&x0.vertex, edge.direction());
            if emitted.is_black() {
                return None;
            }
            Sent {
                value: emitted,
                importance: 1.0,
                on: arriving(scene, &z.vertex, through, scene.pdf_emission_next(&x0.vertex, &edge)),
                before: Density::ZERO,
            }
        }
        _ => scattered(scene, &walks.light, light, (&edge, &z.vertex, through))?,
    };
    let g = edge.geometry_term();
    // Next-event estimation divides by the density that x₀ was sampled with, p_direct =
    // d·p_emission.
    let (own, value) = match (light, sensor) {
        ([x0], _) if next_event => {
            let own = x0.weight.direct;
            let factor = g / (own * x0.pdf.value());
            (own, z.throughput * at_z.value * at_y.value * factor as f32)
        }
        (_, [_]) => (1.0, y.throughput * at_y.value * (g * at_z.importance) as f32),
        _ => (1.0, y.throughput * at_y.value * at_z.value * z.throughput * g as f32),
    };
    let value = if scene.has_media() { value * through } else { value };
    if value.is_black() {
        return None;
    }
    let (s, t) = (light.len(), sensor.len());
    let light = Side {
        vertices: light,
        last: at_z.on,
        before: at_y.before,
        connectible: true,
        merges: s >= 2,
        direct: if next_event { 1.0 } else { y.weight.direct },
    };
    let sensor = Side {
        vertices: sensor,
        last: at_y.on,
        before: at_z.before,
        connectible: true,
        merges: t >= 2,
        direct: 1.0,
    };
    Some(Connection { value, film, emitter, origin, light, sensor, own })
}

/// An inner vertex at the end of the connecting edge, which leads to a vertex through the
/// transmittance T.
fn scattered(
    scene: &Scene,
    walk: &Walk,
    subpath: &[WalkVertex],
    (edge, to, through): (&Edge, &Vertex, Rgb),
) -> Option<Sent> {
    let [.., before, last] = subpath else { return None };
    let scatter = scene.connect_at(&last.vertex, last.from, edge.direction(), walk.mode)?;
    let (forward, backward) = walk.two_ways(&scatter, subpath.len() - 1);
    Some(Sent {
        value: scatter.value,
        importance: 1.0,
        on: arriving(scene, to, through, edge.to_area(forward)),
        before: last.back_to(scene, &before.vertex, backward),
    })
}

/// The density of a vertex with that of the free flight there.
#[inline]
fn arriving(scene: &Scene, end: &Vertex, through: Rgb, pdf: Density<Area>) -> Density<Area> {
    if scene.has_media() { pdf.times(scene.flight_density(end, through)) } else { pdf }
}

impl Walk {
    /// Forward and backward density at vertex `index` with this walk's roulette.
    fn two_ways(
        &self,
        scatter: &TwoWayScatter,
        index: usize,
    ) -> (Density<SolidAngle>, Density<SolidAngle>) {
        let q = |plays: bool, q: Mass| if plays { q } else { Mass::ONE };
        (
            scatter.forward * q(self.roulette(index), scatter.survival_forward),
            scatter.backward * q(self.roulette(1), scatter.survival_backward),
        )
    }
}

impl<'a> Connection<'a> {
    /// The technique.
    pub fn technique(&self) -> Technique {
        Technique::new(self.light.vertices.len(), self.sensor.vertices.len())
    }

    /// V of the connecting edge; true for hits, whose edges were traced.
    pub fn is_visible(&self, scene: &Scene) -> bool {
        match (self.light.vertices.last(), self.sensor.vertices.last()) {
            (Some(y), Some(z)) => scene.visible(&y.vertex, &z.vertex),
            _ => true,
        }
    }

    /// w_{s,t} by the running sums of both subpaths.
    pub fn weight(&self, scene: &Scene, walks: &Walks) -> f64 {
        let weights = walks.light.weights.for_emitter(self.origin.delta);
        let weight = weights.weight(self.light, self.sensor, self.own);
        if cfg!(debug_assertions) {
            verify(scene, &walks.light, self.light.vertices, self.sensor.vertices, weight);
        }
        weight
    }

    /// The contribution with MIS weight `weight` and a factor (the inverse probability that this
    /// connection was picked). `film`: where the sensor subpath starts.
    pub fn contribution(
        &self,
        scene: &Scene,
        film: Vec2,
        weight: f64,
        factor: f32,
    ) -> Contribution {
        let class = |side: &Side<'_>, hit: bool| match side.vertices.last() {
            Some(v) if hit => v.class,
            Some(v) => v.class_at_connection(),
            None => WalkClass::default(),
        };
        let Technique { s, t } = self.technique();
        let (light, sensor) = (class(&self.light, t == 0), class(&self.sensor, s == 0));
        let pinhole = scene.sensor().is_pinhole();
        Contribution {
            film: self.film.unwrap_or(film),
            value: self.value * weight as f32 * factor,
            weight: weight as f32,
            s: s as u16,
            t: t as u16,
            emitter: self.emitter,
            families: WalkClass::join(&light, &sensor, self.origin, pinhole),
        }
    }

    /// Hands the [`Connection::contribution`] over, with its path where the sink records.
    pub fn emit<S: Sink>(&self, scene: &Scene, sink: &mut S, film: Vec2, weight: f64, factor: f32) {
        let contribution = self.contribution(scene, film, weight, factor);
        sink.add(contribution);
        if S::RECORDS_PATHS {
            let (light, sensor) = (self.light.vertices, self.sensor.vertices);
            let vertices = light.iter().chain(sensor.iter().rev());
            sink.record(PathRecord {
                path: joined(light, sensor),
                technique: self.technique(),
                ln_pdf: vertices.map(|v| v.pdf.value().ln()).sum::<f64>() + self.own.ln(),
                weight,
                value: contribution.value,
            });
        }
    }
}

/// The path of two subpaths: both last vertices are ends of the connection.
pub fn joined(light: &[WalkVertex], sensor: &[WalkVertex]) -> Path {
    let mut path = Path::default();
    for (side, reversed) in [(light, false), (sensor, true)] {
        let n = side.len();
        for j in 0..n {
            let j = if reversed { n - 1 - j } else { j };
            let event = if j + 1 == n { Default::default() } else { side[j].event };
            path.vertices.push(side[j].vertex);
            path.events.push(event);
        }
    }
    path
}
