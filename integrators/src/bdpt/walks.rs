//! Both subpaths of a sample, and the techniques that need only one of them.

use glam::Vec2;
use pathspace_core::Scene;
use pathspace_core::bsdf::TransportMode;
use pathspace_core::color::Rgb;
use pathspace_core::emitter::NextDensity;
use pathspace_core::film::Sink;
use pathspace_core::measure::Mass;
use pathspace_core::path::Vertex;
use pathspace_core::random::PrimarySample;

use super::Bdpt;
use super::connect::{Connector, first_vertex};
use super::subpath::{OpenEdge, Subpath, WalkConfig};
use super::weight::Weights;

/// Vertices that most subpaths do not exceed: lists that grow copy them.
const ROOM: usize = 8;

/// Walks that only their own roulette ends.
pub(super) fn always(_: Mass) -> bool {
    true
}

/// How the walks of one integrator go in one scene.
pub(super) struct Walks {
    /// Longest path in edges.
    pub max: usize,
    pinhole: bool,
    light: WalkConfig,
    sensor: WalkConfig,
}

/// A light subpath y₀ = x₀, y₁, …
#[derive(Default)]
pub(super) struct LightSubpath {
    pub vertices: Subpath,
    pub emitter: u32,
}

/// A sensor subpath z₀ = x_k, z₁, …
pub(super) struct SensorSubpath {
    pub film: Vec2,
    pub vertices: Subpath,
    /// The edge that left the scene.
    escaped: Option<OpenEdge>,
}

impl Walks {
    pub(super) fn new(bdpt: &Bdpt, scene: &Scene) -> Self {
        let pinhole = scene.sensor().is_pinhole();
        let max = bdpt.max_length.map_or(usize::MAX / 4, |k| k as usize);
        let config = |mode, max_vertices| WalkConfig {
            mode,
            max_vertices,
            roulette: bdpt.roulette,
            weights: Weights::new(bdpt.heuristic, bdpt.techniques, pinhole, false),
        };
        Walks {
            max,
            pinhole,
            // A lens is met by the edge after vertex max − 1: a walk that ends there would not trace it.
            light: config(
                TransportMode::Importance,
                (max + usize::from(!pinhole)).min(bdpt.techniques.max_s()),
            ),
            sensor: config(TransportMode::Radiance, (max + 1).min(bdpt.techniques.max_t())),
        }
    }

    /// Ends the walks at exactly s and t vertices.
    pub(super) fn restrict(&mut self, s: usize, t: usize) {
        self.max = s + t - 1;
        self.light.max_vertices = s;
        self.sensor.max_vertices = t;
    }

    /// The maker of contributions for a camera sample at `film`.
    pub(super) fn connector<'a, S: Sink>(
        &self,
        scene: &'a Scene,
        sink: &'a mut S,
        film: Vec2,
    ) -> Connector<'a, S> {
        Connector { scene, sink, film, light: self.light, sensor: self.sensor }
    }

    pub(super) fn sensor_subpath<U: PrimarySample>(
        &self,
        scene: &Scene,
        pixel: Option<[u32; 2]>,
        u: &mut U,
        goes_on: impl FnMut(Mass) -> bool,
    ) -> SensorSubpath {
        let sensor = scene.sensor();
        let on_film = u.next2();
        let sample = sensor.sample(pixel, on_film, self.lens(u));
        let mut vertices = Vec::with_capacity(ROOM.min(self.sensor.max_vertices));
        vertices.push(first_vertex(sample.vertex, sensor.pdf_vertex()));
        let first = OpenEdge {
            ray: sample.ray,
            throughput: Rgb::WHITE,
            next: NextDensity::Direction(sensor.pdf_direction(sample.ray.d)),
        };
        let walks = self.max >= 1 && self.sensor.max_vertices >= 2;
        let escaped = if walks {
            self.sensor.walk(scene, &mut vertices, first, u, |_, _, _| (), goes_on)
        } else {
            None
        };
        SensorSubpath { film: sample.film, vertices, escaped }
    }

    /// Technique t = 0 is made on the way: the lens is no surface of the scene.
    pub(super) fn light_subpath<U: PrimarySample, S: Sink>(
        &self,
        connector: &mut Connector<'_, S>,
        u: &mut U,
        goes_on: impl FnMut(Mass) -> bool,
    ) -> LightSubpath {
        let scene = connector.scene;
        let Some(emission) = scene.sample_emission(u.next(), u.next2(), u.next2()) else {
            return LightSubpath::default();
        };
        let emitter = emission.emitter;
        connector.begin_light(emitter);
        let walk = connector.light;
        let mut vertices = Vec::with_capacity(ROOM.min(walk.max_vertices));
        if walk.max_vertices >= 1 {
            let mut x0 = first_vertex(emission.vertex, emission.pdf);
            x0.throughput = emission.radiance * (1.0 / emission.pdf.value()) as f32;
            vertices.push(x0);
            let first = OpenEdge {
                ray: emission.ray,
                throughput: emission.throughput(),
                next: emission.next,
            };
            if walk.max_vertices == 1 && self.pinhole {
                return LightSubpath { vertices, emitter };
            }
            let on_edge = |light: &mut Subpath, edge: &OpenEdge, length| {
                if self.pinhole || light.len() > self.max {
                    return;
                }
                let Some(p) = scene.sensor().hit_lens(&edge.ray, length) else { return };
                let lens = Vertex::Sensor { p, n: scene.sensor().axis() };
                if walk.push(scene, light, lens, edge, true) {
                    connector.hit_lens(light, emitter, edge.ray.d);
                    light.pop();
                }
            };
            walk.walk(scene, &mut vertices, first, u, on_edge, goes_on);
        }
        LightSubpath { vertices, emitter }
    }

    /// Technique t = 1 for every s.
    pub(super) fn onto_film<U: PrimarySample, S: Sink>(
        &self,
        connector: &mut Connector<'_, S>,
        light: &LightSubpath,
        u: &mut U,
    ) {
        for n in 1..=light.vertices.len().min(self.max) {
            let on_lens = self.lens(u);
            if light.vertices[n - 1].connectible {
                connector.onto_film(&light.vertices[..n], light.emitter, on_lens);
            }
        }
    }

    /// Technique s = 0 for every t.
    pub(super) fn hit_emitters<S: Sink>(
        &self,
        connector: &mut Connector<'_, S>,
        sensor: &mut SensorSubpath,
    ) {
        for n in 2..=sensor.vertices.len() {
            connector.hit_emitter(&sensor.vertices[..n]);
        }
        self.hit_background(connector, sensor);
    }

    /// Technique s = 0 for the whole walk of `t` vertices alone.
    pub(super) fn hit_with_all<S: Sink>(
        &self,
        connector: &mut Connector<'_, S>,
        sensor: &mut SensorSubpath,
        t: usize,
    ) {
        if sensor.vertices.len() == t {
            connector.hit_emitter(&sensor.vertices);
        } else if sensor.vertices.len() + 1 == t {
            self.hit_background(connector, sensor);
        }
    }

    fn hit_background<S: Sink>(
        &self,
        connector: &mut Connector<'_, S>,
        sensor: &mut SensorSubpath,
    ) {
        if let Some(edge) = &sensor.escaped
            && sensor.vertices.len() < self.sensor.max_vertices
            && let Some(emitter) = connector.scene.emitters().background()
        {
            let vertex = Vertex::InfiniteEmitter { emitter, to: edge.ray.d };
            if self.sensor.push(connector.scene, &mut sensor.vertices, vertex, edge, false) {
                connector.hit_emitter(&sensor.vertices);
                sensor.vertices.pop();
            }
        }
    }

    /// Numbers for a point of the lens, none for a pinhole.
    pub(super) fn lens<U: PrimarySample>(&self, u: &mut U) -> [f32; 2] {
        if self.pinhole { [0.0; 2] } else { u.next2() }
    }
}
