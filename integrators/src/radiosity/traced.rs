//! Form factors by rays: slow, noisy and without a case distinction.

use pathspace_core::Scene;
use pathspace_core::math::{Frame, warp};
use pathspace_core::random::{Address, PrimarySample, RandomStream};

use super::elements::Mesh;

/// Row i of A_i F_ij from `rays` rays of the cosine's density: the area of the cell times the share
/// of rays that end on element j. Rays from what is closed end on nothing that is an element.
pub fn traced_row(scene: &Scene, mesh: &Mesh, i: usize, rays: u32, seed: u64) -> Vec<f64> {
    let element = &mesh.elements[i];
    let mut row = vec![0.0; mesh.elements.len()];
    for k in 0..rays {
        let mut u = RandomStream::new(Address { seed, step: i as u64, item: k.into() });
        let from = mesh.point(scene, element, u.next2().map(f64::from));
        let frame = Frame::from_normal(element.normal(&from).as_vec3());
        let ray = from.spawn(frame.to_world(warp::cosine_hemisphere(u.next2())));
        let hit = scene.intersect(&ray).and_then(|hit| mesh.find(&hit, -ray.d));
        if let Some(j) = hit {
            row[j] += element.area / f64::from(rays);
        }
    }
    row
}
