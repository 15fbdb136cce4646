//! Growing a subpath, vertex by vertex.

use glam::Vec3;

use super::layout::event_numbers;
use super::weight::{WeightState, Weights};
use crate::bsdf::{Event, TransportMode};
use crate::color::Rgb;
use crate::math::Ray;
use crate::measure::{Area, Density, Edge, End, Mass};
use crate::path::{ScatterSample, Vertex, WalkClass};
use crate::random::PrimarySample;
use crate::scene::NextDensity;
use crate::scene::{Scene, SurfacePoint};

/// A vertex of a subpath.
#[derive(Clone, Copy, Debug)]
pub struct WalkVertex {
    /// The vertex.
    pub vertex: Vertex,
    /// Product of everything before the scattering here over its density: with x₀ alone 1/p(x₀), then L_e/p or W_e/p and so on.
    pub throughput: Rgb,
    /// Unit direction towards the vertex before.
    pub from: Vec3,
    /// True where a connection may end here: a surface with a non-specular component on this side, or an end of the path.
    pub connectible: bool,
    /// What happened here where the walk went on. Until then non-specular, as a connection needs it.
    pub event: Event,
    /// Density of this vertex given the ones before, roulette included.
    pub pdf: Density<Area>,
    /// The events at the surface vertices before this one.
    pub class: WalkClass,
    /// Running sums of the weights.
    pub weight: WeightState,
}

impl WalkVertex {
    /// The first vertex of a subpath, or the only one of a re-sampled end, with density `pdf`.
    pub fn first(vertex: Vertex, pdf: Density<Area>) -> Self {
        WalkVertex {
            vertex,
            throughput: Rgb::WHITE,
            from: Vec3::ZERO,
            connectible: true,
            event: Event::NonSpecular,
            pdf,
            class: WalkClass::default(),
            weight: WeightState { running: 0.0, ratio_before: 0.0, direct: 1.0 },
        }
    }

    /// The events up to and including this vertex, where a connection ends here.
    #[inline]
    pub fn class_at_connection(&self) -> WalkClass {
        let mut class = self.class;
        if matches!(self.vertex, Vertex::Surface(_)) && self.from != Vec3::ZERO {
            class.push(true);
        }
        class
    }

    /// True where subpaths may merge: at a surface that a walk came to and that scatters non-specularly.
    #[inline]
    pub fn merges(&self) -> bool {
        self.ends() && self.from != Vec3::ZERO && matches!(self.vertex, Vertex::Surface(_))
    }

    /// True where techniques may end at this vertex of a path that goes on from it.
    #[inline]
    pub fn ends(&self) -> bool {
        self.connectible && !self.event.is_specular()
    }
}

/// Vertices in walk order: x₀, x₁, … or x_k, x_{k−1}, …
pub type Subpath = Vec<WalkVertex>;

/// An edge of a walk, before it is known where it ends.
#[derive(Clone, Copy, Debug)]
pub struct OpenEdge {
    /// Where it goes.
    pub ray: Ray,
    /// Throughput at its end.
    pub throughput: Rgb,
    /// Density of its end.
    pub next: NextDensity,
}

/// How a walk goes.
#[derive(Clone, Copy, Debug)]
pub struct Walk {
    /// From the sensor (radiance) or an emitter (importance).
    pub mode: TransportMode,
    /// Vertices at most.
    pub max_vertices: usize,
    /// Roulette plays at vertex i (the first is 0) for i ≥ `rr_depth`. Densities from the other side are exact for 1 and `u32::MAX` alone:
    /// a rule that depends on the index makes them depend on the length of the other subpath.
    pub rr_depth: u32,
    /// How techniques are weighed.
    pub weights: Weights,
}

/// A scattering event at a surface point that a walk reached from direction `from` with `throughput`: the edge that it opens, and the event.
/// `None` where the walk ends, by roulette where it `plays`.
#[inline]
pub fn scatter<U: PrimarySample>(
    scene: &Scene,
    point: &SurfacePoint,
    from: Vec3,
    throughput: Rgb,
    mode: TransportMode,
    plays: bool,
    u: &mut U,
) -> Option<(OpenEdge, ScatterSample)> {
    let numbers = event_numbers(u);
    let sample = scene.sample_scatter(point, from, mode, numbers.component, numbers.direction)?;
    let q = if plays { sample.survival } else { Mass::ONE };
    if plays && u.next() as f64 >= q.value() {
        return None;
    }
    let edge = OpenEdge {
        ray: point.spawn(sample.direction),
        throughput: throughput * sample.weight * (1.0 / q.value()) as f32,
        next: NextDensity::Direction(sample.pdf * q),
    };
    Some((edge, sample))
}

/// Walks that only their own roulette ends.
pub fn always(_: Mass) -> bool {
    true
}

impl Walk {
    /// Advances a subpath that holds its first vertex along `edge` until it ends, and returns the edge that left the scene, if it ended so.
    /// `on_edge` sees every edge with its length before its end becomes a vertex. `goes_on` is asked after every scattering event, with the
    /// probability of local roulette: a way to end walks that is no part of their densities.
    pub fn run<U: PrimarySample>(
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
            if !self.arrive(scene, subpath, &edge, &point) {
                return None;
            }
            let (next, survival) = self.scatter(scene, subpath, u)?;
            if !goes_on(survival) {
                return None;
            }
            edge = next;
        }
        None
    }

    /// First half of a step: the surface point that `edge` meets becomes the next vertex. False where the walk ends: it has
    /// its vertices, or the density of the new one is 0 ([`Walk::push`]).
    #[inline]
    pub fn arrive(
        &self,
        scene: &Scene,
        subpath: &mut Subpath,
        edge: &OpenEdge,
        point: &SurfacePoint,
    ) -> bool {
        if subpath.len() >= self.max_vertices {
            return false;
        }
        let connectible = scene.is_connectible(point, -edge.ray.d);
        self.push(scene, subpath, Vertex::Surface(*point), edge, connectible)
            && subpath.len() < self.max_vertices
    }

    /// Second half of a step: an event at the last vertex and the edge that it opens, with the probability of local roulette. `None` where
    /// the walk ends.
    #[inline]
    pub fn scatter<U: PrimarySample>(
        &self,
        scene: &Scene,
        subpath: &mut Subpath,
        u: &mut U,
    ) -> Option<(OpenEdge, Mass)> {
        let plays = self.roulette(subpath.len() - 1);
        let last = subpath.last_mut()?;
        let Vertex::Surface(point) = &last.vertex else { return None };
        let (edge, sample) =
            scatter(scene, point, last.from, last.throughput, self.mode, plays, u)?;
        last.event = sample.event;
        Some((edge, sample.survival))
    }

    /// True where roulette plays at vertex `index`.
    #[inline]
    pub fn roulette(&self, index: usize) -> bool {
        index >= self.rr_depth as usize
    }

    /// Adds the vertex that `edge` ends on, and tells the vertex before the last how likely the opposite walk makes it. False, and nothing
    /// added, where its density is 0: seen from the vertices as they were rounded, the edge lies in a surface. Only corners do that,
    /// at distances of an offset, and no weight could be given to such a path.
    #[inline]
    pub fn push(
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
        if n >= 2 {
            class.push(!last.event.is_specular());
        }
        let backward = if n >= 2 {
            self.backward(scene, last, &subpath[n - 2].vertex, -from)
        } else {
            Density::ZERO
        };
        let weight = self.weights.extend(scene, self.mode, subpath, &vertex, backward);
        subpath.push(WalkVertex {
            vertex,
            throughput: edge.throughput,
            from,
            connectible,
            event: Event::NonSpecular,
            pdf,
            class,
            weight,
        });
        true
    }

    /// Density with which the opposite walk, that came to `last` from direction `to`, goes on to the vertex before it.
    fn backward(
        &self,
        scene: &Scene,
        last: &WalkVertex,
        before: &Vertex,
        to: Vec3,
    ) -> Density<Area> {
        let Vertex::Surface(point) = &last.vertex else { return Density::ZERO };
        let mode = self.mode.opposite();
        let Some((pdf, q)) = scene.scatter_event(point, to, last.from, mode, last.event) else {
            return Density::ZERO;
        };
        let pdf = if self.roulette(1) { pdf * q } else { pdf };
        Edge::new(&End::Surface { p: point.p, n: point.n_g }, &before.end()).to_area(pdf)
    }
}
