//! One integrator at every budget.

use pathspace_core::film::Families;
use pathspace_validation::stats::{
    Estimate, StatsError, efficiency, mean_interval, replicate_slope,
};

use super::{Method, ReferenceHalves, Scene, average, no_pictures};
use crate::budget::Budget;
use crate::comparison::IntegratorSummary;
use crate::experiment::Cell;
use crate::metrics::{Errors, Reached, errors, flip, time_to_error};
use crate::output::exposure;
use crate::results::{BudgetKind, MethodResults, Point, PointBudget, TimeToError};

/// Replicates that FLIP is averaged over: it is slow, and a picture's figure.
const FLIPPED: usize = 4;

/// One budget as measured.
struct Measured {
    point: Point,
    relative: Vec<f64>,
}

pub(super) fn analyse(
    scene: &Scene<'_>,
    index: usize,
    target: Option<f64>,
) -> Result<Method, StatsError> {
    let (name, contestant) = &scene.setup.contestants[index];
    let reference = ReferenceHalves::of(scene, scene.families(index), Families::ALL);
    let pixels = scene.setup.pixels();
    let largest = scene.cells_of(index);
    let mean = mean_image(&largest, pixels);
    let mut measured = Vec::new();
    for budget in &scene.plan.budgets {
        let cells = scene.plan.cells(scene.store, scene.setup, name, *budget);
        if cells.len() >= 2 {
            measured.push(measure(scene, *budget, &cells, &reference, &mean)?);
        }
    }
    let last = &measured[measured.len() - 1].point;
    let costs: Vec<f64> =
        last.per_replicate_mse.iter().zip(&largest).map(|(e, c)| e * c.seconds).collect();
    let summary = summarise(name, last, &largest, &mean);
    let results = MethodResults {
        integrator: name.clone(),
        external: contestant.is_external(),
        slope: slope(&measured),
        efficiency: efficiency_interval(last, &costs),
        ratio: None,
        time_to_error: target.and_then(|target| reach(&measured, target)),
        images: no_pictures(),
        frames: Vec::new(),
        error_pngs: Vec::new(),
        points: measured.into_iter().map(|m| m.point).collect(),
    };
    let nonfinite_example = largest.into_iter().find_map(|c| c.nonfinite_example);
    Ok(Method { results, summary, nonfinite_example })
}

fn measure(
    scene: &Scene<'_>,
    budget: Budget,
    cells: &[Cell],
    reference: &ReferenceHalves,
    mean: &[f32],
) -> Result<Measured, StatsError> {
    let images: Vec<Vec<f32>> =
        cells.iter().map(|c| c.image(Families::ALL, scene.setup.pixels())).collect();
    let views: Vec<&[f32]> = images.iter().map(Vec::as_slice).collect();
    let found = errors(&views, reference.against())?;
    let (kind, value) = match budget {
        Budget::Samples(n) => (BudgetKind::Spp, n as f64),
        Budget::Seconds(s) => (BudgetKind::Seconds, s),
    };
    let point = Point {
        budget: PointBudget { kind, value },
        seconds: average(cells, |c| c.seconds),
        cpu_seconds: average(cells, |c| c.cpu_seconds),
        startup_seconds: cells.iter().map(|c| c.startup_seconds).sum(),
        spp: average(cells, |c| c.spp),
        rays: average(cells, |c| c.rays as f64),
        replicates: cells.len(),
        mse: found.interval,
        relmse: found.relmse(),
        relmse_trimmed: found.trimmed,
        flip: mean_flip(scene, &views, reference, mean),
        firefly_index: found.mse.firefly_index,
        nonfinite: cells.iter().map(|c| c.nonfinite).sum(),
        per_replicate_mse: found.mse.per_replicate.clone(),
    };
    let Errors { relative, .. } = found;
    Ok(Measured { point, relative })
}

/// FLIP of the first replicates against the reference, or against the mean at the largest budget.
fn mean_flip(
    scene: &Scene<'_>,
    images: &[&[f32]],
    reference: &ReferenceHalves,
    mean: &[f32],
) -> Option<f64> {
    let middle = |[a, b]: &[Vec<f32>; 2]| -> Vec<f32> {
        a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect()
    };
    let reference = reference.0.as_ref().map_or_else(|| mean.to_vec(), middle);
    let (pixels, _) = reference.as_chunks::<3>();
    let light = exposure(&pixels.iter().map(|p| p.map(f64::from)).collect::<Vec<_>>());
    let crop = scene.setup.scene.film().crop;
    let shown = images.len().min(FLIPPED);
    let one = |image: &&[f32]| flip(&reference, image, crop.width, crop.height, light);
    let values: Option<Vec<f64>> = images[..shown].iter().map(one).collect();
    values.map(|v| average(&v, |x| *x))
}

/// Slope over the budgets, where there are two and every mean error is positive.
fn slope(measured: &[Measured]) -> Option<Estimate> {
    let amount = |p: &Point| match p.budget.kind {
        BudgetKind::Spp => p.budget.value,
        BudgetKind::Seconds => p.seconds,
    };
    let budgets: Vec<f64> = measured.iter().map(|m| amount(&m.point)).collect();
    let errors: Vec<&[f64]> =
        measured.iter().map(|m| m.point.per_replicate_mse.as_slice()).collect();
    let few = measured.iter().any(|m| m.point.mse.low.is_nan());
    if few { None } else { replicate_slope(&budgets, &errors, 0.95).ok() }
}

fn reach(measured: &[Measured], target: f64) -> Option<TimeToError> {
    let one = |m: &'_ Measured| m.point.seconds;
    let points: Vec<Reached<'_>> =
        measured.iter().map(|m| Reached { seconds: one(m), errors: &m.relative }).collect();
    time_to_error(&points, target).ok()
}

/// 1/(MSE·seconds) of the means, with the relative interval of the costs of the replicates.
fn efficiency_interval(point: &Point, costs: &[f64]) -> Estimate {
    let value = efficiency(point.mse.value, point.seconds);
    let unknown = Estimate { value, low: f64::NAN, high: f64::NAN };
    if point.mse.low.is_nan() {
        return unknown;
    }
    match mean_interval(costs, 0.95) {
        Ok(c) if c.value > 0.0 => {
            Estimate { value, low: value * c.value / c.high, high: value * c.value / c.low }
        }
        Ok(_) | Err(_) => unknown,
    }
}

fn summarise(name: &str, point: &Point, cells: &[Cell], mean: &[f32]) -> IntegratorSummary {
    let (pixels, _) = mean.as_chunks::<3>();
    let channel = |c: usize| average(pixels, |p| f64::from(p[c]));
    IntegratorSummary {
        integrator: name.to_owned(),
        spp: point.spp,
        seconds: point.seconds,
        cpu_seconds: point.cpu_seconds,
        startup_seconds: point.startup_seconds,
        mse: point.mse.value,
        relmse: point.relmse,
        efficiency: efficiency(point.mse.value, point.seconds),
        replicates: cells.len(),
        rays: point.rays,
        nonfinite: point.nonfinite,
        mean: [channel(0), channel(1), channel(2)],
        output: None,
    }
}

/// Mean over replicates of all that an integrator makes.
fn mean_image(cells: &[Cell], pixels: usize) -> Vec<f32> {
    let mut sum = vec![0.0_f64; 3 * pixels];
    for cell in cells {
        for (s, v) in sum.iter_mut().zip(cell.image(Families::ALL, pixels)) {
            *s += f64::from(v) / cells.len() as f64;
        }
    }
    sum.into_iter().map(|v| v as f32).collect()
}
