//! Every pair of integrators on one scene, in rounds.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use pathspace_core::Scene;
use pathspace_core::integrator::Integrator;

use super::config::{Config, StoppingRule};
use super::confirm::Confirmed;
use super::methods::Contender;
use super::report::{PairReport, SceneReport};
use super::{seed_of, sequential};
use crate::pairs::{Judgement, Tiles, judge, tile_maps};
use crate::stats::{CompareConfig, Round, Rule, StatsError, Verdict};

/// Which pairs of a list of integrators are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pairing {
    /// Every one with every other one.
    All,
    /// The first with every other one.
    First,
}

impl Pairing {
    /// Pairs of `n` integrators, by their places.
    pub(crate) fn pairs(self, n: usize) -> Vec<(usize, usize)> {
        let firsts = match self {
            Pairing::All => n,
            Pairing::First => n.min(1),
        };
        (0..firsts).flat_map(|i| (i + 1..n).map(move |j| (i, j))).collect()
    }
}

/// Compares integrators on a scene at level `level` for each pair; `None` where `watch`, which
/// hears what is going on, said to stop.
pub(crate) fn compare_on(
    name: &str,
    scene: &Arc<Scene>,
    (integrators, pairing): (&[&dyn Integrator], Pairing),
    config: &Config,
    level: f64,
    watch: &mut dyn FnMut(&str) -> ControlFlow<()>,
) -> Option<SceneReport> {
    let clock = Instant::now();
    let crop = scene.film().crop;
    let tiles = Tiles::at_most(config.tiles, crop.width as usize, crop.height as usize);
    if watch(&format!("{name}: pilots")).is_break() {
        return None;
    }
    let seed = seed_of(config.seed, name);
    let mut contenders = Contender::all(scene, integrators, &tiles, config, pairing, seed);
    let chosen = pairing.pairs(contenders.len());
    let setting = Setting { name, scene, chosen: &chosen, tiles: &tiles, config };
    let judged = match config.stopping {
        StoppingRule::Rounds { most, growth } => {
            rounds(&setting, &mut contenders, (level, most, growth), watch)
        }
        StoppingRule::Sequential { batch, most } => {
            let limits = sequential::Limits { level, batch, most };
            sequential::run(&setting, &mut contenders, limits, watch)
        }
    };
    let (pairs, error) = match judged {
        Ok(Some(pairs)) => (pairs, None),
        Ok(None) => return None,
        Err(error) => (Vec::new(), Some(error.to_string())),
    };
    Some(SceneReport {
        scene: name.to_owned(),
        size: [crop.width, crop.height],
        integrators: contenders.into_iter().map(|c| c.report).collect(),
        pairs,
        error,
        seconds: clock.elapsed().as_secs_f64(),
    })
}

/// A pair whose verdict is being found.
struct Trial {
    methods: (usize, usize),
    test: Confirmed,
    open: bool,
    report: Option<PairReport>,
}

/// What is compared, and where.
pub(super) struct Setting<'a> {
    pub name: &'a str,
    pub scene: &'a Arc<Scene>,
    /// Pairs of contenders.
    pub chosen: &'a [(usize, usize)],
    pub tiles: &'a Tiles,
    pub config: &'a Config,
}

fn rounds(
    setting: &Setting<'_>,
    contenders: &mut [Contender<'_>],
    (level, most, growth): (f64, u32, u32),
    watch: &mut dyn FnMut(&str) -> ControlFlow<()>,
) -> Result<Option<Vec<PairReport>>, StatsError> {
    let Setting { name, scene, chosen, tiles, config } = *setting;
    let mut trials = Vec::new();
    for &methods in chosen {
        trials.push(Trial {
            methods,
            test: Confirmed::new(level, most)?,
            open: true,
            report: None,
        });
    }
    for round in 0..most {
        let factor = if round == 0 { 1 } else { u64::from(growth) };
        for (index, contender) in contenders.iter_mut().enumerate() {
            let needed =
                trials.iter().any(|t| t.open && (t.methods.0 == index || t.methods.1 == index));
            if !(needed && contender.is_well()) {
                continue;
            }
            if watch(&format!("{name}: round {}, {}", round + 1, contender.method.name)).is_break()
            {
                return Ok(None);
            }
            contender.render(scene, tiles, round.into(), config.replicates, factor);
        }
        for trial in trials.iter_mut().filter(|t| t.open) {
            let (a, b) = (&contenders[trial.methods.0], &contenders[trial.methods.1]);
            trial.open = a.is_well() && b.is_well() && trial.judge(a, b, tiles)?;
        }
    }
    // Those with an integrator that failed have no report.
    Ok(Some(trials.into_iter().filter_map(|t| t.report).collect()))
}

impl Trial {
    /// Judges a round; true where another one is needed.
    fn judge(
        &mut self,
        a: &Contender<'_>,
        b: &Contender<'_>,
        tiles: &Tiles,
    ) -> Result<bool, StatsError> {
        let level = self.test.level();
        let rule = Rule { alpha: level, ..Rule::default() };
        let compare = CompareConfig { rule, ..CompareConfig::default() };
        let last = judge(&a.method, &b.method, tiles, &compare)?;
        let round = self.test.observe(last.p, a.method.replicates.len())?;
        let outcome = match (round, last.verdict) {
            (Round::Reject, _) => Verdict::Differ,
            (_, Verdict::Agree) => Verdict::Agree,
            (_, Verdict::Differ | Verdict::Inconclusive) => Verdict::Inconclusive,
        };
        let maps = if outcome == Verdict::Differ {
            tile_maps(&a.method, &b.method, tiles, &suspicious(&last))?
        } else {
            Vec::new()
        };
        let rounds = self.test.rounds.clone();
        self.report = Some(PairReport { outcome, last, rounds, maps });
        Ok(round == Round::Again)
    }
}

/// Path lengths that look as if they differed.
pub(super) fn suspicious(judgement: &Judgement) -> Vec<u32> {
    let lengths = judgement.lengths.iter();
    lengths.filter(|l| l.p < 0.01).filter_map(|l| l.length).collect()
}
