//! The method against its own slow form, against exact answers and against the integrators that
//! come with pathspace.

mod slow;
mod truth;
mod weights;

use std::sync::Arc;

use pathspace::core::Scene;
use pathspace::core::path::WalkRules;
use pathspace::integrators::Defaults;
use pathspace::scenes::library;

use crate::Vcm;

/// A scene of the library at `res` pixels a side.
fn scene(name: &str, res: u32) -> Arc<Scene> {
    let entry = library::find(name).unwrap();
    let loaded = entry.load(&[("res".into(), res.to_string())]).unwrap();
    Arc::new(Scene::new(&loaded.description).unwrap())
}

fn vcm(spec: &str, max_length: Option<u32>) -> Vcm {
    let defaults = Defaults { rules: WalkRules { max_length, rr_depth: 1 } };
    Vcm::from_spec(&spec.parse().unwrap(), &defaults).unwrap()
}

#[test]
fn the_radius_shrinks_as_the_published_sequence() {
    let vcm = vcm("vcm:radius=0.01,alpha=0.75", None);
    let product: f64 = (1..100).map(|i| (i as f64 + 0.75) / (i as f64 + 1.0)).product();
    assert_eq!(vcm.radius(0), 0.01);
    // Knaus and Zwicker's product ∏ (i + α)/(i + 1) and i^(α−1) are asymptotically proportional.
    let ratio = (vcm.radius(99) / 0.01).powi(2) / product;
    let later: f64 =
        product * (100..1000).map(|i| (i as f64 + 0.75) / (i as f64 + 1.0)).product::<f64>();
    let ratio_later = (vcm.radius(999) / 0.01).powi(2) / later;
    assert!((ratio / ratio_later - 1.0).abs() < 1e-3, "{ratio} {ratio_later}");
}

#[test]
fn options_out_of_range_are_refused() {
    for spec in ["vcm:radius=0", "vcm:alpha=2", "vcm:heuristic=maximum", "vcm:merge=1", "vcm:r=1"] {
        assert!(Vcm::from_spec(&spec.parse().unwrap(), &Defaults::default()).is_err(), "{spec}");
    }
}
