//! Which parts of surfaces light can reach at all: insides of closed blocks, what they cover, and
//! backs of walls are left out, so that the radiosity of an element is that of its open part and
//! does not fade where a block stands on it.

use pathspace_core::Scene;
use pathspace_core::math::{Frame, warp};
use pathspace_core::path::Vertex;
use pathspace_core::random::{Address, PrimarySample, RandomStream};
use pathspace_core::scene::SurfacePoint;
use rayon::prelude::*;

use super::elements::{Element, FINE, Mesh};

/// Sources that a point looks for light at before it counts as closed.
const TRIES: u32 = 96;
/// The same for a point of an element of which no sample is open so far.
const FEW_TRIES: u32 = 8;
/// Rounds at most; one without a new open sample ends them.
const ROUNDS: u64 = 64;
/// Points beside the fine sets that measure the open part of an element that is not wholly open.
const MEASURE: u32 = 256;

/// Marks the samples that emit, then round by round those that see a marked one which sends light
/// on; then measures the open part of each element with its fine sets. A point is tested by whole
/// points, so what is behind a closed surface stays closed exactly. One that sees so little of what
/// is lit that no random try finds it stays dark.
pub(super) fn mark(scene: &Scene, mesh: &mut Mesh) {
    for element in mesh.elements.iter_mut().filter(|e| e.emission.is_some()) {
        element.open.fill(true);
    }
    for round in 0..ROUNDS {
        let light = Light::new(scene, mesh);
        let elements = &mesh.elements;
        let found: Vec<(usize, usize)> = (0..elements.len())
            .into_par_iter()
            .flat_map_iter(|i| {
                let light = &light;
                let closed = elements[i].open.iter().enumerate().filter(|(_, open)| !**open);
                closed.filter_map(move |(k, _)| {
                    let address = Address { seed: 0, step: round, item: item(i, k) };
                    let point = &elements[i].points[k];
                    light.reaches(&elements[i], point, TRIES, address).then_some((i, k))
                })
            })
            .collect();
        if found.is_empty() {
            break;
        }
        for (i, k) in found {
            mesh.elements[i].open[k] = true;
        }
    }
    let light = Light::new(scene, mesh);
    let parts: Vec<Part> =
        (0..mesh.elements.len()).into_par_iter().map(|i| light.part(i)).collect();
    for (element, part) in mesh.elements.iter_mut().zip(parts) {
        element.share = part.share;
        element.fine = part.fine;
        element.cover = part.cover;
        if let Some(points) = part.points {
            element.open = vec![true; points.len()];
            element.points = points;
        }
    }
}

fn item(element: usize, point: usize) -> u64 {
    (element as u64) << 16 | point as u64
}

/// The open part of an element.
struct Part {
    fine: [Vec<bool>; 2],
    share: f64,
    cover: Vec<(SurfacePoint, bool)>,
    /// Its samples, where they are not those of the whole cell.
    points: Option<Vec<SurfacePoint>>,
}

impl Default for Part {
    /// All of it.
    fn default() -> Self {
        Part { fine: [Vec::new(), Vec::new()], share: 1.0, cover: Vec::new(), points: None }
    }
}

/// What is known to be lit.
struct Light<'a> {
    scene: &'a Scene,
    mesh: &'a Mesh,
    sources: Vec<(usize, usize)>,
}

impl<'a> Light<'a> {
    fn new(scene: &'a Scene, mesh: &'a Mesh) -> Self {
        let lit = mesh.elements.iter().enumerate().filter(|(_, element)| element.scatters());
        let sources = lit
            .flat_map(|(i, element)| {
                let open = element.open.iter().enumerate().filter(|(_, open)| **open);
                open.map(move |(k, _)| (i, k))
            })
            .collect();
        Light { scene, mesh, sources }
    }

    /// Whether one of `tries` sources is seen from a point of an element: every other one any at
    /// all, the rest of an element that the point sees much of. In a narrow gap the former are
    /// hardly ever visible.
    fn reaches(&self, from: &Element, point: &SurfacePoint, tries: u32, address: Address) -> bool {
        if self.sources.is_empty() {
            return false;
        }
        let mut u = RandomStream::new(address);
        (0..tries).any(|k| {
            let pick = |u: f32, n: usize| ((u * n as f32) as usize).min(n - 1);
            let to = if k % 2 == 0 {
                let (j, l) = self.sources[pick(u.next(), self.sources.len())];
                Some((&self.mesh.elements[j], l))
            } else {
                let frame = Frame::from_normal(from.normal(point).as_vec3());
                let ray = point.spawn(frame.to_world(warp::cosine_hemisphere(u.next2())));
                let hit = self.scene.intersect(&ray);
                let seen = hit.and_then(|hit| self.mesh.find(&hit, -ray.d));
                let other = u.next();
                seen.map(|j| &self.mesh.elements[j])
                    .map(|e| (e, pick(other, e.points.len())))
                    .filter(|(e, l)| e.open[*l])
            };
            to.is_some_and(|(element, l)| {
                let source = &element.points[l];
                from.faces(point, element, source)
                    && self.scene.visible(&Vertex::Surface(*point), &Vertex::Surface(*source))
            })
        })
    }

    fn part(&self, index: usize) -> Part {
        let element = &self.mesh.elements[index];
        let wholly = Part::default();
        if element.emission.is_some() {
            return wholly;
        }
        let tries = if element.open.contains(&true) { TRIES } else { FEW_TRIES };
        let test = |points: &[SurfacePoint], set: u64, tries: u32| -> Vec<bool> {
            let address = |k| Address { seed: 0, step: ROUNDS + set, item: item(index, k) };
            let points = points.iter().enumerate();
            points.map(|(k, point)| self.reaches(element, point, tries, address(k))).collect()
        };
        let sets = [0, 1].map(|set| self.mesh.fine(self.scene, element, set));
        let first = test(&sets[0], 0, tries);
        if !first.contains(&true) && !element.open.contains(&true) {
            return Part { share: 0.0, ..wholly };
        }
        let fine = [
            if tries < TRIES { test(&sets[0], 0, TRIES) } else { first },
            test(&sets[1], 1, TRIES),
        ];
        let all = [&element.open, &fine[0], &fine[1]];
        if !all.iter().any(|flags| flags.contains(&false)) {
            return wholly;
        }
        let measure: Vec<SurfacePoint> = (0..MEASURE)
            .map(|k| self.mesh.point(self.scene, element, super::sequence::r2(k, [0.5; 2])))
            .collect();
        let measured = test(&measure, 2, TRIES);
        let cover: Vec<(SurfacePoint, bool)> = measure.into_iter().zip(measured).collect();
        let open: Vec<SurfacePoint> =
            cover.iter().filter(|(_, open)| *open).map(|(p, _)| *p).collect();
        let share = open.len() as f64 / f64::from(MEASURE);
        // The first of a sequence without pattern are as even as all of them.
        let count = element.points.len().min(open.len());
        Part { fine, share, cover, points: Some(open[..count].to_vec()) }
    }
}

const _: () = assert!(FINE[0] * FINE[0] < 1 << 16 && MEASURE < 1 << 16);
