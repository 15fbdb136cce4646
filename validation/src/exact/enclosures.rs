//! Closed systems: furnaces, integrating spheres, concentric spheres.

use std::f64::consts::PI;

use glam::DVec3;
use pathspace_core::Rgb;
use pathspace_core::description::EmitterDescription;
use pathspace_core::film::Families;
use pathspace_core::path::WalkRules;

use super::quadrature::film_mean;
use super::{ExactLength, ExactScene, up_to};
use crate::scene_builder::SceneBuilder;

const FILM: u32 = 64;
/// Families that see Lambertian surfaces directly, but those of a single edge.
const DIFFUSE: Families = Families::S0.or(Families::S1).or(Families::T1);
const DIRECT: Families = Families::S0.or(Families::T1);

/// Every scene of this file.
pub fn all() -> Vec<ExactScene> {
    vec![
        furnace("white furnace", 1.0),
        furnace("grey furnace", 0.5),
        concave_furnace(),
        integrating_sphere(),
        integrating_sphere_through_a_lens(),
        integrating_sphere_with_point_light(),
        integrating_sphere_with_both_lights(),
        concentric_spheres(),
    ]
}

/// A Lambertian sphere of reflectance ρ in a constant environment L = 1, seen from near: length 2
/// is ρ, nothing else.
pub fn furnace(name: &'static str, rho: f32) -> ExactScene {
    let mut b = SceneBuilder::new(FILM);
    let material = b.diffuse(rho);
    b.sphere(DVec3::ZERO, 1.0, material);
    b.emitter(EmitterDescription::Constant { radiance: Rgb::WHITE });
    // The corners of the film stay inside the silhouette, sin ψ = 1/1.5.
    b.look_at(DVec3::new(0.0, -1.5, 0.0), DVec3::ZERO, DVec3::Z, 64.0);
    let expected = vec![
        ExactLength::new(1, 0.0, DIRECT),
        ExactLength::new(2, rho as f64, DIFFUSE),
        ExactLength::new(3, 0.0, DIFFUSE),
    ];
    ExactScene { name, description: b.finish(), rules: up_to(4), expected }
}

/// A white corner in a white environment: paths of all lengths, together exactly the environment's
/// radiance.
pub fn concave_furnace() -> ExactScene {
    let mut b = SceneBuilder::new(FILM);
    let white = b.diffuse(1.0);
    b.rectangle(DVec3::ZERO, DVec3::X, DVec3::Y, white);
    b.rectangle(DVec3::ZERO, DVec3::Y, DVec3::Z, white);
    b.emitter(EmitterDescription::Constant { radiance: Rgb::WHITE });
    b.look_at(DVec3::new(1.2, 0.5, 1.2), DVec3::new(0.1, 0.5, 0.1), DVec3::Z, 25.0);
    let expected = vec![ExactLength::total(1.0, DIFFUSE)];
    let rules = WalkRules { max_length: None, rr_depth: 8 };
    ExactScene { name: "white corner in a furnace", description: b.finish(), rules, expected }
}

/// A sphere seen from inside that emits L_e = 1 and reflects ρ = ½ everywhere: L_k = ρ^{k−1}.
pub fn integrating_sphere() -> ExactScene {
    integrating_sphere_seen("integrating sphere", 0.0)
}

/// The same through a lens wide enough that light subpaths hit it (t = 0): what is uniform stays so
/// through any lens.
pub fn integrating_sphere_through_a_lens() -> ExactScene {
    integrating_sphere_seen("integrating sphere through a lens", 1.2)
}

fn integrating_sphere_seen(name: &'static str, aperture_radius: f64) -> ExactScene {
    const LENGTHS: u32 = 6;
    let mut b = SceneBuilder::new(FILM);
    let grey = b.diffuse(0.5);
    let sphere = b.sphere(DVec3::ZERO, 2.0, grey);
    sphere.flip_normals = true;
    sphere.emission = Some(Rgb::WHITE);
    let eye = DVec3::new(0.3, -0.4, 0.2);
    b.look_at(eye, DVec3::new(0.5, 1.0, 0.4), DVec3::Z, 110.0).aperture_radius = aperture_radius;
    let expected = (1..=LENGTHS)
        .map(|k| {
            let families = if k == 1 { DIRECT } else { DIFFUSE };
            let families = families | Families::T0.when(aperture_radius > 0.0);
            ExactLength::new(k, 0.5_f64.powi(k as i32 - 1), families)
        })
        .collect();
    let description = b.finish();
    ExactScene { name, description, rules: up_to(LENGTHS), expected }
}

/// A point light of power Φ off the centre of a sphere of radius R: whatever its position, light
/// reflected j ≥ 1 times has the uniform irradiance ρ^j Φ/(4πR²). The direct irradiance is I cos
/// θ/d².
pub fn integrating_sphere_with_point_light() -> ExactScene {
    point_light_in_a_sphere("integrating sphere with a point light", None)
}

/// The same with walls that emit as well, L_e = ½: a light of zero size and one of finite size in
/// one scene, whose answers add up.
pub fn integrating_sphere_with_both_lights() -> ExactScene {
    point_light_in_a_sphere("integrating sphere with both lights", Some(0.5))
}

fn point_light_in_a_sphere(name: &'static str, emission: Option<f32>) -> ExactScene {
    const LENGTHS: u32 = 6;
    const FOV: f64 = 110.0;
    let (radius, rho, intensity) = (2.0_f64, 0.5_f64, 3.0_f64);
    let light = DVec3::new(0.5, 0.3, -0.6);
    let eye = DVec3::new(-0.4, -0.5, 0.3);
    let mut b = SceneBuilder::new(FILM);
    let grey = b.diffuse(rho as f32);
    let sphere = b.sphere(DVec3::ZERO, radius, grey);
    sphere.flip_normals = true;
    sphere.emission = emission.map(Rgb::grey);
    b.emitter(EmitterDescription::Point {
        position: light,
        intensity: Rgb::grey(intensity as f32),
    });
    let camera = b.look_at(eye, DVec3::new(0.2, 1.0, 0.1), DVec3::Z, FOV).to_world;
    let direct = film_mean(FOV, |d| {
        let d = camera.transform_vector3(d);
        let along = eye.dot(d);
        let wall =
            eye + d * ((along * along + radius * radius - eye.length_squared()).sqrt() - along);
        let to_light = light - wall;
        let cos = -wall.dot(to_light) / (radius * to_light.length());
        intensity * cos / to_light.length_squared()
    });
    let once = intensity / (radius * radius);
    let wall = |k: u32| f64::from(emission.unwrap_or(0.0)) * rho.powi(k as i32 - 1);
    let mut expected: Vec<ExactLength> = (2..=LENGTHS)
        .map(|k| {
            let irradiance = if k == 2 { direct } else { once * rho.powi(k as i32 - 2) };
            ExactLength::new(k, rho / PI * irradiance + wall(k), Families::S1 | Families::T1)
        })
        .collect();
    if emission.is_some() {
        expected.insert(0, ExactLength::new(1, wall(1), DIRECT));
    }
    let description = b.finish();
    ExactScene { name, description, rules: up_to(LENGTHS), expected }
}

/// A sphere r₁ = ½ that emits (exitance 1) inside one of r₂ = 1: B⁽ⁿ⁾ = (ρF)ⁿE with F₁₂ = 1, F₂₁ =
/// (r₁/r₂)², F₂₂ = 1 − F₂₁.
pub fn concentric_spheres() -> ExactScene {
    const LENGTHS: u32 = 6;
    const FOV: f64 = 100.0;
    let (r1, r2, distance) = (0.5, 1.0, 0.75);
    let rho = [0.3_f32 as f64, 0.6_f32 as f64];
    let emission = (1.0 / PI) as f32;
    let mut b = SceneBuilder::new(FILM);
    let (inner, outer) = (b.diffuse(0.3), b.diffuse(0.6));
    b.sphere(DVec3::ZERO, r1, inner).emission = Some(Rgb::grey(emission));
    b.sphere(DVec3::ZERO, r2, outer).flip_normals = true;
    b.look_at(DVec3::new(0.0, -distance, 0.0), DVec3::ZERO, DVec3::Z, FOV);
    // The inner sphere is a disk of radius tan ψ on the film's plane, sin ψ = r₁/distance; it fits.
    let (sin, half) = (r1 / distance, (0.5 * FOV.to_radians()).tan());
    let share = PI * (sin * sin / (1.0 - sin * sin)) / (4.0 * half * half);
    let f21 = (r1 / r2) * (r1 / r2);
    let mut radiance = [emission as f64, 0.0];
    let mut expected = Vec::new();
    for k in 1..=LENGTHS {
        let mean = share * radiance[0] + (1.0 - share) * radiance[1];
        expected.push(ExactLength::new(k, mean, if k == 1 { DIRECT } else { DIFFUSE }));
        radiance = [rho[0] * radiance[1], rho[1] * (f21 * radiance[0] + (1.0 - f21) * radiance[1])];
    }
    let description = b.finish();
    ExactScene { name: "concentric spheres", description, rules: up_to(LENGTHS), expected }
}
