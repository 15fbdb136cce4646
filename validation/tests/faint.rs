//! A lamp of a ten-millionth of the power, alone in its room.

use glam::DVec3;
use pathspace_core::description::SceneDescription;
use pathspace_core::film::{Film, Layers};
use pathspace_core::path::WalkRules;
use pathspace_core::random::derive_seed;
use pathspace_core::{Rgb, Scene};
use pathspace_integrators::{Defaults, Registry};
use pathspace_validation::scene_builder::SceneBuilder;
use rayon::prelude::*;
use std::sync::Arc;

use crate::models;

/// Longest path in edges.
const LENGTHS: u32 = 4;

/// The inside of a luminous sphere of reflectance ½ with L_e = 1, and outside of it a ball of 10⁷
/// times the power.
fn two_rooms() -> SceneDescription {
    let mut b = SceneBuilder::new(4);
    let grey = b.diffuse(0.5);
    let room = b.sphere(DVec3::ZERO, 1.0, grey);
    room.flip_normals = true;
    room.emission = Some(Rgb::WHITE);
    let sun = b.sphere(DVec3::new(4.0, 0.0, 0.0), 1.0, grey);
    sun.emission = Some(Rgb::grey(1e7));
    b.look_at(DVec3::new(0.1, -0.2, 0.1), DVec3::new(0.3, 0.5, 0.2), DVec3::Z, 100.0);
    b.finish()
}

/// The radiance of the room is Σ ρ^{k−1} whatever shines outside.
#[test]
fn a_lamp_of_a_ten_millionth_of_the_power_is_as_bright_as_it_is() {
    let scene = Arc::new(models::build(&two_rooms()));
    let rules = WalkRules { max_length: Some(LENGTHS), ..WalkRules::default() };
    let expected = 2.0 - 0.5_f64.powi(LENGTHS as i32 - 1);
    for (spec, steps) in [
        ("pt", 64),
        ("lt", 20_000),
        ("bdpt", 64),
        ("pssmlt:bootstrap=2000,chains=16", 250),
        ("mmlt:bootstrap=2000,chains=16", 250),
        ("rjmlt:bootstrap=2000,chains=16", 250),
        ("mlt:bootstrap=2000,chains=16", 250),
    ] {
        let spec_of_it = spec.parse().unwrap();
        let integrator = Registry::builtin().create(&spec_of_it, &Defaults { rules }).unwrap();
        let means: Vec<f64> = (0..16)
            .into_par_iter()
            .map(|r| {
                let mut film = Film::new(scene.film(), Layers::NONE);
                let mut run = integrator.start(scene.clone(), derive_seed(7, r)).unwrap();
                run.steps(&mut film, steps);
                film.mean()[1]
            })
            .collect();
        let n = means.len() as f64;
        let mean = means.iter().sum::<f64>() / n;
        let se = (means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
        println!("{spec}: {mean:.4} ± {se:.4} against {expected:.4}");
        assert!((mean - expected).abs() < 5.0 * se + 1e-5 * expected, "{spec}: {mean} ± {se}");
        assert!(se < 0.1 * expected, "{spec}: nothing is shown by {mean} ± {se}");
    }
}

/// What both rooms get is what the scene has.
#[test]
fn the_faint_lamp_is_picked_more_often_than_its_power_says() {
    let scene: Scene = models::build(&two_rooms());
    let masses: Vec<f64> = (0..2).map(|i| scene.emitters().mass(i).value()).collect();
    assert!((masses[0] + masses[1] - 1.0).abs() < 1e-12);
    assert!(masses[0] > 0.01 && masses[0] < 0.02, "{masses:?}");
}
