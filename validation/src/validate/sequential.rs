//! Every pair of integrators on one scene, looked at after every few replicates.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;

use super::config::Config;
use super::methods::Contender;
use super::pairs::{Setting, suspicious};
use super::report::{PairReport, RoundReport};
use crate::pairs::{Method, Observation, PathClass, Tiles, judge, tile_maps, well_sampled};
use crate::stats::{
    Cell, CompareConfig, Decision, Rule, Sequential, SequentialConfig, StatsError, Verdict,
};

/// When to look and when to stop.
pub(super) struct Limits {
    /// Level of each pair.
    pub(super) level: f64,
    /// Replicates between two looks.
    pub(super) batch: usize,
    /// Most replicates.
    pub(super) most: usize,
}

/// A pair under observation.
struct Watched {
    methods: (usize, usize),
    /// Path classes whose sum is tested: those of which the first batch, which is not tested, saw
    /// enough on both sides.
    classes: BTreeSet<PathClass>,
    test: Sequential,
    decision: Decision,
    /// Replicates pushed so far.
    pushed: usize,
}

/// The first batch chooses the path classes and is not tested; each later one is pushed replicate
/// by replicate.
pub(super) fn run(
    setting: &Setting<'_>,
    contenders: &mut [Contender<'_>],
    limits: Limits,
    watch: &mut dyn FnMut(&str) -> ControlFlow<()>,
) -> Result<Option<Vec<PairReport>>, StatsError> {
    let Setting { name, scene, chosen, tiles, config } = *setting;
    let batch = limits.batch.max(2);
    let most = limits.most.max(batch) as u64;
    let mut pairs: Vec<Watched> = Vec::new();
    let mut done = 0_u64;
    while done < most + batch as u64 {
        let more = done..(done + batch as u64).min(most + batch as u64);
        for (index, contender) in contenders.iter_mut().enumerate() {
            let open = |w: &Watched| {
                (w.methods.0 == index || w.methods.1 == index) && w.decision == Decision::Continue
            };
            if !(contender.is_well() && (done == 0 || pairs.iter().any(open))) {
                continue;
            }
            let what = format!(
                "{name}: replicates {} to {}, {}",
                more.start + 1,
                more.end,
                contender.method.name
            );
            if watch(&what).is_break() {
                return Ok(None);
            }
            contender.add(scene, tiles, 0, more.clone(), 1);
        }
        if done == 0 {
            pairs = begin(contenders, chosen, config, &limits, batch)?;
        } else {
            for pair in pairs.iter_mut().filter(|w| w.decision == Decision::Continue) {
                let (a, b) =
                    (&contenders[pair.methods.0].method, &contenders[pair.methods.1].method);
                pair.push(a, b)?;
            }
        }
        done = more.end;
        if pairs.iter().all(|w| w.decision != Decision::Continue) {
            break;
        }
    }
    let mut reports = Vec::new();
    for pair in &pairs {
        let (a, b) = (&contenders[pair.methods.0], &contenders[pair.methods.1]);
        if a.is_well() && b.is_well() {
            reports.push(pair.report(&a.method, &b.method, tiles, &limits)?);
        }
    }
    Ok(Some(reports))
}

fn begin(
    contenders: &[Contender<'_>],
    chosen: &[(usize, usize)],
    config: &Config,
    limits: &Limits,
    batch: usize,
) -> Result<Vec<Watched>, StatsError> {
    let mut pairs = Vec::new();
    for &(i, j) in chosen {
        let (a, b) = (&contenders[i], &contenders[j]);
        if !(a.is_well() && b.is_well()) {
            continue;
        }
        let classes = well_sampled(&a.method, &b.method, &Rule::default())?;
        let lengths: BTreeSet<u16> = classes.iter().map(|c| c.length).collect();
        let mut cells = vec![Cell::image()];
        cells.extend(lengths.iter().map(|k| Cell::length(u32::from(*k))));
        let sequential = SequentialConfig {
            alpha: limits.level,
            mdb_limit: config.mdb,
            ..SequentialConfig::default()
        };
        let test = Sequential::new(&cells, sequential)?;
        let decision = Decision::Continue;
        pairs.push(Watched { methods: (i, j), classes, test, decision, pushed: batch });
    }
    Ok(pairs)
}

impl Watched {
    fn push(&mut self, a: &Method, b: &Method) -> Result<(), StatsError> {
        let n = a.replicates.len().min(b.replicates.len());
        for r in self.pushed..n {
            let (x, y) = (self.row(&a.replicates[r]), self.row(&b.replicates[r]));
            self.decision = self.test.push(&x, &y)?;
            self.pushed = r + 1;
            if self.decision == Decision::Differ {
                break;
            }
        }
        Ok(())
    }

    /// Luminance of the image and of each length over the chosen classes.
    fn row(&self, replicate: &Observation) -> Vec<f64> {
        let mut lengths: BTreeMap<u16, f64> =
            self.classes.iter().map(|c| (c.length, 0.0)).collect();
        for class in &self.classes {
            let mean = replicate.classes.get(class).map_or(0.0, |c| c.mean);
            *lengths.entry(class.length).or_insert(0.0) += mean;
        }
        std::iter::once(lengths.values().sum()).chain(lengths.into_values()).collect()
    }

    fn report(
        &self,
        a: &Method,
        b: &Method,
        tiles: &Tiles,
        limits: &Limits,
    ) -> Result<PairReport, StatsError> {
        let rule = Rule { alpha: limits.level, ..Rule::default() };
        let last = judge(a, b, tiles, &CompareConfig { rule, ..CompareConfig::default() })?;
        let outcome = match (self.decision, last.verdict) {
            (Decision::Differ, _) => Verdict::Differ,
            (_, Verdict::Agree) => Verdict::Agree,
            (_, Verdict::Differ | Verdict::Inconclusive) => Verdict::Inconclusive,
        };
        let maps = if outcome == Verdict::Differ {
            tile_maps(a, b, tiles, &suspicious(&last))?
        } else {
            Vec::new()
        };
        let replicates = self.pushed;
        let round = RoundReport { p: self.test.p(), level: limits.level, replicates };
        Ok(PairReport { outcome, last, rounds: vec![round], maps })
    }
}
