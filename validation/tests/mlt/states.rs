//! What a state caches is what the plain functions of a path say.

use pathspace_core::path::{self, Technique, WalkRules};

use super::{chain, starts};
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
            deltas += (1..k).filter(|&i| x.is_delta(i)).count();
        }
        assert!(deltas > 100, "{name}");
    }
}
