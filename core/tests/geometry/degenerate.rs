//! Bad input and degenerate rays and shapes.

use glam::Vec3;
use pathspace_core::geometry::{
    Accel, CylinderPrim, DiskPrim, GeometryError, Primitives, SpherePrim,
};
use pathspace_core::math::Ray;

use super::meshes::room;
use super::rays::{count, in_cube};

fn mesh(triangles: Vec<[Vec3; 3]>) -> Accel {
    Accel::build(Primitives { triangles, ..Primitives::default() }).expect("a finite mesh")
}

#[test]
fn an_empty_scene_hits_nothing() {
    let a = mesh(vec![]);
    let ray = Ray::new(Vec3::ZERO, Vec3::X);
    assert_eq!((a.closest(&ray), a.closest_portable(&ray)), (None, None));
    assert!(!a.occluded(&ray) && !a.occluded_portable(&ray));
}

#[test]
fn a_single_triangle_works() {
    let a = mesh(vec![[Vec3::ZERO, Vec3::X, Vec3::Y]]);
    let hit = a.closest(&Ray::new(Vec3::new(0.25, 0.5, 1.0), -Vec3::Z));
    assert_eq!(hit.map(|h| (h.t, h.prim, h.b1, h.b2)), Some((1.0, 0, 0.25, 0.5)));
}

#[test]
fn triangles_without_area_are_never_hit() {
    // Corners whose middle is a number f32 has.
    let (a, b) = (Vec3::new(-0.5, 0.125, 0.25), Vec3::new(0.75, 0.25, -0.375));
    let accel = mesh(vec![[a, b, a], [a, a, a], [a, b, (a + b) / 2.0], [b, b, a]]);
    let aimed = count(100_000, 21, |rng| {
        let s: f32 = rand::RngExt::random(rng);
        let o = in_cube(rng, 0.5);
        accel.occluded(&Ray::new(o, a + (b - a) * s - o))
    });
    assert_eq!(aimed, 0);
}

#[test]
fn rays_that_are_not_rays_hit_nothing() {
    let mut scene = Primitives { triangles: room(2), ..Primitives::default() };
    scene.spheres.push(SpherePrim { center: Vec3::ZERO, radius: 0.1 });
    scene.disks.push(DiskPrim { center: Vec3::ZERO, u: Vec3::X * 0.2, v: Vec3::Y * 0.2 });
    let a = Accel::build(scene).expect("a finite scene");
    let good = Ray::new(Vec3::new(0.2, 0.1, 0.1), Vec3::new(1.0, 0.5, 0.25));
    assert!(a.closest(&good).is_some());
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            let (mut r, mut s) = (good, good);
            r.o[axis] = bad;
            s.d[axis] = bad;
            assert_eq!((a.closest(&r), a.closest(&s)), (None, None), "{bad} on axis {axis}");
            assert!(!a.occluded(&r) && !a.occluded(&s));
        }
    }
    for (tmin, tmax) in [(f32::NAN, 1.0), (0.0, f32::NAN), (1.0, 0.5), (0.0, 0.0), (0.0, -1.0)] {
        assert_eq!(a.closest(&Ray { tmin, tmax, ..good }), None, "({tmin}, {tmax})");
    }
    assert_eq!(a.closest(&Ray { d: Vec3::ZERO, ..good }), None);
    assert_eq!(a.closest(&Ray { d: Vec3::splat(1e-40), ..good }), None);
    assert!(a.closest(&Ray { d: good.d * 1e-30, ..good }).is_some());
    assert!(a.closest(&Ray { d: good.d * 1e30, ..good }).is_some());
    assert!(a.closest(&Ray { tmin: f32::NEG_INFINITY, ..good }).is_some_and(|h| h.t > 0.0));
}

#[test]
fn both_ends_of_the_interval_are_exclusive() {
    let a = mesh(room(1));
    let ray = |tmin, tmax| Ray { tmin, tmax, ..Ray::new(Vec3::new(0.125, 0.2, 0.0), Vec3::X) };
    let t = a.closest(&ray(0.0, f32::INFINITY)).map_or(0.0, |h| h.t as f32);
    assert_eq!(t, 0.375);
    assert!(a.occluded(&ray(0.0, t.next_up())) && !a.occluded(&ray(0.0, t)));
    assert!(a.occluded(&ray(t.next_down(), 1.0)) && !a.occluded(&ray(t, 1.0)));
}

#[test]
fn hits_nearer_than_a_ten_thousandth_count() {
    let a = mesh(room(1));
    for distance in [1e-4_f32, 1e-5, 1e-6] {
        let o = Vec3::new(0.5 - distance, 0.05, 0.1);
        let d = Vec3::new(1.0, 0.25, -0.125);
        let t = a.closest(&Ray::new(o, d)).map(|h| h.t as f32);
        assert!(t.is_some_and(|t| (t - (0.5 - o.x)).abs() < 2e-7), "{distance}: {t:?}");
        let long = a.closest(&Ray::new(o, d * 100.0)).map(|h| h.t as f32);
        assert!(long.is_some_and(|t| t < 2.0 * distance / 100.0), "{distance}: {long:?}");
    }
}

#[test]
fn input_that_is_not_finite_is_refused_by_name() {
    let nan = Vec3::new(0.0, f32::NAN, 0.0);
    let refuse = |p: Primitives| Accel::build(p).err().map(|e| e.to_string()).unwrap_or_default();
    let triangles = vec![[Vec3::ZERO, Vec3::X, Vec3::Y], [Vec3::ZERO, nan, Vec3::Y]];
    let message = refuse(Primitives { triangles, ..Primitives::default() });
    assert_eq!(message, "triangle 1: corner 1 (0, NaN, 0) is not finite");
    let sphere = |center, radius| {
        let spheres = vec![SpherePrim { center, radius }];
        Accel::build(Primitives { spheres, ..Primitives::default() }).err()
    };
    assert!(matches!(sphere(nan, 1.0), Some(GeometryError::NotFinite { index: 0, .. })));
    assert!(matches!(sphere(Vec3::ZERO, f32::INFINITY), Some(GeometryError::NotFinite { .. })));
    assert!(matches!(sphere(Vec3::ZERO, 0.0), Some(GeometryError::Radius { .. })));
    assert!(matches!(sphere(Vec3::ZERO, -1.0), Some(GeometryError::Radius { .. })));
    assert!(matches!(sphere(Vec3::X * 2e9, 1.0), Some(GeometryError::OutOfRange { .. })));
    let disks = vec![DiskPrim { center: Vec3::ZERO, u: Vec3::X, v: nan }];
    assert!(refuse(Primitives { disks, ..Primitives::default() }).contains("disk 0: the axis v"));
    let cylinder = |axis, radius| {
        let cylinders = vec![CylinderPrim { base: Vec3::ZERO, axis, radius }];
        refuse(Primitives { cylinders, ..Primitives::default() })
    };
    assert!(cylinder(nan, 1.0).contains("cylinder 0: the axis"));
    assert_eq!(cylinder(Vec3::X, 0.0), "cylinder 0: radius 0 is not positive");
}
