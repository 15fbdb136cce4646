//! Runs a suite.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use pathspace_core::Scene;
use pathspace_core::integrator::Integrator;
use pathspace_core::path::WalkRules;
use pathspace_integrators::{Defaults, Registry, Spec, SpecError};
use pathspace_scenes::library;

use super::{Part, Suite, calibration, chains, exact, hard, numbers};
use crate::validate::{Config, Pairing, Report, SceneReport, compare_on};

/// What to leave out of a suite.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Integrators that take part; all of the registry where empty.
    pub integrators: Vec<Spec>,
    /// Scenes that take part, by name; all where empty.
    pub scenes: Vec<String>,
    /// Level of a single test, in place of the share of α: to run a part of a suite as it was in
    /// the whole.
    pub level: Option<f64>,
}

/// Where a suite is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress<'a> {
    /// Tests done so far.
    pub done: usize,
    /// Tests in all.
    pub tests: usize,
    /// What is going on.
    pub what: &'a str,
}

/// Why a suite can not begin.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SuiteError {
    /// No such integrator.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// No scene of that name in the suite.
    #[error("'{name}' is no scene of this suite ({known})")]
    UnknownScene {
        /// The name.
        name: String,
        /// The names there are.
        known: String,
    },
    /// Statistics of too little data.
    #[error(transparent)]
    Stats(#[from] crate::stats::StatsError),
    /// The level is no probability, or there is nothing to test.
    #[error("{0}")]
    Nothing(String),
}

/// Options that make Markov chains affordable at 32 replicates a round, of a part that allows an
/// integrator `rays` rays; integrators that do not know them are made without. Each of the 32
/// bootstraps has one sample for 750 of these rays, and one chain for 16 samples: with the 4 to 11
/// rays of a sample a sixth to a half of them goes into b̂, whose noise all of the image shares.
fn chain_options(rays: u64) -> String {
    let bootstrap = (rays / 750).clamp(256, 1 << 15);
    format!("bootstrap={bootstrap},chains={}", bootstrap / 16)
}

/// A spec with options that make chains affordable, where it knows them.
fn affordable(registry: &Registry, spec: &str, rays: u64) -> Result<Spec, SpecError> {
    let joint = if spec.contains(':') { ',' } else { ':' };
    let with_options: Spec = format!("{spec}{joint}{}", chain_options(rays)).parse()?;
    let known = registry.create(&with_options, &Defaults::default()).is_ok();
    if known { Ok(with_options) } else { spec.parse() }
}

/// The integrators of a suite, made for each scene anew because the scene says how long paths are.
pub(super) struct Team<'a> {
    registry: &'a Registry,
    specs: Vec<Spec>,
}

impl<'a> Team<'a> {
    /// The integrators that are `asked` for, as they are; where there are none all of the registry,
    /// chains fit for a budget of `rays` rays.
    fn new(registry: &'a Registry, asked: &[Spec], rays: u64) -> Result<Self, SpecError> {
        let mut specs = asked.to_vec();
        if specs.is_empty() {
            for (name, _) in registry.list() {
                specs.push(affordable(registry, name, rays)?);
            }
        }
        let team = Team { registry, specs };
        team.integrators(WalkRules::default())?;
        Ok(team)
    }

    /// The integrators of a part: its own where it has any, of which those that are `asked` for
    /// take part.
    fn of(registry: &'a Registry, part: &Part, asked: &[Spec]) -> Result<Self, SpecError> {
        let (own, against): (&[&str], _) = match *part {
            Part::Exact { specs, .. } if !specs.is_empty() => (specs, None),
            Part::Variants { specs, against, .. } => (specs, Some(against)),
            Part::Pairs { against: Some(against), .. } => {
                let mut team = Team::new(registry, asked, part.rays())?;
                // To the front; a stable sort leaves the others in their order.
                team.specs.sort_by_key(|s| s.name != against);
                return Ok(team);
            }
            _ => return Team::new(registry, asked, part.rays()),
        };
        let own = own.iter().map(|name| affordable(registry, name, part.rays()));
        let mut specs = own.collect::<Result<Vec<Spec>, _>>()?;
        if !asked.is_empty() {
            specs.retain(|s| asked.iter().any(|a| a.to_string() == s.to_string()));
        }
        if let (Some(against), false) = (against, specs.is_empty()) {
            specs.insert(0, affordable(registry, against, part.rays())?);
        }
        let team = Team { registry, specs };
        team.integrators(WalkRules::default())?;
        Ok(team)
    }

    /// The integrators for a scene's rules.
    pub(super) fn integrators(
        &self,
        rules: WalkRules,
    ) -> Result<Vec<Box<dyn Integrator>>, SpecError> {
        let defaults = Defaults { rules };
        self.specs.iter().map(|s| self.registry.create(s, &defaults)).collect()
    }

    /// Number of integrators.
    pub(super) fn len(&self) -> usize {
        self.specs.len()
    }
}

/// Runs `suite` with the integrators of `registry`. `watch` hears of progress; where it says to
/// stop, the report holds what is done.
///
/// # Errors
/// Unknown integrators, options or scenes, before anything is rendered.
pub fn run(
    suite: &Suite,
    registry: &Registry,
    options: &Options,
    watch: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<Report, SuiteError> {
    let clock = Instant::now();
    check_scenes(suite, options)?;
    let team = |part: &Part| Team::of(registry, part, &options.integrators);
    let teams: Vec<Team<'_>> = suite.parts.iter().map(team).collect::<Result<_, _>>()?;
    let tests = suite.parts.iter().zip(&teams).map(|(p, t)| count(p, t, options)).sum();
    if tests == 0 {
        return Err(SuiteError::Nothing("nothing to test: two integrators make a pair".into()));
    }
    let mut report = Report::new(suite.name, &suite.config, tests);
    if let Some(level) = options.level {
        report.config.alpha = level * tests as f64;
    }
    let level = report.level();
    if !(level > 0.0 && level < 1.0) {
        return Err(SuiteError::Nothing(format!("a level of {level} is no probability")));
    }
    for (part, team) in suite.parts.iter().zip(&teams) {
        let flow = match *part {
            Part::Pairs { scenes, size, rays, mdb, hopeless, .. } => {
                let config = Config { rays, mdb, hopeless, ..suite.config };
                let scenes = library_scenes(scenes, options);
                let pairing = pairing(part, team);
                pairs(&mut report, (team, pairing), &scenes, size, &config, watch)?
            }
            Part::Variants { scenes, size, rays, mdb, .. } => {
                let config = Config { rays, mdb, ..suite.config };
                let scenes = library_scenes(scenes, options);
                pairs(&mut report, (team, Pairing::First), &scenes, size, &config, watch)?
            }
            Part::Numbers if !options.scenes.is_empty() || !options.integrators.is_empty() => {
                ControlFlow::Continue(())
            }
            Part::Numbers => {
                let done = report.done();
                let progress = Progress { done, tests, what: "random numbers" };
                if watch(&progress).is_break() {
                    ControlFlow::Break(())
                } else {
                    numbers::numbers(&mut report, level)?;
                    ControlFlow::Continue(())
                }
            }
            Part::Exact { scenes, rays, mdb, .. } => {
                let config = Config { rays, mdb, ..suite.config };
                let scenes = exact::scenes(scenes, options);
                exact::run(&mut report, team, &scenes, &config, "exact", watch)?
            }
            Part::Chains { scenes, starts } => {
                let scenes = library_scenes(scenes, options);
                chains::run(&mut report, &scenes, starts, &suite.config, watch)?
            }
            Part::Calibration { runs } => {
                calibration::run(&mut report, team, options, runs, &suite.config, watch)?
            }
            Part::Hard { rays } => {
                let config = Config { rays, ..suite.config };
                hard::run(&mut report, team, options, &config, watch)?
            }
        };
        if flow.is_break() {
            report.complete = false;
            break;
        }
    }
    report.seconds = clock.elapsed().as_secs_f64();
    Ok(report)
}

/// Which integrators of a team are compared: all with the first where that is the one that the part
/// names.
fn pairing(part: &Part, team: &Team<'_>) -> Pairing {
    match *part {
        Part::Pairs { against: Some(against), .. }
            if team.specs.first().is_some_and(|s| s.name == against) =>
        {
            Pairing::First
        }
        _ => Pairing::All,
    }
}

/// Tests of a part.
fn count(part: &Part, team: &Team<'_>, options: &Options) -> usize {
    let n = team.len();
    match *part {
        Part::Pairs { scenes, .. } => {
            library_scenes(scenes, options).len() * pairing(part, team).pairs(n).len()
        }
        Part::Variants { scenes, .. } => {
            library_scenes(scenes, options).len() * Pairing::First.pairs(n).len()
        }
        Part::Numbers if !options.scenes.is_empty() || !options.integrators.is_empty() => 0,
        Part::Numbers => numbers::TESTS,
        Part::Exact { scenes, .. } => exact::scenes(scenes, options).len() * n,
        Part::Hard { .. } => hard::names(options).len() * n,
        Part::Chains { scenes, .. } => library_scenes(scenes, options).len(),
        Part::Calibration { .. } => calibration::count(team, options),
    }
}

/// Names of scenes of a part before the options leave any out.
fn names(part: &Part) -> Vec<String> {
    let all = Options::default();
    match *part {
        Part::Pairs { scenes, .. }
        | Part::Variants { scenes, .. }
        | Part::Chains { scenes, .. } => {
            library_scenes(scenes, &all).iter().map(|s| s.name.to_owned()).collect()
        }
        Part::Exact { scenes, .. } => {
            exact::scenes(scenes, &all).iter().map(|s| s.name.to_owned()).collect()
        }
        Part::Hard { .. } => hard::names(&all),
        Part::Numbers => Vec::new(),
        Part::Calibration { .. } => calibration::names(),
    }
}

fn check_scenes(suite: &Suite, options: &Options) -> Result<(), SuiteError> {
    let known: Vec<String> = suite.parts.iter().flat_map(names).collect();
    match options.scenes.iter().find(|s| !known.contains(s)) {
        Some(name) => Err(SuiteError::UnknownScene { name: name.clone(), known: known.join(", ") }),
        None => Ok(()),
    }
}

fn library_scenes(names: &[&str], options: &Options) -> Vec<&'static library::LibraryScene> {
    let wanted = |name: &str| (names.is_empty() || names.contains(&name)) && options.wants(name);
    library::all().iter().filter(|s| wanted(s.name)).collect()
}

impl Part {
    /// Rays of an integrator on a scene; the default where a part does not count them.
    fn rays(&self) -> u64 {
        match *self {
            Part::Pairs { rays, .. }
            | Part::Variants { rays, .. }
            | Part::Exact { rays, .. }
            | Part::Hard { rays } => rays,
            Part::Chains { .. } | Part::Calibration { .. } | Part::Numbers => {
                Config::default().rays
            }
        }
    }
}

impl Options {
    /// True where a scene takes part.
    pub(super) fn wants(&self, name: &str) -> bool {
        self.scenes.is_empty() || self.scenes.iter().any(|s| s == name)
    }
}

fn pairs(
    report: &mut Report,
    (team, pairing): (&Team<'_>, Pairing),
    scenes: &[&library::LibraryScene],
    size: u32,
    config: &Config,
    watch: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<ControlFlow<()>, SuiteError> {
    let (tests, level) = (report.tests, report.level());
    let each = pairing.pairs(team.len()).len();
    if each == 0 {
        return Ok(ControlFlow::Continue(()));
    }
    for library in scenes {
        let done = report.done();
        match load(library, size) {
            Ok((scene, rules)) => {
                let integrators = team.integrators(rules)?;
                let borrowed: Vec<&dyn Integrator> = integrators.iter().map(|i| &**i).collect();
                let own = &mut |what: &str| watch(&Progress { done, tests, what });
                match compare_on(library.name, &scene, (&borrowed, pairing), config, level, own) {
                    Some(scene) => report.scenes.push(scene),
                    None => return Ok(ControlFlow::Break(())),
                }
            }
            Err(error) => report.scenes.push(SceneReport {
                scene: library.name.into(),
                size: [size; 2],
                integrators: Vec::new(),
                pairs: Vec::new(),
                error: Some(error),
                seconds: 0.0,
            }),
        }
        report.add_done(each);
    }
    Ok(ControlFlow::Continue(()))
}

/// A library scene of `size` pixels a side, and the rules that it asks for.
pub(super) fn load(
    scene: &library::LibraryScene,
    size: u32,
) -> Result<(Arc<Scene>, WalkRules), String> {
    let loaded = scene.load(&[("res".into(), size.to_string())]).map_err(|e| e.to_string())?;
    let built = Scene::new(&loaded.description).map_err(|e| e.to_string())?;
    let defaults = loaded.defaults;
    let rules = WalkRules { max_length: defaults.max_depth, rr_depth: defaults.rr_depth };
    Ok((Arc::new(built), rules))
}
