//! Two integrators on what both can make.
//!
//! Another renderer hands over one image and no path classes. It is compared as a whole, with the
//! sum of those classes of ours that it can make; where it makes light that the other of the pair
//! can not, nobody can take that out of its image, and the pair is inconclusive.

use std::collections::BTreeMap;

use pathspace_core::film::Families;
use pathspace_validation::pairs::{Judgement, Method, Observation, Unseen, judge};
use pathspace_validation::stats::{CompareConfig, Estimate, StatsError, efficiency_ratio};

use super::{ReferenceHalves, Scene, average};
use crate::experiment::Cell;
use crate::metrics::errors;
use crate::results::PairSummary;

/// Mean luminance of the paths that each set of families can make, as the integrators of our own
/// saw it.
pub(super) type Light = BTreeMap<Families, f64>;

/// The largest mean luminance that one of our own saw in each set of families, all path lengths
/// together.
pub(super) fn light_of_families(scene: &Scene<'_>, methods: &[usize]) -> Light {
    let mut light = Light::new();
    for &index in methods {
        if scene.setup.contestants[index].1.is_external() {
            continue;
        }
        let cells = scene.cells_of(index);
        let mut own = Light::new();
        for cell in &cells {
            for (class, mean) in cell.observation().classes {
                *own.entry(class.families).or_default() += mean.mean / cells.len() as f64;
            }
        }
        for (families, mean) in own {
            let most = light.entry(families).or_default();
            *most = most.max(mean);
        }
    }
    light
}

pub(super) fn compare(
    scene: &Scene<'_>,
    i: usize,
    j: usize,
    light: &Light,
    tests: &CompareConfig,
) -> Result<PairSummary, StatsError> {
    let (one, two) = (Side::of(scene, i), Side::of(scene, j));
    let judgement = if one.external || two.external {
        judge_wholes(scene, &one, &two, light, tests)?
    } else {
        judge(&one.observed(), &two.observed(), &scene.setup.tiles(), tests)?
    };
    let reference = ReferenceHalves::of(scene, one.families, two.families);
    let (mse_a, costs_a) = one.costs(scene, two.families, &reference)?;
    let (mse_b, costs_b) = two.costs(scene, one.families, &reference)?;
    let value = (mse_b * two.seconds()) / (mse_a * one.seconds());
    // Two replicates without a reference share one error: their spread is none.
    let spread = one.cells.len().min(two.cells.len()) > 2 || scene.reference.is_some();
    let interval = if spread { efficiency_ratio(&costs_a, &costs_b, 0.95).ok() } else { None };
    let scaled = |f: fn(&Estimate) -> f64| interval.map_or(f64::NAN, |e| value * f(&e) / e.value);
    Ok(PairSummary {
        judgement,
        mse_a,
        mse_b,
        efficiency_ratio: value,
        efficiency_ratio_low: scaled(|e| e.low),
        efficiency_ratio_high: scaled(|e| e.high),
    })
}

/// One of a pair at the largest budget.
struct Side {
    name: String,
    external: bool,
    families: Families,
    cells: Vec<Cell>,
}

impl Side {
    fn of(scene: &Scene<'_>, index: usize) -> Self {
        let (name, contestant) = &scene.setup.contestants[index];
        Side {
            name: name.clone(),
            external: contestant.is_external(),
            families: scene.families(index),
            cells: scene.cells_of(index),
        }
    }

    fn seconds(&self) -> f64 {
        average(&self.cells, |c| c.seconds)
    }

    fn observed(&self) -> Method {
        let mut method = Method::new(self.name.clone(), self.families);
        method.replicates = self.cells.iter().map(Cell::observation).collect();
        method
    }

    /// All that `others` could make as well as one class.
    fn observed_as_one(&self, others: Families) -> Method {
        let mut method = Method::new(self.name.clone(), Families::ALL);
        let one = |c: &Cell| c.observation_as_one(others);
        method.replicates = self.cells.iter().map(one).collect();
        method
    }

    /// MSE on what `others` can make as well, and MSE times seconds of every replicate.
    fn costs(
        &self,
        scene: &Scene<'_>,
        others: Families,
        reference: &ReferenceHalves,
    ) -> Result<(f64, Vec<f64>), StatsError> {
        let others = if self.external { Families::ALL } else { others };
        let images: Vec<Vec<f32>> =
            self.cells.iter().map(|c| c.image(others, scene.setup.pixels())).collect();
        let views: Vec<&[f32]> = images.iter().map(Vec::as_slice).collect();
        let found = errors(&views, reference.against())?;
        let costs = found.mse.per_replicate.iter().zip(&self.cells).map(|(e, c)| e * c.seconds);
        Ok((found.mse.mse, costs.collect()))
    }

    /// Share of the light of `self` that `other` can not make.
    fn beyond(&self, other: &Side, light: &Light) -> f64 {
        let mine = light.iter().filter(|(f, _)| f.intersects(self.families));
        let (mut all, mut out) = (0.0, 0.0);
        for (families, mean) in mine {
            all += mean;
            if !families.intersects(other.families) {
                out += mean;
            }
        }
        if out == 0.0 { 0.0 } else { out / all }
    }
}

fn judge_wholes(
    scene: &Scene<'_>,
    one: &Side,
    two: &Side,
    light: &Light,
    tests: &CompareConfig,
) -> Result<Judgement, StatsError> {
    let tiles = scene.setup.tiles();
    let inseparable: Vec<Unseen> = [(one, two), (two, one)]
        .into_iter()
        .filter(|(other, external)| external.external && external.beyond(other, light) != 0.0)
        .map(|(other, external)| Unseen {
            integrator: other.name.clone(),
            of: external.name.clone(),
            fraction: external.beyond(other, light),
            reason: format!("which {} does not tell apart", external.name),
        })
        .collect();
    if !inseparable.is_empty() {
        let nothing = |side: &Side| {
            let mut method = Method::new(side.name.clone(), side.families);
            method.replicates = vec![Observation::default(); side.cells.len()];
            method
        };
        let mut judgement = judge(&nothing(one), &nothing(two), &tiles, tests)?;
        judgement.unseen = inseparable;
        return Ok(judgement);
    }
    let part = |side: &Side, other: &Side| {
        side.observed_as_one(if side.external { Families::ALL } else { other.families })
    };
    let mut judgement = judge(&part(one, two), &part(two, one), &tiles, tests)?;
    // There was one class, of no length.
    judgement.lengths.clear();
    for (blind, of) in [(one, two), (two, one)] {
        let fraction = of.beyond(blind, light);
        if fraction != 0.0 {
            let reason = "paths that it has no technique for".into();
            let (integrator, of) = (blind.name.clone(), of.name.clone());
            judgement.unseen.push(Unseen { integrator, of, fraction, reason });
        }
    }
    Ok(judgement)
}
