//! Participating media: absorption alone, furnaces, single scattering.

use std::f64::consts::PI;

use glam::{DAffine3, DVec3};
use pathspace_core::Rgb;
use pathspace_core::description::{EmitterDescription, MaterialKind, PhaseKind, ShapeGeometry};
use pathspace_core::film::Families;
use pathspace_core::path::WalkRules;

use super::quadrature::{film_mean, interval};
use super::{ExactLength, ExactScene, up_to};
use crate::scene_builder::SceneBuilder;

const FILM: u32 = 32;
const DIRECT: Families = Families::S0.or(Families::T1);
const SCATTERED: Families = Families::S0.or(Families::S1).or(Families::T1);
/// Of a point or directional light.
const OF_POINT: Families = Families::S1.or(Families::T1);

/// Every scene of this file.
pub fn all() -> Vec<ExactScene> {
    vec![
        absorbing_slab(),
        absorbing_ball(),
        ball_of_fog_in_a_furnace(),
        furnace_full_of_fog(),
        milk_in_glass_in_a_furnace(),
        airlight("airlight of a point light", 0.0),
        airlight("airlight of a point light, forward", 0.6),
        slab_under_a_directional_light(),
    ]
}

/// The inside of a black sphere of radius 3 that emits L = 1.
fn lamp_all_around(b: &mut SceneBuilder) {
    let black = b.diffuse(0.0);
    let sphere = b.sphere(DVec3::ZERO, 3.0, black);
    sphere.flip_normals = true;
    sphere.emission = Some(Rgb::WHITE);
}

/// A slab that absorbs, between the sensor and a wall of radiance 1: exp(−σh/cos θ), and nothing is
/// scattered.
pub fn absorbing_slab() -> ExactScene {
    const FOV: f64 = 70.0;
    let (sigma, h) = (1.3, 0.6);
    let mut b = SceneBuilder::new(FILM);
    lamp_all_around(&mut b);
    let matched = b.material(MaterialKind::Null);
    let fog = b.medium([sigma; 3], Rgb::BLACK, PhaseKind::Isotropic);
    let flat = DAffine3::from_scale(DVec3::new(1.8, 0.5 * h, 1.8));
    b.shape(ShapeGeometry::Cube, flat, matched);
    b.filled_with(fog);
    b.look_at(DVec3::new(0.0, -1.0, 0.0), DVec3::ZERO, DVec3::Z, FOV);
    let mean = film_mean(FOV, |d| (-sigma * h / d.z).exp());
    let expected = vec![ExactLength::new(1, mean, DIRECT), ExactLength::new(2, 0.0, SCATTERED)];
    ExactScene { name: "absorbing slab", description: b.finish(), rules: up_to(3), expected }
}

/// A ball that absorbs, seen from outside: exp(−σ c) with the chord c.
pub fn absorbing_ball() -> ExactScene {
    const FOV: f64 = 60.0;
    let (sigma, radius, distance) = (1.1, 0.8, 1.7);
    let mut b = SceneBuilder::new(FILM);
    lamp_all_around(&mut b);
    let matched = b.material(MaterialKind::Null);
    let fog = b.medium([sigma; 3], Rgb::BLACK, PhaseKind::Isotropic);
    b.sphere(DVec3::ZERO, radius, matched);
    b.filled_with(fog);
    b.look_at(DVec3::new(0.0, -distance, 0.0), DVec3::ZERO, DVec3::Z, FOV);
    let mean = film_mean(FOV, |d| {
        let half2 = radius * radius - distance * distance * (1.0 - d.z * d.z);
        (-sigma * 2.0 * half2.max(0.0).sqrt()).exp()
    });
    let expected = vec![ExactLength::new(1, mean, DIRECT), ExactLength::new(2, 0.0, SCATTERED)];
    ExactScene { name: "absorbing ball", description: b.finish(), rules: up_to(3), expected }
}

fn furnace(name: &'static str, b: SceneBuilder) -> ExactScene {
    let expected = vec![ExactLength::total(1.0, SCATTERED)];
    let rules = WalkRules { max_length: None, rr_depth: 8 };
    ExactScene { name, description: b.finish(), rules, expected }
}

/// A ball that scatters all and absorbs nothing, in coloured extinction, under a sky of radiance 1:
/// it can not be seen.
pub fn ball_of_fog_in_a_furnace() -> ExactScene {
    let mut b = SceneBuilder::new(FILM);
    let matched = b.material(MaterialKind::Null);
    let fog = b.medium([0.5, 1.5, 1.0], Rgb::WHITE, PhaseKind::Isotropic);
    b.sphere(DVec3::ZERO, 1.0, matched);
    b.filled_with(fog);
    b.emitter(EmitterDescription::Constant { radiance: Rgb::WHITE });
    b.look_at(DVec3::new(0.0, -1.5, 0.0), DVec3::ZERO, DVec3::Z, 64.0);
    furnace("ball of fog in a furnace", b)
}

/// A lamp all around that is full of fog which scatters forward: no boundary but the lamp itself,
/// the sensor inside.
pub fn furnace_full_of_fog() -> ExactScene {
    let mut b = SceneBuilder::new(FILM);
    lamp_all_around(&mut b);
    let fog = b.medium([0.4; 3], Rgb::WHITE, PhaseKind::HenyeyGreenstein { g: 0.7 });
    b.sensor_in(fog);
    b.look_at(DVec3::new(0.3, -0.4, 0.2), DVec3::new(0.5, 1.0, 0.4), DVec3::Z, 90.0);
    furnace("furnace full of fog", b)
}

/// A ball of glass filled with a medium that absorbs nothing, under a sky of radiance 1.
pub fn milk_in_glass_in_a_furnace() -> ExactScene {
    let mut b = SceneBuilder::new(FILM);
    let glass = b.glass(1.3);
    let milk = b.medium([1.0; 3], Rgb::WHITE, PhaseKind::Rayleigh);
    b.sphere(DVec3::ZERO, 1.0, glass);
    b.filled_with(milk);
    b.emitter(EmitterDescription::Constant { radiance: Rgb::WHITE });
    b.look_at(DVec3::new(0.0, -1.5, 0.0), DVec3::ZERO, DVec3::Z, 64.0);
    // Only hits of the sky see everything through the glass.
    let expected = vec![ExactLength::total(1.0, Families::S0)];
    let rules = WalkRules { max_length: None, rr_depth: 8 };
    let name = "milk in glass in a furnace";
    ExactScene { name, description: b.finish(), rules, expected }
}

/// A point light beside the view in fog without end. Scattered once: L(d) = ∫ I σ_s ρ(θ) exp(−σ_t
/// (t + r)) / r² dt.
pub fn airlight(name: &'static str, g: f64) -> ExactScene {
    const FOV: f64 = 40.0;
    let (sigma, albedo, intensity) = (0.4, 0.75, 5.0);
    let light = DVec3::new(1.5, 0.5, 0.2);
    let mut b = SceneBuilder::new(FILM);
    let phase = PhaseKind::HenyeyGreenstein { g };
    let fog = b.medium([sigma; 3], Rgb::grey(albedo as f32), phase);
    b.sensor_in(fog);
    b.emitter(EmitterDescription::Point {
        position: light,
        intensity: Rgb::grey(intensity as f32),
    });
    let eye = DVec3::new(0.0, -1.0, 0.0);
    let camera = b.look_at(eye, DVec3::ZERO, DVec3::Z, FOV).to_world;
    let half = (0.5 * FOV.to_radians()).tan();
    let over_film = |f: &dyn Fn(DVec3) -> f64| {
        // The integrand is smooth: far fewer panels than for silhouettes.
        let row = |x: f64| {
            interval(-half, half, 6, |y| f(DVec3::new(x, y, 1.0).normalize())) / (2.0 * half)
        };
        interval(-half, half, 6, row) / (2.0 * half)
    };
    let mean = over_film(&|d| {
        let d = camera.transform_vector3(d);
        let integrand = |t: f64| {
            let to_light = light - (eye + d * t);
            let r = to_light.length();
            // Light comes along −to_light and goes on along −d.
            let cos = to_light.dot(d) / r;
            let phase = (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5));
            intensity * albedo * sigma * phase * (-sigma * (t + r)).exp() / (r * r)
        };
        // Finely beside the light, then to where 10⁻¹² is left.
        interval(0.0, 4.0, 24, integrand) + interval(4.0, 70.0, 24, integrand)
    });
    let expected = vec![ExactLength::new(2, mean, OF_POINT)];
    ExactScene { name, description: b.finish(), rules: up_to(2), expected }
}

/// A slab of optical thickness τ under light that comes straight down. Scattered once upwards into
/// the direction of cosine μ: E ω ρ (1 − exp(−τ(1 + 1/μ)))/(1 + μ) (Chandrasekhar 1960, §7).
pub fn slab_under_a_directional_light() -> ExactScene {
    const FOV: f64 = 60.0;
    let (sigma, h, albedo, irradiance) = (1.5, 0.5, 0.9, 2.0);
    let mut b = SceneBuilder::new(FILM);
    let matched = b.material(MaterialKind::Null);
    let fog = b.medium([sigma; 3], Rgb::grey(albedo as f32), PhaseKind::Isotropic);
    let flat = DAffine3::from_scale(DVec3::new(2.0, 2.0, 0.5 * h));
    b.shape(ShapeGeometry::Cube, flat, matched);
    b.filled_with(fog);
    b.emitter(EmitterDescription::Directional {
        direction: DVec3::NEG_Z,
        irradiance: Rgb::grey(irradiance as f32),
    });
    b.look_at(DVec3::new(0.0, 0.0, 1.5), DVec3::ZERO, DVec3::Y, FOV);
    let tau = sigma * h;
    let mean = film_mean(FOV, |d| {
        let mu = d.z;
        let left = 1.0 - (-tau * (1.0 + 1.0 / mu)).exp();
        irradiance * albedo * left / (4.0 * PI * (1.0 + mu))
    });
    let expected = vec![ExactLength::new(2, mean, OF_POINT)];
    let name = "slab of fog under a directional light";
    ExactScene { name, description: b.finish(), rules: up_to(2), expected }
}
