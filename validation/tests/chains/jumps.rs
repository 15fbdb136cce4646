//! Jumps between techniques: the path stays, the ratio is the one that was derived, densities are
//! the oracle's.

use pathspace_core::Scene;
use pathspace_core::film::RecordingSink;
use pathspace_core::path::{Path, PathRecord, Technique, Vertex, WalkRules, ln_density};
use pathspace_core::random::{Address, PrimarySample, RandomStream, Stream};
use pathspace_integrators::Defaults;
use pathspace_integrators::bdpt::Numbers;
use pathspace_integrators::chain::ChainTarget;
use pathspace_integrators::mmlt::Multiplexed;
use pathspace_integrators::primary::{
    Integrand, Jump, Moving, PrimaryState, PrimaryTarget, PrimaryVector, Reading,
};
use pathspace_integrators::rjmlt::{Reversible, Rjmlt};
use pathspace_scenes::library;

use crate::models;

const STARTS: u64 = 20_000;
/// In the scene of radius 1; the jump itself promises ten times less.
const NEAR: f32 = 1e-3;

fn rjmlt() -> Rjmlt {
    let rules = WalkRules { max_length: Some(6), ..WalkRules::default() };
    Rjmlt::from_spec(&"rjmlt:continue=0.7".parse().unwrap(), &Defaults { rules }).unwrap()
}

pub(super) fn scenes() -> Vec<(String, Scene)> {
    let mut scenes: Vec<_> =
        models::in_media().into_iter().map(|(name, scene)| (name.to_owned(), scene)).collect();
    scenes.extend(models::all().into_iter().map(|(name, scene)| (name.to_owned(), scene)));
    for name in ["glass-egg", "water-pool", "mis-plates"] {
        let loaded = library::find(name).unwrap().load(&[]).unwrap();
        scenes.push((name.to_owned(), models::build(&loaded.description)));
    }
    scenes
}

fn stream(item: u64) -> RandomStream {
    RandomStream::new(Address { seed: 11, step: 0, item })
}

/// Bootstrap states with numbers of their own.
fn states<'a>(
    rjmlt: &'a Rjmlt,
    scene: &'a Scene,
) -> impl Iterator<Item = (PrimaryState, RandomStream)> + 'a {
    let target = PrimaryTarget::new(rjmlt.techniques.clone(), rjmlt.options);
    (0..STARTS).filter_map(move |item| {
        let mut u = stream(item);
        target.bootstrap(scene, &mut u).map(|(state, _)| (state, u))
    })
}

fn record(
    techniques: &Reversible,
    scene: &Scene,
    k: u16,
    u: &mut impl PrimarySample,
) -> Option<(PathRecord, f64)> {
    let mut sink = RecordingSink::default();
    techniques.evaluate(scene, k, u, &mut sink);
    let f = sink.contributions.pop()?.value.mean().into();
    Some((sink.records.pop()?, f))
}

/// Greatest distance between vertices.
fn distance(a: &Path, b: &Path) -> f32 {
    let one = |(a, b): (&Vertex, &Vertex)| match (a, b) {
        (Vertex::InfiniteEmitter { to: a, .. }, Vertex::InfiniteEmitter { to: b, .. }) => {
            a.distance(*b)
        }
        _ => a.position().unwrap().distance(b.position().unwrap()),
    };
    a.vertices.iter().zip(&b.vertices).map(one).fold(0.0, f32::max)
}

#[test]
fn jumps_keep_the_path_and_have_the_ratio_one() {
    let rjmlt = rjmlt();
    for (name, scene) in scenes() {
        let (mut made, mut lost, mut far, mut inexact) = (0, 0, 0, 0);
        let mut kinds = std::collections::BTreeSet::new();
        for (mut x, mut u) in states(&rjmlt, &scene) {
            let k = x.point.part;
            let mut y = PrimaryVector::default();
            match rjmlt.techniques.jump(&scene, &mut x.point, &mut y, &mut u) {
                Jump::Stays => {}
                Jump::Lost => lost += 1,
                Jump::To { factor, .. } => {
                    made += 1;
                    let here = &mut Reading::new(&x.point.vector);
                    let (a, f_a) = record(&rjmlt.techniques, &scene, k, here).unwrap();
                    let (b, f_b) =
                        record(&rjmlt.techniques, &scene, k, &mut Reading::new(&y)).unwrap();
                    assert_ne!(a.technique, b.technique);
                    kinds.insert((a.technique.family(), b.technique.family()));
                    far += u32::from(distance(&a.path, &b.path) > 1e-5);
                    assert!(distance(&a.path, &b.path) < NEAR, "{name}: {a:?} {b:?}");
                    inexact += u32::from((f_b / f_a * factor - 1.0).abs() > 1e-3);
                }
            }
        }
        println!("{name}: {made} made, {lost} lost, {far} far, {inexact} inexact, {kinds:?}");
        assert!(made > 100 && lost * 100 < made, "{name}: {made} made, {lost} lost");
        assert!(far * 50 < made && inexact * 20 < made, "{name}: {made}, {far}, {inexact}");
    }
}

#[test]
fn a_technique_is_inverted_without_any_of_its_numbers() {
    let rjmlt = rjmlt();
    let bdpt = &rjmlt.techniques.0.bdpt;
    for (name, scene) in scenes() {
        let (mut made, mut lost) = (0, 0);
        for (mut x, mut u) in states(&rjmlt, &scene) {
            let film = x.point.contributions[0].film;
            let (k, x) = (x.point.part, &mut x.point.vector);
            let (a, _) = record(&rjmlt.techniques, &scene, k, &mut Reading::new(x)).unwrap();
            let mut numbers = Numbers::default();
            let selector = Multiplexed::select(&scene, k, a.technique.s, u.next()).unwrap();
            numbers.push(Stream::Connection, &[selector]);
            let found =
                bdpt.invert_technique(&scene, &a.path, film, a.technique, &mut numbers, &mut u);
            let mut y = PrimaryVector::default();
            let mut moving = Moving::large(x, &mut y, &mut u);
            for stream in [Stream::Sensor, Stream::Light, Stream::Lens, Stream::Connection] {
                for (index, &value) in numbers.stream(stream).iter().enumerate() {
                    moving.set(stream, index, value);
                }
            }
            let b = record(&rjmlt.techniques, &scene, k, &mut moving);
            match (found, b) {
                (Some(()), Some((b, _))) if distance(&a.path, &b.path) < NEAR => made += 1,
                _ => lost += 1,
            }
        }
        println!("{name}: {made} made, {lost} lost");
        assert!(made > 400 && lost * 100 < made, "{name}: {made} made, {lost} lost");
    }
}

#[test]
fn densities_of_all_techniques_at_once_are_those_of_each_alone() {
    let rjmlt = rjmlt();
    let bdpt = &rjmlt.techniques.0.bdpt;
    for (name, scene) in scenes() {
        let mut tested = 0;
        for (x, _) in states(&rjmlt, &scene).take(2000) {
            let (k, x) = (x.point.part, &x.point.vector);
            let (a, _) = record(&rjmlt.techniques, &scene, k, &mut Reading::new(x)).unwrap();
            let all = bdpt.ln_densities(&scene, &a.path);
            assert_eq!(all.len(), usize::from(k) + 2);
            for (s, ln) in all.into_iter().enumerate() {
                let technique = Technique::new(s, usize::from(k) + 1 - s);
                let one = ln_density(&scene, &a.path, technique, &bdpt.rules());
                match (ln, one) {
                    (Some(a), Some(b)) => {
                        assert!((a - b).abs() < 1e-9, "{name} {technique:?}: {a} {b}");
                        tested += 1;
                    }
                    (a, b) => assert_eq!(a, b, "{name} {technique:?}"),
                }
            }
        }
        assert!(tested > 1000, "{name}: {tested}");
    }
}
