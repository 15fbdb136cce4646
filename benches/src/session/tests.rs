use pathspace_core::description::FilmDescription;
use pathspace_integrators::{Defaults, Registry};

use super::*;

fn scene() -> Arc<Scene> {
    let scene = pathspace_scenes::library::find("cornell-box").unwrap();
    let mut description = scene.load(&[]).unwrap().description;
    description.film = FilmDescription::new(24, 18);
    Arc::new(Scene::new(&description).unwrap())
}

fn integrator(spec: &str) -> Box<dyn Integrator> {
    let defaults = Defaults::default();
    Registry::builtin().create(&spec.parse().unwrap(), &defaults).unwrap()
}

fn plan<'a>(integrator: &'a dyn Integrator, scene: &'a Arc<Scene>) -> Plan<'a> {
    Plan { integrator, scene, layers: Layers::NONE, seed: 4, shard: Shard::WHOLE }
}

fn go_on(_: &Session<'_>, _: &Status) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

#[test]
fn a_render_until_an_error_has_the_film_of_as_many_samples() {
    let (scene, pt) = (scene(), integrator("pt:max_depth=4"));
    let mut session = Session::start(plan(&*pt, &scene)).unwrap();
    let goal = Goal { budget: None, error: Some(0.06) };
    assert!(session.run(goal, &mut go_on).unwrap());
    let error = session.error().unwrap();
    assert!(error.high <= 0.06 && error.low > 0.03, "{error:?}");
    let mut plain = Session::start(plan(&*pt, &scene)).unwrap();
    plain.run(Budget::Samples(session.progress().steps), &mut go_on).unwrap();
    assert!(session.film().sums() == plain.film().sums());
    assert_eq!(plain.error(), None);
}

#[test]
fn a_limit_ends_a_render_short_of_its_error() {
    let (scene, pt) = (scene(), integrator("pt:max_depth=4"));
    let mut session = Session::start(plan(&*pt, &scene)).unwrap();
    let goal = Goal { budget: Some(Budget::Samples(40)), error: Some(1e-6) };
    assert!(!session.run(goal, &mut go_on).unwrap());
    assert_eq!(session.progress().steps, 40);
    assert!(session.error().unwrap().low > 1e-6);
}

/// Independent renders of many samples say what the error is; its own estimate must hold it.
#[test]
fn the_error_is_the_one_that_independent_renders_have() {
    let (scene, pt) = (scene(), integrator("pt:max_depth=4"));
    let image = |seed: u64, n: u64| {
        let plan = Plan { seed, ..plan(&*pt, &scene) };
        let mut session = Session::start(plan).unwrap();
        session
            .run(Goal { budget: Some(Budget::Samples(n)), error: Some(1e-9) }, &mut go_on)
            .unwrap();
        let y: Vec<f64> =
            session.film().image().iter().map(pathspace_core::color::luminance).collect();
        (y, session.error())
    };
    let (reference, _) = image(99, 4096);
    let mean = reference.iter().sum::<f64>() / reference.len() as f64;
    let (mut squares, mut estimates) = (Vec::new(), Vec::new());
    for seed in 0..16 {
        let (y, error) = image(seed, 32);
        let sum: f64 = y.iter().zip(&reference).map(|(a, b)| (a - b).powi(2)).sum();
        // The reference has 1/128 of the variance.
        squares.push(sum / reference.len() as f64 / (1.0 + 1.0 / 128.0) / (mean * mean));
        estimates.push(error.unwrap());
    }
    let average = |v: &[f64]| v.iter().sum::<f64>() / 16.0;
    let truth = average(&squares).sqrt();
    let inside = estimates.iter().filter(|e| (e.low..=e.high).contains(&truth)).count();
    assert!(inside >= 14, "{inside} of 16 hold {truth}: {estimates:?}");
    // Squared errors of the renders say themselves how well they are known.
    let spread = average(&squares.iter().map(|s| (s - truth * truth).powi(2)).collect::<Vec<_>>());
    let estimate = average(&estimates.iter().map(|e| e.value * e.value).collect::<Vec<_>>());
    let deviation = (estimate - truth * truth).abs() / (spread / 15.0).sqrt();
    assert!(deviation < 4.0, "{estimate} and {}, {deviation} deviations", truth * truth);
}

#[test]
fn a_chain_is_rendered_as_replicates_and_goes_on_to_the_bit() {
    let scene = scene();
    let chain = integrator("pssmlt:bootstrap=500,chains=4,max_depth=4");
    let mut whole = Session::start(plan(&*chain, &scene)).unwrap();
    whole.watch_error();
    // Time decides how long replicates are; here it shall not.
    whole.replicate.length = 3;
    let mut parts = Session::start(plan(&*chain, &scene)).unwrap();
    parts.watch_error();
    parts.replicate.length = 3;
    let until = |n| Goal { budget: Some(Budget::Samples(n)), error: Some(1e-9) };
    whole.run(until(70), &mut go_on).unwrap();
    for stop in [1, 3, 10, 70] {
        parts.run(until(stop), &mut go_on).unwrap();
        let (progress, film) = (parts.progress(), parts.film().clone());
        parts = Session::resume(plan(&*chain, &scene), &progress, film).unwrap();
    }
    assert!(whole.film().sums() == parts.film().sums());
    let (a, b) = (whole.progress(), parts.progress());
    assert_eq!((a.replicate.index, a.replicate.steps), (23, 1));
    assert_eq!((&a.state, &a.precision), (&b.state, &b.precision));
    assert_eq!((b.replicate.index, b.replicate.steps), (23, 1));
    assert_eq!(whole.error(), parts.error());
    assert!(whole.error().is_some());
}

#[test]
fn the_start_of_a_chain_is_a_quarter_of_a_replicate_at_most() {
    for (first, second) in [(0.5, 0.01), (0.02, 0.01), (1.0, 0.3), (0.01, 0.01)] {
        let steps = replicate_length(first, second) as f64;
        let start = first - second;
        assert!(start <= 0.2501 * (start + steps * second), "{first} {second}: {steps}");
    }
    assert_eq!(replicate_length(0.0, 0.0), 8);
    assert_eq!(replicate_length(1e9, 1e-9), 4096);
}

#[test]
fn time_outside_of_rendering_does_not_count() {
    let (scene, pt) = (scene(), integrator("pt:max_depth=2"));
    let mut session = Session::start(plan(&*pt, &scene)).unwrap();
    let nap = || std::thread::sleep(std::time::Duration::from_millis(300));
    let mut watch = |session: &Session<'_>, _: &Status| {
        let before = session.spent();
        nap();
        assert_eq!(session.spent(), before);
        ControlFlow::Continue(())
    };
    session.run(Budget::Samples(3), &mut watch).unwrap();
    let before = session.spent();
    nap();
    assert_eq!(session.spent(), before);
    session.run(Budget::Samples(4), &mut watch).unwrap();
    assert!(session.spent().seconds < 0.3, "{:?}", session.spent());
}
