//! Smooth dielectrics: every path is the only one, and Fresnel's equations tell what it carries.

use std::f64::consts::PI;

use glam::{DAffine3, DVec3};
use pathspace_core::Rgb;
use pathspace_core::description::{EmitterDescription, ShapeGeometry};
use pathspace_core::film::Families;
use pathspace_core::path::WalkRules;

use super::forms::fresnel;
use super::quadrature::film_mean;
use super::{ExactLength, ExactScene, up_to};
use crate::scene_builder::SceneBuilder;

const FILM: u32 = 64;
/// Bounces in glass that are followed one by one; the index is high so that they are not rare.
const ORDERS: u32 = 2;
const UNLIMITED: WalkRules = WalkRules { max_length: None, rr_depth: 5 };

/// Every scene of this file.
pub fn all() -> Vec<ExactScene> {
    vec![
        glass_from_outside(),
        glass_from_inside(),
        glass_cube(),
        slab(),
        slab_under_directional_light(),
    ]
}

/// A glass ball in a constant environment L = 1: R at length 2, (1−R)² R^j at length 3 + j, all
/// together 1.
pub fn glass_from_outside() -> ExactScene {
    // The corners of the film stay inside the silhouette.
    const FOV: f64 = 32.0;
    let (n, distance) = (2.5, 2.5);
    let mut b = SceneBuilder::new(FILM);
    let glass = b.glass(n as f32);
    b.sphere(DVec3::ZERO, 1.0, glass);
    b.emitter(EmitterDescription::Constant { radiance: Rgb::WHITE });
    b.look_at(DVec3::new(0.0, -distance, 0.0), DVec3::ZERO, DVec3::Z, FOV);
    // All reflections in a sphere have the same angle: sin θ = distance·sin ψ, ψ from the axis.
    let mean = |f: &dyn Fn(f64) -> f64| {
        film_mean(FOV, |d| {
            let sin2 = distance * distance * (1.0 - d.z * d.z);
            f(fresnel(1.0, n, (1.0 - sin2).max(0.0).sqrt()))
        })
    };
    let seen = Families::S0;
    let mut expected = vec![
        ExactLength::total(1.0, seen),
        ExactLength::new(1, 0.0, seen),
        ExactLength::new(2, mean(&|r| r), seen),
    ];
    for j in 0..ORDERS {
        let value = mean(&|r| (1.0 - r).powi(2) * r.powi(j as i32));
        expected.push(ExactLength::new(3 + j, value, seen));
    }
    let description = b.finish();
    ExactScene { name: "glass in a furnace, from outside", description, rules: UNLIMITED, expected }
}

/// A glass cube in an environment L = 1 is invisible. What enters by one face leaves by it or the
/// opposite one, and is reflected totally by the four others.
pub fn glass_cube() -> ExactScene {
    let mut b = SceneBuilder::new(FILM);
    let glass = b.glass(1.5);
    b.shape(ShapeGeometry::Cube, DAffine3::IDENTITY, glass);
    b.emitter(EmitterDescription::Constant { radiance: Rgb::WHITE });
    b.look_at(DVec3::new(1.7, -2.2, 1.4), DVec3::ZERO, DVec3::Z, 35.0);
    let expected = vec![ExactLength::total(1.0, Families::S0)];
    let description = b.finish();
    ExactScene { name: "glass cube in a furnace", description, rules: UNLIMITED, expected }
}

/// From inside a glass ball the environment has radiance n²: n² (1−R) R^j at length 2 + j. The eye
/// is near enough to the centre that no reflection is total.
pub fn glass_from_inside() -> ExactScene {
    const FOV: f64 = 90.0;
    let n = 2.5;
    let eye = DVec3::new(0.0, -0.3, 0.0);
    let mut b = SceneBuilder::new(FILM);
    let glass = b.glass(n as f32);
    b.sphere(DVec3::ZERO, 1.0, glass);
    b.emitter(EmitterDescription::Constant { radiance: Rgb::WHITE });
    let camera = b.look_at(eye, DVec3::new(1.0, 0.0, 0.3), DVec3::Z, FOV).to_world;
    let mean = |f: &dyn Fn(f64) -> f64| {
        film_mean(FOV, |d| {
            let d = camera.transform_vector3(d);
            // Distance of the ray from the centre.
            let sin2 = eye.cross(d).length_squared();
            f(fresnel(n, 1.0, (1.0 - sin2).sqrt()))
        })
    };
    let seen = Families::S0;
    let mut expected = vec![ExactLength::total(n * n, seen)];
    for j in 0..ORDERS {
        let value = n * n * mean(&|r| (1.0 - r) * r.powi(j as i32));
        expected.push(ExactLength::new(2 + j, value, seen));
    }
    let description = b.finish();
    ExactScene { name: "glass in a furnace, from inside", description, rules: UNLIMITED, expected }
}

/// A plate of two boundaries in front of an emitter L = 1: (1−R)² R^{2j} at length 3 + 2j, together
/// T = (1−R)/(1+R).
pub fn slab() -> ExactScene {
    const FOV: f64 = 90.0;
    let n = 2.0;
    let mut b = SceneBuilder::new(FILM);
    let (glass, black) = (b.glass(n as f32), b.diffuse(0.0));
    plate(&mut b, glass, 40.0, 0.0, 0.05);
    let light =
        b.rectangle(DVec3::new(-20.0, -20.0, -0.1), DVec3::X * 40.0, DVec3::Y * 40.0, black);
    light.emission = Some(Rgb::WHITE);
    b.look_at(DVec3::new(0.0, 0.0, 1.0), DVec3::ZERO, DVec3::Y, FOV);
    let mean = |f: &dyn Fn(f64) -> f64| film_mean(FOV, |d| f(fresnel(1.0, n, d.z)));
    let seen = Families::S0;
    let expected = vec![
        ExactLength::total(mean(&|r| (1.0 - r) / (1.0 + r)), seen),
        ExactLength::new(2, 0.0, seen),
        ExactLength::new(3, mean(&|r| (1.0 - r).powi(2)), seen),
    ];
    let description = b.finish();
    ExactScene { name: "emitter behind a slab", description, rules: UNLIMITED, expected }
}

/// Parallel light through a plate onto a nearly black receiver: E cos θ (1−R)² R^{2j} at length 4 +
/// 2j. Only light tracing sees it.
pub fn slab_under_directional_light() -> ExactScene {
    let (n, rho, irradiance) = (1.5, 1e-6, 2e6);
    let mut b = SceneBuilder::new(FILM);
    let (glass, grey) = (b.glass(n as f32), b.diffuse(rho as f32));
    plate(&mut b, glass, 2.6, 0.4, 0.45);
    b.rectangle(DVec3::new(-1.1, -1.1, 0.0), DVec3::X * 2.2, DVec3::Y * 2.2, grey);
    let direction = DVec3::new(0.3, 0.1, -0.8).normalize();
    b.emitter(EmitterDescription::Directional {
        direction,
        irradiance: Rgb::grey(irradiance as f32),
    });
    // The film is the square [−1, 1]² of the receiver.
    b.look_at(
        DVec3::new(0.0, 0.0, 0.35),
        DVec3::ZERO,
        DVec3::Y,
        2.0 * (1.0 / 0.35_f64).atan().to_degrees(),
    );
    let cos = -direction.z;
    let r = fresnel(1.0, n, cos);
    let direct = rho as f32 as f64 / PI * irradiance * cos * (1.0 - r).powi(2);
    // What the receiver itself sends back to the plate and receives again is below ρ of this.
    let first =
        ExactLength { uncertainty: direct * rho, ..ExactLength::new(4, direct, Families::T1) };
    let expected = vec![ExactLength::new(3, 0.0, Families::T1), first];
    let description = b.finish();
    ExactScene { name: "slab under a directional light", description, rules: up_to(5), expected }
}

/// Two boundaries at heights z0 < z1, square of side `side` about the z axis, normals outward.
fn plate(b: &mut SceneBuilder, glass: usize, side: f64, z0: f64, z1: f64) {
    let corner = |z| DVec3::new(-0.5 * side, -0.5 * side, z);
    b.rectangle(corner(z1), DVec3::X * side, DVec3::Y * side, glass);
    b.rectangle(corner(z0), DVec3::Y * side, DVec3::X * side, glass);
}
