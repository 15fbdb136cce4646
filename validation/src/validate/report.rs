//! What a validation found.

use serde::Serialize;

use super::config::Config;
use crate::pairs::{Channel, Judgement, TileMap};
use crate::stats::Verdict;

/// Most lengths and most tiles that the message of a failure names.
const MOST_PLACES: usize = 4;

/// Everything that was held to something, and how it came out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Name of the suite; empty for [`super::validate()`].
    pub suite: String,
    /// The settings.
    pub config: Config,
    /// Number of tests that share α.
    pub tests: usize,
    /// Scenes on which integrators were compared with each other.
    pub scenes: Vec<SceneReport>,
    /// Everything that was held to a known answer.
    pub checks: Vec<Check>,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// False where it was stopped early.
    pub complete: bool,
    /// Version of this crate.
    pub version: &'static str,
    /// Tests done so far.
    #[serde(skip)]
    pub(super) done: usize,
}

/// Integrators compared on one scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneReport {
    /// Name of the scene.
    pub scene: String,
    /// Columns and rows of the film.
    pub size: [u32; 2],
    /// The integrators.
    pub integrators: Vec<MethodReport>,
    /// Every pair of those that render the scene.
    pub pairs: Vec<PairReport>,
    /// Why nothing could be rendered, if so.
    pub error: Option<String>,
    /// Wall-clock seconds.
    pub seconds: f64,
}

/// How an integrator fared on a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MethodReport {
    /// Its spec.
    pub integrator: String,
    /// Whether it rendered.
    pub state: MethodState,
    /// Why not, where it did not.
    pub reason: Option<String>,
    /// Replicates in the first round.
    pub replicates: usize,
    /// Samples per pixel of a replicate in the first round.
    pub samples: u64,
    /// Rays in all rounds, pilot included.
    pub rays: u64,
    /// Contributions that were not finite.
    pub nonfinite: u64,
    /// Mean luminance of the image.
    pub mean: Option<f64>,
}

/// Whether an integrator rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MethodState {
    /// It did.
    Rendered,
    /// The scene is not for it; no mistake.
    Refused,
    /// It failed, or emitted what is not finite: a mistake.
    Failed,
}

/// The verdict on a pair of integrators on a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PairReport {
    /// Verdict after all rounds.
    pub outcome: Verdict,
    /// The figures of the last round. Its own verdict and p-value are those of one round.
    #[serde(flatten)]
    pub last: Judgement,
    /// Seed and p-value of each round.
    pub rounds: Vec<RoundReport>,
    /// Where a pair differs: maps of the difference in standard errors, of the image first, then of
    /// path lengths.
    pub maps: Vec<TileMap>,
}

/// One round of a test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RoundReport {
    /// Family-wise p-value; of the e-process so far where the stopping rule is sequential.
    pub p: f64,
    /// Level at or below which the round rejects.
    pub level: f64,
    /// Replicates a side.
    pub replicates: usize,
}

/// Something held to a known answer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// Kind of check: `exact`, `chains`, `numbers`, `hard`, `calibration`.
    pub kind: &'static str,
    /// Scene or case.
    pub scene: String,
    /// Integrator or mutation, where there is one.
    pub subject: String,
    /// Specs of the integrators that have to take part for it to come out the same; none where it
    /// is about none.
    pub integrators: Vec<String>,
    /// How it came out.
    pub outcome: CheckOutcome,
    /// Why, where there is something to say.
    pub reason: Option<String>,
    /// Each round's p-value.
    pub rounds: Vec<RoundReport>,
    /// Largest minimum detectable bias, relative, where there is one.
    pub mdb: Option<f64>,
    /// What was tested one by one, in the last round.
    pub cells: Vec<CheckCell>,
    /// Wall-clock seconds.
    pub seconds: f64,
}

/// How a [`Check`] came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CheckOutcome {
    /// As it should be.
    Passed,
    /// Not as it should be.
    Failed,
    /// Too noisy to tell.
    Inconclusive,
    /// Not for this integrator.
    Skipped,
}

impl Check {
    /// A check of one integrator.
    pub(crate) fn of(kind: &'static str, scene: &str, integrator: String) -> Self {
        Check { integrators: vec![integrator.clone()], ..Check::new(kind, scene, integrator) }
    }

    /// A check without a result yet.
    pub(crate) fn new(kind: &'static str, scene: &str, subject: String) -> Self {
        Check {
            kind,
            scene: scene.to_owned(),
            subject,
            integrators: Vec::new(),
            outcome: CheckOutcome::Inconclusive,
            reason: None,
            rounds: Vec::new(),
            mdb: None,
            cells: Vec::new(),
            seconds: 0.0,
        }
    }
}

impl CheckOutcome {
    /// From whether the test rejects, and the verdict of its last round.
    pub(crate) fn of(rejected: bool, verdict: Verdict) -> Self {
        match (rejected, verdict) {
            (true, _) => CheckOutcome::Failed,
            (false, Verdict::Agree) => CheckOutcome::Passed,
            (false, Verdict::Differ | Verdict::Inconclusive) => CheckOutcome::Inconclusive,
        }
    }
}

/// One number of a [`Check`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckCell {
    /// Name: `image`, `length 3`, a mutation's invariant.
    pub name: String,
    /// Path length.
    pub length: Option<u32>,
    /// p-value after adjustment within the check.
    pub p: f64,
    /// Measured mean.
    pub mean: Option<f64>,
    /// What it should be.
    pub expected: Option<f64>,
    /// Minimum detectable bias, relative.
    pub mdb: Option<f64>,
}

/// One thing that is wrong, and how to see it again.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Failure {
    /// Scene or case.
    pub scene: String,
    /// Integrators concerned, two at most.
    pub integrators: Vec<String>,
    /// Path length where it shows most, of a pair.
    pub length: Option<u32>,
    /// Column and row of the tile where it shows most, of a pair.
    pub tile: Option<[usize; 2]>,
    /// Seed of the report.
    pub seed: u64,
    /// What is wrong, in words.
    pub message: String,
    /// Level of this one test; with the seed, it makes a report of this scene and these integrators
    /// alone come out the same.
    pub level: f64,
}

impl Report {
    /// True where nothing is wrong.
    pub fn passed(&self) -> bool {
        self.failures().is_empty()
    }

    /// Pairs and checks that agree, that differ, and that tell nothing.
    pub fn tally(&self) -> [usize; 3] {
        let pairs = self.scenes.iter().flat_map(|s| &s.pairs).map(|p| match p.outcome {
            Verdict::Agree => Some(0),
            Verdict::Differ => Some(1),
            Verdict::Inconclusive => Some(2),
        });
        let checks = self.checks.iter().map(|c| match c.outcome {
            CheckOutcome::Passed => Some(0),
            CheckOutcome::Failed => Some(1),
            CheckOutcome::Inconclusive => Some(2),
            CheckOutcome::Skipped => None,
        });
        let mut tally = [0; 3];
        pairs.chain(checks).flatten().for_each(|kind| tally[kind] += 1);
        tally
    }

    /// Level of a single test.
    pub fn level(&self) -> f64 {
        self.config.alpha / self.tests.max(1) as f64
    }

    /// Tests done so far.
    pub(crate) fn done(&self) -> usize {
        self.done
    }

    pub(crate) fn add_done(&mut self, tests: usize) {
        self.done += tests;
    }

    /// Everything that is wrong.
    pub fn failures(&self) -> Vec<Failure> {
        let scenes = self.scenes.iter().flat_map(|s| self.failures_of_scene(s));
        let checks = self.checks.iter().filter_map(|c| self.failure_of_check(c));
        scenes.chain(checks).collect()
    }

    /// Every integrator that refused a scene, with the reason.
    pub fn skips(&self) -> Vec<(&str, &str, &str)> {
        let refused = |s: &'_ SceneReport| -> Vec<usize> {
            let methods = s.integrators.iter().enumerate();
            methods.filter(|(_, a)| a.state == MethodState::Refused).map(|(i, _)| i).collect()
        };
        let mut skips = Vec::new();
        for scene in &self.scenes {
            for i in refused(scene) {
                let method = &scene.integrators[i];
                let reason = method.reason.as_deref().unwrap_or("");
                skips.push((scene.scene.as_str(), method.integrator.as_str(), reason));
            }
        }
        for check in self.checks.iter().filter(|c| c.outcome == CheckOutcome::Skipped) {
            let reason = check.reason.as_deref().unwrap_or("");
            skips.push((check.scene.as_str(), check.subject.as_str(), reason));
        }
        skips
    }

    fn failure(&self, scene: &str, integrators: Vec<String>, message: String) -> Failure {
        Failure {
            scene: scene.to_owned(),
            integrators,
            length: None,
            tile: None,
            seed: self.config.seed,
            message,
            level: self.level(),
        }
    }

    fn failures_of_scene(&self, scene: &SceneReport) -> Vec<Failure> {
        let mut failures = Vec::new();
        if let Some(error) = &scene.error {
            failures.push(self.failure(&scene.scene, Vec::new(), error.clone()));
        }
        for method in scene.integrators.iter().filter(|a| a.state == MethodState::Failed) {
            let message = method.reason.clone().unwrap_or_default();
            failures.push(self.failure(&scene.scene, vec![method.integrator.clone()], message));
        }
        for pair in scene.pairs.iter().filter(|p| p.outcome == Verdict::Differ) {
            let last = &pair.last;
            let integrators = vec![last.a.clone(), last.b.clone()];
            let p: Vec<String> = pair.rounds.iter().map(|r| format!("{:.1e}", r.p)).collect();
            let (length, tile) = pair.place();
            let (a, b) = (last.image.mean_a, last.image.mean_b);
            let message = format!(
                "{} and {} differ: means {a:.6} and {b:.6}{}; p = {}",
                last.a,
                last.b,
                pair.places(),
                p.join(", then ")
            );
            let base = self.failure(&scene.scene, integrators, message);
            failures.push(Failure { length, tile, ..base });
        }
        failures
    }

    fn failure_of_check(&self, check: &Check) -> Option<Failure> {
        if check.outcome != CheckOutcome::Failed {
            return None;
        }
        let worst = check.cells.iter().min_by(|a, b| a.p.total_cmp(&b.p));
        let message = match (&check.reason, worst) {
            (Some(reason), _) => reason.clone(),
            (None, Some(CheckCell { name, p, mean: Some(m), expected: Some(e), .. })) => {
                format!("{}, {name}: {m:.7} where {e:.7} is exact; p = {p:.1e}", check.subject)
            }
            (None, Some(cell)) => format!("{}, {}: p = {:.1e}", check.subject, cell.name, cell.p),
            (None, None) => "failed".into(),
        };
        let integrators = check.integrators.clone();
        let length = worst.and_then(|c| c.length);
        Some(Failure { length, ..self.failure(&check.scene, integrators, message) })
    }
}

impl PairReport {
    /// Where the difference shows, in words: path lengths and channels with their means, the kind
    /// of path, tiles; and which techniques both use.
    fn places(&self) -> String {
        let mut words = String::new();
        let cells = self.last.lengths.iter().chain(&self.last.channels);
        let mut differ: Vec<_> = cells.filter(|l| l.verdict == Verdict::Differ).collect();
        differ.sort_by(|a, b| a.p.total_cmp(&b.p));
        for l in differ.into_iter().take(MOST_PLACES) {
            let channel = match l.channel {
                Channel::Luminance => "",
                Channel::Red => " in red",
                Channel::Blue => " in blue",
            };
            let what = l.length.map_or("image".into(), |k| format!("length {k}"));
            words += &format!(", {what}{channel} {:.6} and {:.6}", l.mean_a, l.mean_b);
        }
        if let Some(place) = &self.last.place {
            words += &format!(
                "; most on paths of length {} that {} can make, {:.6} and {:.6}",
                place.length,
                place.techniques.join(", "),
                place.mean_a,
                place.mean_b
            );
        }
        let tiles: Vec<String> = self.maps.first().map_or(Vec::new(), |map| {
            let worst = map.largest(MOST_PLACES);
            worst.iter().map(|(x, y, sigma)| format!("{x},{y} ({sigma:+.1} σ)")).collect()
        });
        if !tiles.is_empty() {
            words += &format!("; tiles {}", tiles.join(", "));
        }
        if !self.last.common.is_empty() {
            words += &format!("; both use {}", self.last.common.join(", "));
        }
        words
    }

    /// Path length and tile where the difference shows most; `None` where a single one does not
    /// stand out.
    pub fn place(&self) -> (Option<u32>, Option<[usize; 2]>) {
        let differs = self.last.lengths.iter().filter(|l| l.verdict == Verdict::Differ);
        let length = differs.min_by(|a, b| a.p.total_cmp(&b.p)).and_then(|l| l.length);
        let map = self.maps.iter().find(|m| m.length == length).or(self.maps.first());
        (length, map.and_then(TileMap::worst))
    }
}
