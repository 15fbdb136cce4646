//! The tree against plain tests of every primitive, and the instruction sets against each other.

use glam::{DVec3, Vec3};
use pathspace_core::geometry::{
    Accel, CylinderPrim, DiskPrim, Hit, InstructionSet, Primitives, SpherePrim,
};
use pathspace_core::math::Ray;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use super::meshes::blob;
use super::rays::{count, direction, in_cube};

/// Mixed scene of `n` small triangles, spheres, disks and cylinders each.
fn mixed(n: usize, size: f32) -> Primitives {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let mut p = Primitives::default();
    for _ in 0..n {
        let c = in_cube(&mut rng, 0.5);
        let corner = |rng: &mut Pcg64Mcg| c + in_cube(rng, size);
        p.triangles.push([corner(&mut rng), corner(&mut rng), corner(&mut rng)]);
        let center = in_cube(&mut rng, 0.5);
        p.spheres.push(SpherePrim { center, radius: size * rng.random_range(0.1..1.0) });
        let center = in_cube(&mut rng, 0.5);
        let u = in_cube(&mut rng, size);
        let v = u.cross(direction(&mut rng)) * rng.random_range(0.3..2.0);
        p.disks.push(DiskPrim { center, u, v });
        let (base, axis) = (in_cube(&mut rng, 0.5), in_cube(&mut rng, size));
        p.cylinders.push(CylinderPrim { base, axis, radius: size * rng.random_range(0.1..1.0) });
    }
    p
}

/// Ray of any kind: from inside or outside, oblique or axis-parallel, bounded or not.
fn any_ray(rng: &mut Pcg64Mcg) -> Ray {
    let reach = if rng.random() { 0.5 } else { 2.0 };
    let o = in_cube(rng, reach);
    let mut d = (in_cube(rng, 0.5) - o) * rng.random_range(0.1..4.0);
    for axis in 0..3 {
        if rng.random_range(0..16) == 0 {
            d[axis] = 0.0;
        }
    }
    let tmin = if rng.random() { 0.0 } else { 0.3 * rng.random::<f32>() };
    let tmax = if rng.random() { f32::INFINITY } else { tmin + rng.random::<f32>() };
    Ray { tmin, tmax, ..Ray::new(o, d) }
}

fn bits(h: Option<Hit>) -> Option<(u64, u32, u64, u64)> {
    h.map(|h| (h.t.to_bits(), h.prim, h.b1.to_bits(), h.b2.to_bits()))
}

fn build(p: Primitives) -> Accel {
    Accel::build(p).expect("finite primitives")
}

#[test]
fn all_instruction_sets_give_the_same_bits() {
    let mut scene = mixed(2000, 0.05);
    scene.triangles.extend(blob(32));
    let accel = build(scene.clone());
    for (seed, set) in [InstructionSet::Portable, InstructionSet::Avx2].into_iter().enumerate() {
        let mut other = build(scene.clone());
        other.restrict(set);
        let differ = count(525_000, 1 + seed as u64, |rng| {
            let ray = any_ray(rng);
            bits(accel.closest(&ray)) != bits(other.closest(&ray))
                || accel.occluded(&ray) != other.occluded(&ray)
        });
        assert_eq!(differ, 0, "{set:?}");
    }
}

#[test]
fn closest_equals_the_least_over_trees_of_one_primitive() {
    let scene = mixed(25, 0.3);
    let mut single: Vec<Accel> = vec![];
    for t in &scene.triangles {
        single.push(build(Primitives { triangles: vec![*t], ..Primitives::default() }));
    }
    for s in &scene.spheres {
        single.push(build(Primitives { spheres: vec![*s], ..Primitives::default() }));
    }
    for d in &scene.disks {
        single.push(build(Primitives { disks: vec![*d], ..Primitives::default() }));
    }
    for c in &scene.cylinders {
        single.push(build(Primitives { cylinders: vec![*c], ..Primitives::default() }));
    }
    let accel = build(scene);
    let differ = count(100_000, 2, |rng| {
        let ray = any_ray(rng);
        let hits = single.iter().enumerate().filter_map(|(i, a)| {
            assert_eq!(a.closest(&ray).is_some(), a.occluded(&ray));
            a.closest(&ray).map(|h| Hit { prim: i as u32, ..h })
        });
        let least = hits.min_by(|a, b| a.t.total_cmp(&b.t).then(a.prim.cmp(&b.prim)));
        bits(accel.closest(&ray)) != bits(least) || accel.occluded(&ray) != least.is_some()
    });
    assert_eq!(differ, 0);
}

/// Distance to a triangle in f64 (Möller & Trumbore 1997), with the smallest barycentric weight.
fn reference_triangle(t: &[Vec3; 3], ray: &Ray) -> Option<(f64, f64)> {
    let [a, b, c] = t.map(|v| v.as_dvec3());
    let (o, d): (DVec3, DVec3) = (ray.o.as_dvec3(), ray.d.as_dvec3());
    let (e, f) = (b - a, c - a);
    let p = d.cross(f);
    let det = e.dot(p);
    let u = (o - a).dot(p) / det;
    let q = (o - a).cross(e);
    let v = d.dot(q) / det;
    let t = f.dot(q) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some((t, u.min(v).min(1.0 - u - v)))
}

#[test]
fn triangles_are_hit_where_f64_says() {
    let scene = Primitives { triangles: mixed(60, 0.4).triangles, ..Primitives::default() };
    let accel = build(scene);
    let wrong = (0..8_u64)
        .into_par_iter()
        .map(|seed| {
            let mut rng = Pcg64Mcg::seed_from_u64(seed);
            let mut wrong = 0;
            for _ in 0..20_000 {
                let ray = Ray::new(in_cube(&mut rng, 0.6), direction(&mut rng));
                let hits = accel.primitives().triangles.iter();
                let least = hits
                    .filter_map(|t| reference_triangle(t, &ray))
                    .filter(|h| h.0 > 0.0)
                    .min_by(|a, b| a.0.total_cmp(&b.0));
                let ok = match (accel.closest(&ray), least) {
                    (Some(h), Some((t, _))) => (h.t - t).abs() < 1e-12 * (1.0 + t),
                    (None, None) => true,
                    _ => false,
                };
                // Grazing the rim of a triangle may go either way.
                let rim = least.is_some_and(|l| l.1 < 1e-5);
                wrong += usize::from(!ok && !rim);
            }
            wrong
        })
        .sum::<usize>();
    assert!(wrong <= 4, "{wrong} of 160000 rays differ");
}

#[test]
fn barycentric_weights_rebuild_the_hit() {
    let accel = build(Primitives { triangles: blob(24), ..Primitives::default() });
    let off = count(100_000, 4, |rng| {
        let ray = Ray::new(in_cube(rng, 0.2), direction(rng));
        accel.closest(&ray).is_none_or(|h| {
            let p = ray.o.as_dvec3() + ray.d.as_dvec3() * h.t;
            let off = (accel.position(&h, &ray).as_dvec3() - p).length();
            // Half a spacing, but for hits that are kept off the edges.
            let inside = h.b1.min(h.b2).min(1.0 - h.b1 - h.b2) > 0.01;
            off > if inside { 1e-7 } else { 1e-4 }
        })
    });
    assert_eq!(off, 0);
}

#[test]
fn of_coincident_primitives_the_smallest_id_is_hit() {
    let tri = blob(4)[17];
    let center = (tri[0] + tri[1] + tri[2]) / 3.0;
    for copies in [2, 9, 40] {
        let accel = build(Primitives { triangles: vec![tri; copies], ..Primitives::default() });
        let hit = accel.closest(&Ray::new(Vec3::ZERO, center));
        assert_eq!(hit.map(|h| h.prim), Some(0), "{copies} copies");
    }
}
