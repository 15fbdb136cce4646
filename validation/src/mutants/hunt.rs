//! Goes hunting: runs the test of a mutant, with the mutant and without.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use glam::{DAffine3, DVec3};
use pathspace_core::Scene;
use pathspace_core::description::{Crop, SceneDescription, ShapeGeometry};
use pathspace_core::film::RecordingSink;
use pathspace_core::integrator::{Integrator, PathEstimator};
use pathspace_core::mutant::{self, Mutant};
use pathspace_core::path::{Technique, WalkRules, ln_density, samplable};
use pathspace_core::random::{Address, RandomStream, derive_seed};
use pathspace_integrators::pt::PathTracer;
use pathspace_integrators::{Defaults, Registry};
use pathspace_scenes::library;

use super::catalogue::{Hunt, Level};
use crate::exact::ExactScene;
use crate::suites;
use crate::validate::{CheckOutcome, Config, compare_on};

/// Level of one test.
const ALPHA: f64 = 1e-6;
/// Pixels a side.
const SIZE: u32 = 32;
/// Relative difference of a weight from the oracle's beyond rounding.
const TOLERANCE: f64 = 1e-3;

/// What a hunt brought.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Seeds tried.
    pub seeds: u64,
    /// Seeds on which the mutant was found.
    pub caught: u64,
    /// Seeds on which the test failed without any mutant.
    pub false_alarms: u64,
    /// Wall-clock seconds of all with the mutant.
    pub seconds: f64,
}

/// Why there is no hunt.
#[derive(Debug, thiserror::Error, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum MutantError {
    /// The build leaves mutants out.
    #[error("this build has no mutants; build with --features mutants")]
    NotBuilt,
    /// A test can not be run as it stands in the catalogue.
    #[error("{0}")]
    Bad(String),
}

/// Tries a hunt with `seeds` seeds derived from `seed`. Mutants are switched on for the whole process: one hunt at a time.
///
/// # Errors
/// [`MutantError`].
pub fn hunt(hunt: &Hunt, seed: u64, seeds: u64) -> Result<Outcome, MutantError> {
    let mut outcome = Outcome { seeds, ..Outcome::default() };
    for index in 0..seeds {
        let own = derive_seed(seed, index);
        if fails(&hunt.level, own)? {
            outcome.false_alarms += 1;
        }
        let _off = On::new(hunt.mutant)?;
        let clock = Instant::now();
        if fails(&hunt.level, own)? {
            outcome.caught += 1;
        }
        outcome.seconds += clock.elapsed().as_secs_f64();
    }
    Ok(outcome)
}

/// A mutant that is on until this is dropped.
struct On;

impl On {
    fn new(mutant: Mutant) -> Result<Self, MutantError> {
        if mutant::switch(Some(mutant)) { Ok(On) } else { Err(MutantError::NotBuilt) }
    }
}

impl Drop for On {
    fn drop(&mut self) {
        mutant::switch(None);
    }
}

fn bad(error: impl std::fmt::Display) -> MutantError {
    MutantError::Bad(error.to_string())
}

/// Runs the test; true where it fails. Scenes are built anew: some mutants are in there.
fn fails(level: &Level, seed: u64) -> Result<bool, MutantError> {
    match *level {
        Level::Oracle { scene, integrator, samples } => {
            let (scene, rules) = library_scene(scene, false)?;
            oracle_fails(&scene, integrator, rules, samples, seed)
        }
        Level::Exact { scene, integrator, replicates, rays, mirrored } => {
            let mut scenes = crate::exact::all().into_iter();
            let mut scene = scenes
                .find(|s| s.name == scene)
                .ok_or_else(|| bad(format!("no exact scene '{scene}'")))?;
            if mirrored {
                mirror(&mut scene);
            }
            let config = Config { seed, replicates, rays, mdb: 1e-4, ..Config::default() };
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
        Level::Pair { scene, integrators, rays, cropped } => {
            let (scene, rules) = library_scene(scene, cropped)?;
            let config = Config { seed, rays, mdb: 1e-4, ..Config::default() };
            let [a, b] = [create(integrators[0], rules)?, create(integrators[1], rules)?];
            let watch = &mut |_: &str| ControlFlow::Continue(());
            let mut report = crate::validate::Report::new("mutant", &config, 1);
            report.scenes.extend(compare_on("mutant", &scene, &[&*a, &*b], &config, ALPHA, watch));
            Ok(!report.passed())
        }
    }
}

fn create(spec: &str, rules: WalkRules) -> Result<Box<dyn Integrator>, MutantError> {
    let spec = spec.parse().map_err(bad)?;
    Registry::builtin().create(&spec, &Defaults { rules }).map_err(bad)
}

/// A library scene, of a lower left part of which the film may be.
fn library_scene(name: &str, cropped: bool) -> Result<(Arc<Scene>, WalkRules), MutantError> {
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

/// Puts flat shapes where they were by a transform that mirrors: they stay the same set of points and the same side.
fn mirror(scene: &mut ExactScene) {
    let flip = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    for shape in &mut scene.description.shapes {
        if matches!(shape.geometry, ShapeGeometry::Rectangle | ShapeGeometry::Disk) {
            shape.to_world *= flip;
        }
    }
}

/// Weights of path tracing against those of the oracle: true where more than one in a hundred is off.
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
