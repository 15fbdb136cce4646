//! What a state caches is what the plain functions of a path say.

use pathspace_core::film::RecordingSink;
use pathspace_core::integrator::PathEstimator;
use pathspace_core::path::{self, Technique, WalkRules};

use pathspace_integrators::bdpt::Bdpt;
use pathspace_integrators::mlt::MltPath;
use pathspace_scenes::library;

use super::{chain, numbers, starts};
use crate::models;

#[test]
fn states_agree_with_the_oracle() {
    let rules = WalkRules::default();
    for (name, scene) in models::all() {
        let chain = chain(&scene, "max_depth=8");
        let mut deltas = 0;
        for (x, _) in starts(&chain, &scene, 1).take(3000) {
            let f = path::contribution(&scene, x.path());
            for (a, b) in x.value().iter().zip(f) {
                assert!((a / b - 1.0).abs() < 1e-12 || *a == b, "{name}: {a} {b}");
            }
            let k = x.length();
            for s in 0..=k + 1 {
                let technique = Technique::new(s, k + 1 - s);
                let oracle = path::samplable(&scene, x.path(), technique, &rules);
                assert_eq!(x.samplable(s), oracle, "{name} {technique:?}");
            }
            assert_eq!(x.families(), path::families(&scene, x.path(), &rules), "{name}");
            deltas += (1..k).filter(|&i| x.is_specular(i)).count();
        }
        // A coat reflects a few percent of the light.
        let enough = if name.starts_with("glazed") { 20 } else { 100 };
        assert!(deltas > enough, "{name}: {deltas}");
    }
}

/// Edges as short as rounding must not cost a path its delta lobes: its light would be missing in
/// b̂.
#[test]
fn every_path_that_starts_can_come_from_is_a_state() {
    let bdpt = "bdpt:max_depth=7".parse().unwrap();
    let bdpt = Bdpt::from_spec(&bdpt, &Default::default()).unwrap();
    for name in ["ring-caustic", "water-pool", "cornell-caustic"] {
        let loaded = library::find(name).unwrap().load(&[("res".into(), "24".into())]).unwrap();
        let scene = models::build(&loaded.description);
        let (mut all, mut lost) = (0, 0);
        for item in 0..30_000 {
            let mut sink = RecordingSink::default();
            bdpt.estimate(&scene, None, &mut numbers(6, item), &mut sink);
            for (contribution, record) in sink.contributions.iter().zip(sink.records) {
                if !contribution.value.is_black() {
                    all += 1;
                    lost += u32::from(MltPath::new(&scene, record.path).is_none());
                }
            }
        }
        assert!(lost == 0 && all > 10_000, "{name}: {lost} of {all}");
    }
}
