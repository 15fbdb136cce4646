//! A light above a Lambertian plate that the film covers exactly: a camera that looks straight down
//! sees every point of the plate with the same weight, so that the mean image is the mean of the
//! closed-form irradiance times ρ/π.

use std::f64::consts::PI;

use glam::DVec3;
use pathspace_core::Rgb;
use pathspace_core::description::{FilmDescription, MeshData};
use pathspace_core::film::Families;

use super::forms;
use super::quadrature::mean;
use super::{ExactLength, ExactScene, up_to};
use crate::scene_builder::SceneBuilder;

const RHO: f32 = 0.75;
const SEEN: Families = Families::S0.or(Families::S1).or(Families::T1);

/// Every scene of this file.
pub fn all() -> Vec<ExactScene> {
    vec![
        sphere_light(),
        small_sphere_light(),
        disk_light(),
        polygon_light(),
        parallel_rectangles(),
        perpendicular_rectangles(),
        coaxial_disks(),
    ]
}

/// A scene whose film is the part [x0, x1] × [y0, y1] of a larger plate at z = 0, seen from height
/// `eye`.
fn plate([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], eye: f64) -> SceneBuilder {
    let mut b = view([x0, x1], [y0, y1], eye);
    let grey = b.diffuse(RHO);
    let (w, h) = (x1 - x0, y1 - y0);
    let corner = DVec3::new(x0 - 0.1 * w, y0 - 0.1 * h, 0.0);
    b.rectangle(corner, DVec3::X * (1.2 * w), DVec3::Y * (1.2 * h), grey);
    b
}

/// An empty scene with that film.
fn view([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], eye: f64) -> SceneBuilder {
    let (w, h) = (x1 - x0, y1 - y0);
    let mut b = SceneBuilder::new(64);
    b.description().film = FilmDescription::new(64, (64.0 * h / w).round() as u32);
    let below = DVec3::new(0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.0);
    let fov = 2.0 * (0.5 * w / eye).atan().to_degrees();
    b.look_at(below + DVec3::Z * eye, below, DVec3::Y, fov);
    b
}

fn scene(name: &'static str, b: SceneBuilder, irradiance: f64) -> ExactScene {
    let families = Families::S0 | Families::T1;
    let expected = vec![
        ExactLength::new(1, 0.0, families),
        ExactLength::new(2, RHO as f64 / PI * irradiance, SEEN),
        ExactLength::new(3, 0.0, SEEN),
    ];
    ExactScene { name, description: b.finish(), rules: up_to(4), expected }
}

/// A black sphere of radiance 1: E = π(R/d)² cos θ.
fn sphere_light_of(name: &'static str, radius: f64, height: f64, eye: f64) -> ExactScene {
    let range = [-1.0, 1.0];
    let mut b = plate(range, range, eye);
    let black = b.diffuse(0.0);
    b.sphere(DVec3::Z * height, radius, black).emission = Some(Rgb::WHITE);
    let irradiance = mean(range, range, |x, y| {
        let d = (x * x + y * y + height * height).sqrt();
        forms::sphere_irradiance(radius, d, height / d, 1.0)
    });
    scene(name, b, irradiance)
}

/// A sphere light that fills a good part of the sky.
pub fn sphere_light() -> ExactScene {
    sphere_light_of("sphere light", 0.6, 1.0, 0.35)
}

/// A sphere light 10⁻⁵ of its distance wide.
pub fn small_sphere_light() -> ExactScene {
    let mut scene = sphere_light_of("small sphere light", 1e-4, 10.0, 1.0);
    // Too small to be hit.
    for e in &mut scene.expected {
        e.families = if e.mean > 0.0 { Families::S1 } else { e.families };
    }
    scene
}

/// A disk parallel to the plate.
pub fn disk_light() -> ExactScene {
    let (radius, height) = (0.8, 0.8);
    let range = [-1.0, 1.0];
    let mut b = plate(range, range, 0.4);
    let black = b.diffuse(0.0);
    b.disk(DVec3::Z * height, -DVec3::Z, radius, black).emission = Some(Rgb::WHITE);
    let irradiance = mean(range, range, |x, y| {
        forms::disk_irradiance(radius, height, (x * x + y * y).sqrt(), 1.0)
    });
    scene("disk light", b, irradiance)
}

/// A triangle in general position.
pub fn polygon_light() -> ExactScene {
    let range = [-1.0, 1.0];
    let triangle =
        [DVec3::new(-1.2, -0.9, 0.9), DVec3::new(0.1, 1.4, 1.2), DVec3::new(1.3, -0.7, 0.7)];
    let mut b = plate(range, range, 0.4);
    let black = b.diffuse(0.0);
    let light = b.mesh(
        MeshData {
            positions: triangle.iter().map(|p| p.as_vec3().to_array()).collect(),
            triangles: vec![[0, 1, 2]],
            ..MeshData::default()
        },
        black,
    );
    light.emission = Some(Rgb::WHITE);
    // The vertices as the mesh holds them.
    let triangle = triangle.map(|p| p.as_vec3().as_dvec3());
    let irradiance = mean(range, range, |x, y| {
        forms::polygon_irradiance(DVec3::new(x, y, 0.0), DVec3::Z, &triangle, 1.0)
    });
    scene("polygon light", b, irradiance)
}

/// C-11, twice as long as wide.
pub fn parallel_rectangles() -> ExactScene {
    let (a, c, distance) = (2.0, 1.0, 0.8);
    let (xs, ys) = ([0.0, a], [0.0, c]);
    let mut b = plate(xs, ys, 0.5);
    let black = b.diffuse(0.0);
    let light = b.rectangle(DVec3::Z * distance, DVec3::Y * c, DVec3::X * a, black);
    light.emission = Some(Rgb::WHITE);
    scene("parallel rectangles", b, PI * forms::parallel_rectangles(a, c, distance))
}

/// C-14: unit squares with a common edge.
pub fn perpendicular_rectangles() -> ExactScene {
    // A ray along the common edge may hit the light instead of the floor, by rounding.
    let mut b = plate([1e-6, 1.0], [0.0, 1.0], 0.8);
    let black = b.diffuse(0.0);
    b.rectangle(DVec3::ZERO, DVec3::Y, DVec3::Z, black).emission = Some(Rgb::WHITE);
    scene("perpendicular rectangles", b, PI * forms::perpendicular_rectangles(1.0, 1.0, 1.0))
}

/// C-41: the film sees the whole receiving disk and nothing beside it.
pub fn coaxial_disks() -> ExactScene {
    let (r1, r2, distance, half) = (1.0, 0.8, 0.7, 1.05);
    let range = [-half, half];
    let mut b = view(range, range, 0.3);
    let (grey, black) = (b.diffuse(RHO), b.diffuse(0.0));
    b.disk(DVec3::ZERO, DVec3::Z, r1, grey);
    b.disk(DVec3::Z * distance, -DVec3::Z, r2, black).emission = Some(Rgb::WHITE);
    let share = PI * r1 * r1 / (4.0 * half * half);
    scene("coaxial disks", b, share * PI * forms::coaxial_disks(r1, r2, distance))
}
