//! Both subpaths of a sample: first vertices, the lens and the environment.

use glam::Vec2;

use super::connect::{Connection, connect};
use super::layout::emission_numbers;
use super::subpath::{OpenEdge, Subpath, Walk, WalkVertex};
use super::techniques::TechniqueSet;
use super::weight::Weights;
use crate::bsdf::TransportMode;
use crate::color::Rgb;
use crate::measure::Mass;
use crate::mis::Heuristic;
use crate::path::{Vertex, WalkRules};
use crate::random::PrimarySample;
use crate::scene::NextDensity;
use crate::scene::Scene;

/// Vertices that most subpaths do not exceed: lists that grow copy them.
const ROOM: usize = 8;

/// How the walks of one integrator go in one scene.
#[derive(Clone, Copy, Debug)]
pub struct Walks {
    /// Longest path in edges.
    pub max: usize,
    /// From an emitter.
    pub light: Walk,
    /// From the sensor.
    pub sensor: Walk,
    pinhole: bool,
}

/// A light subpath y₀ = x₀, y₁, …
#[derive(Clone, Debug, Default)]
pub struct LightSubpath {
    /// Its vertices.
    pub vertices: Subpath,
    /// Index of the emitter.
    pub emitter: u32,
}

/// A sensor subpath z₀ = x_k, z₁, …
#[derive(Clone, Debug)]
pub struct SensorSubpath {
    /// Film position in pixels.
    pub film: Vec2,
    /// Its vertices.
    pub vertices: Subpath,
    /// The edge that left the scene.
    pub escaped: Option<OpenEdge>,
}

impl Walks {
    /// Walks by `rules` for the techniques of a set, weighed by a heuristic.
    pub fn new(
        scene: &Scene,
        rules: &WalkRules,
        heuristic: Heuristic,
        techniques: TechniqueSet,
    ) -> Self {
        let pinhole = scene.sensor().is_pinhole();
        Walks::weighed(scene, rules, Weights::new(heuristic, techniques, pinhole, false))
    }

    /// Walks by `rules` with given weights.
    pub fn weighed(scene: &Scene, rules: &WalkRules, weights: Weights) -> Self {
        let pinhole = scene.sensor().is_pinhole();
        let techniques = weights.techniques;
        let max = rules.max_length.map_or(usize::MAX / 4, |k| k as usize);
        let walk =
            |mode, max_vertices| Walk { mode, max_vertices, rr_depth: rules.rr_depth, weights };
        Walks {
            max,
            pinhole,
            // A lens is met by the edge after vertex max − 1: a walk that ends there would not
            // trace it.
            light: walk(
                TransportMode::Importance,
                (max + usize::from(!pinhole)).min(techniques.max_s()),
            ),
            sensor: walk(TransportMode::Radiance, (max + 1).min(techniques.max_t())),
        }
    }

    /// Ends the walks at exactly s and t vertices.
    pub fn restrict(&mut self, s: usize, t: usize) {
        self.max = s + t - 1;
        self.light.max_vertices = s;
        self.sensor.max_vertices = t;
    }

    /// A sensor subpath; its film position lies in `pixel`, or anywhere in the crop window.
    pub fn sensor_subpath<U: PrimarySample>(
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
        vertices.push(WalkVertex::first(sample.vertex, sensor.pdf_vertex()));
        let next = NextDensity::Direction(sensor.pdf_direction(sample.ray.d));
        let first = OpenEdge::new(sample.ray, Rgb::WHITE, next);
        let walks = self.max >= 1 && self.sensor.max_vertices >= 2;
        let escaped = if walks {
            self.sensor.run(scene, &mut vertices, first, u, |_, _, _| (), goes_on)
        } else {
            None
        };
        SensorSubpath { film: sample.film, vertices, escaped }
    }

    /// A light subpath. `on_lens` takes the subpaths that end on a lens on the way (technique t =
    /// 0): the lens is no surface of the scene.
    pub fn light_subpath<U: PrimarySample>(
        &self,
        scene: &Scene,
        u: &mut U,
        mut on_lens: impl FnMut(&[WalkVertex]),
        goes_on: impl FnMut(Mass) -> bool,
    ) -> LightSubpath {
        let (pick, position, direction) = emission_numbers(u);
        let Some(emission) = scene.sample_emission(pick, position, direction) else {
            return LightSubpath::default();
        };
        let emitter = emission.emitter;
        let delta = scene.emitters().get(emitter).is_delta();
        let walk = Walk { weights: self.light.weights.for_emitter(delta), ..self.light };
        let mut vertices = Vec::with_capacity(ROOM.min(walk.max_vertices));
        if walk.max_vertices >= 1 {
            let mut x0 = WalkVertex::first(emission.vertex, emission.pdf);
            x0.throughput = Rgb::WHITE * (1.0 / emission.pdf.value()) as f32;
            vertices.push(x0);
            let first = OpenEdge::new(emission.ray, emission.throughput(), emission.next);
            if walk.max_vertices == 1 && self.pinhole {
                return LightSubpath { vertices, emitter };
            }
            let on_edge = |light: &mut Subpath, edge: &OpenEdge, length| {
                if self.pinhole || light.len() > self.max {
                    return;
                }
                let Some(p) = scene.sensor().hit_lens(&edge.ray, length) else { return };
                let lens = Vertex::Sensor { p, n: scene.sensor().axis() };
                let Some(last) = light.last() else { return };
                let edge = edge.through(scene, &last.vertex, &lens);
                if walk.push(scene, light, lens, &edge, true) {
                    on_lens(light);
                    light.pop();
                }
            };
            walk.run(scene, &mut vertices, first, u, on_edge, goes_on);
        }
        LightSubpath { vertices, emitter }
    }

    /// The subpath that ends on the environment, where the sensor subpath left the scene; call it
    /// last: the vertex is gone afterwards.
    pub fn on_background<R>(
        &self,
        scene: &Scene,
        sensor: &mut SensorSubpath,
        then: impl FnOnce(&[WalkVertex]) -> R,
    ) -> Option<R> {
        let edge = sensor.escaped.as_ref()?;
        let emitter = scene.emitters().background()?;
        if sensor.vertices.len() >= self.sensor.max_vertices {
            return None;
        }
        let vertex = Vertex::InfiniteEmitter { emitter, to: edge.ray.d };
        if !self.sensor.push(scene, &mut sensor.vertices, vertex, edge, false) {
            return None;
        }
        let result = then(&sensor.vertices);
        sensor.vertices.pop();
        Some(result)
    }

    /// Numbers for a point of the lens, none for a pinhole.
    pub fn lens<U: PrimarySample>(&self, u: &mut U) -> [f32; 2] {
        if self.pinhole { [0.0; 2] } else { u.next2() }
    }

    /// [`connect`] with these walks.
    #[inline]
    pub fn connect<'a>(
        &self,
        scene: &Scene,
        light: &'a [WalkVertex],
        sensor: &'a [WalkVertex],
    ) -> Option<Connection<'a>> {
        connect(scene, self, light, sensor)
    }
}
