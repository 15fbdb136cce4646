//! Media along edges: which one is where, transmittance, free flights.
//!
//! Index-matched surfaces are no vertices where there are media. They live in a tree of their own,
//! so that visibility is that of the other surfaces, to the bit, and an edge asks the tree of
//! boundaries only for where it passes from one medium into another.
//!
//! What a boundary says of its near side holds for the piece of an edge before it. Only where an
//! edge meets no boundary the medium is the one that its vertices know. A boundary within
//! [`TOUCHING`] of a surface that an edge starts or ends on is not passed, so that a medium may
//! fill a room to its walls.

use glam::{DVec3, Vec3};

use super::Scene;
use crate::color::Rgb;
use crate::geometry::Accel;
use crate::math::{NO_PRIM, Ray};
use crate::medium::{Medium, MediumIndex, MediumPoint};
use crate::random::{PrimarySample, coordinate_between, nearest_coordinate};
use crate::rays::count_ray;
use crate::vertex::Vertex;

/// How near a boundary may be to a surface and count as lying on it, in the normalised scene.
pub(super) const TOUCHING: f64 = 1e-5;

/// Vertices keep this distance from the ends of their piece of an edge, so that rounding leaves
/// them inside.
const INSIDE: f64 = 1e-6;

/// Half a step of the random numbers' grid: no flight has length 0.
const HALF_STEP: f64 = 1.0 / (1 << 25) as f64;

/// The media of a scene and where they are.
pub(super) struct Volumes {
    pub(super) media: Vec<Medium>,
    /// Index-matched surfaces, with the shape of each primitive.
    pub(super) boundaries: Option<(Accel, Vec<u32>)>,
    /// Around everything.
    pub(super) outside: MediumIndex,
    /// Around the sensor.
    pub(super) sensor: MediumIndex,
    /// Around each point emitter.
    pub(super) emitters: Vec<MediumIndex>,
}

/// How an edge of a walk ends.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// A vertex in a medium or on a surface; `None` where it leaves the scene.
    pub end: Option<Vertex>,
    /// T of the edge.
    pub transmittance: Rgb,
}

/// A boundary on the way.
pub(super) struct Crossing {
    /// Distance from the ray's origin.
    pub(super) t: f64,
    pub(super) shape: u32,
    /// The media before and behind; `None` for a surface that bounds none.
    pub(super) sides: Option<[MediumIndex; 2]>,
    /// The rest of the ray.
    pub(super) rest: Ray,
}

/// ∫σ_t over a piece of an edge, in three channels.
#[derive(Clone, Copy, Default)]
struct Depth([f64; 3]);

impl Depth {
    fn add(&mut self, medium: &Medium, length: f64) {
        for (sum, sigma) in self.0.iter_mut().zip(medium.extinction()) {
            if *sigma > 0.0 {
                *sum += sigma * length.max(0.0);
            }
        }
    }

    fn transmittance(self) -> Rgb {
        Rgb::from(self.0.map(|d| libm::exp(-d) as f32))
    }
}

impl Scene {
    /// True where the scene has participating media.
    #[inline]
    pub fn has_media(&self) -> bool {
        self.volumes.is_some()
    }

    /// The media of the scene.
    pub fn media(&self) -> &[Medium] {
        self.volumes.as_ref().map_or(&[], |v| &v.media)
    }

    /// A medium; `None` in empty space.
    #[inline]
    pub fn medium(&self, index: MediumIndex) -> Option<&Medium> {
        self.media().get(index.get())
    }

    /// The medium on the side of a vertex that `d` points to.
    #[inline]
    pub fn medium_towards(&self, vertex: &Vertex, d: Vec3) -> MediumIndex {
        let Some(volumes) = &self.volumes else { return MediumIndex::NONE };
        match vertex {
            Vertex::Surface(s) => s.media[usize::from(s.n_g.dot(d) <= 0.0)],
            Vertex::Medium(m) => m.medium,
            Vertex::PointEmitter { emitter, .. } => {
                volumes.emitters.get(*emitter as usize).copied().unwrap_or(MediumIndex::NONE)
            }
            Vertex::InfiniteEmitter { .. } => volumes.outside,
            Vertex::Sensor { .. } => volumes.sensor,
        }
    }

    /// T(x, y) = exp(−∫σ_t) per channel along the edge, whatever surfaces stand between
    /// ([`Scene::visible`] tells it). Symmetric to the bit; white where there are no media.
    #[inline]
    pub fn transmittance(&self, x: &Vertex, y: &Vertex) -> Rgb {
        match &self.volumes {
            None => Rgb::WHITE,
            Some(volumes) => self.transmittance_in(volumes, x, y),
        }
    }

    fn transmittance_in(&self, volumes: &Volumes, x: &Vertex, y: &Vertex) -> Rgb {
        // Whatever end is first, the same arithmetic.
        let (a, b) = match (x.position(), y.position()) {
            (None, _) => (y, x),
            (Some(p), Some(q)) if order(p, q).is_gt() => (y, x),
            _ => (x, y),
        };
        let Some(p) = a.position() else { return Rgb::WHITE };
        let origin = p.as_dvec3();
        let (d, length) = match b.position() {
            None => (b.direction_from(p), f64::INFINITY),
            Some(q) => {
                let v = q.as_dvec3() - origin;
                ((v / v.length()).as_vec3(), v.length())
            }
        };
        let ray = match a {
            Vertex::Surface(s) => s.spawn(d),
            _ => Ray::new(p, d),
        };
        let way = Way { medium: self.medium_towards(a, d), origin, ray, touching: touching(a) };
        let mut depth = Depth::default();
        let last = self.pieces(volumes, way, length - touching(b), |_, medium, from, to| {
            depth.add(medium, to - from);
            true
        });
        if let Some((medium, from)) = last
            && let Some(medium) = self.medium(medium)
        {
            depth.add(medium, length - from);
        }
        depth.transmittance()
    }

    /// Follows an edge of a walk from vertex `start` along `ray` to where it scatters: in a medium,
    /// at a distance drawn with the given numbers (channel, distance), or on the surface behind.
    pub fn fly(&self, start: &Vertex, ray: &Ray, numbers: [f32; 2]) -> Flight {
        let mut surface = self.intersect(ray);
        let Some(volumes) = &self.volumes else {
            let end = surface.map(Vertex::Surface);
            return Flight { end, transmittance: Rgb::WHITE };
        };
        // A beam begins outside everything.
        let origin = start.position().unwrap_or(ray.o).as_dvec3();
        let d = ray.d.as_dvec3();
        let length = surface.map_or(f64::INFINITY, |s| (s.p.as_dvec3() - origin).dot(d));
        let channel = ((numbers[0] * 3.0) as usize).min(2);
        let mut left = -libm::log(1.0 - (f64::from(numbers[1]) + HALF_STEP));
        let mut depth = Depth::default();
        let mut scattered = None;
        let mut fly = |index: MediumIndex, medium: &Medium, from: f64, to: f64| {
            let sigma = medium.extinction()[channel];
            let all = if sigma > 0.0 { sigma * (to - from) } else { 0.0 };
            if left >= all {
                left -= all;
                depth.add(medium, to - from);
                return true;
            }
            let inside = |t: f64| t.min(to - INSIDE).max(from + INSIDE);
            let short = to - from <= 2.0 * INSIDE;
            let t = if short { 0.5 * (from + to) } else { inside(from + left / sigma) };
            depth.add(medium, t - from);
            scattered = Some(MediumPoint { p: (origin + d * t).as_vec3(), medium: index });
            false
        };
        let way = Way {
            medium: self.medium_towards(start, ray.d),
            origin,
            ray: *ray,
            touching: touching(start),
        };
        let end = if surface.is_some() { length - TOUCHING } else { length };
        let mut last = MediumIndex::NONE;
        if let Some((medium, from)) = self.pieces(volumes, way, end, &mut fly) {
            last = medium;
            if let Some(m) = self.medium(medium) {
                fly(medium, m, from, length);
            }
        }
        let transmittance = depth.transmittance();
        if let Some(point) = scattered {
            return Flight { end: Some(Vertex::Medium(point)), transmittance };
        }
        if let Some(point) = &mut surface
            && !self.shapes[point.shape as usize].bounds
        {
            point.media = [last; 2];
        }
        Flight { end: surface.map(Vertex::Surface), transmittance }
    }

    /// Density of a free flight that ends at `end`, with T of its edge: Σ P_c σ_{t,c} T_c per
    /// length in a medium, Σ P_c T_c behind it.
    #[inline]
    pub fn flight_density(&self, end: &Vertex, transmittance: Rgb) -> f64 {
        let t = transmittance.to_array().map(f64::from);
        let Vertex::Medium(point) = end else { return (t[0] + t[1] + t[2]) / 3.0 };
        let Some(medium) = self.medium(point.medium) else { return 0.0 };
        let sigma = medium.extinction();
        (sigma[0] * t[0] + sigma[1] * t[1] + sigma[2] * t[2]) / 3.0
    }

    /// Numbers (channel, distance) by which [`Scene::fly`] follows the edge from `start` to `end`,
    /// uniform among all that do where `free` is. `None` where no flight gets there.
    pub fn invert_flight<U: PrimarySample>(
        &self,
        start: &Vertex,
        end: &Vertex,
        free: &mut U,
    ) -> Option<[f32; 2]> {
        let t = self.transmittance(start, end).to_array().map(f64::from);
        let shares = match end {
            Vertex::Medium(point) => {
                let sigma = self.medium(point.medium)?.extinction();
                [0, 1, 2].map(|c| sigma[c] * t[c])
            }
            _ => t,
        };
        let mut left = f64::from(free.next()) * shares.iter().sum::<f64>();
        let mut channel = None;
        for (c, share) in shares.into_iter().enumerate().filter(|(_, share)| *share > 0.0) {
            channel = Some(c);
            left -= share;
            if left < 0.0 {
                break;
            }
        }
        let c = channel?;
        let third = |i: usize| i as f64 / 3.0;
        let pick = coordinate_between(third(c), third(c + 1), free.next())?;
        let distance = match end {
            Vertex::Medium(_) => nearest_coordinate(1.0 - t[c] - HALF_STEP),
            _ => coordinate_between(1.0 - t[c] - HALF_STEP, 1.0, free.next())?,
        };
        Some([pick, distance])
    }

    /// Calls `piece` with each piece of an edge that ends on a boundary nearer than `end`, until it
    /// says false. Returns the medium of the last piece and where that begins; `None` where `piece`
    /// said false. Distances are from the edge's start.
    fn pieces(
        &self,
        volumes: &Volumes,
        way: Way,
        end: f64,
        mut piece: impl FnMut(MediumIndex, &Medium, f64, f64) -> bool,
    ) -> Option<(MediumIndex, f64)> {
        let Way { mut medium, origin, ray, touching } = way;
        // The triangle that it starts on is none of the boundaries.
        let mut ray = Ray { from: NO_PRIM, ..ray };
        let mut from = 0.0;
        let Some(boundaries) = &volumes.boundaries else { return Some((medium, from)) };
        while let Some(crossing) = self.crossing(boundaries, &ray) {
            let t = (ray.o.as_dvec3() - origin).dot(ray.d.as_dvec3()) + crossing.t;
            if t >= end {
                break;
            }
            ray = crossing.rest;
            let Some([near, far]) = crossing.sides.filter(|_| t > touching) else { continue };
            if let Some(m) = self.medium(near)
                && !piece(near, m, from, t)
            {
                return None;
            }
            (medium, from) = (far, t);
        }
        Some((medium, from))
    }

    /// The next index-matched surface along a ray.
    pub(super) fn crossing(&self, boundaries: &(Accel, Vec<u32>), ray: &Ray) -> Option<Crossing> {
        count_ray();
        let (accel, prim_shape) = boundaries;
        let hit = accel.closest(ray)?;
        let p = accel.position(&hit, ray);
        let point = self.complete_in(accel, prim_shape, hit.prim, hit.b1 as f32, hit.b2 as f32, p);
        let [front, back] = point.media;
        let outwards = point.n_g.dot(ray.d) > 0.0;
        let sides = if outwards { [back, front] } else { [front, back] };
        let sides = self.shapes[point.shape as usize].bounds.then_some(sides);
        Some(Crossing { t: hit.t, shape: point.shape, sides, rest: point.spawn(ray.d) })
    }
}

/// Where an edge begins.
struct Way {
    /// As its vertex knows it.
    medium: MediumIndex,
    origin: DVec3,
    ray: Ray,
    /// No boundary is passed before this distance.
    touching: f64,
}

/// An order of points: first the one with the smaller coordinates, where a rounded direction does
/// least harm.
fn order(p: Vec3, q: Vec3) -> std::cmp::Ordering {
    let (near, far) = (p.abs().max_element(), q.abs().max_element());
    let lexicographic =
        || p.x.total_cmp(&q.x).then_with(|| p.y.total_cmp(&q.y)).then_with(|| p.z.total_cmp(&q.z));
    near.total_cmp(&far).then_with(lexicographic)
}

/// The part of an edge at an end in which no boundary is passed.
fn touching(end: &Vertex) -> f64 {
    if end.surface().is_some() { TOUCHING } else { 0.0 }
}
