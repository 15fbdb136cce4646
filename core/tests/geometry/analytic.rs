//! Spheres, disks and cylinders.

use glam::Vec3;
use pathspace_core::geometry::{
    Accel, CylinderPrim, DiskPrim, PrimKind, Primitives, SpherePrim, offset_origin,
};
use pathspace_core::math::Ray;
use rand::RngExt;

use super::rays::{count, direction, in_cube};

fn spheres(spheres: Vec<SpherePrim>) -> Accel {
    Accel::build(Primitives { spheres, ..Primitives::default() }).expect("finite spheres")
}

fn disk(center: Vec3, u: Vec3, v: Vec3) -> Accel {
    let disks = vec![DiskPrim { center, u, v }];
    Accel::build(Primitives { disks, ..Primitives::default() }).expect("a finite disk")
}

#[test]
fn a_sphere_is_hit_from_outside_and_from_inside() {
    let a = spheres(vec![SpherePrim { center: Vec3::new(0.5, 0.0, 0.0), radius: 0.25 }]);
    let t = |o, d| a.closest(&Ray::new(o, d)).map(|h| h.t);
    assert_eq!(t(Vec3::ZERO, Vec3::X), Some(0.25));
    assert_eq!(t(Vec3::ZERO, 2.0 * Vec3::X), Some(0.125));
    assert_eq!(t(Vec3::new(0.5, 0.0, 0.0), Vec3::Y), Some(0.25));
    assert_eq!(t(Vec3::new(1.0, 0.0, 0.0), Vec3::X), None);
}

#[test]
fn a_small_far_sphere_keeps_its_distance_to_an_ulp() {
    let a = spheres(vec![SpherePrim { center: Vec3::new(0.9, 0.0, 0.0), radius: 1e-5 }]);
    let hit = a.closest(&Ray::new(Vec3::new(-0.9, 0.0, 0.0), Vec3::X));
    let exact = 1.8 - 1e-5;
    assert!(hit.is_some_and(|h| (h.t - exact).abs() < 2e-7), "{hit:?}");
}

/// Two spheres 4·10⁻⁵ of the radius apart, as the walls of a thin shell.
#[test]
fn the_inner_of_two_close_spheres_is_always_found_from_between() {
    for radius in [0.02_f32, 0.1, 0.9] {
        let center = Vec3::new(0.03, -0.05, 0.02);
        let inner = SpherePrim { center, radius };
        let a = spheres(vec![inner, SpherePrim { center, radius: radius * (1.0 + 4e-5) }]);
        let lost = count(200_000, 11, |rng| {
            let d = direction(rng);
            let outside = center + d * (radius * 1.2);
            // From outside the outer one is met; from its inner side, straight on, the inner one.
            let aim = center + in_cube(rng, 0.4 * radius);
            let ray = Ray::new(outside, aim - outside);
            let Some(hit) = a.closest(&ray).filter(|h| h.prim == 1) else { return true };
            let p = a.position(&hit, &ray);
            let n = a.normal(hit.prim, p);
            let o = offset_origin(p, n, a.error_bound(hit.prim, p), ray.d);
            let inwards = a.closest(&Ray::new(o, ray.d));
            // And from the inner one back out: the outer one again.
            let Some(first) = inwards.filter(|h| h.prim == 0) else { return true };
            let ray = Ray::new(o, ray.d);
            let q = a.position(&first, &ray);
            let o = offset_origin(q, a.normal(0, q), a.error_bound(0, q), -ray.d);
            a.closest(&Ray::new(o, -ray.d)).map(|h| h.prim) != Some(1)
        });
        assert_eq!(lost, 0, "radius {radius}");
    }
}

fn cylinder(base: Vec3, axis: Vec3, radius: f32) -> Accel {
    let cylinders = vec![CylinderPrim { base, axis, radius }];
    Accel::build(Primitives { cylinders, ..Primitives::default() }).expect("a finite cylinder")
}

#[test]
fn a_cylinder_is_hit_from_outside_and_from_inside_and_is_open_at_its_ends() {
    let a = cylinder(Vec3::new(0.0, 0.0, -0.25), 0.5 * Vec3::Z, 0.25);
    let t = |o, d| a.closest(&Ray::new(o, d)).map(|h| h.t);
    assert_eq!(t(Vec3::new(-0.75, 0.0, 0.1), Vec3::X), Some(0.5));
    assert_eq!(t(Vec3::ZERO, 2.0 * Vec3::Y), Some(0.125));
    assert_eq!(t(Vec3::new(-0.75, 0.0, 0.2501), Vec3::X), None);
    assert_eq!(t(Vec3::new(-0.75, 0.0, 0.2499), Vec3::X), Some(0.5));
    // Down the axis there is nothing; into the open end, the inner side.
    assert_eq!(t(Vec3::new(0.1, 0.0, 0.75), -Vec3::Z), None);
    assert_eq!(t(Vec3::new(-0.25, 0.0, 0.5), Vec3::new(0.5, 0.0, -0.5)), Some(1.0));
}

#[test]
fn hits_of_a_slanted_cylinder_lie_on_it_and_have_its_normal() {
    let (base, axis, radius) = (Vec3::new(0.1, -0.3, 0.2), Vec3::new(0.2, 0.5, -0.3), 0.15_f32);
    let a = cylinder(base, axis, radius);
    let unit = axis.as_dvec3().normalize();
    let hits = std::sync::atomic::AtomicUsize::new(0);
    let wrong = count(100_000, 13, |rng| {
        let ray = Ray::new(in_cube(rng, 0.9), direction(rng));
        let Some(hit) = a.closest(&ray) else { return false };
        hits.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let p = a.position(&hit, &ray);
        let from = p.as_dvec3() - base.as_dvec3();
        let along = from.dot(unit);
        let across = from - unit * along;
        let off = (across.length() - f64::from(radius)).abs();
        let tilt = (a.normal(hit.prim, p).as_dvec3() - across.normalize()).length();
        let reached = (p - ray.at(hit.t as f32)).length() < 1e-6;
        let on = (-1e-7..=axis.as_dvec3().length() + 1e-7).contains(&along);
        !(on && reached && off < f64::from(a.error_bound(hit.prim, p)) && tilt < 1e-6)
    });
    assert_eq!(wrong, 0);
    assert!(hits.into_inner() > 2000);
}

#[test]
fn a_disk_ends_at_its_rim() {
    let a = disk(Vec3::new(0.0, 0.0, 0.3), 0.5 * Vec3::X, 0.25 * Vec3::Y);
    let hit = |x, y| a.closest(&Ray::new(Vec3::new(x, y, 0.0), Vec3::Z));
    assert!(hit(0.499, 0.0).is_some() && hit(0.501, 0.0).is_none());
    assert!(hit(0.0, 0.249).is_some() && hit(0.0, 0.251).is_none());
    assert!(hit(0.36, 0.18).is_none(), "inside the rectangle of the axes, outside the ellipse");
    let h = hit(0.25, -0.125).map(|h| (h.t as f32, h.b1, h.b2));
    assert_eq!(h, Some((0.3, 0.5, -0.5)));
}

#[test]
fn a_slanted_disk_gives_the_coordinates_of_the_hit() {
    let (c, u) = (Vec3::new(0.1, 0.2, -0.1), Vec3::new(0.3, 0.1, -0.2));
    let v = u.cross(Vec3::new(0.2, 0.9, 0.3)).normalize() * 0.2;
    let a = disk(c, u, v);
    let wrong = count(50_000, 12, |rng| {
        let (x, y): (f32, f32) = (rng.random_range(-0.7..0.7), rng.random_range(-0.7..0.7));
        let p = c + u * x + v * y;
        let o = p + direction(rng) * 0.5;
        let ray = Ray::new(o, p - o);
        // Nearly along the disk the rounding of the origin moves the hit.
        let grazing = ray.d.dot(u.cross(v).normalize()).abs() < 0.005;
        let hit = a.closest(&ray);
        !grazing && hit.is_none_or(|h| (h.b1 as f32 - x).abs().max((h.b2 as f32 - y).abs()) > 1e-4)
    });
    assert_eq!(wrong, 0);
}

#[test]
fn a_ray_in_the_plane_of_a_disk_misses() {
    let a = disk(Vec3::ZERO, 0.5 * Vec3::X, 0.5 * Vec3::Y);
    assert_eq!(a.closest(&Ray::new(Vec3::new(-0.9, 0.1, 0.0), Vec3::X)), None);
}

#[test]
fn ids_run_over_triangles_then_spheres_then_disks_then_cylinders() {
    let at = |x: f32| Vec3::new(x, 0.0, 0.5);
    let p = Primitives {
        triangles: vec![[at(-0.6), at(-0.4), at(-0.5) + Vec3::Y * 0.1]],
        spheres: vec![SpherePrim { center: at(0.0), radius: 0.1 }],
        disks: vec![DiskPrim { center: at(0.5), u: Vec3::X * 0.1, v: Vec3::Y * 0.1 }],
        cylinders: vec![CylinderPrim { base: at(0.8), axis: Vec3::Y * 0.1, radius: 0.05 }],
    };
    assert_eq!(p.locate(0), Some((PrimKind::Triangle, 0)));
    assert_eq!(p.locate(1), Some((PrimKind::Sphere, 0)));
    assert_eq!(p.locate(2), Some((PrimKind::Disk, 0)));
    assert_eq!(p.locate(3), Some((PrimKind::Cylinder, 0)));
    assert_eq!(p.locate(4), None);
    let a = Accel::build(p).expect("finite primitives");
    let hit = |x: f32| a.closest(&Ray::new(Vec3::new(x, 0.02, 0.0), Vec3::Z)).map(|h| h.prim);
    let hits = [hit(-0.5), hit(0.0), hit(0.5), hit(0.8), hit(0.9)];
    assert_eq!(hits, [Some(0), Some(1), Some(2), Some(3), None]);
}
