//! Kinds of paths that a comparison keeps apart.

use std::collections::BTreeMap;
use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::film::{Families, Film};
use pathspace_core::path::WalkRules;
use pathspace_core::random::derive_seed;
use pathspace_integrators::{Defaults, Registry};
use pathspace_scenes::library;
use pathspace_validation::pairs::{Method, Observation, PathClass, Tiles, judge};
use pathspace_validation::stats::{CompareConfig, Verdict};

const SIZE: usize = 32;
const SAMPLES: u64 = 64;

fn method(scene: &Arc<Scene>, spec: &str, rules: WalkRules, seed: u64) -> Method {
    let integrator =
        Registry::builtin().create(&spec.parse().unwrap(), &Defaults { rules }).unwrap();
    let mut method = Method::new(spec.into(), integrator.families(scene));
    for r in 0..16 {
        let mut film = Film::new(scene.film(), Observation::LAYERS);
        let mut run = integrator.start(scene.clone(), derive_seed(seed, r)).unwrap();
        for _ in 0..SAMPLES {
            run.step(&mut film);
        }
        method.replicates.push(Observation::of(&film, &Tiles::at_most(16, SIZE, SIZE)));
    }
    method
}

/// The same method with light from infinity and from lamps in one class.
fn without_marks(method: &Method) -> Method {
    let one = |observation: &Observation| {
        let mut classes: BTreeMap<PathClass, _> = BTreeMap::new();
        for (class, value) in &observation.classes {
            let bits = class.families.bits() & Families::ALL.bits();
            let key = PathClass { families: Families::from_bits(bits), ..*class };
            let sum = classes.entry(key).or_insert_with(|| {
                let mut dark = value.clone();
                dark.mean = 0.0;
                dark.tiles.fill(0.0);
                (dark.channels, dark.sources) = Default::default();
                dark
            });
            sum.mean += value.mean;
            sum.tiles.iter_mut().zip(&value.tiles).for_each(|(sum, v)| *sum += v);
        }
        Observation { classes, samples: 0 }
    };
    Method { replicates: method.replicates.iter().map(one).collect(), ..method.clone() }
}

/// `erpt` hits the small lamp of ring-caustic through the ring too seldom to have met it in these
/// replicates; that the surroundings shine through the ring as well must not make them look well
/// sampled.
#[test]
fn a_lamp_that_was_never_met_does_not_hide_behind_the_surroundings() {
    let scene = library::find("ring-caustic").unwrap();
    let loaded = scene.load(&[("res".into(), SIZE.to_string())]).unwrap();
    let built = Arc::new(Scene::new(&loaded.description).unwrap());
    let rules =
        WalkRules { max_length: loaded.defaults.max_depth, rr_depth: loaded.defaults.rr_depth };
    let (lt, erpt) = (method(&built, "lt", rules, 1), method(&built, "erpt", rules, 3));
    let verdict = |a: &Method, b: &Method| {
        judge(a, b, &Tiles::at_most(16, SIZE, SIZE), &CompareConfig::default()).unwrap().verdict
    };
    assert_eq!(verdict(&without_marks(&lt), &without_marks(&erpt)), Verdict::Differ);
    assert_eq!(verdict(&lt, &erpt), Verdict::Inconclusive);
}
