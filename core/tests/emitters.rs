//! Samplers of emitters against their densities, seen from points by rays.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use pathspace_core::description::*;
use pathspace_core::math::{Frame, Ray};
use pathspace_core::measure::{Edge, End};
use pathspace_core::path::Vertex;
use pathspace_core::scene::NextDensity;
use pathspace_core::texture::Bitmap;
use pathspace_core::{Rgb, Scene};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use crate::chi2::{self, Chart, Outcome};

const ALPHA: f64 = 1e-4;
const SAMPLES: usize = 300_000;

/// A closed convex octahedron with triangles of unequal area.
fn octahedron() -> MeshData {
    let positions = vec![
        [1.0, 0.0, 0.0],
        [-0.5, 0.0, 0.0],
        [0.0, 0.8, 0.0],
        [0.0, -1.2, 0.0],
        [0.0, 0.0, 0.6],
        [0.0, 0.0, -1.0],
    ];
    let triangles = vec![
        [0, 2, 4],
        [2, 1, 4],
        [1, 3, 4],
        [3, 0, 4],
        [2, 0, 5],
        [1, 2, 5],
        [3, 1, 5],
        [0, 3, 5],
    ];
    MeshData { positions, triangles, ..MeshData::default() }
}

/// Shapes about the origin: convex ones round it, flat ones through it with normal +z.
pub fn shapes() -> Vec<(&'static str, ShapeGeometry, DAffine3)> {
    let turned = DQuat::from_rotation_x(0.3);
    let place =
        |scale: DVec3| DAffine3::from_scale_rotation_translation(scale, turned, DVec3::ZERO);
    let sphere = ShapeGeometry::Sphere { center: DVec3::ZERO, radius: 0.5 };
    let cylinder = ShapeGeometry::Cylinder { p0: -0.5 * DVec3::X, p1: 0.5 * DVec3::X, radius: 0.4 };
    vec![
        ("sphere", sphere, place(DVec3::ONE)),
        ("cube", ShapeGeometry::Cube, place(DVec3::new(0.3, 0.5, 0.2))),
        ("mirrored cube", ShapeGeometry::Cube, place(DVec3::new(-0.3, 0.2, 0.4))),
        ("mesh", ShapeGeometry::Mesh(Arc::new(octahedron())), place(DVec3::splat(0.6))),
        ("disk", ShapeGeometry::Disk, place(DVec3::new(0.5, 0.3, 1.0))),
        ("rectangle", ShapeGeometry::Rectangle, place(DVec3::new(0.5, 0.3, 1.0))),
        ("cylinder", cylinder, place(DVec3::new(0.8, 1.0, 1.0))),
        ("mirrored rectangle", ShapeGeometry::Rectangle, place(DVec3::new(-0.5, 0.3, 1.0))),
    ]
}

fn is_flat(geometry: &ShapeGeometry) -> bool {
    matches!(geometry, ShapeGeometry::Disk | ShapeGeometry::Rectangle)
}

pub fn emitters(
    shape: Option<(&ShapeGeometry, DAffine3, bool)>,
    others: Vec<EmitterDescription>,
) -> Scene {
    let mut description = SceneDescription {
        emitters: others,
        materials: vec![MaterialDescription { name: "null".into(), kind: MaterialKind::Null }],
        ..SceneDescription::default()
    };
    description.sensor.to_world = DAffine3::from_translation(DVec3::new(0.0, -2.0, 0.0));
    if let Some((geometry, to_world, flip_normals)) = shape {
        description.shapes.push(ShapeDescription {
            name: "light".into(),
            geometry: geometry.clone(),
            to_world,
            flip_normals,
            material: 0,
            emission: Some(Rgb::new(1.0, 2.0, 3.0)),
        });
    }
    Scene::new(&description).unwrap()
}

pub fn lamp() -> EmitterDescription {
    EmitterDescription::Point { position: DVec3::new(0.0, 0.0, 1.5), intensity: Rgb::grey(0.3) }
}

/// World → normalised.
pub fn inside(scene: &Scene, p: DVec3) -> Vec3 {
    let n = scene.normalisation();
    ((p - n.center) * n.scale).as_vec3()
}

/// Density per solid angle about `reference` of a density per area, at the first surface in
/// direction `w`.
fn seen(scene: &Scene, reference: Vec3, w: Vec3, area: impl Fn(&Vertex) -> f64) -> f64 {
    let Some(point) = scene.intersect(&Ray::new(reference, w)) else { return 0.0 };
    let vertex = Vertex::Surface(point);
    let edge = Edge::new(&End::Point { p: reference }, &vertex.end());
    area(&vertex) * edge.distance2() / edge.cos_b()
}

fn next_event_from(
    name: &str,
    scene: &Scene,
    reference: Vec3,
    chart: &Chart<Vec3>,
    seed: u64,
) -> Outcome {
    let sample = |r: &mut Pcg64Mcg| {
        let sample = scene.sample_direct(reference, r.random(), [r.random(), r.random()])?;
        let again = scene.pdf_direct(reference, &sample.vertex);
        assert_eq!(sample.pdf, again, "{name}: density of the sample and of its vertex");
        let point = sample.vertex.surface()?;
        Some((point.p - reference).normalize())
    };
    let density = |w: &Vec3| {
        seen(scene, reference, *w, |v| {
            let front = v.surface().is_some_and(|s| s.n_g.dot(*w) < 0.0);
            if front { scene.pdf_direct(reference, v).value() } else { 0.0 }
        })
    };
    chi2::test_with_edges(name, chart, [12, 12], SAMPLES, seed, sample, density)
}

#[test]
fn next_event_points_follow_their_density_from_outside() {
    let mut outcomes = Vec::new();
    for (i, (name, geometry, to_world)) in shapes().into_iter().enumerate() {
        // A cylinder sampled by area has a pole of its density along its silhouette, which the
        // midpoints of a cell miss.
        if matches!(geometry, ShapeGeometry::Cylinder { .. }) {
            continue;
        }
        let scene = emitters(Some((&geometry, to_world, false)), vec![lamp()]);
        for (j, eye) in [DVec3::new(0.4, -0.5, 1.4), DVec3::new(-0.7, -1.0, 0.9)].iter().enumerate()
        {
            let (reference, center) = (inside(&scene, *eye), inside(&scene, DVec3::ZERO));
            let chart = chi2::gnomonic(center - reference, 0.8);
            let seed = (10 * i + j) as u64;
            outcomes.push(next_event_from(name, &scene, reference, &chart, seed));
        }
    }
    chi2::assert_none_rejected(outcomes, ALPHA);
}

#[test]
fn next_event_points_follow_their_density_from_inside() {
    let mut outcomes = Vec::new();
    for (i, (name, geometry, to_world)) in shapes().into_iter().enumerate() {
        if is_flat(&geometry) {
            continue;
        }
        let scene = emitters(Some((&geometry, to_world, true)), vec![lamp()]);
        let reference = inside(&scene, DVec3::new(0.02, -0.05, 0.03));
        let chart = chi2::zone(-1.0, 1.0);
        outcomes.push(next_event_from(name, &scene, reference, &chart, 100 + i as u64));
    }
    chi2::assert_none_rejected(outcomes, ALPHA);
}

#[test]
fn small_and_near_spheres_are_sampled_in_their_cones() {
    let mut outcomes = Vec::new();
    for (i, (radius, distance)) in [(0.5, 0.51), (0.5, 0.6), (1e-3, 1.0)].into_iter().enumerate() {
        let sphere = ShapeGeometry::Sphere { center: DVec3::ZERO, radius };
        let scene = emitters(Some((&sphere, DAffine3::IDENTITY, false)), Vec::new());
        let eye = DVec3::new(0.6, 0.0, 0.8) * distance;
        let (reference, center) = (inside(&scene, eye), inside(&scene, DVec3::ZERO));
        let sin: f64 = radius / distance;
        let tan = sin / (1.0 - sin * sin).sqrt();
        let chart = chi2::gnomonic(center - reference, 1.1 * tan);
        let name = format!("sphere {radius} at {distance}");
        outcomes.push(next_event_from(&name, &scene, reference, &chart, 200 + i as u64));
    }
    chi2::assert_none_rejected(outcomes, ALPHA);
}

#[test]
fn emission_positions_are_uniform_on_the_area() {
    let mut outcomes = Vec::new();
    for (i, (name, geometry, to_world)) in shapes().into_iter().enumerate() {
        let scene = emitters(Some((&geometry, to_world, false)), vec![lamp()]);
        let center = inside(&scene, DVec3::ZERO);
        // Everything is seen once from the middle of a convex shape and from before a flat one.
        let (reference, chart) = if is_flat(&geometry) {
            let reference = inside(&scene, DVec3::new(0.1, 0.0, 0.7));
            (reference, chi2::gnomonic(center - reference, 1.2))
        } else {
            (center, chi2::zone(-1.0, 1.0))
        };
        let sample = |r: &mut Pcg64Mcg| {
            let u = (r.random(), [r.random(), r.random()], [r.random(), r.random()]);
            let sample = scene.sample_emission(u.0, u.1, u.2)?;
            assert_eq!(sample.pdf, scene.pdf_emission_vertex(&sample.vertex), "{name}");
            Some((sample.vertex.surface()?.p - reference).normalize())
        };
        let density =
            |w: &Vec3| seen(&scene, reference, *w, |v| scene.pdf_emission_vertex(v).value());
        let seed = 300 + i as u64;
        outcomes.push(chi2::test_with_edges(
            name,
            &chart,
            [12, 12],
            SAMPLES,
            seed,
            sample,
            density,
        ));
    }
    chi2::assert_none_rejected(outcomes, ALPHA);
}

#[test]
fn emission_leaves_by_the_cosine_on_the_normals_side() {
    let mut outcomes = Vec::new();
    for (i, (name, geometry, to_world)) in shapes().into_iter().enumerate() {
        let flip = i % 2 == 1;
        let scene = emitters(Some((&geometry, to_world, flip)), Vec::new());
        let sample = |r: &mut Pcg64Mcg| {
            let u = (r.random(), [r.random(), r.random()], [r.random(), r.random()]);
            let sample = scene.sample_emission(u.0, u.1, u.2)?;
            let point = sample.vertex.surface()?;
            assert!(!scene.emitted(point, sample.ray.d).is_black(), "{name}: the dark side");
            let local = Frame::from_normal(point.n_g).to_local(sample.ray.d);
            let NextDensity::Direction(p) = sample.next else { panic!("a surface emits rays") };
            assert!((p.value() - local.z as f64 / PI).abs() < 1e-6, "{name}");
            Some(local)
        };
        let density = |w: &Vec3| (w.z as f64).max(0.0) / PI;
        let chart = chi2::zone(0.0, 1.0);
        outcomes.push(chi2::test(name, &chart, [20, 20], SAMPLES, 400 + i as u64, sample, density));
    }
    chi2::assert_none_rejected(outcomes, ALPHA);
}

#[test]
fn emission_density_of_the_second_vertex_is_that_of_the_sample() {
    for (name, geometry, to_world) in shapes() {
        let scene = emitters(Some((&geometry, to_world, false)), vec![lamp()]);
        let mut u = chi2::rng(5);
        for _ in 0..1000 {
            let (pick, a, b) = (u.random(), [u.random(), u.random()], [u.random(), u.random()]);
            let sample = scene.sample_emission(pick, a, b).unwrap();
            // A wall across the ray at distance 1, oblique.
            let p = sample.ray.at(1.0);
            let n = (sample.ray.d + Vec3::new(0.1, 0.3, 0.2)).normalize();
            let edge = Edge::new(&sample.vertex.end(), &End::Surface { p, n });
            let own = sample.next.to_area(&edge).value();
            let again = scene.pdf_emission_next(&sample.vertex, &edge).value();
            assert!((own / again - 1.0).abs() < 1e-4 / sample.cos as f64, "{name}: {own} {again}");
        }
    }
}

#[test]
fn environment_is_sampled_uniformly() {
    let sky = EmitterDescription::Constant { radiance: Rgb::WHITE };
    let scene = emitters(None, vec![sky, lamp()]);
    let mass = scene.emitters().mass(0).value();
    let density = |_: &Vec3| mass / (4.0 * PI);
    let chart = chi2::zone(-1.0, 1.0);
    let to = |vertex: &Vertex| match vertex {
        Vertex::InfiniteEmitter { to, .. } => Some(*to),
        _ => None,
    };
    let direct = |r: &mut Pcg64Mcg| {
        let s = scene.sample_direct(Vec3::ZERO, r.random(), [r.random(), r.random()])?;
        assert_eq!(s.pdf, scene.pdf_direct(Vec3::ZERO, &s.vertex));
        to(&s.vertex)
    };
    let emission = |r: &mut Pcg64Mcg| {
        let u = (r.random(), [r.random(), r.random()], [r.random(), r.random()]);
        let s = scene.sample_emission(u.0, u.1, u.2)?;
        assert_eq!(s.pdf, scene.pdf_emission_vertex(&s.vertex));
        to(&s.vertex)
    };
    let outcomes = vec![
        chi2::test("next event", &chart, [20, 20], SAMPLES, 500, direct, density),
        chi2::test("emission", &chart, [20, 20], SAMPLES, 501, emission, density),
    ];
    chi2::assert_none_rejected(outcomes, ALPHA);
}

/// An environment map with a dark part and a small sun, turned.
pub fn painted_sky() -> EmitterDescription {
    let mut data: Vec<f32> = (0..16 * 9 * 3).map(|i| (i % 7) as f32 * 0.1).collect();
    data[..100].fill(0.0);
    data[300..303].fill(20.0);
    let bitmap = Bitmap::from_floats(16, 9, 3, data).unwrap();
    let to_world = DMat3::from_quat(DQuat::from_rotation_x(0.8) * DQuat::from_rotation_y(0.3));
    EmitterDescription::Environment { bitmap: Arc::new(bitmap), to_world, scale: 0.5 }
}

#[test]
fn environment_maps_follow_their_density() {
    let scene = emitters(None, vec![painted_sky(), lamp()]);
    let mass = scene.emitters().mass(0).value();
    let map = scene.emitters().environment().unwrap();
    let density = |d: &Vec3| mass * map.pdf(*d).value();
    let chart = chi2::zone(-1.0, 1.0);
    let to = |vertex: &Vertex| match vertex {
        Vertex::InfiniteEmitter { to, .. } => Some(*to),
        _ => None,
    };
    let direct = |r: &mut Pcg64Mcg| {
        let s = scene.sample_direct(Vec3::ZERO, r.random(), [r.random(), r.random()])?;
        assert_eq!(s.pdf, scene.pdf_direct(Vec3::ZERO, &s.vertex));
        if let Some(d) = to(&s.vertex) {
            assert_eq!(s.radiance, map.radiance(d));
            assert_eq!(s.radiance, scene.emitted_from(&s.vertex, -d));
        }
        to(&s.vertex)
    };
    let emission = |r: &mut Pcg64Mcg| {
        let u = (r.random(), [r.random(), r.random()], [r.random(), r.random()]);
        let s = scene.sample_emission(u.0, u.1, u.2)?;
        assert_eq!(s.pdf, scene.pdf_emission_vertex(&s.vertex));
        to(&s.vertex)
    };
    let cells = [20, 20];
    let outcomes = vec![
        chi2::test_with_edges("map, next event", &chart, cells, SAMPLES, 600, direct, density),
        chi2::test_with_edges("map, emission", &chart, cells, SAMPLES, 601, emission, density),
    ];
    chi2::assert_none_rejected(outcomes, ALPHA);
}

#[test]
fn beams_cover_the_disk_across_the_scene_uniformly() {
    let toward = DVec3::new(0.3, -0.4, -0.8);
    let sun = EmitterDescription::Directional { direction: toward, irradiance: Rgb::WHITE };
    let sky = EmitterDescription::Constant { radiance: Rgb::WHITE };
    let mut outcomes = Vec::new();
    for (i, (name, emitter)) in [("sun", sun), ("sky", sky)].into_iter().enumerate() {
        let scene = emitters(None, vec![emitter]);
        let (radius, center) = (scene.ball().radius, scene.ball().center);
        let r2 = (radius as f64).powi(2);
        // Points of the disk by (r², φ), as directions are by (z, φ): Lambert's equal-area map.
        let sample = |r: &mut Pcg64Mcg| {
            let u = (r.random(), [r.random(), r.random()], [r.random(), r.random()]);
            let s = scene.sample_emission(u.0, u.1, u.2)?;
            let d = s.ray.d;
            if name == "sun" {
                assert!((d - toward.normalize().as_vec3()).length() < 1e-6);
            }
            let o = s.ray.o - center;
            assert!(o.dot(-d) > radius, "the ray starts inside the scene");
            let across = o - d * o.dot(d);
            let local = Frame::from_normal(d).to_local(across);
            let z = 1.0 - across.length_squared() as f64 / r2;
            let NextDensity::Across(p) = s.next else { panic!("a beam") };
            assert!((p.value() * PI * r2 - 1.0).abs() < 1e-9);
            let side = local.truncate().normalize_or_zero() * (1.0 - z * z).max(0.0).sqrt() as f32;
            Some(side.extend(z as f32))
        };
        let chart = chi2::zone(0.0, 1.0);
        let density = |_: &Vec3| 0.5 / PI;
        outcomes.push(chi2::test(name, &chart, [20, 20], SAMPLES, 510 + i as u64, sample, density));
    }
    chi2::assert_none_rejected(outcomes, ALPHA);
}

#[test]
fn emitters_are_picked_by_power() {
    let sphere = ShapeGeometry::Sphere { center: DVec3::ZERO, radius: 0.5 };
    let sun = EmitterDescription::Directional { direction: DVec3::Z, irradiance: Rgb::grey(2.0) };
    let sky = EmitterDescription::Constant { radiance: Rgb::grey(0.1) };
    let dark = EmitterDescription::Point { position: DVec3::ZERO, intensity: Rgb::BLACK };
    let scene = emitters(Some((&sphere, DAffine3::IDENTITY, false)), vec![lamp(), dark, sun, sky]);
    let scale = scene.normalisation().scale;
    let disk = PI * (scene.ball().radius as f64).powi(2);
    // Mean over the channels, in the normalised scene.
    let power = [
        2.0 * PI * 4.0 * PI * (0.5 * scale).powi(2),
        4.0 * PI * 0.3 * scale * scale,
        0.0,
        2.0 * disk,
        0.1 * 4.0 * PI * disk,
    ];
    let total: f64 = power.iter().sum();
    let n = 1_000_000;
    let mut counts = [0_u32; 5];
    for i in 0..n {
        let (k, mass) = scene.emitters().pick((i as f32 + 0.5) / n as f32).unwrap();
        assert_eq!(mass, scene.emitters().mass(k));
        counts[k as usize] += 1;
    }
    for k in 0..5 {
        let mass = scene.emitters().mass(k as u32).value();
        // One pick in 32 goes to all four that emit alike.
        let even = if power[k] > 0.0 { 1.0 / 128.0 } else { 0.0 };
        let expected = 31.0 / 32.0 * power[k] / total + even;
        assert!((mass - expected).abs() < 1e-6, "emitter {k}: {mass}");
        assert!((counts[k] as f64 / n as f64 - mass).abs() < 2e-6, "emitter {k}: {}", counts[k]);
    }
}
