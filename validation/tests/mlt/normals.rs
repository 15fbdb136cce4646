//! The derivative of normals that the manifold perturbation needs.

use glam::DAffine3;
use pathspace_core::description::ShapeGeometry;
use pathspace_core::math::Ray;
use pathspace_core::random::PrimarySample;
use pathspace_validation::scene_builder::{SceneBuilder, smooth_sphere};

use super::numbers;
use crate::models::{build, v};

/// A step between neighbouring hits.
const STEP: f32 = 2e-3;

#[test]
fn normals_change_as_their_derivative_says() {
    let mut b = SceneBuilder::new(8);
    let grey = b.diffuse(0.5);
    b.sphere(v(-1.0, 0.0, 0.0), 0.5, grey).flip_normals = true;
    b.mesh(smooth_sphere(0.6, 2), grey).to_world = DAffine3::from_translation(v(0.6, 0.0, 0.0));
    let tube = ShapeGeometry::Cylinder { p0: v(0.0, -1.0, 1.2), p1: v(0.3, 1.0, 1.4), radius: 0.3 };
    b.shape(tube, DAffine3::IDENTITY, grey);
    b.rectangle(v(-2.0, -2.0, -1.0), v(4.0, 0.0, 0.0), v(0.0, 4.0, 0.0), grey);
    let scene = build(&b.finish());
    let mut u = numbers(4, 0);
    let mut pairs = [0; 4];
    for _ in 0..4000 {
        let [a, c] = u.next2();
        let o = glam::Vec3::new(a - 0.5, c - 0.5, 1.0);
        let d = glam::Vec3::new(u.next() - 0.5, u.next() - 0.5, -1.5).normalize();
        let offset = glam::Vec3::new(u.next() - 0.5, u.next() - 0.5, 0.0) * STEP;
        let (Some(p), Some(q)) =
            (scene.intersect(&Ray::new(o, d)), scene.intersect(&Ray::new(o + offset, d)))
        else {
            continue;
        };
        // Steps at grazing incidence are long.
        if p.prim != q.prim || p.n_g.dot(d).abs() < 0.3 {
            continue;
        }
        let change = (q.frame.n.as_dvec3() - p.frame.n.as_dvec3()).as_vec3();
        let step = q.p.as_dvec3() - p.p.as_dvec3();
        let said = scene.normal_change(&p, step).as_vec3();
        // Second order in the step in units of the world (the sphere has the curvature 2), and the
        // rounding of normals.
        let world = step / scene.normalisation().scale;
        let bound = 2.2 * world.length_squared() as f32 + 1e-6;
        assert!(change.distance(said) < bound, "shape {}: {change} {said}", p.shape);
        pairs[p.shape as usize] += 1;
    }
    assert!(pairs.iter().all(|n| *n > 50), "{pairs:?}");
}
