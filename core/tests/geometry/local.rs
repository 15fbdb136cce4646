//! Precision is local: what is large or far away takes none from what is small or near.

use glam::{DVec3, Quat, Vec3};
use pathspace_core::geometry::{Accel, DiskPrim, Primitives, SpherePrim, offset_origin};
use pathspace_core::math::Ray;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use super::meshes::{blob, room, rotated_room};
use super::rays::{count, direction, in_cube, on_triangle};

fn build(p: Primitives) -> Accel {
    Accel::build(p).expect("finite primitives")
}

/// A square of half side `half` about `center` across the unit vector `n`, as two triangles.
fn ground(center: Vec3, n: Vec3, half: f32) -> Vec<[Vec3; 3]> {
    let (u, v) = n.any_orthonormal_pair();
    let corner = |x: f32, y: f32| center + (u * x + v * y) * half;
    let c = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    vec![[c[0], c[1], c[2]], [c[0], c[2], c[3]]]
}

/// Where the line o + t·d meets the plane of a triangle.
fn plane_t(ray: &Ray, [a, b, c]: &[Vec3; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(|v| v.as_dvec3());
    let n = (b - a).cross(c - a);
    n.dot(a - ray.o.as_dvec3()) / n.dot(ray.d.as_dvec3())
}

#[test]
fn far_things_change_no_bit_of_near_hits_and_offsets() {
    let near = Primitives { triangles: blob(12), ..Primitives::default() };
    let alone = build(near.clone());
    let mut together = near;
    for distance in [10.0_f32, 1e3, 1e5, 1e6] {
        together.spheres.push(SpherePrim { center: Vec3::X * distance, radius: 0.1 * distance });
        together.spheres.push(SpherePrim { center: Vec3::ZERO, radius: 3.0 * distance });
    }
    let together = build(together);
    let differ = count(1 << 17, 51, |rng| {
        let ray = Ray::new(in_cube(rng, 0.2), direction(rng));
        let seen = |a: &Accel| {
            let hit = a.closest(&ray)?;
            let p = a.position(&hit, &ray);
            Some((hit.prim, hit.t, p, a.error_bound(hit.prim, p)))
        };
        seen(&alone).is_none() || seen(&alone) != seen(&together)
    });
    assert_eq!(differ, 0);
}

#[test]
fn error_bounds_are_a_few_spacings_of_the_coordinates() {
    for half in [1.0_f32, 1e2, 1e4, 1e6] {
        let a = build(Primitives {
            triangles: ground(Vec3::ZERO, Vec3::new(0.6, 0.0, 0.8), half),
            ..Primitives::default()
        });
        for p in
            [Vec3::new(0.8, 0.1, -0.6), Vec3::new(8.0, 1.0, -6.0), Vec3::new(0.008, 0.0, -0.006)]
        {
            let spacing = p.abs().max_element() * f32::EPSILON;
            let bound = a.error_bound(0, p);
            assert!(bound < 2.0 * spacing + 1e-12 * half, "{half}, {p}: {bound}");
        }
    }
}

#[test]
fn a_disk_close_over_a_ground_is_seen_from_any_side() {
    let tilted = Quat::from_xyzw(0.3, -0.2, 0.5, 0.8).normalize() * Vec3::Z;
    for (half, gap) in [
        (1e2, 1e-6),
        (1e3, 1e-6),
        (1e4, 1e-5),
        (1e4, 1e-4),
        (1e5, 1e-4),
        (1e5, 1e-3),
        (1e6, 1e-3),
        (1e6, 1e-2),
        (1e7, 1e-2),
        (1e8, 1e-1),
    ] {
        for (name, n, floor) in
            [("level", Vec3::Z, 0.0), ("tilted", tilted, 0.02 * half * f32::EPSILON)]
        {
            let triangles = ground(Vec3::ZERO, n, half);
            // The corners are rounded: what is the plane's distance from its nominal place?
            let off = triangles.iter().map(|t| plane_t(&Ray::new(n, -n), t) - 1.0);
            let off = off.fold(0.0_f64, |m, x| m.max(x.abs())) as f32;
            let gap = gap + 2.0 * off + floor;
            let (u, v) = n.any_orthonormal_pair();
            let disk = DiskPrim { center: n * gap, u: u * 0.7, v: v * 0.7 };
            let a = build(Primitives { triangles, disks: vec![disk], ..Primitives::default() });
            let lost = count(1 << 15, 52, |rng| {
                let o = (u * rng.random_range(-3.0..3.0) + v * rng.random_range(-3.0..3.0))
                    + n * rng.random_range(0.5..2.0);
                let r = 0.69 * rng.random::<f32>().sqrt();
                let (sin, cos) = (std::f32::consts::TAU * rng.random::<f32>()).sin_cos();
                let target = n * gap + u * (r * cos) + v * (r * sin);
                let ray = Ray::new(o, target - o);
                let Some(hit) = a.closest(&ray).filter(|h| h.prim == 2) else { return true };
                // From the disk down: the ground, and nothing between ground and disk is lost.
                let p = a.position(&hit, &ray);
                let down = Ray::new(offset_origin(p, n, a.error_bound(2, p), -n), -n);
                let Some(below) = a.closest(&down).filter(|h| h.prim < 2) else { return true };
                let q = a.position(&below, &down);
                let up = Ray::new(offset_origin(q, n, a.error_bound(below.prim, q), n), n);
                a.closest(&up).map(|h| h.prim) != Some(2)
            });
            assert_eq!(lost, 0, "half side {half}, gap {gap}, {name}");
        }
    }
}

/// The diagonal of a square passes through the middle, where the details are.
#[test]
fn hits_near_the_diagonal_of_a_huge_square_lie_where_the_plane_is_met() {
    for half in [1.0, 1e2, 1e4, 1e5, 1e6, 1e7] {
        let triangles = ground(Vec3::ZERO, Vec3::Z, half);
        let a = build(Primitives { triangles: triangles.clone(), ..Primitives::default() });
        let off = count(1 << 16, 53, |rng| {
            let o = Vec3::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0), 1.0);
            let s = rng.random_range(-0.8_f32..0.8);
            let near = s + 10.0_f32.powf(rng.random_range(-9.0..-1.0));
            let on = if rng.random() { Vec3::new(s, near, 0.0) } else { Vec3::new(near, s, 0.0) };
            let ray = Ray::new(o, on - o);
            let Some(hit) = a.closest(&ray) else { return true };
            let p = a.position(&hit, &ray).as_dvec3();
            let exact = o.as_dvec3() + ray.d.as_dvec3() * plane_t(&ray, &triangles[0]);
            // Hits keep off the edges.
            (p - exact).length() > 200.0 * f64::from(f32::EPSILON) + 1e-11 * f64::from(half)
        });
        assert_eq!(off, 0, "half side {half}");
    }
}

/// Rays that come from far away meet small things as f64 says, but for a rim of 10⁻³.
#[test]
fn small_things_are_met_from_a_million_times_their_size() {
    let q = Quat::from_xyzw(0.1, 0.7, -0.3, 0.6).normalize();
    let (u, v) = (q * Vec3::X, q * Vec3::Y);
    for distance in [1e2_f32, 1e3, 1e4, 1e5, 1e6, 1e7] {
        let corner = |x: f32, y: f32| u * x + v * y;
        let tri = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(0.0, 1.0)];
        let a = build(Primitives { triangles: vec![tri], ..Primitives::default() });
        let wrong = count(1 << 16, 54, |rng| {
            let from = direction(rng);
            let o = from * distance;
            let target = corner(rng.random_range(-1.5..1.5), rng.random_range(-1.5..1.5));
            let ray = Ray::new(o, target - o);
            // Where this ray, with its rounded direction, meets the plane.
            let t = plane_t(&ray, &tri);
            let p = ray.o.as_dvec3() + ray.d.as_dvec3() * t;
            let (x, y) = (p.dot(u.as_dvec3()), p.dot(v.as_dvec3()));
            let inside = (1.0 + y).min(1.0 - y - 2.0 * x.abs());
            let grazing = ray.d.normalize().dot(u.cross(v)).abs() < 0.05;
            !grazing && inside.abs() > 1e-3 && a.closest(&ray).is_some() != (inside > 0.0)
        });
        assert_eq!(wrong, 0, "distance {distance}");
    }
}

#[test]
fn shadows_of_far_lamps_are_those_of_the_exact_segment() {
    // A disk of 1 cm, 1 cm over a plate, and lamps at any distance.
    let plate = ground(Vec3::ZERO, Vec3::Z, 2.0);
    let disk = DiskPrim { center: Vec3::Z * 0.01, u: Vec3::X * 0.01, v: Vec3::Y * 0.01 };
    let a = build(Primitives { triangles: plate, disks: vec![disk], ..Primitives::default() });
    for distance in [1.0_f32, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 9e8] {
        let wrong = count(1 << 15, 55, |rng| {
            let lamp = (direction(rng) + Vec3::Z * 1.5) * distance;
            let p = Vec3::new(rng.random_range(-0.03..0.03), rng.random_range(-0.03..0.03), 0.0);
            let (o, e) = (p.as_dvec3(), lamp.as_dvec3());
            let at = o + (e - o) * (0.01 / (e.z - o.z));
            let r = at.truncate().length() / 0.01;
            let hidden = a.hides(p, lamp, [0, u32::MAX]) || a.hides(p, lamp, [1, u32::MAX]);
            (r - 1.0).abs() > 1e-3 && hidden != (r < 1.0)
        });
        assert_eq!(wrong, 0, "distance {distance}");
    }
}

/// A closed mesh of any size, anywhere: rays that leave its walls inwards neither escape nor meet
/// their own triangle.
#[test]
fn closed_meshes_of_every_scale_are_tight_for_rays_that_leave_them() {
    let far = Vec3::new(0.3, -0.5, 0.7);
    for (name, mesh) in [("room", room(1)), ("rotated room", rotated_room(4)), ("blob", blob(12))] {
        for (scale, place) in [
            (1.0, 0.0),
            (1.0, 10.0),
            (1e-3, 0.0),
            (1e-3, 0.1),
            (1e-6, 0.0),
            (1e-6, 1e-4),
            (1e3, 0.0),
            (1e3, 1e4),
            (1e6, 0.0),
            (1e6, 1e7),
        ] {
            let middle = far * place;
            let triangles: Vec<_> = mesh.iter().map(|t| t.map(|v| v * scale + middle)).collect();
            let a = build(Primitives { triangles: triangles.clone(), ..Primitives::default() });
            let bad = count(1 << 15, 56, |rng| leaves_badly(&a, &triangles, middle, rng));
            assert_eq!(bad, 0, "{name}, scale {scale}, {place} away");
        }
    }
}

fn leaves_badly(a: &Accel, mesh: &[[Vec3; 3]], o: Vec3, rng: &mut Pcg64Mcg) -> bool {
    let i = rng.random_range(0..mesh.len());
    let target = on_triangle(rng, &mesh[i]);
    let ray = Ray::new(o, target - o);
    let Some(hit) = a.closest(&ray) else { return true };
    let p = a.position(&hit, &ray);
    let n = -a.normal(hit.prim, p);
    let d = direction(rng);
    let d = if d.dot(n) < 0.0 { -d } else { d };
    let ray = Ray::new(offset_origin(p, n, a.error_bound(hit.prim, p), d), d);
    a.closest(&ray).is_none_or(|h| h.prim == hit.prim)
}

#[test]
fn a_ray_that_leaves_a_triangle_of_a_huge_ground_does_not_meet_the_ground_again() {
    for half in [1.0, 1e2, 1e4, 1e6, 1e8] {
        for n in [Vec3::Z, Vec3::new(0.36, 0.48, 0.8)] {
            let a =
                build(Primitives { triangles: ground(n * 0.3, n, half), ..Primitives::default() });
            let again = count(1 << 16, 57, |rng| {
                let o = n * 1.0 + in_cube(rng, 0.3);
                let reach = 10.0_f32.powf(rng.random_range(-1.0..1.0));
                let ray = Ray::new(o, -n + direction(rng) * reach);
                let Some(hit) = a.closest(&ray) else { return false };
                let p = a.position(&hit, &ray);
                let m = a.normal(hit.prim, p);
                let m = if m.dot(n) < 0.0 { -m } else { m };
                let grazing = 10.0_f32.powf(rng.random_range(-4.0..0.0));
                let d = (direction(rng).cross(m) + m * grazing).normalize();
                let o = offset_origin(p, m, a.error_bound(hit.prim, p), d);
                a.closest(&Ray::new(o, d)).is_some()
            });
            assert_eq!(again, 0, "half side {half}, {n}");
        }
    }
}

/// N equal boxes and boxes whose areas underflow beside the largest: trees stay as deep as others.
#[test]
fn trees_of_equal_and_of_tiny_primitives_are_balanced() {
    let tri = [Vec3::new(0.1, 0.2, 0.3), Vec3::new(0.4, 0.2, 0.3), Vec3::new(0.1, 0.6, 0.5)];
    let equal = build(Primitives { triangles: vec![tri; 20_000], ..Primitives::default() });
    assert!(equal.stats().depth < 16, "{:?}", equal.stats());
    let tiny = |i: usize| {
        let at = DVec3::new(i as f64, (i * 7 % 100) as f64, (i * 13 % 100) as f64) * 1e-17;
        tri.map(|v| (at + v.as_dvec3() * 1e-17).as_vec3())
    };
    let mut triangles: Vec<_> = (0..20_000).map(tiny).collect();
    triangles.push(tri.map(|v| v * 1e5));
    let mixed = build(Primitives { triangles, ..Primitives::default() });
    assert!(mixed.stats().depth < 16, "{:?}", mixed.stats());
}
