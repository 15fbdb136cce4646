//! Caustics: light that reaches a receiver through glass, by flux.

use std::f64::consts::PI;

use glam::DVec3;
use pathspace_core::Rgb;
use pathspace_core::description::{EmitterDescription, FilmDescription};
use pathspace_core::film::Families;

use super::forms::fresnel;
use super::quadrature::interval;
use super::{ExactLength, ExactScene, up_to};
use crate::scene_builder::SceneBuilder;

/// Every scene of this file.
pub fn all() -> Vec<ExactScene> {
    vec![
        refractive_plane("refractive plane, inner", 0.8),
        refractive_plane("refractive plane", 1.5),
    ]
}

/// Flux within radius `r` of the receiver at height `above` over a plane, from a point of intensity
/// 1 at `depth` below it in a medium of index n: ∫ 2π T(θ₁) sin θ₁ dθ₁ up to the ray that arrives
/// at r = depth·tan θ₁ + above·tan θ₂, sin θ₂ = n sin θ₁.
pub fn refracted_flux(n: f64, depth: f64, above: f64, r: f64) -> f64 {
    let arrival = |theta: f64| {
        let sin2 = n * theta.sin();
        depth * theta.tan() + above * sin2 / (1.0 - sin2 * sin2).max(1e-300).sqrt()
    };
    let (mut lo, mut hi) = (0.0, (1.0 / n).asin());
    for _ in 0..200 {
        let middle = 0.5 * (lo + hi);
        if arrival(middle) < r { lo = middle } else { hi = middle }
    }
    interval(0.0, lo, 64, |t| 2.0 * PI * (1.0 - fresnel(n, 1.0, t.cos())) * t.sin())
}

/// A point light in a medium under a plane; the film looks up at a Lambertian disk of radius `r`
/// from between.
pub fn refractive_plane(name: &'static str, r: f64) -> ExactScene {
    let (n, depth, above, rho) = (1.5, 1.0, 2.0, 1e-3);
    let half = 1.05 * r;
    let mut b = SceneBuilder::new(64);
    b.description().film = FilmDescription::new(64, 64);
    let (glass, grey) = (b.glass(n as f32), b.diffuse(rho as f32));
    b.rectangle(DVec3::new(-4.0, -4.0, 0.0), DVec3::X * 8.0, DVec3::Y * 8.0, glass);
    b.disk(DVec3::Z * above, -DVec3::Z, r, grey);
    b.emitter(EmitterDescription::Point {
        position: DVec3::Z * -depth,
        intensity: Rgb::grey(1000.0),
    });
    let eye = 0.5 * above;
    let fov = 2.0 * (half / (above - eye)).atan().to_degrees();
    b.look_at(DVec3::Z * eye, DVec3::Z * above, DVec3::Y, fov);
    let flux = 1000.0 * refracted_flux(n, depth, above, r);
    let value = rho as f32 as f64 / PI * flux / (4.0 * half * half);
    let expected = vec![
        ExactLength::new(2, 0.0, Families::T1),
        ExactLength::new(3, value, Families::T1),
        ExactLength::new(4, 0.0, Families::T1),
    ];
    ExactScene { name, description: b.finish(), rules: up_to(4), expected }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flux_has_the_known_digits() {
        assert!((refracted_flux(1.5, 1.0, 2.0, 1.5) - 0.3417786).abs() < 5e-8);
    }
}
