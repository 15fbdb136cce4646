use std::fs;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use pathspace_core::Scene;
use pathspace_core::description::{Crop, FilmDescription, FilterKind};
use pathspace_core::film::Layers;
use pathspace_core::integrator::Integrator;
use pathspace_core::path::WalkRules;
use pathspace_integrators::{Defaults, Registry};

use super::*;
use crate::budget::Budget;
use crate::session::{Plan, Session};
use crate::shard::Shard;

const LAYERS: Layers =
    Layers { length: true, technique: true, unweighted: true, emitter: true, class: true };

/// A file that goes away with it.
struct Place(PathBuf);

impl Place {
    fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!("pathspace-{}-{number}.film", std::process::id());
        Place(std::env::temp_dir().join(name))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

/// A small window of a scene with glass, under a filter that spreads splats over pixels.
fn scene() -> Arc<Scene> {
    window_of("cornell-caustic")
}

fn window_of(name: &str) -> Arc<Scene> {
    let scene = pathspace_scenes::library::find(name).unwrap();
    let mut description = scene.load(&[]).unwrap().description;
    description.film = FilmDescription {
        crop: Crop { x: 3, y: 2, width: 17, height: 13 },
        filter: FilterKind::Tent { radius: 1.3 },
        ..FilmDescription::new(24, 18)
    };
    Arc::new(Scene::new(&description).unwrap())
}

/// Every integrator there is, and the options that bring a run of their own, each with a scene: the
/// one with glass, or a diffuse one where it refuses that.
fn integrators() -> Vec<(Box<dyn Integrator>, Arc<Scene>)> {
    let registry = Registry::builtin();
    let defaults = Defaults { rules: WalkRules { max_length: Some(5), rr_depth: 4 } };
    let create = |spec: &str| registry.create(&spec.parse().unwrap(), &defaults);
    let named = registry.all().map(|(name, _)| {
        // Chains need no good start here, and finite elements no good answer.
        create(&format!("{name}:bootstrap=400,chains=5"))
            .or_else(|_| create(&format!("{name}:elements=100")))
            .or_else(|_| create(name))
            .unwrap()
    });
    let (glass, diffuse) = (scene(), window_of("cornell-box"));
    named
        .chain([create("bdpt:connect=cache").unwrap()])
        .map(|integrator| {
            let scene = if integrator.start(glass.clone(), 1).is_ok() { &glass } else { &diffuse };
            (integrator, scene.clone())
        })
        .collect()
}

fn identity(plan: &Plan<'_>) -> Identity {
    Identity {
        version: "1.2.3".into(),
        program: "fedcba9876543210".into(),
        scene: "a scene".into(),
        scene_hash: "0123456789abcdef".into(),
        integrator: plan.integrator.spec(),
        rules: WalkRules::default(),
        seed: plan.seed,
        film: *plan.scene.film(),
        layers: plan.layers,
        shards: Shards::from(plan.shard),
    }
}

fn steps(session: &mut Session<'_>, n: u64) {
    let done = session.run(Budget::Samples(n), &mut |_, _| ControlFlow::Continue(())).unwrap();
    assert!(done);
}

fn assert_same(a: &Film, b: &Film, what: &str) {
    assert_eq!((a.samples(), a.nonfinite()), (b.samples(), b.nonfinite()), "{what}");
    assert!(a.sums() == b.sums() && a.planes() == b.planes(), "{what}");
}

#[test]
fn every_integrator_goes_on_from_a_file_to_the_bit() {
    let place = Place::new();
    for (integrator, scene) in integrators() {
        for shard in [Shard::WHOLE, Shard::new(1, 3).unwrap()] {
            let plan =
                Plan { integrator: &*integrator, scene: &scene, layers: LAYERS, seed: 9, shard };
            let total = 5 * u64::from(shard.count());
            let mut whole = Session::start(plan).unwrap();
            steps(&mut whole, total);

            // Stopped twice, at other steps, each time through a file.
            let mut parts = Session::start(plan).unwrap();
            for stop in [1, 4] {
                steps(&mut parts, stop * u64::from(shard.count()));
                write(&place.0, &identity(&plan), &parts.progress(), parts.film()).unwrap();
                let back = Checkpoint::read_of(&place.0, &identity(&plan)).unwrap();
                assert_eq!((back.progress.steps, back.progress.work.rays > 0), (stop, true));
                parts = Session::resume(plan, &back.progress, back.film).unwrap();
            }
            steps(&mut parts, total);
            let what = format!("{} {shard}", integrator.spec());
            assert_same(whole.film(), parts.film(), &what);
            let (a, b) = (whole.progress(), parts.progress());
            assert_eq!((a.steps, a.state), (b.steps, b.state), "{what}");
            // An integrator may have to look at the scene again; its rays are then counted again.
            assert_eq!(a.work.samples, b.work.samples, "{what}");
            assert!(a.work.rays <= b.work.rays, "{what}");
        }
    }
}

/// Renders the shards of `count` and merges their files in the order that `order` gives.
fn merged(plan: Plan<'_>, count: u32, samples: u64, order: &[u32]) -> Merged {
    let places: Vec<Place> = (0..count)
        .map(|i| {
            let place = Place::new();
            let plan = Plan { shard: Shard::new(i, count).unwrap(), ..plan };
            let mut session = Session::start(plan).unwrap();
            steps(&mut session, samples);
            write(&place.0, &identity(&plan), &session.progress(), session.film()).unwrap();
            place
        })
        .collect();
    let paths: Vec<PathBuf> = order.iter().map(|i| places[*i as usize].0.clone()).collect();
    merge(&paths).unwrap()
}

#[test]
fn shards_add_up_to_the_whole_of_every_integrator() {
    for (integrator, scene) in integrators() {
        let plan = Plan {
            integrator: &*integrator,
            scene: &scene,
            layers: LAYERS,
            seed: 3,
            shard: Shard::WHOLE,
        };
        let what = integrator.spec();
        let (a, b) = (merged(plan, 3, 8, &[0, 1, 2]), merged(plan, 3, 8, &[2, 0, 1]));
        assert_same(&a.checkpoint.film, &b.checkpoint.film, &what);
        assert_eq!(a.checkpoint.progress.steps, 8, "{what}");
        let mut whole = Session::start(plan).unwrap();
        steps(&mut whole, 8);
        let (whole, film) = (whole.film(), &a.checkpoint.film);
        assert_eq!(whole.samples(), film.samples(), "{what}");
        if a.checkpoint.progress.by_steps {
            // The same contributions, summed in another order.
            let keys = |f: &Film| f.planes().keys().copied().collect::<Vec<_>>();
            assert_eq!(keys(whole), keys(film), "{what}");
            let planes = film.planes().iter().map(|(k, p)| (p, &whole.planes()[k]));
            for (a, b) in planes.chain([(film.sums(), whole.sums())]) {
                for (a, b) in a.sums().iter().flatten().zip(b.sums().iter().flatten()) {
                    assert!((a - b).abs() <= 1e-14 * b.abs(), "{what}: {a} and {b}");
                }
            }
        }
    }
}

/// Where every contribution is a multiple of 2⁻²⁰ below 2²⁰, no sum is rounded.
#[test]
fn sums_without_rounding_are_merged_to_the_bit() {
    let scene = {
        let scene = pathspace_scenes::library::find("furnace").unwrap();
        let mut description = scene.load(&[]).unwrap().description;
        description.film = FilmDescription::new(9, 7);
        Arc::new(Scene::new(&description).unwrap())
    };
    // Emission only: every sample is the radiance itself.
    let integrator =
        Registry::builtin().create(&"pt:max_depth=1".parse().unwrap(), &Defaults::default());
    let integrator = integrator.unwrap();
    let plan = Plan {
        integrator: &*integrator,
        scene: &scene,
        layers: LAYERS,
        seed: 3,
        shard: Shard::WHOLE,
    };
    let mut whole = Session::start(plan).unwrap();
    steps(&mut whole, 10);
    assert!(whole.film().mean()[0] > 0.0);
    assert_same(whole.film(), &merged(plan, 4, 10, &[3, 1, 0, 2]).checkpoint.film, "furnace");
}

#[test]
fn what_does_not_belong_together_is_not_merged() {
    let scene = scene();
    let integrator = Registry::builtin().create(&"pt".parse().unwrap(), &Defaults::default());
    let integrator = integrator.unwrap();
    let save = |seed: u64, index: u32, count: u32| {
        let place = Place::new();
        let shard = Shard::new(index, count).unwrap();
        let plan =
            Plan { integrator: &*integrator, scene: &scene, layers: Layers::NONE, seed, shard };
        let mut session = Session::start(plan).unwrap();
        steps(&mut session, u64::from(count));
        write(&place.0, &identity(&plan), &session.progress(), session.film()).unwrap();
        place
    };
    let (a, again) = (save(1, 0, 3), save(1, 0, 3));
    let (seed, of_four) = (save(2, 1, 3), save(1, 1, 4));
    let error = |others: &[&Place]| {
        let paths: Vec<PathBuf> = others.iter().map(|p| p.0.clone()).collect();
        merge(&paths).unwrap_err().to_string()
    };
    assert!(error(&[&a, &again]).ends_with("overlap: both hold shard 1/3"));
    assert!(error(&[&a, &seed]).ends_with("its seed is 2, not 1"), "{}", error(&[&a, &seed]));
    assert!(error(&[&a, &of_four]).ends_with("it is a shard of 4, the other one of 3"));
    assert_eq!(error(&[]), "no files to merge");
    // Missing ones are named, and what is merged so far can be merged on.
    let (b, c) = (save(1, 1, 3), save(1, 2, 3));
    let two = merge(&[a.0.clone(), c.0.clone()]).unwrap();
    assert_eq!(two.missing, [1]);
    let place = Place::new();
    let Checkpoint { identity, progress, film } = &two.checkpoint;
    write(&place.0, identity, progress, film).unwrap();
    assert_eq!(merge(&[b.0.clone(), place.0.clone()]).unwrap().missing, [0; 0]);
    assert!(error(&[&place, &c]).ends_with("overlap: both hold shard 3/3"));
}

#[test]
fn what_differs_is_named() {
    let (scene, place) = (scene(), Place::new());
    let integrator = Registry::builtin().create(&"pt".parse().unwrap(), &Defaults::default());
    let integrator = integrator.unwrap();
    let plan = Plan {
        integrator: &*integrator,
        scene: &scene,
        layers: Layers::NONE,
        seed: 1,
        shard: Shard::WHOLE,
    };
    let session = Session::start(plan).unwrap();
    let own = identity(&plan);
    write(&place.0, &own, &session.progress(), session.film()).unwrap();
    assert!(Checkpoint::read_of(&place.0, &own).is_ok());
    // Another name of the same content is no difference.
    assert!(Checkpoint::read_of(&place.0, &Identity { scene: "b".into(), ..own.clone() }).is_ok());
    let film = own.film;
    let rules = WalkRules { max_length: Some(3), ..own.rules };
    let crop = Crop { x: 4, ..film.crop };
    let table = [
        (Identity { version: "2".into(), ..own.clone() }, "its version is 1.2.3, not 2"),
        (
            Identity { program: "00".into(), ..own.clone() },
            "its program is build fedcba987654, not build unknown",
        ),
        (
            Identity { scene_hash: "ff".into(), ..own.clone() },
            "its content of the scene is a scene (0123456789ab), not a scene (ff)",
        ),
        (Identity { integrator: "lt".into(), ..own.clone() }, "its integrator is pt, not lt"),
        (
            Identity { rules, ..own.clone() },
            "its path length is unlimited with roulette from 5, not up to 3 with roulette from 5",
        ),
        (Identity { seed: 2, ..own.clone() }, "its seed is 1, not 2"),
        (
            Identity { film: FilmDescription { width: 25, ..film }, ..own.clone() },
            "its size is 24x18, not 25x18",
        ),
        (
            Identity { film: FilmDescription { crop, ..film }, ..own.clone() },
            "its window is 3,2,17,13, not 4,2,17,13",
        ),
        (
            Identity { film: FilmDescription { filter: FilterKind::Box, ..film }, ..own.clone() },
            "its filter is a tent of radius 1.3, not a box",
        ),
        (
            Identity { layers: LAYERS, ..own.clone() },
            "its set of layers is none, not length,st,unweighted,emitter,class",
        ),
        (
            Identity { shards: Shards { count: 2, present: vec![1] }, ..own.clone() },
            "its shard is 1/1, not 2/2",
        ),
        (
            Identity { seed: 2, integrator: "lt".into(), ..own.clone() },
            "its integrator is pt, not lt; its seed is 1, not 2",
        ),
    ];
    for (here, expected) in table {
        let error = Checkpoint::read_of(&place.0, &here).unwrap_err().to_string();
        assert!(error.ends_with(&format!(": is of another render: {expected}")), "{error}");
    }
}

#[test]
fn a_torn_or_changed_file_is_refused_wherever_it_is_touched() {
    let (scene, place) = (scene(), Place::new());
    let integrator = Registry::builtin().create(&"lt".parse().unwrap(), &Defaults::default());
    let integrator = integrator.unwrap();
    let plan = Plan {
        integrator: &*integrator,
        scene: &scene,
        layers: Layers::NONE,
        seed: 1,
        shard: Shard::WHOLE,
    };
    let mut session = Session::start(plan).unwrap();
    steps(&mut session, 1);
    write(&place.0, &identity(&plan), &session.progress(), session.film()).unwrap();
    let bytes = fs::read(&place.0).unwrap();
    let error = |bytes: &[u8]| {
        fs::write(&place.0, bytes).unwrap();
        Checkpoint::read(&place.0).unwrap_err()
    };
    for cut in (0..bytes.len()).step_by(97).chain([bytes.len() - 1]) {
        let expected = if cut < MAGIC.len() { "is not a checkpoint" } else { "is damaged" };
        let message = error(&bytes[..cut]).to_string();
        assert!(message.contains(expected), "{cut}: {message}");
    }
    for at in (MAGIC.len()..bytes.len()).step_by(61) {
        let mut changed = bytes.clone();
        changed[at] ^= 1;
        assert!(matches!(error(&changed), CheckpointError::Damaged { .. }), "{at}");
    }
    let mut later = bytes.clone();
    later[MAGIC.len() - 2] = b'3';
    assert!(matches!(error(&later), CheckpointError::Format { .. }));
    let longer = [&bytes[..], b"x"].concat();
    assert!(matches!(error(&longer), CheckpointError::Damaged { .. }));
    let _ = fs::remove_file(&place.0);
    assert!(matches!(Checkpoint::read(&place.0), Err(CheckpointError::Read { .. })));
}
