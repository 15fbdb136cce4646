//! Light and sensor subpaths, with what the weights need at every vertex.

use pathspace::core::Scene;
use pathspace::core::bsdf::TransportMode;
use pathspace::core::color::Rgb;
use pathspace::core::emitter::NextDensity;
use pathspace::core::glam::{Vec2, Vec3};
use pathspace::core::math::Ray;
use pathspace::core::measure::{Area, Density};
use pathspace::core::path::{Vertex, WalkClass};
use pathspace::core::random::PrimarySample;

use crate::weight::Weights;

/// A vertex of a subpath.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SubpathVertex {
    /// The vertex.
    pub vertex: Vertex,
    /// f/p of everything before the scattering here, emitted radiance or importance included.
    pub throughput: Rgb,
    /// Unit direction towards the vertex before.
    pub from: Vec3,
    /// True where a connection may end here.
    pub connectible: bool,
    /// True where a merge may happen here: surfaces that spread light, not the ends of the path.
    pub merges: bool,
    /// p of this vertex given the ones before, roulette included.
    pub pdf: Density<Area>,
    /// Surface vertices up to and including this one.
    pub class: WalkClass,
    /// K_{j−1} at v_j (`weight`).
    pub running: f64,
    /// d_1 at x₁ of a light subpath, else 1.
    pub direct: f64,
}

impl SubpathVertex {
    /// v₀: x₀ or the point on the lens.
    pub(crate) fn first(vertex: Vertex, pdf: Density<Area>, throughput: Rgb) -> Self {
        SubpathVertex {
            vertex,
            throughput,
            from: Vec3::ZERO,
            connectible: true,
            merges: false,
            pdf,
            class: WalkClass::default(),
            running: 0.0,
            direct: 1.0,
        }
    }
}

/// An edge of a walk before it is known where it ends.
pub(crate) struct OpenEdge {
    pub ray: Ray,
    pub throughput: Rgb,
    pub next: NextDensity,
}

/// A light subpath x₀, x₁, …
#[derive(Default)]
pub(crate) struct LightSubpath {
    pub vertices: Vec<SubpathVertex>,
    pub emitter: u32,
}

/// A sensor subpath x_k, x_{k−1}, …
pub(crate) struct SensorSubpath {
    pub film: Vec2,
    pub vertices: Vec<SubpathVertex>,
}

/// How walks go.
#[derive(Clone, Copy)]
pub(crate) struct Walks<'a> {
    pub scene: &'a Scene,
    pub weights: Weights,
    /// Longest path in edges.
    pub max_length: usize,
}

impl Walks<'_> {
    /// Samples x_k, x_{k−1}, …; the last vertex may lie on the environment.
    pub(crate) fn sensor<U: PrimarySample>(
        &self,
        pixel: Option<[u32; 2]>,
        u: &mut U,
    ) -> SensorSubpath {
        let sensor = self.scene.sensor();
        let on_film = u.next2();
        let sample = sensor.sample(pixel, on_film, self.lens(u));
        let mut vertices =
            vec![SubpathVertex::first(sample.vertex, sensor.pdf_vertex(), Rgb::WHITE)];
        let next = NextDensity::Direction(sensor.pdf_direction(sample.ray.d));
        let first = OpenEdge { ray: sample.ray, throughput: Rgb::WHITE, next };
        let mode = TransportMode::Radiance;
        let left = self.walk(mode, &mut vertices, self.max_length + 1, 0.0, first, u);
        if let (Some(edge), Some(emitter)) = (left, self.scene.emitters().background()) {
            let vertex = Vertex::InfiniteEmitter { emitter, to: edge.ray.d };
            self.push(mode, &mut vertices, vertex, false, 0.0, &edge);
        }
        SensorSubpath { film: sample.film, vertices }
    }

    /// Samples x₀, x₁, …
    pub(crate) fn light<U: PrimarySample>(&self, u: &mut U) -> LightSubpath {
        let (pick, position, direction) = (u.next(), u.next2(), u.next2());
        let Some(emission) = self.scene.sample_emission(pick, position, direction) else {
            return LightSubpath::default();
        };
        let emitter = emission.emitter;
        let throughput = emission.radiance * (1.0 / emission.pdf.value()) as f32;
        let mut vertices = vec![SubpathVertex::first(emission.vertex, emission.pdf, throughput)];
        let first =
            OpenEdge { ray: emission.ray, throughput: emission.throughput(), next: emission.next };
        let mode = TransportMode::Importance;
        let start = self.start(emitter);
        // The last vertex of the longest light subpath is seen by the sensor itself.
        self.walk(mode, &mut vertices, self.max_length, start, first, u);
        LightSubpath { vertices, emitter }
    }

    /// K₀ of light subpaths: 1 where s = 0 can make the path.
    pub(crate) fn start(&self, emitter: u32) -> f64 {
        f64::from(!self.scene.emitters().get(emitter).is_delta())
    }

    /// Numbers for a point of the lens, none for a pinhole.
    pub(crate) fn lens<U: PrimarySample>(&self, u: &mut U) -> [f32; 2] {
        if self.scene.sensor().is_pinhole() { [0.0; 2] } else { u.next2() }
    }

    /// Extends a subpath that holds v₀ until it ends, and returns the edge that left the scene, if it ended so with room for a vertex. Roulette
    /// plays at every surface and depends on the event alone, so that both walks know each other's.
    fn walk<U: PrimarySample>(
        &self,
        mode: TransportMode,
        subpath: &mut Vec<SubpathVertex>,
        max_vertices: usize,
        start: f64,
        mut edge: OpenEdge,
        u: &mut U,
    ) -> Option<OpenEdge> {
        while !edge.throughput.is_black() && subpath.len() < max_vertices {
            let Some(point) = self.scene.intersect(&edge.ray) else { return Some(edge) };
            let from = -edge.ray.d;
            let spreads = !self.scene.is_delta_at(&point, from);
            if !self.push(mode, subpath, Vertex::Surface(point), spreads, start, &edge) {
                return None;
            }
            let (lobe, direction) = (u.next(), u.next2());
            let sample = self.scene.sample_scatter(&point, from, mode, lobe, direction)?;
            let q = sample.survival;
            if u.next() as f64 >= q.value() {
                return None;
            }
            edge = OpenEdge {
                ray: point.spawn(sample.direction),
                throughput: edge.throughput * sample.weight * (1.0 / q.value()) as f32,
                next: NextDensity::Direction(sample.pdf * q),
            };
        }
        None
    }

    /// Adds the vertex that `edge` ends on. False, and nothing added, where its density is 0: seen from the rounded vertices the edge
    /// lies in a surface.
    pub(crate) fn push(
        &self,
        mode: TransportMode,
        subpath: &mut Vec<SubpathVertex>,
        vertex: Vertex,
        spreads: bool,
        start: f64,
        edge: &OpenEdge,
    ) -> bool {
        let (n, d) = (subpath.len(), edge.ray.d);
        let last = &subpath[n - 1];
        let pdf = edge.next.to_area(&last.vertex.edge_to(&vertex));
        if pdf.is_zero() {
            return false;
        }
        let (mut running, mut direct) = (start, 1.0);
        if n >= 2 {
            let before = &subpath[n - 2];
            let opposite = self.opposite(mode, last, before, d);
            running = self.weights.arrive(before, last, last.connectible, last.direct, opposite);
        } else if mode == TransportMode::Importance
            && let Some(p) = vertex.position()
        {
            direct = self.scene.pdf_direct(p, &last.vertex) / last.pdf;
        }
        let mut class = last.class;
        class.push(spreads);
        subpath.push(SubpathVertex {
            vertex,
            throughput: edge.throughput,
            from: -d,
            connectible: spreads,
            merges: spreads,
            pdf,
            class,
            running,
            direct,
        });
        true
    }

    /// p′ of `before`: the walk of the other side, which came to `last` from direction `d` ahead, goes on to it.
    fn opposite(
        &self,
        mode: TransportMode,
        last: &SubpathVertex,
        before: &SubpathVertex,
        d: Vec3,
    ) -> Density<Area> {
        let mode = match mode {
            TransportMode::Radiance => TransportMode::Importance,
            TransportMode::Importance => TransportMode::Radiance,
        };
        let Vertex::Surface(point) = &last.vertex else { return Density::ZERO };
        match self.scene.scatter_event(point, d, last.from, mode) {
            Some((pdf, q)) => last.vertex.edge_to(&before.vertex).to_area(pdf * q),
            None => Density::ZERO,
        }
    }
}
