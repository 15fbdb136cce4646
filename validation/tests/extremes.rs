//! Random numbers at the ends of their range: no contribution is NaN or infinite.

use pathspace_core::Scene;
use pathspace_core::film::{Contribution, Sink};
use pathspace_core::integrator::PathEstimator;
use pathspace_core::random::{Address, PrimarySample, RandomStream};
use pathspace_integrators::bdpt::Bdpt;
use pathspace_integrators::lt::LightTracer;
use pathspace_integrators::pt::PathTracer;

use crate::models;

/// Half of the numbers are 0, the smallest, a half or the largest.
struct Extremes(RandomStream);

impl PrimarySample for Extremes {
    fn next(&mut self) -> f32 {
        let u = self.0.next();
        match (self.0.next() * 8.0) as u32 {
            0 => 0.0,
            1 => 1.0 / 16_777_216.0,
            2 => 0.5,
            3 => 1.0 - 1.0 / 16_777_216.0,
            _ => u,
        }
    }
}

#[derive(Default)]
struct NonFinite {
    contributions: usize,
    bad: Vec<Contribution>,
}

impl Sink for NonFinite {
    fn add(&mut self, c: Contribution) {
        self.contributions += 1;
        if !(c.value.is_finite() && c.film.is_finite() && c.weight.is_finite()) {
            self.bad.push(c);
        }
    }
}

fn torture(name: &str, scene: &Scene, estimator: &impl PathEstimator) {
    let mut sink = NonFinite::default();
    let film = scene.film();
    for item in 0..40_000 {
        let pixel = [item as u32 % film.width, item as u32 / film.width % film.height];
        let mut u = Extremes(RandomStream::new(Address { seed: 11, step: 0, item }));
        estimator.estimate(scene, Some(pixel), &mut u, &mut sink);
    }
    assert!(sink.contributions > 1000, "{name}: {} contributions", sink.contributions);
    let first = sink.bad.first();
    assert!(sink.bad.is_empty(), "{name}: {} of {}: {first:?}", sink.bad.len(), sink.contributions);
}

#[test]
fn path_tracing_stays_finite() {
    let pt = PathTracer::from_spec(&"pt".parse().unwrap(), &Default::default()).unwrap();
    models::all().iter().for_each(|(name, scene)| torture(name, scene, &pt));
}

#[test]
fn light_tracing_stays_finite() {
    let lt = LightTracer::from_spec(&"lt".parse().unwrap(), &Default::default()).unwrap();
    models::all().iter().for_each(|(name, scene)| torture(name, scene, &lt));
}

#[test]
fn bidirectional_path_tracing_stays_finite() {
    let bdpt = Bdpt::from_spec(&"bdpt".parse().unwrap(), &Default::default()).unwrap();
    models::all().iter().for_each(|(name, scene)| torture(name, scene, &bdpt));
}

#[test]
fn no_path_is_as_short_as_nothing() {
    let (name, scene) = models::all().remove(0);
    for text in ["pt:max_depth=0", "lt:max_depth=0"] {
        let spec = text.parse().unwrap();
        let mut sink = NonFinite::default();
        for item in 0..2000 {
            let mut u = RandomStream::new(Address { seed: 1, step: 0, item });
            let pixel = Some([item as u32 % 32, item as u32 / 64]);
            if text.starts_with("pt") {
                let pt = PathTracer::from_spec(&spec, &Default::default()).unwrap();
                pt.estimate(&scene, pixel, &mut u, &mut sink);
            } else {
                let lt = LightTracer::from_spec(&spec, &Default::default()).unwrap();
                lt.estimate(&scene, pixel, &mut u, &mut sink);
            }
        }
        assert_eq!(sink.contributions, 0, "{name} {text}");
    }
}
