//! What the page says without scripts: the table of efficiencies, the matrix of verdicts, the
//! geometric means.

use serde::Serialize;

use crate::plots::{charts, is_single};
use crate::results::{Results, SceneResults};
use crate::standing::{Standing, Standings};
use pathspace_validation::page::verdict_words;
use pathspace_validation::stats::Verdict;

/// A value with its interval as a bar on a logarithmic axis; shares of the axis in percent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Bar {
    left: f64,
    width: f64,
    point: f64,
    /// Where 1 is.
    one: f64,
}

/// A row of the geometric means.
#[derive(Debug, Serialize)]
pub(super) struct OverallRow {
    integrator: String,
    baseline: String,
    value: f64,
    low: f64,
    high: f64,
    scenes: usize,
    bar: Option<Bar>,
}

/// A row of the table of a scene: the largest budget of an integrator.
#[derive(Debug, Serialize)]
pub(super) struct MethodRow {
    bar: Option<Bar>,
    #[serde(flatten)]
    standing: Standing,
}

/// A chart as SVG.
#[derive(Debug, Serialize)]
pub(super) struct Plot {
    name: &'static str,
    caption: String,
    svg: String,
}

/// A cell of the matrix of verdicts.
#[derive(Debug, Serialize)]
pub(super) struct MatrixCell {
    pair: usize,
    verdict: &'static str,
    words: &'static str,
    sign: &'static str,
    p: f64,
    mdb: f64,
    a: String,
    b: String,
}

/// A row of the matrix: one integrator against those before it.
#[derive(Debug, Serialize)]
pub(super) struct MatrixRow {
    integrator: String,
    cells: Vec<Option<MatrixCell>>,
}

/// Tables of one scene.
#[derive(Debug, Serialize)]
pub(super) struct SceneTables {
    baseline: Option<String>,
    /// Are they right, and which is best: a sentence each, and the word for a chip.
    right: String,
    best: String,
    chip: &'static str,
    chip_words: &'static str,
    /// Who is ranked apart.
    partial: Vec<String>,
    busy: Option<f64>,
    /// True where there is one budget: dots, no curve.
    single: bool,
    plots: Vec<Plot>,
    rows: Vec<MethodRow>,
    /// Heads of the columns of the matrix.
    columns: Vec<String>,
    matrix: Vec<MatrixRow>,
    differ: usize,
}

impl SceneTables {
    pub(super) fn of(scene: &SceneResults, integrators: &[String], threads: usize) -> SceneTables {
        let Standings { rows, tally, right, best, busy, .. } = Standings::of(scene, threads);
        let ratios = scene.methods.iter().filter_map(|a| a.ratio.as_ref());
        let axis = Axis::over(ratios.map(|r| [r.low, r.value, r.high]));
        let baseline =
            scene.methods.iter().find_map(|a| a.ratio.as_ref()).map(|r| r.baseline.clone());
        let names: Vec<String> = scene.methods.iter().map(|a| a.integrator.clone()).collect();
        let (chip, chip_words) = match (tally.differ, tally.inconclusive, tally.pairs) {
            (0, _, 0) => ("inconclusive", "? not tested"),
            (0, 0, _) => ("agree", "✓ no difference found"),
            // Some are shown to be alike, and none to differ.
            (0, _, _) if tally.agree > 0 => ("agree", "✓ no difference found"),
            (0, _, _) => ("inconclusive", "? needs more samples"),
            _ => ("differ", "✗ differs"),
        };
        let partial = rows.iter().filter(|r| !r.whole).map(|r| r.integrator.clone()).collect();
        let bar = |r: &Standing| axis.filter(|_| !r.is_baseline)?.bar(r.low, r.ratio, r.high);
        SceneTables {
            baseline,
            right,
            best,
            chip,
            chip_words,
            partial,
            busy,
            single: is_single(scene),
            plots: (charts(scene, integrators, threads).iter())
                .map(|c| Plot { name: c.name, caption: c.caption.clone(), svg: c.inline_svg() })
                .collect(),
            rows: rows.into_iter().map(|r| MethodRow { bar: bar(&r), standing: r }).collect(),
            columns: names[..names.len().saturating_sub(1)].to_vec(),
            matrix: (1..names.len()).map(|i| matrix_row(scene, &names, i)).collect(),
            differ: tally.differ,
        }
    }
}

fn matrix_row(scene: &SceneResults, names: &[String], row: usize) -> MatrixRow {
    let cell = |column: usize| {
        let found = scene.pairs.iter().enumerate().find(|(_, pair)| {
            let j = &pair.judgement;
            let (a, b) = (&names[row], &names[column]);
            (&j.a == a && &j.b == b) || (&j.a == b && &j.b == a)
        });
        found.map(|(pair, summary)| {
            let j = &summary.judgement;
            MatrixCell {
                pair,
                verdict: j.verdict.as_str(),
                words: verdict_words(j.verdict),
                sign: match j.verdict {
                    Verdict::Agree => "✓",
                    Verdict::Differ => "✗",
                    Verdict::Inconclusive => "?",
                },
                p: j.p,
                mdb: j.mdb,
                a: j.a.clone(),
                b: j.b.clone(),
            }
        })
    };
    let cells = (0..names.len() - 1).map(|c| if c < row { cell(c) } else { None }).collect();
    MatrixRow { integrator: names[row].clone(), cells }
}

/// Rows of the geometric means over scenes.
pub(super) fn overall(results: &Results) -> Vec<OverallRow> {
    let axis = Axis::over(results.overall.iter().map(|o| [o.low, o.geometric_mean, o.high]));
    let row = |o: &crate::results::Overall| OverallRow {
        integrator: o.integrator.clone(),
        baseline: o.baseline.clone(),
        value: o.geometric_mean,
        low: o.low,
        high: o.high,
        scenes: o.scenes,
        bar: axis.and_then(|a| a.bar(o.low, o.geometric_mean, o.high)),
    };
    results.overall.iter().map(row).collect()
}

/// A logarithmic axis that holds 1.
#[derive(Clone, Copy, Debug)]
struct Axis {
    low: f64,
    high: f64,
}

impl Axis {
    /// The axis over values that are positive and finite, with a margin; `None` without any.
    fn over(values: impl Iterator<Item = [f64; 3]>) -> Option<Axis> {
        let logs: Vec<f64> =
            values.flatten().filter(|v| *v > 0.0 && v.is_finite()).map(f64::ln).collect();
        if logs.is_empty() {
            return None;
        }
        let low = logs.iter().fold(0.0_f64, |m, v| m.min(*v)) - 0.1;
        let high = logs.iter().fold(0.0_f64, |m, v| m.max(*v)) + 0.1;
        Some(Axis { low, high })
    }

    fn at(self, value: f64) -> f64 {
        100.0 * ((value.max(0.0).ln() - self.low) / (self.high - self.low)).clamp(0.0, 1.0)
    }

    /// The bar of a value; an end that is not known reaches to the end of the axis.
    fn bar(self, low: f64, value: f64, high: f64) -> Option<Bar> {
        if !(value > 0.0 && value.is_finite()) {
            return None;
        }
        let left = if low.is_finite() { self.at(low) } else { 0.0 };
        let right = if high.is_finite() { self.at(high) } else { 100.0 };
        Some(Bar { left, width: right - left, point: self.at(value), one: self.at(1.0) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_lie_on_a_common_axis_that_holds_one() {
        let axis = Axis::over([[2.0, 4.0, 8.0], [0.5, 1.0, 2.0]].into_iter()).unwrap();
        let (a, b) = (axis.bar(2.0, 4.0, 8.0).unwrap(), axis.bar(0.5, 1.0, 2.0).unwrap());
        assert!((a.left - (b.left + b.width)).abs() < 1e-9 && a.one == b.one);
        assert!((b.point - b.one).abs() < 1e-9 && a.left + a.width <= 100.0);
    }

    #[test]
    fn an_interval_without_ends_reaches_over_the_axis() {
        let axis = Axis::over([[f64::NAN, 4.0, f64::INFINITY]].into_iter()).unwrap();
        let bar = axis.bar(f64::NAN, 4.0, f64::INFINITY).unwrap();
        assert_eq!((bar.left, bar.width), (0.0, 100.0));
        assert!(axis.bar(1.0, f64::NAN, 2.0).is_none());
        assert!(Axis::over(std::iter::empty()).is_none());
    }
}
