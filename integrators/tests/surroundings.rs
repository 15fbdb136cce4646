//! Every integrator sees environment maps and textures alike: means of the image by replicates.

use std::sync::Arc;

use glam::{Affine2, DAffine3, DMat3, DVec3, Vec2};
use pathspace_core::description::*;
use pathspace_core::film::{Film, Layers};
use pathspace_core::texture::{Bitmap, Filter, Image, Texture, Wrap};
use pathspace_core::{Rgb, Scene};
use pathspace_integrators::{Defaults, Registry};

fn textured(name: &str, texture: Texture) -> MaterialDescription {
    MaterialDescription {
        name: name.into(),
        kind: MaterialKind::Textured {
            model: Box::new(MaterialKind::Diffuse { reflectance: texture.mean() }),
            textures: vec![(Parameter::Reflectance, Arc::new(texture))],
        },
    }
}

fn shape(
    name: &str,
    geometry: ShapeGeometry,
    to_world: DAffine3,
    material: usize,
) -> ShapeDescription {
    let (name, flip_normals, emission) = (name.into(), false, None);
    ShapeDescription { name, geometry, to_world, flip_normals, material, emission }
}

/// A ground with an image on it and a ball with a checkerboard under a sky with a small sun, seen
/// from above.
fn scene() -> Scene {
    let mut sky = vec![0.2f32; 32 * 17 * 3];
    let sun = 3 * (4 * 32 + 5);
    sky[sun..sun + 3].copy_from_slice(&[300.0, 250.0, 200.0]);
    let texels: Vec<f32> = (0..8 * 8 * 3).map(|i| (i % 11) as f32 * 0.08).collect();
    let image = Texture::Bitmap(Image {
        bitmap: Arc::new(Bitmap::from_floats(8, 8, 3, texels).unwrap()),
        filter: Filter::Bilinear,
        wrap: Wrap::Repeat,
        to_uv: Affine2::from_scale(Vec2::splat(3.0)),
    });
    let colors = [0.9, 0.1].map(|v| Arc::new(Texture::Constant(Rgb::grey(v))));
    let board = Texture::Checkerboard { colors, to_uv: Affine2::from_scale(Vec2::new(8.0, 4.0)) };
    let ground = DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2)
        * DAffine3::from_scale(DVec3::splat(4.0));
    let ball = ShapeGeometry::Sphere { center: DVec3::new(0.3, 0.7, 0.1), radius: 0.6 };
    let mut description = SceneDescription {
        shapes: vec![
            shape("ground", ShapeGeometry::Rectangle, ground, 0),
            shape("ball", ball, DAffine3::IDENTITY, 1),
        ],
        materials: vec![textured("ground", image), textured("ball", board)],
        emitters: vec![EmitterDescription::Environment {
            bitmap: Arc::new(Bitmap::from_floats(32, 17, 3, sky).unwrap()),
            to_world: DMat3::from_rotation_y(0.4),
            scale: 0.7,
        }],
        film: FilmDescription::new(16, 16),
        ..SceneDescription::default()
    };
    // From above, looking down: +z of the camera is −y.
    description.sensor.to_world = DAffine3 {
        matrix3: DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::NEG_Y),
        translation: DVec3::new(0.0, 5.0, 0.0),
    };
    description.sensor.fov_x_degrees = 40.0;
    Scene::new(&description).unwrap()
}

/// Mean and standard error of each channel.
fn mean(scene: &Arc<Scene>, spec: &str, steps: u32) -> [(f64, f64); 3] {
    let defaults = Defaults::default();
    let integrator = Registry::builtin().create(&spec.parse().unwrap(), &defaults).unwrap();
    let replicates = 8;
    let means: Vec<[f64; 3]> = (0..replicates)
        .map(|seed| {
            let mut run = integrator.start(scene.clone(), seed).unwrap();
            let mut film = Film::new(scene.film(), Layers::default());
            for _ in 0..steps {
                run.step(&mut film);
            }
            assert_eq!(film.nonfinite(), 0, "{spec}");
            film.mean()
        })
        .collect();
    std::array::from_fn(|c| {
        let n = means.len() as f64;
        let mean = means.iter().map(|m| m[c]).sum::<f64>() / n;
        let variance = means.iter().map(|m| (m[c] - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean, (variance / n).sqrt())
    })
}

#[test]
fn all_agree_on_the_mean() {
    let scene = Arc::new(scene());
    let reference = mean(&scene, "bdpt", 32);
    println!("bdpt: {reference:?}");
    for (spec, steps) in
        [("pt", 64), ("lt", 128), ("pssmlt", 48), ("mmlt", 48), ("rjmlt", 48), ("mlt", 48)]
    {
        let found = mean(&scene, spec, steps);
        println!("{spec}: {found:?}");
        for c in 0..3 {
            let ((a, ea), (b, eb)) = (reference[c], found[c]);
            // Eight replicates know their spread to a quarter; a lost factor would be tens of per
            // cent.
            let bound = 6.0 * ea.hypot(eb);
            assert!((a - b).abs() < bound, "{spec} channel {c}: {b} ± {eb}, bdpt {a} ± {ea}");
            assert!(bound < 0.1 * a, "{spec} channel {c}: too noisy, {b} ± {eb}");
        }
    }
}
