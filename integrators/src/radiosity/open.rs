//! Which parts of surfaces light can reach at all: insides of closed blocks, what they cover, and backs of walls are left out, so that
//! the radiosity of an element is that of its open part and does not fade where a block stands on it.

use pathspace_core::Scene;
use pathspace_core::path::Vertex;
use pathspace_core::random::{Address, PrimarySample, RandomStream};
use rayon::prelude::*;

use super::elements::{Element, Mesh};

/// Sources that a sample looks for light at in one round.
const TRIES: u32 = 96;
/// Rounds at most; one without a new open sample ends them.
const ROUNDS: u64 = 64;

/// Marks the samples that emit, then round by round those that see a marked one which sends light on. A sample is tested
/// by whole points, so what is behind a closed surface stays closed exactly. A sample that sees so little of what is lit
/// that no random try finds it stays dark.
pub(super) fn mark(scene: &Scene, mesh: &mut Mesh) {
    for element in mesh.elements.iter_mut().filter(|e| e.emission.is_some()) {
        element.open.fill(true);
    }
    for round in 0..ROUNDS {
        let sources: Vec<(usize, usize)> = mesh
            .elements
            .iter()
            .enumerate()
            .filter(|(_, element)| element.spreads())
            .flat_map(|(i, element)| {
                let open = element.open.iter().enumerate().filter(|(_, open)| **open);
                open.map(move |(k, _)| (i, k))
            })
            .collect();
        if sources.is_empty() {
            return;
        }
        let elements = &mesh.elements;
        let found: Vec<(usize, usize)> = (0..elements.len())
            .into_par_iter()
            .flat_map_iter(|i| {
                let sources = &sources;
                let closed = elements[i].open.iter().enumerate().filter(|(_, open)| !**open);
                closed.filter_map(move |(k, _)| {
                    let address = Address { seed: 0, step: round, item: (i << 8 | k) as u64 };
                    let mut u = RandomStream::new(address);
                    let sees = (0..TRIES).any(|_| {
                        let pick = (u.next() * sources.len() as f32) as usize;
                        let (j, l) = sources[pick.min(sources.len() - 1)];
                        see_each_other(scene, (&elements[i], k), (&elements[j], l))
                    });
                    sees.then_some((i, k))
                })
            })
            .collect();
        if found.is_empty() {
            return;
        }
        for (i, k) in found {
            mesh.elements[i].open[k] = true;
        }
    }
}

fn see_each_other(scene: &Scene, a: (&Element, usize), b: (&Element, usize)) -> bool {
    let (p, q) = (&a.0.points[a.1], &b.0.points[b.1]);
    let d = q.p.as_dvec3() - p.p.as_dvec3();
    d.dot(a.0.normal(p)) > 0.0
        && d.dot(b.0.normal(q)) < 0.0
        && scene.visible(&Vertex::Surface(*p), &Vertex::Surface(*q))
}
