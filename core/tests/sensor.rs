//! The sensor: its samples, densities, importance and projection say the same.

use std::f64::consts::PI;

use glam::{DAffine3, DQuat, DVec3, Vec2, Vec3};
use pathspace_core::Scene;
use pathspace_core::description::*;
use pathspace_core::math::Frame;
use pathspace_core::path::Vertex;
use pathspace_core::sensor::Sensor;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use crate::chi2;

const SAMPLES: usize = 300_000;

fn placed() -> DAffine3 {
    DAffine3::from_rotation_translation(
        DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -0.7, 1.1),
        DVec3::new(0.3, 0.2, -0.5),
    )
}

/// Sensors that differ in everything a description says, with the film they belong to.
pub fn sensors() -> Vec<(&'static str, Scene)> {
    let square = FilmDescription::new(32, 32);
    let wide = FilmDescription::new(40, 24);
    let crop = FilmDescription { crop: Crop { x: 7, y: 3, width: 11, height: 17 }, ..wide };
    let pinhole = SensorDescription { to_world: placed(), ..SensorDescription::default() };
    let mirrored = SensorDescription {
        to_world: placed() * DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)),
        ..pinhole.clone()
    };
    let shifted = SensorDescription { principal_point_offset: [0.2, -0.1], ..pinhole.clone() };
    let lens = SensorDescription { aperture_radius: 0.2, focus_distance: 1.5, ..pinhole.clone() };
    let fisheye = SensorDescription { fov_x_degrees: 150.0, ..pinhole.clone() };
    [
        ("pinhole", pinhole.clone(), square),
        ("mirrored", mirrored, wide),
        ("shifted", shifted, wide),
        ("crop", pinhole, crop),
        ("lens", lens.clone(), square),
        ("lens and crop", SensorDescription { principal_point_offset: [0.1, 0.1], ..lens }, crop),
        ("wide angle", fisheye, square),
    ]
    .map(|(name, sensor, film)| (name, build(sensor, film)))
    .into()
}

fn build(sensor: SensorDescription, film: FilmDescription) -> Scene {
    // A far point keeps the normalisation from being that of a single point.
    let emitters = vec![EmitterDescription::Point {
        position: DVec3::new(0.0, 0.0, 3.0),
        intensity: pathspace_core::Rgb::WHITE,
    }];
    Scene::new(&SceneDescription { sensor, film, emitters, ..SceneDescription::default() }).unwrap()
}

fn lens_point(vertex: &Vertex) -> Vec3 {
    let Vertex::Sensor { p, .. } = vertex else { panic!("a camera sample starts on the lens") };
    *p
}

#[test]
fn projection_inverts_sampling() {
    for (name, scene) in sensors() {
        let sensor = scene.sensor();
        let mut r = chi2::rng(1);
        for i in 0..20_000 {
            let Crop { x, y, width, height } = scene.film().crop;
            let pixel = (i % 2 == 0).then(|| [x + i % width, y + i / 7 % height]);
            let u = [r.random(), r.random()];
            let sample = sensor.sample(pixel, u, [r.random(), r.random()]);
            let p = lens_point(&sample.vertex);
            if let Some(pixel) = pixel {
                assert_eq!(sample.film.floor(), Vec2::new(pixel[0] as f32, pixel[1] as f32));
            }
            let back = sensor.film_position(p, sample.ray.d);
            // Rounding may carry a position at the very border of the window across it.
            let Some(back) = back else {
                let edge = sample.film - Vec2::new(x as f32, y as f32);
                let far = Vec2::new(width as f32, height as f32) - edge;
                assert!(edge.min(far).min_element() < 1e-3, "{name}: lost {}", sample.film);
                continue;
            };
            assert!(back.distance(sample.film) < 2e-4, "{name}: {back} {}", sample.film);
            // W_e |cos θ| = p_A p_σ: the sample's weight is 1.
            let cos = sensor.axis().dot(sample.ray.d) as f64;
            let p = sensor.pdf_vertex().value() * sensor.pdf_direction(sample.ray.d).value();
            let weight = sensor.importance(sample.ray.d) * cos / p;
            assert!((weight - 1.0).abs() < 1e-6, "{name}: weight {weight}");
        }
    }
}

#[test]
fn importance_integrates_to_one_over_the_window() {
    // Midpoints over the directions of a half space that has the film in it.
    const N: usize = 1500;
    for (name, scene) in sensors() {
        let sensor = scene.sensor();
        let frame = Frame::from_normal(sensor.axis());
        // The lens point moves the window, not its size: any will do, and for a pinhole there is
        // one.
        let p = lens_point(&sensor.sample_vertex([0.8, 0.3]).0);
        let half = 5.0;
        let mut sum = 0.0;
        for i in 0..N {
            for j in 0..N {
                let at = |i: usize| half * (2.0 * (i as f64 + 0.5) / N as f64 - 1.0);
                let (x, y) = (at(i), at(j));
                let cos = 1.0 / (1.0 + x * x + y * y).sqrt();
                let d = frame.to_world((DVec3::new(x, y, 1.0) * cos).as_vec3());
                if sensor.film_position(p, d).is_some() {
                    sum += sensor.importance(d) * cos * cos.powi(3);
                }
            }
        }
        let lens_area = if sensor.is_pinhole() { 1.0 } else { 1.0 / sensor.pdf_vertex().value() };
        let integral = sum * (2.0 * half / N as f64).powi(2) * lens_area;
        // Cells at the border: a hundredth of the width of the smallest window.
        assert!((integral - 1.0).abs() < 0.03, "{name}: {integral}");
    }
}

#[test]
fn directions_follow_their_density() {
    let mut outcomes = Vec::new();
    for (i, (name, scene)) in sensors().into_iter().enumerate() {
        let sensor = scene.sensor();
        let sample = |r: &mut Pcg64Mcg| {
            // One point of the lens, all of the film.
            Some(sensor.sample(None, [r.random(), r.random()], [0.7, 0.6]).ray.d)
        };
        let p = lens_point(&sensor.sample_vertex([0.7, 0.6]).0);
        let density = |w: &Vec3| {
            let seen = sensor.axis().dot(*w) > 0.0 && sensor.film_position(p, *w).is_some();
            if seen { sensor.pdf_direction(*w).value() } else { 0.0 }
        };
        let half = if name == "wide angle" { 5.5 } else { 0.8 };
        let chart = chi2::gnomonic(sensor.axis(), half);
        outcomes.push(chi2::test_with_edges(
            name,
            &chart,
            [16, 16],
            SAMPLES,
            i as u64,
            sample,
            density,
        ));
    }
    chi2::assert_none_rejected(outcomes, 1e-4);
}

#[test]
fn lens_points_are_uniform_for_both_kinds_of_samples() {
    let lens = SensorDescription {
        to_world: placed(),
        aperture_radius: 0.2,
        focus_distance: 1.5,
        ..SensorDescription::default()
    };
    let scene = build(lens, FilmDescription::new(8, 8));
    let sensor = scene.sensor();
    let radius2 = 1.0 / (PI * sensor.pdf_vertex().value());
    let expected = (0.2 * scene.normalisation().scale).powi(2);
    assert!((radius2 / expected - 1.0).abs() < 1e-9);
    let frame = Frame::from_normal(sensor.axis());
    // (r², φ) of the disk as (z, φ) of a hemisphere.
    let lift = |p: Vec3| {
        let local = frame.to_local(p - sensor.position());
        assert!(local.z.abs() < 1e-6, "off the lens");
        let z = 1.0 - (local.truncate().length_squared() as f64 / radius2).min(1.0);
        let side = local.truncate().normalize_or_zero() * (1.0 - z * z).sqrt() as f32;
        Some(side.extend(z as f32))
    };
    let density = |_: &Vec3| 0.5 / PI;
    let chart = chi2::zone(0.0, 1.0);
    let vertex =
        |r: &mut Pcg64Mcg| lift(lens_point(&sensor.sample_vertex([r.random(), r.random()]).0));
    let camera = |r: &mut Pcg64Mcg| {
        let sample = sensor.sample(Some([3, 5]), [0.5, 0.5], [r.random(), r.random()]);
        lift(lens_point(&sample.vertex))
    };
    let outcomes = vec![
        chi2::test("vertex", &chart, [16, 16], SAMPLES, 1, vertex, density),
        chi2::test("camera sample", &chart, [16, 16], SAMPLES, 2, camera, density),
    ];
    chi2::assert_none_rejected(outcomes, 1e-4);
}

#[test]
fn rays_of_one_film_point_meet_in_the_plane_of_focus() {
    let lens = SensorDescription {
        to_world: placed(),
        aperture_radius: 0.2,
        focus_distance: 1.5,
        ..SensorDescription::default()
    };
    let pinhole = SensorDescription { aperture_radius: 0.0, ..lens.clone() };
    let film = FilmDescription::new(8, 8);
    let (lens, pinhole) = (build(lens, film), build(pinhole, film));
    // The two scenes are normalised differently: compare in world units.
    let world = |scene: &Scene, p: Vec3| {
        p.as_dvec3() / scene.normalisation().scale + scene.normalisation().center
    };
    let mut r = chi2::rng(3);
    for _ in 0..1000 {
        let u = [r.random(), r.random()];
        let through = |scene: &Scene, q: [f32; 2]| {
            let s = scene.sensor().sample(None, u, q);
            let distance = 1.5 * scene.normalisation().scale as f32;
            let along = distance / s.ray.d.dot(scene.sensor().axis());
            world(scene, s.ray.at(along))
        };
        let sharp = through(&pinhole, [0.0; 2]);
        for _ in 0..4 {
            let q = [r.random(), r.random()];
            assert!(through(&lens, q).distance(sharp) < 2e-6);
        }
    }
}

#[test]
fn a_vanishing_lens_is_a_pinhole() {
    let lens = SensorDescription {
        to_world: placed(),
        aperture_radius: 1e-7,
        focus_distance: 1.5,
        ..SensorDescription::default()
    };
    let pinhole = SensorDescription { aperture_radius: 0.0, ..lens.clone() };
    let film = FilmDescription::new(16, 9);
    let (lens, pinhole): (Scene, Scene) = (build(lens, film), build(pinhole, film));
    let (a, b): (&Sensor, &Sensor) = (lens.sensor(), pinhole.sensor());
    let mut r = chi2::rng(4);
    for _ in 0..1000 {
        let (u, q) = ([r.random(), r.random()], [r.random(), r.random()]);
        let (x, y) = (a.sample(None, u, q), b.sample(None, u, q));
        assert!(x.ray.d.distance(y.ray.d) < 1e-6 && x.film == y.film);
        let ratio = a.importance(x.ray.d) / a.pdf_vertex().value() / b.importance(y.ray.d);
        assert!((ratio - 1.0).abs() < 1e-5);
    }
}

#[test]
fn directions_of_a_lens_point_land_where_they_should() {
    for (name, scene) in sensors() {
        let sensor = scene.sensor();
        let mut rng = Pcg64Mcg::new(9);
        for _ in 0..2000 {
            let u: [f32; 4] = rng.random();
            let film = sensor.film_point([u[0], u[1]]);
            let (vertex, _) = sensor.sample_vertex([u[2], u[3]]);
            let p = lens_point(&vertex);
            let d = sensor.direction(p, film);
            // The rounding of a direction moves the image point by some 10⁻⁷ of the distance.
            let back = sensor.film_position(p, d);
            let near = back.is_some_and(|b| b.distance(film) < 1e-3);
            let border = (film - film.round()).abs().min_element() < 1e-3;
            assert!(near || border, "{name}: {film} {back:?}");
        }
    }
}
