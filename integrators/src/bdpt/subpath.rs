//! Light and sensor subpaths, with what the weights need at every vertex.

use glam::Vec3;
use pathspace_core::Scene;
use pathspace_core::bsdf::TransportMode;
use pathspace_core::color::Rgb;
use pathspace_core::emitter::NextDensity;
use pathspace_core::math::Ray;
use pathspace_core::measure::{Area, Density, Edge, End, Mass};
use pathspace_core::path::{Vertex, WalkClass};
use pathspace_core::random::PrimarySample;

use super::weight::{WeightState, Weights};

/// A vertex of a subpath.
#[derive(Clone, Copy, Debug)]
pub(super) struct SubpathVertex {
    /// The vertex.
    pub vertex: Vertex,
    /// Product of everything before the scattering here over its density; of the emitted radiance or the importance too.
    pub throughput: Rgb,
    /// Unit direction towards the vertex before.
    pub from: Vec3,
    /// True where a connection may end here.
    pub connectible: bool,
    /// Density of this vertex given the ones before, roulette included.
    pub pdf: Density<Area>,
    /// Surface vertices up to and including this one.
    pub class: WalkClass,
    /// Running sums of the weights.
    pub weight: WeightState,
}

/// Vertices in walk order: x₀, x₁, … or x_k, x_{k−1}, …
pub(super) type Subpath = Vec<SubpathVertex>;

/// What both walks share.
#[derive(Clone, Copy)]
pub(super) struct WalkConfig {
    pub mode: TransportMode,
    /// Vertices at most.
    pub max_vertices: usize,
    /// Roulette at every surface vertex, or none at all: a rule that depends on the index would make densities from the two
    /// sides depend on the length of the other subpath.
    pub roulette: bool,
    pub weights: Weights,
}

/// An edge of a walk, before it is known where it ends.
pub(super) struct OpenEdge {
    pub ray: Ray,
    pub throughput: Rgb,
    pub next: NextDensity,
}

impl WalkConfig {
    /// Extends a subpath that holds its first vertex along `edge` until it ends, and returns the edge that left the scene, if it ended so.
    /// `on_edge` sees every edge with its length before its end becomes a vertex. `goes_on` is asked after every scattering event, with the probability of local
    /// roulette: a way to end walks that is no part of their densities.
    pub(super) fn walk<U: PrimarySample>(
        &self,
        scene: &Scene,
        subpath: &mut Subpath,
        mut edge: OpenEdge,
        u: &mut U,
        mut on_edge: impl FnMut(&mut Subpath, &OpenEdge, f32),
        mut goes_on: impl FnMut(Mass) -> bool,
    ) -> Option<OpenEdge> {
        while !edge.throughput.is_black() {
            let hit = scene.intersect(&edge.ray);
            let length = hit.map_or(f32::INFINITY, |h| h.p.distance(edge.ray.o));
            on_edge(subpath, &edge, length);
            let Some(point) = hit else { return Some(edge) };
            if subpath.len() >= self.max_vertices {
                return None;
            }
            let from = -edge.ray.d;
            let connectible = !scene.is_delta_at(&point, from);
            if !self.push(scene, subpath, Vertex::Surface(point), &edge, connectible)
                || subpath.len() >= self.max_vertices
            {
                return None;
            }
            let (lobe, direction) = (u.next(), u.next2());
            let sample = scene.sample_scatter(&point, from, self.mode, lobe, direction)?;
            let q = if self.roulette { sample.survival } else { Mass::ONE };
            if self.roulette && u.next() as f64 >= q.value() {
                return None;
            }
            if !goes_on(sample.survival) {
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

    /// Adds the vertex that `edge` ends on, and tells the vertex before the last how likely the opposite walk makes it. False, and nothing
    /// added, where its density is 0: seen from the vertices as they were rounded, the edge lies in a surface. Only corners do that,
    /// at distances of an offset, and no weight could be given to such a path.
    pub(super) fn push(
        &self,
        scene: &Scene,
        subpath: &mut Subpath,
        vertex: Vertex,
        edge: &OpenEdge,
        connectible: bool,
    ) -> bool {
        let from = -edge.ray.d;
        let n = subpath.len();
        let last = &subpath[n - 1];
        let to_vertex = Edge::new(&last.vertex.end(), &vertex.end());
        let pdf = edge.next.to_area(&to_vertex);
        if pdf.is_zero() {
            return false;
        }
        let mut class = last.class;
        class.push(connectible);
        let backward = if n >= 2 {
            self.backward(scene, last, &subpath[n - 2].vertex, -from)
        } else {
            Density::ZERO
        };
        let weight = self.weights.extend(scene, self.mode, subpath, &vertex, backward);
        subpath.push(SubpathVertex {
            vertex,
            throughput: edge.throughput,
            from,
            connectible,
            pdf,
            class,
            weight,
        });
        true
    }

    /// Density with which the opposite walk, that came to `last` from direction `to`, goes on to the vertex before it.
    pub(super) fn backward(
        &self,
        scene: &Scene,
        last: &SubpathVertex,
        before: &Vertex,
        to: Vec3,
    ) -> Density<Area> {
        let Vertex::Surface(point) = &last.vertex else { return Density::ZERO };
        let Some((pdf, q)) = scene.scatter_event(point, to, last.from, opposite(self.mode)) else {
            return Density::ZERO;
        };
        let pdf = if self.roulette { pdf * q } else { pdf };
        Edge::new(&End::Surface { p: point.p, n: point.n_g }, &before.end()).to_area(pdf)
    }
}

/// The mode of the walk from the other side.
pub(super) fn opposite(mode: TransportMode) -> TransportMode {
    match mode {
        TransportMode::Radiance => TransportMode::Importance,
        TransportMode::Importance => TransportMode::Radiance,
    }
}
