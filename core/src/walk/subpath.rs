//! Growing a subpath, vertex by vertex.

use glam::Vec3;

use super::layout::{event_numbers, flight_numbers};
use super::weight::{WeightState, Weights};
use crate::bsdf::{Event, TransportMode};
use crate::color::Rgb;
use crate::math::Ray;
use crate::measure::{Area, Density, Edge, End, Mass, SolidAngle};
use crate::path::{ScatterSample, Vertex, WalkClass};
use crate::random::PrimarySample;
use crate::scene::{NextDensity, Scene};

/// A vertex of a subpath.
#[derive(Clone, Copy, Debug)]
pub struct WalkVertex {
    /// The vertex.
    pub vertex: Vertex,
    /// Product of everything before the scattering here over its density: with x₀ alone 1/p(x₀),
    /// then L_e/p or W_e/p and so on.
    pub throughput: Rgb,
    /// Unit direction towards the vertex before.
    pub from: Vec3,
    /// True where a connection may end here: a surface with a non-specular component on this side,
    /// or an end of the path.
    pub connectible: bool,
    /// What happened here where the walk went on. Until then non-specular, as a connection needs
    /// it.
    pub event: Event,
    /// Density of this vertex given the ones before, roulette included.
    pub pdf: Density<Area>,
    /// T of the edge from the vertex before.
    pub transmittance: Rgb,
    /// The events at the scattering vertices before this one.
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
            transmittance: Rgb::WHITE,
            class: WalkClass::default(),
            weight: WeightState { running: 0.0, ratio_before: 0.0, direct: 1.0 },
        }
    }

    /// The events up to and including this vertex, where a connection ends here.
    #[inline]
    pub fn class_at_connection(&self) -> WalkClass {
        let mut class = self.class;
        if self.vertex.scatters() && self.from != Vec3::ZERO {
            class.push(true);
        }
        class
    }

    /// True where subpaths may merge: at a surface that a walk came to and that scatters
    /// non-specularly.
    #[inline]
    pub fn merges(&self) -> bool {
        self.ends() && self.from != Vec3::ZERO && matches!(self.vertex, Vertex::Surface(_))
    }

    /// Density of the vertex before by a walk that leaves this one towards it with density `pdf`.
    #[inline]
    pub(super) fn back_to(
        &self,
        scene: &Scene,
        before: &Vertex,
        pdf: Density<SolidAngle>,
    ) -> Density<Area> {
        let area = Edge::new(&self.vertex.end(), &before.end()).to_area(pdf);
        if scene.has_media() {
            area.times(scene.flight_density(before, self.transmittance))
        } else {
            area
        }
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
    /// Density of its end, the free flight not counted.
    pub next: NextDensity,
    /// T up to its end, once it has travelled.
    pub transmittance: Rgb,
}

impl OpenEdge {
    /// An edge that has not travelled.
    #[inline]
    pub fn new(ray: Ray, throughput: Rgb, next: NextDensity) -> Self {
        OpenEdge { ray, throughput, next, transmittance: Rgb::WHITE }
    }

    /// Follows the edge from vertex `start` to its end: a surface, or, by a free flight, a point in
    /// a medium; `None` where it leaves the scene. The throughput gains T over the density of the
    /// flight. Numbers are read in scenes with media alone.
    #[inline]
    pub fn travel<U: PrimarySample>(
        &mut self,
        scene: &Scene,
        start: &Vertex,
        u: &mut U,
    ) -> Option<Vertex> {
        if !scene.has_media() {
            return scene.intersect(&self.ray).map(Vertex::Surface);
        }
        let flight = scene.fly(start, &self.ray, flight_numbers(u));
        let density = match &flight.end {
            Some(end) => scene.flight_density(end, flight.transmittance),
            None => f64::from(flight.transmittance.mean()),
        };
        self.arrive(flight.transmittance, density);
        flight.end
    }

    /// Area density of the end, the free flight counted, where the edge begins at `start`.
    #[inline]
    pub fn pdf_of_end(&self, scene: &Scene, start: &End, end: &Vertex) -> Density<Area> {
        let pdf = self.next.to_area(&Edge::new(start, &end.end()));
        if !scene.has_media() {
            return pdf;
        }
        pdf.times(scene.flight_density(end, self.transmittance))
    }

    /// Ends a flight of this density at the given vertex.
    fn arrive(&mut self, transmittance: Rgb, density: f64) {
        self.transmittance = transmittance;
        self.throughput *= transmittance;
        self.throughput *= (1.0 / density) as f32;
    }

    /// The edge as it passes through the vertex `end`, where it does not end: the lens.
    pub(super) fn through(&self, scene: &Scene, start: &Vertex, end: &Vertex) -> OpenEdge {
        let mut edge = *self;
        if scene.has_media() {
            let through = scene.transmittance(start, end);
            edge.arrive(through, scene.flight_density(end, through));
        }
        edge
    }
}

/// How a walk goes.
#[derive(Clone, Copy, Debug)]
pub struct Walk {
    /// From the sensor (radiance) or an emitter (importance).
    pub mode: TransportMode,
    /// Vertices at most.
    pub max_vertices: usize,
    /// Roulette plays at vertex i (the first is 0) for i ≥ `rr_depth`. Densities from the other
    /// side are exact for 1 and `u32::MAX` alone: a rule that depends on the index makes them
    /// depend on the length of the other subpath.
    pub rr_depth: u32,
    /// How techniques are weighed.
    pub weights: Weights,
}

/// A scattering event at a vertex that a walk reached from direction `from` with `throughput`: the
/// edge that it opens, and the event. `None` where the walk ends, by roulette where it `plays`.
#[inline]
pub fn scatter<U: PrimarySample>(
    scene: &Scene,
    vertex: &Vertex,
    from: Vec3,
    throughput: Rgb,
    mode: TransportMode,
    plays: bool,
    u: &mut U,
) -> Option<(OpenEdge, ScatterSample)> {
    let numbers = event_numbers(u);
    let sample = scene.sample_at(vertex, from, mode, numbers.component, numbers.direction)?;
    let q = if plays { sample.survival } else { Mass::ONE };
    if plays && u.next() as f64 >= q.value() {
        return None;
    }
    let throughput = throughput * sample.weight * (1.0 / q.value()) as f32;
    let next = NextDensity::Direction(sample.pdf * q);
    let edge = OpenEdge::new(vertex.spawn(sample.direction)?, throughput, next);
    Some((edge, sample))
}

/// Walks that only their own roulette ends.
pub fn always(_: Mass) -> bool {
    true
}

impl Walk {
    /// Advances a subpath that holds its first vertex along `edge` until it ends, and returns the
    /// edge that left the scene, if it ended so. `on_edge` sees every edge as it was opened, with
    /// its length, before its end becomes a vertex. `goes_on` is asked after every scattering
    /// event, with the probability of local roulette: a way to end walks that is no part of their
    /// densities.
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
            let last = subpath.last()?;
            let opened = edge;
            let end = edge.travel(scene, &last.vertex, u);
            let at = end.and_then(|v| v.position());
            let length = at.map_or(f32::INFINITY, |p| p.distance(edge.ray.o));
            on_edge(subpath, &opened, length);
            let Some(vertex) = end else { return Some(edge) };
            if !self.arrive(scene, subpath, &edge, vertex) {
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

    /// First half of a step: the end that `edge` travelled to becomes the next vertex. False where
    /// the walk ends: it has its vertices, or the density of the new one is 0 ([`Walk::push`]).
    #[inline]
    pub fn arrive(
        &self,
        scene: &Scene,
        subpath: &mut Subpath,
        edge: &OpenEdge,
        end: Vertex,
    ) -> bool {
        if subpath.len() >= self.max_vertices {
            return false;
        }
        let connectible = scene.connects_at(&end, -edge.ray.d);
        self.push(scene, subpath, end, edge, connectible) && subpath.len() < self.max_vertices
    }

    /// Second half of a step: an event at the last vertex and the edge that it opens, with the
    /// probability of local roulette. `None` where the walk ends.
    #[inline]
    pub fn scatter<U: PrimarySample>(
        &self,
        scene: &Scene,
        subpath: &mut Subpath,
        u: &mut U,
    ) -> Option<(OpenEdge, Mass)> {
        let plays = self.roulette(subpath.len() - 1);
        let last = subpath.last_mut()?;
        let (edge, sample) =
            scatter(scene, &last.vertex, last.from, last.throughput, self.mode, plays, u)?;
        last.event = sample.event;
        Some((edge, sample.survival))
    }

    /// True where roulette plays at vertex `index`.
    #[inline]
    pub fn roulette(&self, index: usize) -> bool {
        index >= self.rr_depth as usize
    }

    /// Adds the vertex that `edge` ends on, and tells the vertex before the last how likely the
    /// opposite walk makes it. False, and nothing added, where its density is 0: seen from the
    /// vertices as they were rounded, the edge lies in a surface. Only corners do that, at
    /// distances of an offset, and no weight could be given to such a path.
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
        let pdf = edge.pdf_of_end(scene, &last.vertex.end(), &vertex);
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
            transmittance: edge.transmittance,
            class,
            weight,
        });
        true
    }

    /// Density with which the opposite walk, that came to `last` from direction `to`, goes on to
    /// the vertex before it.
    fn backward(
        &self,
        scene: &Scene,
        last: &WalkVertex,
        before: &Vertex,
        to: Vec3,
    ) -> Density<Area> {
        let mode = self.mode.opposite();
        let event = scene.event_at(&last.vertex, to, last.from, mode, last.event);
        let Some((pdf, q)) = event else { return Density::ZERO };
        let pdf = if self.roulette(1) { pdf * q } else { pdf };
        last.back_to(scene, before, pdf)
    }
}
