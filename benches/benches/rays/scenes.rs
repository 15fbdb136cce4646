//! Three meshes and five sets of rays on each.

use glam::{Quat, Vec3};
use pathspace_core::geometry::{Accel, offset_origin, segment};
use pathspace_core::math::{Frame, Ray};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

#[path = "../../../core/tests/geometry/meshes.rs"]
#[expect(dead_code, reason = "shared with the tests, which use more of it")]
mod meshes;

/// Camera images are this many pixels wide and high.
const SIDE: u32 = 512;

/// A mesh, where it is looked at from, and a rectangular light.
pub struct Scene {
    pub name: &'static str,
    pub triangles: Vec<[Vec3; 3]>,
    eye: Vec3,
    at: Vec3,
    /// Half the width of the image at distance 1.
    spread: f32,
    light: [Vec3; 3],
}

pub fn all() -> Vec<Scene> {
    vec![
        Scene {
            name: "room",
            triangles: room(),
            eye: Vec3::new(0.0, 0.02, -0.43),
            at: Vec3::new(0.0, -0.05, 0.4),
            spread: 0.7,
            light: [Vec3::new(-0.45, -0.3, 0.2), Vec3::Y * 0.3, Vec3::Z * 0.2],
        },
        Scene {
            name: "blob",
            triangles: meshes::blob(128),
            eye: Vec3::new(0.1, 0.15, -0.4),
            at: Vec3::ZERO,
            spread: 0.9,
            light: [Vec3::new(-0.3, 0.35, -0.1), Vec3::X * 0.3, Vec3::new(0.0, 0.0, 0.3)],
        },
        Scene {
            name: "terrain",
            triangles: terrain(1000),
            eye: Vec3::new(-0.55, 0.25, -0.6),
            at: Vec3::new(0.1, -0.1, 0.1),
            spread: 0.7,
            light: [Vec3::new(-0.6, 0.05, -0.6), Vec3::X * 0.3, Vec3::Z * 0.3],
        },
    ]
}

/// Closed room with two rotated boxes on the floor and a lamp under the ceiling: 38 triangles.
fn room() -> Vec<[Vec3; 3]> {
    let mut t = meshes::room(1);
    for (c, h, angle) in [
        (Vec3::new(-0.2, -0.15, 0.15), Vec3::new(0.13, 0.25, 0.13), 0.3),
        (Vec3::new(0.18, -0.27, -0.1), Vec3::new(0.13, 0.13, 0.13), -0.3),
    ] {
        let q = Quat::from_rotation_y(angle);
        t.extend(meshes::lattice_cube(1, |p| c + q * (p * h)));
    }
    let (o, u, v) = (Vec3::new(-0.1, 0.395, -0.1), Vec3::X * 0.2, Vec3::Z * 0.2);
    t.extend([[o, o + u, o + u + v], [o, o + u + v, o + v]]);
    t
}

/// Height field of 2 n² triangles.
fn terrain(n: i32) -> Vec<[Vec3; 3]> {
    let height = |x: f32, z: f32| {
        let mut h = 0.0;
        let (mut a, mut f) = (0.12_f32, 3.0_f32);
        for k in 0..8 {
            let r = 0.7 * k as f32;
            h += a * (f * x + 1.3 * r + (f * 0.6 * z).sin()).sin() * (f * z - r).cos();
            a *= 0.5;
            f *= 2.1;
        }
        h - 0.1
    };
    let at = |i: i32, j: i32| {
        let (x, z) = (1.3 * i as f32 / n as f32 - 0.65, 1.3 * j as f32 / n as f32 - 0.65);
        Vec3::new(x, height(x, z), z)
    };
    let mut t = Vec::with_capacity(2 * (n * n) as usize);
    for i in 0..n {
        for j in 0..n {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            t.extend([[a, b, c], [a, c, d]]);
        }
    }
    t
}

/// A set of rays and the question asked of them.
pub struct Workload {
    pub name: &'static str,
    pub rays: Vec<Ray>,
    pub any: bool,
}

/// Camera rays in scan order, two bounces of cosine-distributed rays, and shadow segments to the
/// light, as closest-hit and as any-hit queries.
pub fn workloads(scene: &Scene, accel: &Accel) -> Vec<Workload> {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let camera = camera(scene);
    let bounce1 = bounce(accel, &camera, &mut rng);
    let bounce2 = bounce(accel, &bounce1, &mut rng);
    let from: Vec<Ray> =
        camera.iter().step_by(2).chain(bounce1.iter().step_by(2)).copied().collect();
    let shadow = shadow(scene, accel, &from, &mut rng);
    let set = |name, rays, any| Workload { name, rays, any };
    vec![
        set("camera", camera, false),
        set("bounce1", bounce1, false),
        set("bounce2", bounce2, false),
        set("shadow-closest", shadow.clone(), false),
        set("shadow-any", shadow, true),
    ]
}

fn camera(scene: &Scene) -> Vec<Ray> {
    let forward = (scene.at - scene.eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let pixel = |i: u32| (2.0 * (i as f32 + 0.5) / SIDE as f32 - 1.0) * scene.spread;
    (0..SIDE * SIDE)
        .map(|i| {
            let d = forward + right * pixel(i % SIDE) - up * pixel(i / SIDE);
            Ray::new(scene.eye, d.normalize())
        })
        .collect()
}

/// Hit point pushed off the surface to the side the ray came from, and the normal of that side.
fn hit(accel: &Accel, ray: &Ray) -> Option<(Vec3, Vec3)> {
    let hit = accel.closest(ray)?;
    let p = accel.position(&hit, ray);
    let n = accel.normal(hit.prim, p);
    let n = if n.dot(ray.d) > 0.0 { -n } else { n };
    Some((offset_origin(p, n, accel.error_bound(hit.prim, p), n), n))
}

fn bounce(accel: &Accel, rays: &[Ray], rng: &mut Pcg64Mcg) -> Vec<Ray> {
    let hits = rays.iter().filter_map(|r| hit(accel, r));
    hits.map(|(p, n)| {
        let (r, phi) = (rng.random::<f32>().sqrt(), std::f32::consts::TAU * rng.random::<f32>());
        let local = Vec3::new(r * phi.cos(), r * phi.sin(), (1.0 - r * r).max(1e-6).sqrt());
        Ray::new(p, Frame::from_normal(n).to_world(local))
    })
    .collect()
}

fn shadow(scene: &Scene, accel: &Accel, rays: &[Ray], rng: &mut Pcg64Mcg) -> Vec<Ray> {
    let [o, u, v] = scene.light;
    let hits = rays.iter().filter_map(|r| hit(accel, r));
    hits.filter_map(|(p, n)| {
        let q = o + u * rng.random::<f32>() + v * rng.random::<f32>();
        ((q - p).dot(n) > 0.0).then(|| segment(p, q))
    })
    .collect()
}
