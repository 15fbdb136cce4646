//! Leaving surfaces: no self-hits, no light through walls, symmetric visibility.

use glam::Vec3;
use pathspace_core::geometry::{
    Accel, CylinderPrim, DiskPrim, Primitives, SpherePrim, offset_origin, segment,
};
use pathspace_core::math::{NO_PRIM, Ray};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use super::meshes::{blob, lattice_cube, room, rotated_room};
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

/// Traces into the scene, leaves the hit into the hemisphere it came from and counts rays that meet
/// the same primitive again before `shortest`.
fn self_hits(
    accel: &Accel,
    rays: usize,
    origin: impl Fn(&mut Pcg64Mcg) -> Vec3 + Sync,
    shortest: impl Fn(u32, bool, f32) -> f32 + Sync,
) -> usize {
    count(rays, 31, |rng| {
        let o = origin(rng);
        let ray = Ray::new(o, direction(rng));
        let Some(hit) = accel.closest(&ray) else { return false };
        let p = accel.position(&hit, &ray);
        let n = accel.normal(hit.prim, p);
        let inside = n.dot(ray.d) > 0.0;
        let n = if inside { -n } else { n };
        let d = leaving(rng, n);
        let o = offset_origin(p, n, accel.error_bound(hit.prim, p), d);
        let again = accel.closest(&Ray::new(o, d)).filter(|h| h.prim == hit.prim);
        again.is_some_and(|h| {
            (h.t as f32) < shortest(hit.prim, inside, d.dot(n) / d.length_squared())
        })
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
        let hits =
            self_hits(&mesh(triangles), 1 << 19, |rng| in_cube(rng, 0.25), |_, _, _| f32::MAX);
        assert_eq!(hits, 0, "{name}");
    }
}

#[test]
fn a_ray_that_leaves_a_sphere_a_disk_or_a_cylinder_does_not_meet_it_again() {
    let mut p = Primitives::default();
    const RADII: [f32; 3] = [0.3, 0.05, 1e-3];
    for (i, radius) in RADII.into_iter().enumerate() {
        let center = Vec3::new(0.5 * i as f32 - 0.6, 0.2, 0.1);
        p.spheres.push(SpherePrim { center, radius });
    }
    p.disks.push(DiskPrim {
        center: Vec3::new(0.1, -0.6, 0.0),
        u: Vec3::new(0.5, 0.1, 0.2),
        v: Vec3::new(-0.2, 0.0, 0.5),
    });
    for (i, radius) in RADII.into_iter().enumerate() {
        let base = Vec3::new(0.5 * i as f32 - 0.6, 0.2, -0.9);
        p.cylinders.push(CylinderPrim { base, axis: Vec3::new(0.1, -0.2, 0.4), radius });
    }
    let accel = Accel::build(p).expect("finite primitives");
    // From inside a sphere the same one is met again, at the end of the chord of 2 r cos θ. A chord
    // of a cylinder is the longer the less it goes across.
    let chord = |prim: u32, inside: bool, cos: f32| match prim {
        0..=2 if inside => (2.0 * RADII[prim as usize] * cos - 1e-6) * 0.9,
        4..=6 if inside => (2.0 * RADII[prim as usize - 4] * cos - 1e-6) * 0.9,
        _ => f32::MAX,
    };
    let origin = |rng: &mut Pcg64Mcg| {
        let (i, p) = (rng.random_range(0..8), accel.primitives());
        match (p.spheres.get(i), p.cylinders.get(i.wrapping_sub(4))) {
            (Some(s), _) => s.center + in_cube(rng, 0.5 * s.radius),
            (_, Some(c)) => c.base + c.axis * rng.random::<f32>() + in_cube(rng, 0.5 * c.radius),
            _ => in_cube(rng, 0.9),
        }
    };
    assert_eq!(self_hits(&accel, 1 << 20, origin, chord), 0);
}

/// A point within rounding of an edge of the triangle or up to 10⁻⁴ inside.
fn at_an_edge(rng: &mut Pcg64Mcg, t: &[Vec3; 3]) -> Vec3 {
    let corner = rng.random_range(0..3);
    let (a, b, c) = (t[corner], t[(corner + 1) % 3], t[(corner + 2) % 3]);
    let on = a + (b - a) * if rng.random() { rng.random() } else { 0.0 };
    let within = if rng.random() { 10.0_f32.powf(-9.0 + 5.0 * rng.random::<f32>()) } else { 0.0 };
    on + (c - on) * within
}

#[test]
fn rays_do_not_escape_through_the_corners_they_start_in() {
    for (name, triangles) in [
        ("room", room(1)),
        ("rotated room", rotated_room(1)),
        ("fine room", rotated_room(16)),
        ("blob", blob(12)),
    ] {
        let targets = triangles.clone();
        let accel = mesh(triangles);
        for anywhere in [false, true] {
            let escaped = count(1 << 19, 32, |rng| {
                let o = in_cube(rng, 0.25);
                let target = &targets[rng.random_range(0..targets.len())];
                let d = if anywhere { direction(rng) } else { at_an_edge(rng, target) - o };
                let ray = Ray::new(o, d);
                let Some(hit) = accel.closest(&ray) else { return true };
                let p = accel.position(&hit, &ray);
                let n = -accel.normal(hit.prim, p);
                let d = leaving(rng, n);
                let o = offset_origin(p, n, accel.error_bound(hit.prim, p), d);
                accel.closest(&Ray::new(o, d)).is_none()
            });
            assert_eq!(escaped, 0, "{name}, anywhere: {anywhere}");
        }
    }
}

/// A box whose walls lean by the angle, so that they meet floor and ceiling at it and at its
/// supplement.
fn leaning(degrees: f32) -> Vec<[Vec3; 3]> {
    let lean = 1.0 / degrees.to_radians().tan();
    lattice_cube(1, |p| Vec3::new(p.x + 0.5 * lean * p.z, p.y, 0.5 * p.z) * 0.25)
}

#[test]
fn rays_do_not_escape_where_walls_meet_at_any_angle() {
    for degrees in [10.0, 15.0, 20.0, 30.0, 40.0, 45.0, 50.0, 60.0, 70.0, 80.0] {
        for (shift, middle) in [("at the origin", Vec3::ZERO), ("aside", Vec3::new(0.3, -0.7, 0.9))]
        {
            let targets: Vec<_> =
                leaning(degrees).into_iter().map(|t| t.map(|v| v + middle)).collect();
            let accel = mesh(targets.clone());
            let escaped = count(1 << 19, 35, |rng| {
                let o = middle + in_cube(rng, 0.01);
                let target = &targets[rng.random_range(0..targets.len())];
                let ray = Ray::new(o, at_an_edge(rng, target) - o);
                let Some(hit) = accel.closest(&ray) else { return true };
                let p = accel.position(&hit, &ray);
                let n = -accel.normal(hit.prim, p);
                let d = leaving(rng, n);
                let o = offset_origin(p, n, accel.error_bound(hit.prim, p), d);
                accel.closest(&Ray::new(o, d)).is_none()
            });
            assert_eq!(escaped, 0, "{degrees}°, {shift}");
        }
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
        let hides = |x, y| accel.hides(x, y, [NO_PRIM; 2]);
        a != b || accel.occluded(&a) != accel.occluded(&b) || hides(x, y) != hides(y, x)
    });
    assert_eq!(differ, 0);
}

#[test]
fn points_on_two_walls_of_a_room_see_each_other() {
    for (name, triangles) in [("room", room(1)), ("rotated", rotated_room(16))] {
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
            let (x, y) = (offset_origin(x, n, e, d), offset_origin(y, m, f, -d));
            accel.hides(x, y, [NO_PRIM; 2])
        });
        assert_eq!(hidden, 0, "{name}");
    }
}
