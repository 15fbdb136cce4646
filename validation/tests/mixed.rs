//! Materials with a specular and a non-specular component on one side: every integrator agrees,
//! path length by path length.

use std::sync::Arc;

use pathspace_core::description::SceneDescription;
use pathspace_core::film::Film;
use pathspace_core::path::WalkRules;
use pathspace_core::random::derive_seed;
use pathspace_integrators::{Defaults, Registry};
use pathspace_validation::pairs::{Method, Observation, Tiles, judge};
use pathspace_validation::stats::{CompareConfig, Verdict};
use rayon::prelude::*;

use crate::models;

const SIZE: u32 = 16;
const REPLICATES: u64 = 16;
const TILES: usize = 4;

/// An integrator with as many steps as make its noise like that of the others.
fn replicates(description: &SceneDescription, (spec, steps): (&str, u64)) -> Method {
    let scene = Arc::new(models::build(description));
    let rules = WalkRules { max_length: Some(5), rr_depth: 4 };
    let defaults = Defaults { rules };
    let integrator = Registry::builtin().create(&spec.parse().unwrap(), &defaults).unwrap();
    let mut method = Method::new(spec.into(), integrator.families(&scene));
    method.replicates = (0..REPLICATES)
        .into_par_iter()
        .map(|r| {
            let mut film = Film::new(scene.film(), Observation::LAYERS);
            let mut run = integrator.start(scene.clone(), derive_seed(7, r)).unwrap();
            for _ in 0..steps {
                run.step(&mut film);
            }
            Observation::of(&film, &Tiles::at_most(TILES, SIZE as usize, SIZE as usize))
        })
        .collect();
    method
}

/// Every integrator that sees media.
const IN_MEDIA: [(&str, u64); 5] = [
    ("pt", 256),
    ("lt", 256),
    ("pssmlt:chains=256,bootstrap=16384", 96),
    ("mmlt:chains=256,bootstrap=16384", 192),
    ("rjmlt:chains=256,bootstrap=16384,jump=0.3", 192),
];

/// Every integrator against bdpt: none differs, and most of them see a bias of some percent.
fn compare(description: SceneDescription) {
    let others = [
        ("pt", 256),
        ("lt", 256),
        ("pssmlt:chains=256,bootstrap=16384", 96),
        ("mmlt:chains=256,bootstrap=16384", 192),
        ("rjmlt:chains=256,bootstrap=16384", 192),
        ("mlt:chains=256,bootstrap=16384", 192),
    ];
    compare_with(description, &others, 4);
}

fn compare_with(mut description: SceneDescription, others: &[(&str, u64)], least: usize) {
    (description.film.width, description.film.height) = (SIZE, SIZE);
    description.film.crop.width = SIZE;
    description.film.crop.height = SIZE;
    let bdpt = replicates(&description, ("bdpt", 96));
    let mut agree = 0;
    for other in others {
        let other = replicates(&description, *other);
        let tiles = Tiles::at_most(TILES, SIZE as usize, SIZE as usize);
        let told = judge(&bdpt, &other, &tiles, &CompareConfig::default()).unwrap();
        println!("{}: {:?}, MDB {:.3}, p {:.3}", told.b, told.verdict, told.mdb, told.p);
        for l in &told.lengths {
            println!(
                "  {:?}: {:?} MDB {:.3} {} {}",
                l.length, l.verdict, l.mdb, l.mean_a, l.mean_b
            );
        }
        assert_ne!(told.verdict, Verdict::Differ, "{told:?}");
        agree += usize::from(told.mdb < 0.08);
    }
    assert!(agree >= least, "only {agree} comparisons see a bias of 8 %");
}

#[test]
fn integrators_agree_in_coloured_fog_with_a_ball_of_milk() {
    compare_with(models::foggy_room(), &IN_MEDIA, 3);
}

#[test]
fn integrators_agree_in_endless_fog_through_a_lens() {
    compare_with(models::fog_through_a_lens(), &IN_MEDIA, 3);
}

#[test]
fn integrators_agree_on_plastic_in_a_room_with_a_lamp() {
    compare(models::glazed_room());
}

#[test]
fn integrators_agree_on_plastic_beside_glass_under_a_point_light() {
    compare(models::glazed_caustic());
}

#[test]
fn integrators_agree_on_smooth_shaded_plastic_under_a_sky_through_a_lens() {
    compare(models::glazed_air());
}
