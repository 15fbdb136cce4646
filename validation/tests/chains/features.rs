//! What tests of chains look at.

use std::sync::Arc;

use glam::Vec2;
use pathspace_core::Scene;
use pathspace_core::film::Sink;
use pathspace_core::random::{Address, PrimarySample, RandomStream};
use pathspace_integrators::chain::{ChainTarget, Proposal, Reader, Writer};
use pathspace_integrators::mmlt::Mmlt;
use pathspace_integrators::primary::{Integrand, PrimaryTarget};
use pathspace_integrators::pssmlt::Estimated;
use pathspace_integrators::pt::PathTracer;
use pathspace_integrators::rjmlt::Rjmlt;
use pathspace_integrators::{Defaults, Spec};
use pathspace_validation::chains::{SELECTOR, SENSOR, invariance};

use super::grey;
use super::jumps::scenes;
use crate::models;

/// A film position that every move takes `step` further to the right, towards no target at all.
struct Drift {
    step: f32,
}

impl ChainTarget for Drift {
    type State = f32;

    fn kinds(&self) -> Vec<String> {
        vec!["drift".to_owned()]
    }

    fn bootstrap(&self, _: &Scene, u: &mut RandomStream) -> Option<(f32, f64)> {
        Some((u.next(), 1.0))
    }

    fn propose(&self, _: &Scene, x: &mut f32, _: &mut RandomStream) -> Proposal<f32> {
        Proposal::new(*x + self.step, 1.0, 0)
    }

    fn splat<S: Sink>(&self, scene: &Scene, x: &f32, weight: f64, sink: &mut S) {
        let width = scene.film().crop.width as f32;
        sink.add(grey(Vec2::new(x * width, 0.0), weight));
    }

    fn encode(&self, x: &f32, out: &mut Writer) {
        out.u32(x.to_bits());
    }

    fn decode(&self, _: &Scene, bytes: &mut Reader<'_>) -> Option<f32> {
        bytes.u32().map(f32::from_bits)
    }
}

#[test]
fn invariance_sees_a_drift_but_not_the_direction_of_rounding() {
    let scene = models::build(&models::lamp_in_a_shell());
    let checks = |step| invariance("toy", &Drift { step }, &scene, &|_| [0.0; 2], 1, 1000);
    let seen = checks(1e-3);
    assert!(seen.len() == 1 && seen[0].p < 1e-9, "{seen:#?}");
    assert_eq!(checks(1e-6), []);
}

/// Every state of a bootstrap of `integrand` has its coordinate.
fn begins_with<I: Integrand>(
    target: &PrimaryTarget<I>,
    scene: &Scene,
    (stream, index): (pathspace_core::random::Stream, usize),
) -> usize {
    let states = (0..2000).filter_map(|item| {
        let mut u = RandomStream::new(Address { seed: 4, step: 0, item });
        target.bootstrap(scene, &mut u)
    });
    states.map(|(x, _)| assert!(x.point.vector.get(stream, index).is_some())).count()
}

#[test]
fn every_point_reads_the_coordinate_that_tests_of_its_chain_look_at() {
    let defaults = Defaults::default();
    let spec = |text: &str| -> Spec { text.parse().unwrap() };
    let mmlt = Mmlt::from_spec(&spec("mmlt"), &defaults).unwrap();
    let rjmlt = Rjmlt::from_spec(&spec("rjmlt"), &defaults).unwrap();
    let pt = Arc::new(PathTracer::from_spec(&spec("pt"), &defaults).unwrap());
    let pssmlt = PrimaryTarget::new(Estimated(pt), mmlt.options);
    let mmlt = PrimaryTarget::new(mmlt.techniques, mmlt.options);
    let rjmlt = PrimaryTarget::new(rjmlt.techniques, rjmlt.options);
    for (name, scene) in scenes() {
        let made = [
            begins_with(&pssmlt, &scene, SENSOR),
            begins_with(&mmlt, &scene, SELECTOR),
            begins_with(&rjmlt, &scene, SELECTOR),
        ];
        assert!(made.iter().all(|made| *made > 10), "{name}: {made:?}");
    }
}
