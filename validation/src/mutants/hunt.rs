//! Runs the test of a mutant, in whatever build this is.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use glam::{DAffine3, DVec3};
use pathspace_core::Rgb;
use pathspace_core::Scene;
use pathspace_core::description::{
    Crop, EmitterDescription, FilmDescription, SceneDescription, ShapeGeometry,
};
use pathspace_core::film::RecordingSink;
use pathspace_core::integrator::{Integrator, PathEstimator};
use pathspace_core::path::{Technique, WalkRules, ln_density, samplable};
use pathspace_core::random::{Address, RandomStream, derive_seed};
use pathspace_integrators::mlt::Mlt;
use pathspace_integrators::primary::{PrimaryOptions, PrimaryTarget};
use pathspace_integrators::pssmlt::Estimated;
use pathspace_integrators::pt::PathTracer;
use pathspace_integrators::rjmlt::Rjmlt;
use pathspace_integrators::{Defaults, Registry};
use pathspace_scenes::library;

use super::MutantError;
use super::catalogue::{Chain, Test};
use crate::chains;
use crate::exact::ExactScene;
use crate::scene_builder::{SceneBuilder, smooth_sphere};
use crate::stats::{StatsError, holm};
use crate::suites;
use crate::validate::{CheckOutcome, Config, Confirmed, Pairing, Report, compare_on};

/// Level of one test.
const ALPHA: f64 = 1e-6;
/// Pixels a side.
const SIZE: u32 = 16;
/// Longest path of chains that are tested by themselves.
const LONGEST: u32 = 5;
/// Steps of a pilot replicate and least of any: with the film as small as it is, most hunts need no
/// more.
const STEPS: u64 = 2;
/// Relative difference of a weight from the oracle's beyond rounding.
const TOLERANCE: f64 = 1e-3;

/// A scene of the hunt alone.
const COARSE_BALL: &str = "coarse ball";
/// Replicates of a test against an exact answer.
const REPLICATES: usize = 32;

/// What the test of a mutant said.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Seeds tried.
    pub seeds: u64,
    /// Seeds on which the test failed: the mutant is found where it is on, and a false alarm where
    /// none is.
    pub failed: u64,
    /// Wall-clock seconds of all.
    pub seconds: f64,
}

/// Runs a test with `seeds` seeds derived from `seed`, until `watch` says to stop.
///
/// # Errors
/// [`MutantError`].
pub fn hunt(
    test: &Test,
    seed: u64,
    seeds: u64,
    watch: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Outcome, MutantError> {
    let mut outcome = Outcome::default();
    let clock = Instant::now();
    for index in 0..seeds {
        if watch().is_break() {
            break;
        }
        outcome.failed += u64::from(fails(test, derive_seed(seed, index))?);
        outcome.seeds += 1;
    }
    outcome.seconds = clock.elapsed().as_secs_f64();
    Ok(outcome)
}

fn bad(error: impl std::fmt::Display) -> MutantError {
    MutantError::Bad(error.to_string())
}

/// Runs the test; true where it fails.
fn fails(test: &Test, seed: u64) -> Result<bool, MutantError> {
    match test {
        Test::Oracle { scene, integrator, samples } => {
            let (scene, rules) = library_scene(scene, false)?;
            oracle_fails(&scene, integrator, rules, *samples, seed)
        }
        Test::Exact { scene, integrator, rays, mirrored } => {
            let mut scenes = crate::exact::all().into_iter();
            let mut scene = scenes
                .find(|s| s.name == scene.as_str())
                .ok_or_else(|| bad(format!("no exact scene '{scene}'")))?;
            if *mirrored {
                turn_lights_away(&mut scene);
            }
            let film = &mut scene.description.film;
            *film = FilmDescription::new(film.width.div_ceil(4), film.height.div_ceil(4));
            let config = Config { replicates: REPLICATES, ..config(seed, *rays) };
            let integrator = create(integrator, scene.rules)?;
            let check = suites::check(&scene, &*integrator, &config, ALPHA, "mutant");
            match check.outcome {
                CheckOutcome::Skipped => Err(bad(format!(
                    "{} on {}: {}",
                    check.subject,
                    check.scene,
                    check.reason.unwrap_or_default()
                ))),
                outcome => Ok(outcome == CheckOutcome::Failed),
            }
        }
        Test::Chain { scene, chain, starts } => {
            let (scene, rules) = library_scene(scene, false)?;
            let rules = WalkRules { max_length: rules.max_length.or(Some(LONGEST)), ..rules };
            chain_fails(&scene, *chain, rules, *starts, seed)
        }
        Test::Numbers => {
            let mut report = Report::new("mutant", &Config { seed, ..Config::default() }, 1);
            suites::numbers(&mut report, ALPHA).map_err(bad)?;
            Ok(!report.passed())
        }
        Test::Pair { scene, integrators, rays, cropped } => {
            let (scene, rules) = library_scene(scene, *cropped)?;
            let config = config(seed, *rays);
            let [a, b] = [create(&integrators[0], rules)?, create(&integrators[1], rules)?];
            let watch = &mut |_: &str| ControlFlow::Continue(());
            let mut report = Report::new("mutant", &config, 1);
            report.scenes.extend(compare_on(
                "mutant",
                &scene,
                (&[&*a, &*b], Pairing::All),
                &config,
                ALPHA,
                watch,
            ));
            Ok(!report.passed())
        }
    }
}

fn config(seed: u64, rays: u64) -> Config {
    Config { seed, rays, samples: STEPS, mdb: 1e-4, ..Config::default() }
}

fn create(spec: &str, rules: WalkRules) -> Result<Box<dyn Integrator>, MutantError> {
    let spec = spec.parse().map_err(bad)?;
    Registry::builtin().create(&spec, &Defaults { rules }).map_err(bad)
}

/// A library scene, of a lower left part of which the film may be.
fn library_scene(name: &str, cropped: bool) -> Result<(Arc<Scene>, WalkRules), MutantError> {
    if name == COARSE_BALL {
        let rules = WalkRules { max_length: Some(3), ..WalkRules::default() };
        return Ok((Arc::new(Scene::new(&coarse_ball()).map_err(bad)?), rules));
    }
    let scene = library::find(name).ok_or_else(|| bad(format!("no library scene '{name}'")))?;
    let loaded = scene.load(&[("res".into(), SIZE.to_string())]).map_err(bad)?;
    let mut description: SceneDescription = loaded.description;
    if cropped {
        description.film.crop = Crop { x: 2, y: SIZE / 2, width: SIZE / 2, height: SIZE / 4 };
    }
    let defaults = loaded.defaults;
    let rules = WalkRules { max_length: defaults.max_depth, rr_depth: defaults.rr_depth };
    Ok((Arc::new(Scene::new(&description).map_err(bad)?), rules))
}

/// Turns flat emitters over by a transform that mirrors: nothing is lit any more. (Where they keep
/// their side a mutant leaves all in the dark, and of what was never sampled no test says that it
/// is wrong; one hit where nothing may be is proof.)
fn turn_lights_away(scene: &mut ExactScene) {
    let mirror = DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0));
    for shape in scene.description.shapes.iter_mut().filter(|s| s.emission.is_some()) {
        if matches!(shape.geometry, ShapeGeometry::Rectangle | ShapeGeometry::Disk) {
            shape.to_world *= mirror;
        }
    }
    scene.expected.iter_mut().for_each(|e| e.mean = 0.0);
}

/// A ball of 32 facets with smooth normals in a beam from above: what its shading normals do is all
/// there is to see.
fn coarse_ball() -> SceneDescription {
    let mut b = SceneBuilder::new(SIZE);
    let grey = b.diffuse(0.75);
    b.mesh(smooth_sphere(1.0, 1), grey);
    b.look_at(DVec3::new(3.0, 1.0, 4.0), DVec3::ZERO, DVec3::Y, 23.0);
    b.emitter(EmitterDescription::Directional {
        direction: DVec3::new(0.3, -1.0, -0.2),
        irradiance: Rgb::WHITE,
    });
    b.finish()
}

/// All tests of a chain together, in rounds.
fn chain_fails(
    scene: &Scene,
    chain: Chain,
    rules: WalkRules,
    starts: u64,
    seed: u64,
) -> Result<bool, MutantError> {
    let defaults = Defaults { rules };
    let spec = |text: &str| text.parse().map_err(bad);
    let config = Config::default();
    let mut test = Confirmed::new(ALPHA, config.rounds().0).map_err(bad)?;
    test.run(&config, |round, factor, _| {
        let (seed, starts) = (derive_seed(seed, round), starts * factor);
        let checks = match chain {
            Chain::Primary => {
                let tracer = PathTracer::from_spec(&spec("pt")?, &defaults).map_err(bad)?;
                let spec = spec("pssmlt:large=0.1")?;
                let options = PrimaryOptions::from_options(&mut spec.options()).map_err(bad)?;
                let target = PrimaryTarget::new(Estimated(Arc::new(tracer)), options);
                chains::primary("pssmlt", target, chains::SENSOR, scene, seed, starts)
            }
            Chain::Jumps => {
                let rjmlt = spec("rjmlt:large=0.1,jump=0.9")?;
                let rjmlt = Rjmlt::from_spec(&rjmlt, &defaults).map_err(bad)?;
                let target = PrimaryTarget::new(rjmlt.techniques, rjmlt.options);
                chains::primary("rjmlt", target, chains::SELECTOR, scene, seed, starts)
            }
            Chain::PathSpace | Chain::Manifold => {
                let manifold = chain == Chain::Manifold;
                let spec = spec(if manifold {
                    "mlt:bidir=0,lens=0,caustic=0,multi=0,area=1"
                } else {
                    "mlt:lens=0,caustic=0,multi=0,manifold=0"
                })?;
                let target = Mlt::from_spec(&spec, &defaults).map_err(bad)?.target(scene);
                chains::path("mlt", &target, scene, seed, starts)
            }
        };
        let adjusted = holm(&checks.iter().map(|c| c.p).collect::<Vec<_>>());
        let least = adjusted.into_iter().fold(1.0, f64::min);
        Ok(Some((least, starts as usize)))
    })
}

impl From<StatsError> for MutantError {
    fn from(error: StatsError) -> Self {
        bad(error)
    }
}

/// Weights of path tracing against those of the oracle: true where more than one in a hundred is
/// off.
fn oracle_fails(
    scene: &Scene,
    spec: &str,
    rules: WalkRules,
    samples: u64,
    seed: u64,
) -> Result<bool, MutantError> {
    let spec = spec.parse().map_err(bad)?;
    let tracer = PathTracer::from_spec(&spec, &Defaults { rules }).map_err(bad)?;
    let mut sink = RecordingSink::default();
    for item in 0..samples {
        let mut u = RandomStream::new(Address { seed, step: 0, item });
        tracer.estimate(scene, None, &mut u, &mut sink);
    }
    let mut off = 0;
    for record in &sink.records {
        let k = record.path.length();
        let techniques: Vec<Technique> = (0..2.min(k))
            .map(|s| Technique::new(s, k + 1 - s))
            .filter(|t| samplable(scene, &record.path, *t, &rules))
            .collect();
        let Some(own) = techniques.iter().position(|t| *t == record.technique) else {
            off += 1;
            continue;
        };
        let ln: Vec<Option<f64>> =
            techniques.iter().map(|t| ln_density(scene, &record.path, *t, &rules)).collect();
        let weight = tracer.heuristic.weight_ln(own, &ln);
        if (record.weight - weight).abs() > TOLERANCE * weight.max(1e-3) {
            off += 1;
        }
    }
    Ok(100 * off > sink.records.len())
}
