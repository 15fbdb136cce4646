//! All scenes together.

use pathspace_validation::stats::geometric_mean;

use crate::results::{Overall, SceneResults};

const RESAMPLES: usize = 9999;
/// Scenes from which on a bootstrap over them says something.
const SCENES: usize = 5;

/// Geometric mean over scenes of the ratio of efficiencies to the baseline, with a bootstrap over
/// scenes.
///
/// Integrators with a ratio in two scenes at least take part, in the order in which they come
/// first. With fewer than five scenes there is no interval (NaN): a bootstrap over so few is too
/// narrow. It says nothing of scenes of another kind.
pub fn overall(scenes: &[SceneResults]) -> Vec<Overall> {
    let mut found: Vec<(String, String, Vec<f64>)> = Vec::new();
    for method in scenes.iter().flat_map(|s| &s.methods) {
        let Some(ratio) = &method.ratio else { continue };
        let same = |(name, baseline, _): &&mut (String, String, Vec<f64>)| {
            *name == method.integrator && *baseline == ratio.baseline
        };
        match found.iter_mut().find(same) {
            Some((_, _, values)) => values.push(ratio.value),
            None => {
                let names = (method.integrator.clone(), ratio.baseline.clone());
                found.push((names.0, names.1, vec![ratio.value]));
            }
        }
    }
    let mean = |(integrator, baseline, values): (String, String, Vec<f64>)| {
        let g = geometric_mean(&values, 0.95, RESAMPLES, 1).ok()?;
        let scenes = values.len();
        let end = |v: f64| if scenes < SCENES { f64::NAN } else { v };
        let (geometric_mean, low, high) = (g.value, end(g.low), end(g.high));
        Some(Overall { integrator, baseline, geometric_mean, low, high, scenes })
    };
    found.into_iter().filter_map(mean).collect()
}
