//! Leaving surfaces: no self-hits, no light through walls, symmetric visibility.

use glam::Vec3;
use pathspace_core::geometry::{Accel, DiskPrim, Primitives, SpherePrim, offset_origin, segment};
use pathspace_core::math::Ray;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use super::meshes::{blob, room, rotated_room};
use super::rays::{count, direction, in_cube};

/// Direction about the normal: anywhere in the hemisphere, or grazing down to 10⁻⁴.
fn leaving(rng: &mut Pcg64Mcg, n: Vec3) -> Vec3 {
    let d = direction(rng);
    let d = if d.dot(n) < 0.0 { -d } else { d };
    if rng.random() {
        d
    } else {
        let across = (d - n * d.dot(n)).normalize_or_zero();
        across + n * 10.0_f32.powf(-4.0 + 3.0 * rng.random::<f32>())
    }
}

/// Traces into the scene from inside, leaves the hit into the hemisphere it came from and counts
/// rays that meet the same primitive again, which a flat or convex-from-outside surface forbids.
fn self_hits(accel: &Accel, n: usize, origin: impl Fn(&mut Pcg64Mcg) -> Vec3 + Sync) -> usize {
    count(n, 31, |rng| {
        let o = origin(rng);
        let ray = Ray::new(o, direction(rng));
        let Some(hit) = accel.closest(&ray) else { return false };
        let p = accel.position(&hit, &ray);
        let n = accel.normal(hit.prim, p);
        let n = if n.dot(ray.d) > 0.0 { -n } else { n };
        let d = leaving(rng, n);
        let o = offset_origin(p, n, accel.error_bound(hit.prim, p), d);
        accel.closest(&Ray::new(o, d)).is_some_and(|h| h.prim == hit.prim)
    })
}

fn mesh(triangles: Vec<[Vec3; 3]>) -> Accel {
    Accel::build(Primitives { triangles, ..Primitives::default() }).expect("a finite mesh")
}

#[test]
fn a_ray_that_leaves_a_triangle_does_not_meet_it_again() {
    for (name, triangles) in [
        ("room", room(1)),
        ("rotated room", rotated_room(1)),
        ("fine rotated room", rotated_room(16)),
        ("blob", blob(128)),
    ] {
        let hits = self_hits(&mesh(triangles), 1 << 20, |rng| in_cube(rng, 0.25));
        assert_eq!(hits, 0, "{name}");
    }
}

#[test]
fn a_ray_that_leaves_a_sphere_or_a_disk_does_not_meet_it_again() {
    let mut p = Primitives::default();
    for (i, radius) in [0.3, 0.05, 1e-3].into_iter().enumerate() {
        let center = Vec3::new(0.5 * i as f32 - 0.6, 0.2, 0.1);
        p.spheres.push(SpherePrim { center, radius });
    }
    p.disks.push(DiskPrim {
        center: Vec3::new(0.1, -0.6, 0.0),
        u: Vec3::new(0.5, 0.1, 0.2),
        v: Vec3::new(-0.2, 0.0, 0.5),
    });
    let accel = Accel::build(p).expect("finite primitives");
    assert_eq!(self_hits(&accel, 1 << 20, |rng| in_cube(rng, 0.9)), 0);
}

#[test]
fn rays_do_not_escape_through_the_corners_they_start_in() {
    for (name, triangles) in
        [("room", room(1)), ("rotated room", rotated_room(1)), ("fine room", rotated_room(16))]
    {
        let accel = mesh(triangles);
        let escaped = count(1 << 21, 32, |rng| {
            let ray = Ray::new(in_cube(rng, 0.25), direction(rng));
            let Some(hit) = accel.closest(&ray) else { return true };
            let p = accel.position(&hit, &ray);
            let n = -accel.normal(hit.prim, p);
            let d = leaving(rng, n);
            let o = offset_origin(p, n, accel.error_bound(hit.prim, p), d);
            accel.closest(&Ray::new(o, d)).is_none()
        });
        // Points within rounding of a second wall cannot be told from points beyond it.
        assert!(escaped <= 2, "{name}: {escaped} of 2097152");
    }
}

#[test]
fn the_offset_goes_to_the_side_of_the_direction() {
    let (p, n) = (Vec3::new(0.3, -0.2, 0.9), Vec3::new(0.6, 0.0, 0.8));
    let up = offset_origin(p, n, 1e-6, Vec3::Z) - p;
    let down = offset_origin(p, n, 1e-6, -Vec3::Z) - p;
    assert!(up.dot(n) >= 1e-6 && down.dot(n) <= -1e-6);
    assert_eq!((up.y, down.y), (0.0, 0.0));
}

#[test]
fn visibility_is_symmetric_to_the_bit() {
    let mut scene = Primitives { triangles: blob(48), ..Primitives::default() };
    scene.spheres.push(SpherePrim { center: Vec3::ZERO, radius: 0.2 });
    let accel = Accel::build(scene).expect("a finite scene");
    let differ = count(1_100_000, 33, |rng| {
        let (x, y) = (in_cube(rng, 0.7), in_cube(rng, 0.7));
        let (a, b) = (segment(x, y), segment(y, x));
        a != b || accel.occluded(&a) != accel.occluded(&b)
    });
    assert_eq!(differ, 0);
}

#[test]
fn points_on_two_walls_of_a_room_see_each_other() {
    for (name, triangles) in [("room", room(1)), ("rotated", rotated_room(4))] {
        let accel = mesh(triangles);
        let hidden = count(1 << 20, 34, |rng| {
            let o = in_cube(rng, 0.25);
            let point = |rng: &mut Pcg64Mcg| {
                let ray = Ray::new(o, direction(rng));
                let hit = accel.closest(&ray)?;
                let p = accel.position(&hit, &ray);
                Some((p, -accel.normal(hit.prim, p), accel.error_bound(hit.prim, p)))
            };
            let (Some((x, n, e)), Some((y, m, f))) = (point(rng), point(rng)) else { return true };
            // Cosines of zero carry no light.
            let d = (y - x).normalize_or_zero();
            if d.dot(n) < 1e-4 || d.dot(m) > -1e-4 {
                return false;
            }
            accel.occluded(&segment(offset_origin(x, n, e, d), offset_origin(y, m, f, -d)))
        });
        assert_eq!(hidden, 0, "{name}");
    }
}
