//! Phase functions, free flights, transmittance and boundaries.

use glam::{DAffine3, DVec3, Vec3};
use pathspace_core::description::*;
use pathspace_core::math::{Frame, Ray};
use pathspace_core::medium::{MediumIndex, MediumPoint, Phase};
use pathspace_core::path::Vertex;
use pathspace_core::{Rgb, Scene, SceneError};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use crate::chi2::{self, Outcome};

const ALPHA: f64 = 1e-4;

fn phases() -> Vec<(&'static str, PhaseKind)> {
    let hg = |g| PhaseKind::HenyeyGreenstein { g };
    let blend = PhaseKind::Blend { weight: 0.3, pair: Box::new([hg(-0.5), PhaseKind::Rayleigh]) };
    vec![
        ("isotropic", PhaseKind::Isotropic),
        ("forward", hg(0.7)),
        ("backward", hg(-0.4)),
        ("no g", hg(0.0)),
        ("Rayleigh", PhaseKind::Rayleigh),
        ("blend", blend),
    ]
}

/// A cube [−1, 1]³ of fog and a ball in it, seen from outside.
fn description(phase: PhaseKind) -> SceneDescription {
    let shape = |name: &str, geometry, scale, material| ShapeDescription {
        name: name.into(),
        geometry,
        to_world: DAffine3::from_scale(DVec3::splat(scale)),
        flip_normals: false,
        material,
        emission: None,
    };
    let kind = MaterialKind::Diffuse { reflectance: Rgb::grey(0.5) };
    let sphere = ShapeGeometry::Sphere { center: DVec3::ZERO, radius: 0.25 };
    let fog =
        MediumKind::Homogeneous { extinction: [1.0, 2.0, 0.5], albedo: Rgb::new(0.9, 0.5, 0.2) };
    SceneDescription {
        shapes: vec![shape("fog", ShapeGeometry::Cube, 1.0, 0), shape("ball", sphere, 1.0, 1)],
        materials: vec![
            MaterialDescription { name: "null".into(), kind: MaterialKind::Null },
            MaterialDescription { name: "grey".into(), kind },
        ],
        sensor: SensorDescription {
            to_world: DAffine3::from_translation(DVec3::new(0.0, 0.0, -4.0)),
            ..SensorDescription::default()
        },
        media: MediaDescription {
            media: vec![MediumDescription { name: "fog".into(), kind: fog, phase }],
            boundaries: vec![BoundaryDescription { shape: 0, interior: Some(0), exterior: None }],
            sensor: None,
        },
        ..SceneDescription::default()
    }
}

fn phase_of(kind: PhaseKind) -> Phase {
    let scene = Scene::new(&description(kind)).expect("a scene");
    scene.media()[0].phase().clone()
}

#[test]
fn phase_functions_follow_their_densities() {
    let from = Vec3::new(0.36, -0.48, 0.8);
    let outcomes: Vec<Outcome> = phases()
        .into_iter()
        .enumerate()
        .map(|(i, (name, kind))| {
            let phase = phase_of(kind);
            let sample =
                |r: &mut Pcg64Mcg| Some(phase.sample(from, r.random(), [r.random(), r.random()]).0);
            let density = |to: &Vec3| phase.pdf(from, *to).value();
            let chart = chi2::zone(-1.0, 1.0);
            chi2::test(name, &chart, [16, 16], 200_000, 60 + i as u64, sample, density)
        })
        .collect();
    for outcome in &outcomes {
        assert!((outcome.integral - 1.0).abs() < 1e-4, "{outcome}");
    }
    chi2::assert_none_rejected(outcomes, ALPHA);
}

#[test]
fn phase_functions_are_reciprocal_and_their_numbers_come_back() {
    let mut r = chi2::rng(3);
    for (name, kind) in phases() {
        let phase = phase_of(kind);
        for _ in 0..2000 {
            let from = Frame::from_normal(Vec3::Y)
                .to_world(pathspace_core::math::warp::uniform_sphere([r.random(), r.random()]));
            let (to, pdf) = phase.sample(from, r.random(), [r.random(), r.random()]);
            assert_eq!(pdf, phase.pdf(from, to), "{name}");
            let (there, back) = (phase.pdf(from, to).value(), phase.pdf(to, from).value());
            assert!((there - back).abs() <= 1e-9 * there, "{name}: {there} {back}");
            let [component, u, v] = phase.invert(from, to, r.random());
            let (again, _) = phase.sample(from, component, [u, v]);
            assert!(again.dot(to) > 1.0 - 1e-5, "{name}: {to} {again}");
        }
    }
}

#[test]
fn the_mean_cosine_of_henyey_and_greenstein_is_g() {
    let mut r = chi2::rng(4);
    let phase = phase_of(PhaseKind::HenyeyGreenstein { g: 0.6 });
    let from = Vec3::new(0.0, 0.6, 0.8);
    let n = 100_000;
    let sum: f64 = (0..n)
        .map(|_| {
            let (to, _) = phase.sample(from, 0.0, [r.random(), r.random()]);
            f64::from(-from.dot(to))
        })
        .sum();
    assert!((sum / f64::from(n) - 0.6).abs() < 0.005, "{}", sum / f64::from(n));
}

/// The point in the medium at a position in world units.
fn inside(scene: &Scene, p: DVec3) -> Vertex {
    let n = scene.normalisation();
    let p = ((p - n.center) * n.scale).as_vec3();
    Vertex::Medium(MediumPoint { p, medium: MediumIndex::new(0).expect("an index") })
}

#[test]
fn transmittance_is_that_of_the_way_inside_and_symmetric_to_the_bit() {
    let scene = Scene::new(&description(PhaseKind::Isotropic)).expect("a scene");
    let sensor = Vertex::Sensor { p: scene.sensor().position(), n: scene.sensor().axis() };
    let mut r = chi2::rng(5);
    for _ in 0..1000 {
        let mut c = || 1.8 * r.random::<f64>() - 0.9;
        let (x, y) = (DVec3::new(c(), c(), c()), DVec3::new(c(), c(), c()));
        let (a, b) = (inside(&scene, x), inside(&scene, y));
        let found = scene.transmittance(&a, &b);
        assert_eq!(found, scene.transmittance(&b, &a));
        let expected = [1.0, 2.0, 0.5].map(|s: f64| (-s * x.distance(y)).exp());
        for (t, e) in found.to_array().into_iter().zip(expected) {
            assert!((f64::from(t) - e).abs() < 1e-6, "{found:?} {expected:?}");
        }
        // From the sensor at z = −4 the fog begins at z = −1.
        let found = scene.transmittance(&sensor, &a);
        assert_eq!(found, scene.transmittance(&a, &sensor));
        let eye = DVec3::new(0.0, 0.0, -4.0);
        let way = (x - eye).normalize();
        let expected = (-(x.distance(eye) - 3.0 / way.z)).exp();
        assert!((f64::from(found.r) - expected).abs() < 1e-5, "{found:?} {expected}");
    }
}

/// Flights from a point end in the fog with the density that is told, and pass with what is left.
#[test]
fn free_flights_follow_their_density() {
    let scene = Scene::new(&description(PhaseKind::Isotropic)).expect("a scene");
    let start = inside(&scene, DVec3::new(0.0, 0.5, -0.9));
    let ray = Ray::new(start.position().expect("a point"), Vec3::Z);
    let mut r = chi2::rng(6);
    let (n, cells, length) = (200_000, 20, 1.9 * scene.normalisation().scale);
    let mut counts = vec![0.0; cells + 1];
    for _ in 0..n {
        let flight = scene.fly(&start, &ray, [r.random(), r.random()]);
        let cell = match flight.end {
            Some(Vertex::Medium(m)) => {
                (f64::from(m.p.distance(ray.o)) / length * cells as f64) as usize
            }
            end => {
                assert!(end.is_none());
                cells
            }
        };
        counts[cell] += 1.0;
    }
    let at = |t: f64| {
        let p = (ray.o.as_dvec3() + DVec3::Z * t).as_vec3();
        let end = Vertex::Medium(MediumPoint { p, medium: MediumIndex::new(0).expect("one") });
        scene.flight_density(&end, scene.transmittance(&start, &end))
    };
    let mut left = 1.0;
    for (cell, count) in counts.iter().take(cells).enumerate() {
        let h = length / cells as f64;
        let a = cell as f64 * h + 1e-9;
        let p = h / 6.0 * (at(a) + 4.0 * at(a + 0.5 * h) + at(a + h * (1.0 - 1e-6)));
        left -= p;
        let expected = p * f64::from(n);
        assert!((count - expected).abs() < 5.0 * expected.sqrt(), "{cell}: {count} {expected}");
    }
    let expected = left * f64::from(n);
    assert!((counts[cells] - expected).abs() < 5.0 * expected.sqrt(), "{counts:?} {expected}");
}

#[test]
fn a_medium_may_fill_a_room_to_its_walls() {
    // The ball becomes a cube of the same size as the boundary, seen from inside.
    let mut description = description(PhaseKind::Isotropic);
    description.shapes[1].geometry = ShapeGeometry::Cube;
    description.shapes[1].flip_normals = true;
    description.sensor.to_world = DAffine3::IDENTITY;
    let scene = Scene::new(&description).expect("a scene");
    let mut r = chi2::rng(7);
    for _ in 0..2000 {
        let d = pathspace_core::math::warp::uniform_sphere([r.random(), r.random()]);
        let wall = scene.intersect(&Ray::new(scene.sensor().position(), d)).expect("a wall");
        let sensor = Vertex::Sensor { p: scene.sensor().position(), n: scene.sensor().axis() };
        let t = scene.transmittance(&sensor, &Vertex::Surface(wall)).r;
        let length = f64::from(wall.p.distance(scene.sensor().position()));
        let expected = (-length / scene.normalisation().scale).exp();
        assert!((f64::from(t) - expected).abs() < 1e-4, "{t} {expected}");
    }
}

#[test]
fn boundaries_that_do_not_close_or_overlap_are_refused() {
    let mut open = description(PhaseKind::Isotropic);
    open.shapes[0].geometry = ShapeGeometry::Rectangle;
    let error = |d: &SceneDescription| match Scene::new(d) {
        Ok(_) => "no error".to_owned(),
        Err(e) => e.to_string(),
    };
    assert_eq!(
        error(&open),
        "shape 'fog': as a boundary of media it is not closed, or overlaps another one"
    );
    let mut overlap = description(PhaseKind::Isotropic);
    overlap.shapes[1].geometry = ShapeGeometry::Cube;
    overlap.shapes[1].to_world = DAffine3::from_translation(DVec3::splat(0.7));
    overlap.shapes[1].material = 0;
    overlap.media.media.push(overlap.media.media[0].clone());
    overlap.media.boundaries.push(BoundaryDescription {
        shape: 1,
        interior: Some(1),
        exterior: None,
    });
    assert!(error(&overlap).starts_with("shape '"), "{}", error(&overlap));
    let mut wrong = description(PhaseKind::Isotropic);
    wrong.media.sensor = Some(0);
    assert_eq!(error(&wrong), "sensor: names the medium 'fog' but stands in 'empty space'");
    let mut endless = description(PhaseKind::Isotropic);
    endless.media.boundaries.clear();
    endless.media.sensor = Some(0);
    endless.emitters.push(EmitterDescription::Constant { radiance: Rgb::WHITE });
    assert_eq!(
        error(&endless),
        "medium 'fog': is everywhere, so that light from infinity never arrives: bound it"
    );
}

#[test]
fn values_out_of_range_are_named() {
    let bad = |change: &dyn Fn(&mut MediumDescription)| {
        let mut d = description(PhaseKind::Isotropic);
        change(&mut d.media.media[0]);
        match Scene::new(&d) {
            Err(SceneError::Medium { problem, .. }) => problem,
            _ => "no error".into(),
        }
    };
    let kind = |extinction, albedo| MediumKind::Homogeneous { extinction, albedo };
    let white = Rgb::WHITE;
    assert_eq!(
        bad(&|m| m.kind = kind([1.0, -2.0, 1.0], white)),
        "the extinction -2 is not a number ≥ 0"
    );
    assert_eq!(bad(&|m| m.kind = kind([1.0; 3], white * 2.0)), "the albedo 2 is not in [0, 1]");
    assert_eq!(
        bad(&|m| m.phase = PhaseKind::HenyeyGreenstein { g: 1.0 }),
        "the mean cosine g = 1 is not in (−1, 1)"
    );
}
