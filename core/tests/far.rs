//! Scenes whose camera or lamp is far away, and scenes that are far from the origin.

use glam::{DAffine3, DVec3};
use pathspace_core::description::*;
use pathspace_core::{Rgb, Scene, SceneError};
use rand::RngExt;

use crate::chi2;

/// A plate of half side 1 in the plane z = 0, moved by `offset`, seen by a camera at `eye` whose
/// image is 2.2 wide at the plate.
fn plate(eye: DVec3, offset: DVec3, emitters: Vec<EmitterDescription>) -> SceneDescription {
    let shape = ShapeDescription {
        name: "plate".into(),
        geometry: ShapeGeometry::Rectangle,
        to_world: DAffine3::from_translation(offset),
        material: 0,
        emission: None,
        flip_normals: false,
    };
    let z = -eye.normalize();
    let x = z.any_orthonormal_vector();
    let matrix3 = glam::DMat3::from_cols(x, z.cross(x), z);
    let sensor = SensorDescription {
        to_world: DAffine3 { matrix3, translation: eye + offset },
        fov_x_degrees: 2.0 * (1.1 / eye.length()).atan().to_degrees(),
        ..SensorDescription::default()
    };
    let kind = MaterialKind::Diffuse { reflectance: Rgb::grey(0.5) };
    SceneDescription {
        shapes: vec![shape],
        materials: vec![MaterialDescription { name: "grey".into(), kind }],
        emitters,
        sensor,
        film: FilmDescription::new(64, 64),
        ..SceneDescription::default()
    }
}

#[test]
fn rays_of_a_telephoto_camera_meet_the_plate_where_their_film_position_says() {
    let toward = DVec3::new(0.48, -0.6, 0.64);
    for distance in [1e1, 1e2, 1e3, 1e4, 1e5, 1e6] {
        let eye = toward * distance;
        let scene = Scene::new(&plate(eye, DVec3::ZERO, vec![])).expect("a scene");
        let n = scene.normalisation();
        let z = -toward;
        let x = z.any_orthonormal_vector();
        let y = z.cross(x);
        let mut r = chi2::rng(3);
        let mut seen = 0;
        for _ in 0..2000 {
            let s = scene.sensor().sample(None, [r.random(), r.random()], [0.5; 2]);
            let Some(hit) = scene.intersect(&s.ray) else { continue };
            seen += 1;
            let p = hit.p.as_dvec3() / n.scale + n.center;
            // The vertex is an f32: the camera itself may be off by its spacing. The film says
            // where the ray goes.
            let half = 1.1 / distance;
            let along = |v: f32| (1.0 - 2.0 * v as f64 / 64.0) * half;
            let d = z + x * along(s.film.x) + y * along(s.film.y);
            let origin = scene.sensor().position().as_dvec3() / n.scale + n.center;
            let exact = origin - d * (origin.z / d.z);
            // Hits keep off the edges and the diagonal.
            let edge = (1.0 - exact.x.abs()).min(1.0 - exact.y.abs());
            if edge.min((exact.x - exact.y).abs()) < 1e-4 {
                continue;
            }
            assert!((p - exact).length() < 2e-6, "{distance}: {p} instead of {exact}");
        }
        assert!(seen > 500, "{distance}: {seen}");
    }
}

#[test]
fn beams_do_not_grow_with_the_distance_of_cameras_and_lamps() {
    let sky = EmitterDescription::Constant { radiance: Rgb::WHITE };
    let near = Scene::new(&plate(DVec3::Z * 3.0, DVec3::ZERO, vec![sky.clone()])).expect("a scene");
    for distance in [1e2, 1e4, 1e6] {
        let lamp = EmitterDescription::Point {
            position: DVec3::new(0.6, 0.0, 0.8) * distance,
            intensity: Rgb::WHITE,
        };
        let far = plate(DVec3::Z * distance, DVec3::ZERO, vec![sky.clone(), lamp]);
        let far = Scene::new(&far).expect("a scene");
        assert_eq!(far.ball(), near.ball());
        assert_eq!(far.normalisation(), near.normalisation());
    }
}

#[test]
fn a_scene_far_from_the_origin_is_shifted_without_loss_and_another_is_not() {
    let at = |offset| Scene::new(&plate(DVec3::Z * 3.0, offset, vec![])).expect("a scene");
    let here = at(DVec3::ZERO);
    assert_eq!(here.normalisation().center, DVec3::ZERO);
    assert_eq!(at(DVec3::new(1.0, -0.5, 2.0)).normalisation().center, DVec3::ZERO);
    let there = at(DVec3::new(1e6, -2e6, 0.5e6));
    let corners = |s: &Scene| s.accel().primitives().triangles.clone();
    assert_eq!(corners(&here), corners(&there));
}

#[test]
fn a_shape_that_f32_cannot_hold_is_warned_about_or_refused_by_name() {
    let with_ball = |radius: f64| {
        let mut d = plate(DVec3::Z * 3.0, DVec3::ZERO, vec![]);
        let center = DVec3::new(0.3, 0.2, 0.7);
        let geometry = ShapeGeometry::Sphere { center, radius };
        let ball = ShapeDescription { name: "ball".into(), geometry, ..d.shapes[0].clone() };
        d.shapes.push(ball);
        Scene::new(&d)
    };
    assert!(with_ball(1e-3).is_ok_and(|s| s.warnings().is_empty()));
    let warned = with_ball(1e-6).map(|s| s.warnings().join("; ")).unwrap_or_default();
    assert!(warned.contains("shape 'ball'") && warned.contains("23.9"), "{warned}");
    let refused = with_ball(1e-8).err();
    assert!(matches!(&refused, Some(SceneError::Shape { shape, .. }) if shape == "ball"));
}
