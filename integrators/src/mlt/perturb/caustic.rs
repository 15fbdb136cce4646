//! The caustic perturbation (Veach 1997, §11.4.3.2): suffixes (D|L) S⁺ D E.
//!
//! The direction at the vertex before the specular vertices moves, the walk follows them to the
//! non-specular vertex, and the sensor's vertex is connected to it. It moves caustics as the lens
//! perturbation moves what is seen.

use pathspace_core::Scene;
use pathspace_core::bsdf::{Event, TransportMode};
use pathspace_core::measure::Density;
use pathspace_core::path::{Path, Vertex};
use pathspace_core::random::RandomStream;

use super::super::emission;
use super::super::mutator::{Candidate, Kept, Mutator};
use super::super::path::MltPath;
use super::Sizes;
use super::kernel::LogUniform;
use super::walk::{follow, hit_like, same_kind, sure_density};

/// The caustic perturbation.
#[derive(Clone, Debug)]
pub struct Caustic {
    /// Distances on the film in radians, near its centre.
    view: LogUniform,
}

impl Caustic {
    /// The perturbation for this scene's film.
    pub fn new(scene: &Scene, sizes: &Sizes) -> Self {
        Caustic { view: sizes.on_film(scene).scaled(scene.sensor().pixel_angle()) }
    }

    /// The vertex whose direction is perturbed.
    fn pivot(x: &MltPath) -> Option<usize> {
        let k = x.length();
        if k < 3 || x.is_specular(k - 1) || !x.is_specular(k - 2) {
            return None;
        }
        let mut i = k - 2;
        while i > 0 && x.is_specular(i) {
            i -= 1;
        }
        Some(i)
    }

    fn kept(pivot: usize) -> Kept {
        Kept { light: pivot + 1, sensor: 1 }
    }

    /// Distances at the pivot (angles; lengths for a pivot at infinity) that move the image of the
    /// caustic about as far as the lens perturbation would: the distance seen from the sensor over
    /// the length of the chain. It depends on the path, as the way back depends on the new one.
    fn size(&self, x: &MltPath, pivot: usize) -> LogUniform {
        let k = x.length();
        let distance = |i: usize| x.edge(i).distance2().sqrt();
        if x.vertices()[pivot].position().is_none() {
            return self.view.scaled(distance(k - 1));
        }
        let chain: f64 = (pivot..k - 1).map(distance).sum();
        self.view.scaled(distance(k - 1) / chain).within_right_angle()
    }
}

impl Mutator for Caustic {
    fn name(&self) -> &'static str {
        "caustic"
    }

    fn applies(&self, x: &MltPath) -> bool {
        Caustic::pivot(x).is_some()
    }

    fn propose(&self, scene: &Scene, x: &MltPath, u: &mut RandomStream) -> Option<Candidate> {
        let pivot = Caustic::pivot(x)?;
        let k = x.length();
        let size = self.size(x, pivot);
        let v = x.vertices();
        let mut ray = match &v[pivot] {
            Vertex::InfiniteEmitter { to, .. } => {
                let offset = size.sample_plane(u);
                emission::beam_ray(
                    scene,
                    *to,
                    emission::moved_across(*to, v[1].position()?, offset),
                )
            }
            vertex => {
                let d = size.sample_direction(x.edge(pivot).direction(), u);
                match vertex {
                    Vertex::Surface(point) => point.spawn(d),
                    _ => pathspace_core::math::Ray::new(vertex.position()?, d),
                }
            }
        };
        let mut vertices = v.to_vec();
        for (i, vertex) in vertices.iter_mut().enumerate().take(k).skip(pivot + 1) {
            let point = hit_like(scene, &ray, x, i)?;
            *vertex = Vertex::Surface(point);
            if i < k - 1 {
                ray = follow(scene, &point, -ray.d, x.event(i), TransportMode::Importance)?;
            }
        }
        let path = MltPath::new(scene, Path::new(vertices, x.path().events.clone()))?;
        let v = path.vertices();
        let visible = scene.visible(&v[k - 1], &v[k]);
        visible.then(|| Candidate { path, kept: Caustic::kept(pivot) })
    }

    fn ln_transition(&self, scene: &Scene, x: &MltPath, y: &MltPath, kept: Kept) -> Option<f64> {
        let pivot = Caustic::pivot(x)?;
        let k = x.length();
        if kept != Caustic::kept(pivot) || !same_kind(x, y, pivot + 1, k - 1) {
            return None;
        }
        let size = self.size(x, pivot);
        let edge = y.edge(pivot);
        let first = match &x.vertices()[pivot] {
            Vertex::InfiniteEmitter { to, .. } => {
                let (from, to_point) = (x.vertices()[1].position()?, y.vertices()[1].position()?);
                let moved = emission::distance_across(*to, from, to_point);
                edge.beam_to_area(Density::new(size.plane_density(moved)))
            }
            _ => {
                let pdf = size.direction_density(x.edge(pivot).direction(), edge.direction());
                edge.to_area(Density::new(pdf))
            }
        };
        let mut ln = first.value().ln();
        for i in pivot + 1..k - 1 {
            let edge = y.edge(i);
            let Event::Specular(component) = y.event(i) else { return None };
            let point = y.vertices()[i].surface()?;
            let pdf = sure_density(scene, point, edge.direction(), component);
            ln += edge.to_area(Density::new(pdf)).value().ln();
        }
        ln.is_finite().then_some(ln)
    }
}
