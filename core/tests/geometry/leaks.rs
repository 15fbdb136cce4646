//! Every ray from inside a closed mesh hits it: 10⁷ rays and more, on both code paths.

use glam::Vec3;
use pathspace_core::geometry::{Accel, Primitives};
use pathspace_core::math::Ray;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use super::meshes::{blob, room, rotated_room};
use super::rays::{count, direction, in_cube, on_triangle};

/// Rays per kind and mesh on the AVX2 path; a tenth of that on the portable one.
const RAYS: usize = 1 << 19;

/// How rays are drawn: a triangle of the mesh and a random stream give a ray, or none.
type Draw = fn(&mut Pcg64Mcg, &[Vec3; 3]) -> Option<Ray>;

fn aimed(rng: &mut Pcg64Mcg, target: Vec3) -> Option<Ray> {
    let o = inside(rng);
    // Sometimes longer or shorter than the segment: t scales, the hit must not.
    Some(Ray::new(o, (target - o) * [1.0, 0.125, 3.7][rng.random_range(0..3)]))
}

/// Point well inside every mesh.
fn inside(rng: &mut Pcg64Mcg) -> Vec3 {
    in_cube(rng, 0.25)
}

fn random(rng: &mut Pcg64Mcg, _: &[Vec3; 3]) -> Option<Ray> {
    Some(Ray::new(inside(rng), direction(rng)))
}

fn at_edges(rng: &mut Pcg64Mcg, t: &[Vec3; 3]) -> Option<Ray> {
    let i = rng.random_range(0..3);
    let (a, b) = (t[i], t[(i + 1) % 3]);
    let s: f32 = rng.random();
    aimed(rng, a + (b - a) * s)
}

fn at_vertices(rng: &mut Pcg64Mcg, t: &[Vec3; 3]) -> Option<Ray> {
    let corner = rng.random_range(0..3);
    aimed(rng, t[corner])
}

fn axis_parallel_through_vertices(rng: &mut Pcg64Mcg, t: &[Vec3; 3]) -> Option<Ray> {
    let v = t[rng.random_range(0..3)];
    let axis = rng.random_range(0..3);
    let mut o = v;
    o[axis] = 0.2 * (2.0 * rng.random::<f32>() - 1.0);
    let mut d = if rng.random() { Vec3::ZERO } else { Vec3::splat(-0.0) };
    d[axis] = (v - o)[axis];
    // Inside the sphere that every mesh contains.
    (o.length() < 0.39).then(|| Ray::new(o, d))
}

fn from_close_to_walls(rng: &mut Pcg64Mcg, t: &[Vec3; 3]) -> Option<Ray> {
    let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize();
    let distance = 10.0_f32.powf(-5.0 + 2.0 * rng.random::<f32>());
    Some(Ray::new(on_triangle(rng, t) - n * distance, direction(rng)))
}

fn check(mesh: Vec<[Vec3; 3]>, draws: &[(&str, Draw)]) {
    let accel = Accel::build(Primitives { triangles: mesh, ..Primitives::default() })
        .expect("a finite mesh");
    let triangles = &accel.primitives().triangles;
    for (seed, (name, draw)) in draws.iter().enumerate() {
        let rays = |n: usize, misses: &(dyn Fn(&Ray) -> bool + Sync)| {
            count(n, seed as u64, |rng| {
                let i = rng.random_range(0..triangles.len());
                draw(rng, &triangles[i]).is_some_and(|r| misses(&r))
            })
        };
        let wide = rays(RAYS, &|r| accel.closest(r).is_none() || !accel.occluded(r));
        let portable = rays(RAYS / 10, &|r| {
            accel.closest_portable(r).is_none() || !accel.occluded_portable(r)
        });
        assert_eq!((wide, portable), (0, 0), "{name}, {} triangles", triangles.len());
    }
}

const STRUCTURED: [(&str, Draw); 4] = [
    ("random", random),
    ("at edges", at_edges),
    ("at vertices", at_vertices),
    ("axis-parallel", axis_parallel_through_vertices),
];
const ALL: [(&str, Draw); 5] = [
    STRUCTURED[0],
    STRUCTURED[1],
    STRUCTURED[2],
    STRUCTURED[3],
    ("close to walls", from_close_to_walls),
];

#[test]
fn an_axis_aligned_room_is_tight() {
    check(room(1), &ALL);
    check(room(6), &ALL);
}

#[test]
fn a_rotated_room_is_tight() {
    check(rotated_room(1), &ALL);
    check(rotated_room(6), &ALL);
}

#[test]
fn a_mesh_of_200k_triangles_is_tight() {
    check(blob(128), &STRUCTURED);
}
