//! Hard cases for any integrator: other units, places far from the origin, boxes that no light
//! enters.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use glam::{DAffine3, DVec3};
use pathspace_core::description::{EmitterDescription, SceneDescription, ShapeGeometry};
use pathspace_core::film::Families;
use pathspace_core::integrator::{Integrator, IntegratorError};
use pathspace_core::path::WalkRules;
use pathspace_core::random::derive_seed;
use pathspace_core::{Rgb, Scene, SceneError};
use pathspace_scenes::{SceneFileError, library};

use super::exact;
use super::run::{Options, Progress, SuiteError, Team};
use crate::exact::{ExactLength, ExactScene};
use crate::pairs::{Judgement, Method, Tiles, judge};
use crate::scene_builder::{SceneBuilder, smooth_sphere};
use crate::stats::{CompareConfig, Rule, StatsError, Verdict};
use crate::validate::{
    Check, CheckCell, CheckOutcome, Config, Confirmed, Report, pilot, replicates, seed_of,
};

/// A library scene in other units or somewhere else.
struct Moved {
    name: &'static str,
    scene: &'static str,
    scale: f64,
    /// Offset in radii of the scene.
    radii: f64,
}

const MOVED: &[Moved] = &[
    Moved { name: "millionth of the size", scene: "cornell-caustic", scale: 1e-6, radii: 0.0 },
    Moved { name: "million times the size", scene: "thin-lens", scale: 1e6, radii: 0.0 },
    Moved { name: "a million radii away", scene: "cornell-caustic", scale: 1.0, radii: 1e6 },
];

/// The same scene scaled about the origin, then shifted. Lights that have no surface get the power
/// that keeps irradiances.
pub fn moved(description: &SceneDescription, scale: f64, offset: DVec3) -> SceneDescription {
    let t = DAffine3::from_translation(offset) * DAffine3::from_scale(DVec3::splat(scale));
    let mut d = description.clone();
    for s in &mut d.shapes {
        s.to_world = t * s.to_world;
    }
    for e in &mut d.emitters {
        if let EmitterDescription::Point { position, intensity } = e {
            *position = t.transform_point3(*position);
            *intensity *= (scale * scale) as f32;
        }
    }
    d.sensor.to_world.translation = t.transform_point3(d.sensor.to_world.translation);
    d.sensor.aperture_radius *= scale;
    d.sensor.focus_distance *= scale;
    d
}

/// A closed box of each kind of surface with the camera inside and lights of every kind outside:
/// exactly black.
pub fn dark_boxes() -> Vec<ExactScene> {
    ["dark cube", "dark sphere", "dark mesh"].map(dark_box).into()
}

fn dark_box(name: &'static str) -> ExactScene {
    let v = DVec3::new;
    let mut b = SceneBuilder::new(64);
    let (white, black) = (b.diffuse(0.9), b.diffuse(0.0));
    match name {
        "dark cube" => {
            b.shape(ShapeGeometry::Cube, DAffine3::IDENTITY, white).flip_normals = true;
        }
        "dark sphere" => {
            b.sphere(DVec3::ZERO, 1.5, white).flip_normals = true;
        }
        _ => {
            // Without shading normals: those let light in at grazing angles.
            let mut facets = smooth_sphere(1.5, 4);
            facets.normals.clear();
            b.mesh(facets, white).flip_normals = true;
        }
    }
    b.rectangle(v(-0.4, -0.5, -0.6), v(0.9, 0.1, 0.3), v(0.0, 0.7, 0.5), white);
    let lamp = Some(Rgb::grey(10.0));
    b.sphere(v(2.5, 0.5, 0.3), 0.5, black).emission = lamp;
    b.rectangle(v(-2.0, -2.0, 2.0), v(0.0, 4.0, 0.0), v(4.0, 0.0, 0.0), black).emission = lamp;
    b.emitter(EmitterDescription::Constant { radiance: Rgb::WHITE });
    let intensity = Rgb::grey(9.0);
    b.emitter(EmitterDescription::Point { position: v(-2.0, 1.0, 1.0), intensity });
    let (direction, irradiance) = (v(0.3, 0.4, -1.0), Rgb::grey(5.0));
    b.emitter(EmitterDescription::Directional { direction, irradiance });
    b.look_at(v(0.1, -0.7, 0.2), DVec3::ZERO, DVec3::Z, 100.0);
    let rules = WalkRules { max_length: Some(8), rr_depth: u32::MAX };
    let expected = vec![ExactLength::total(0.0, Families::ALL)];
    ExactScene { name, description: b.finish(), rules, expected }
}

/// Names of all cases that the options want.
pub(super) fn names(options: &Options) -> Vec<String> {
    let moved = MOVED.iter().map(|m| m.name.to_owned());
    let dark = dark_boxes().into_iter().map(|s| s.name.to_owned());
    moved.chain(dark).filter(|n| options.wants(n)).collect()
}

/// Holds every integrator to every case.
pub(super) fn run(
    report: &mut Report,
    team: &Team<'_>,
    options: &Options,
    config: &Config,
    watch: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<ControlFlow<()>, SuiteError> {
    for case in MOVED.iter().filter(|m| options.wants(m.name)) {
        let scenes = case.build();
        let rules = scenes.as_ref().map_or(WalkRules::default(), |s| s.2);
        for integrator in team.integrators(rules)? {
            let what = format!("{}: {}", case.name, integrator.spec());
            let progress = Progress { done: report.done(), tests: report.tests, what: &what };
            if watch(&progress).is_break() {
                return Ok(ControlFlow::Break(()));
            }
            let level = report.level();
            report.checks.push(match &scenes {
                Ok((here, there, _)) => check(case, [here, there], &*integrator, config, level),
                Err(error) => failed(case, &*integrator, error.to_string()),
            });
            report.add_done(1);
        }
    }
    let mut dark = dark_boxes();
    dark.retain(|s| options.wants(s.name));
    // Where nothing is to be seen no variance says how long to look.
    let config = Config { rays: config.rays / 4, ..*config };
    exact::run(report, team, &dark, &config, "hard", watch)
}

/// Why there is nothing to compare.
#[derive(Debug, thiserror::Error)]
enum HardError {
    #[error(transparent)]
    File(#[from] SceneFileError),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Integrator(#[from] IntegratorError),
    #[error(transparent)]
    Stats(#[from] StatsError),
    #[error("no scene {0} in the library")]
    Unknown(&'static str),
    #[error("{0} contributions are not finite: {1}")]
    NonFinite(u64, String),
}

impl Moved {
    /// The scene here, there, and its rules.
    fn build(&self) -> Result<(Arc<Scene>, Arc<Scene>, WalkRules), HardError> {
        let scene = library::find(self.scene).ok_or(HardError::Unknown(self.scene))?;
        let loaded = scene.load(&[("res".into(), "32".into())])?;
        let defaults = loaded.defaults;
        let here = Scene::new(&loaded.description)?;
        let radius = self.scale / here.normalisation().scale;
        let offset = DVec3::new(0.6, -0.64, 0.48) * (self.radii * radius);
        let there = Scene::new(&moved(&loaded.description, self.scale, offset))?;
        let rules = WalkRules { max_length: defaults.max_depth, rr_depth: defaults.rr_depth };
        Ok((Arc::new(here), Arc::new(there), rules))
    }
}

fn failed(case: &Moved, integrator: &dyn Integrator, reason: String) -> Check {
    let base = Check::of("hard", case.name, integrator.spec());
    Check { outcome: CheckOutcome::Failed, reason: Some(reason), ..base }
}

/// Compares an integrator with itself in two places.
fn check(
    case: &Moved,
    scenes: [&Arc<Scene>; 2],
    integrator: &dyn Integrator,
    config: &Config,
    level: f64,
) -> Check {
    let clock = Instant::now();
    let mut check = Check::of("hard", case.name, integrator.spec());
    match compare(&mut check, scenes, integrator, config, level) {
        Ok(()) => {}
        Err(HardError::Integrator(IntegratorError::Refused { reason, .. })) => {
            (check.outcome, check.reason) = (CheckOutcome::Skipped, Some(reason));
        }
        Err(error) => {
            (check.outcome, check.reason) = (CheckOutcome::Failed, Some(error.to_string()));
        }
    }
    check.seconds = clock.elapsed().as_secs_f64();
    check
}

fn compare(
    check: &mut Check,
    scenes: [&Arc<Scene>; 2],
    integrator: &dyn Integrator,
    config: &Config,
    level: f64,
) -> Result<(), HardError> {
    let crop = scenes[0].film().crop;
    let tiles = Tiles::at_most(config.tiles, crop.width as usize, crop.height as usize);
    let own = seed_of(seed_of(config.seed, &check.scene), &check.subject);
    let pilot_seed = derive_seed(own, u64::MAX);
    let pilot = pilot(scenes[0], integrator, &tiles, pilot_seed, config.samples)?;
    let steps = pilot.steps(config.replicates, config.mdb, config.rays / 2, None);
    let mut verdict = Verdict::Inconclusive;
    let mut test = Confirmed::new(level, config.rounds().0)?;
    let rejected = test.run(config, |round, factor, at| {
        let mut methods = Vec::new();
        for (place, scene) in scenes.into_iter().enumerate() {
            let seed = derive_seed(derive_seed(own, round), place as u64);
            let range = 0..config.replicates as u64;
            let batch = replicates(scene, integrator, &tiles, seed, range, steps * factor)?;
            if batch.nonfinite > 0 {
                let first = batch.first_nonfinite.unwrap_or_default();
                return Err(HardError::NonFinite(batch.nonfinite, first));
            }
            let name = ["here", "there"][place].to_owned();
            let families = integrator.families(scene);
            methods.push(Method { name, families, replicates: batch.observations });
        }
        let rule = Rule { alpha: at, ..Rule::default() };
        let compare = CompareConfig { rule, ..CompareConfig::default() };
        let judgement = judge(&methods[0], &methods[1], &tiles, &compare)?;
        verdict = judgement.verdict;
        check.mdb = judgement.mdb.is_finite().then_some(judgement.mdb);
        check.cells = cells(&judgement);
        Ok::<_, HardError>(Some((judgement.p, config.replicates)))
    })?;
    check.outcome = CheckOutcome::of(rejected, verdict);
    check.rounds = test.rounds;
    Ok(())
}

fn cells(judgement: &Judgement) -> Vec<CheckCell> {
    std::iter::once(&judgement.image)
        .chain(&judgement.lengths)
        .map(|l| CheckCell {
            name: l.length.map_or("image".into(), |k| format!("length {k}")),
            length: l.length,
            p: l.p,
            mean: Some(l.mean_b),
            expected: Some(l.mean_a),
            mdb: l.mdb.is_finite().then_some(l.mdb),
        })
        .collect()
}
