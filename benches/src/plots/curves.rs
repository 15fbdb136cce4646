//! Error over time: what several budgets give.

use crate::results::SceneResults;

use super::axis::Axis;
use super::drawing::{Anchor, Drawing, FONT, Ink, Item, width_of};

const WIDTH: f64 = 620.0;
const HEIGHT: f64 = 380.0;
const LEFT: f64 = 62.0;
const TOP: f64 = 10.0;
const BELOW: f64 = 46.0;
/// Between two names at the right.
const STEP: f64 = 15.0;

/// MSE over seconds, names at the right of the plot; `None` without a point.
pub(super) fn curve_plot(scene: &SceneResults, series: impl Fn(&str) -> usize) -> Option<Drawing> {
    let good = |v: f64| v > 0.0 && v.is_finite();
    let names = scene.methods.iter().map(|a| width_of(&a.integrator)).fold(0.0, f64::max);
    let right = WIDTH - (names + 24.0).min(0.4 * WIDTH);
    let bottom = HEIGHT - BELOW;
    let points = || scene.methods.iter().flat_map(|a| &a.points);
    let x = Axis::over(points().map(|p| p.seconds), LEFT, right)?;
    let errors = points().flat_map(|p| [p.mse.value, p.mse.low, p.mse.high]);
    let y = Axis::over(errors, bottom, TOP)?;
    let mut sheet = Drawing { width: WIDTH, height: HEIGHT, items: Vec::new() };
    for (at, label) in x.ticks(44.0) {
        sheet.line(&[[at, TOP], [at, bottom]], 1.0, Ink::Line, false);
        sheet.text([at, bottom + 16.0], &label, Ink::Soft, Anchor::Middle);
    }
    for (at, label) in y.ticks(26.0) {
        sheet.line(&[[LEFT, at], [right, at]], 1.0, Ink::Line, false);
        sheet.text([LEFT - 6.0, at + 0.35 * FONT], &label, Ink::Soft, Anchor::End);
    }
    let middle = 0.5 * (LEFT + right);
    sheet.text([middle, bottom + 36.0], "seconds (MSE upwards)", Ink::Text, Anchor::Middle);
    let mut ends: Vec<(f64, f64, &str, Ink)> = Vec::new();
    for method in &scene.methods {
        let ink = Ink::Series(series(&method.integrator));
        let shown: Vec<_> =
            method.points.iter().filter(|p| good(p.seconds) && good(p.mse.value)).collect();
        let at = |p: &&crate::results::Point| [x.at(p.seconds), y.at(p.mse.value)];
        let line: Vec<[f64; 2]> = shown.iter().map(at).collect();
        sheet.line(&line, 2.0, ink, false);
        for (p, [px, py]) in shown.iter().zip(&line) {
            if good(p.mse.low) && good(p.mse.high) {
                sheet.line(&[[*px, y.at(p.mse.low)], [*px, y.at(p.mse.high)]], 1.2, ink, false);
            }
            sheet.items.push(Item::Dot { at: [*px, *py], radius: 3.0, ink, hollow: false });
        }
        if let Some([px, py]) = line.last() {
            ends.push((*px, *py, &method.integrator, ink));
        }
    }
    // Names beside the plot, each at the height of its last point or as near to it as the others
    // leave room.
    ends.sort_by(|a, b| a.1.total_cmp(&b.1));
    let room = STEP * ends.len().saturating_sub(1) as f64;
    let mut next = TOP;
    for (n, (px, py, name, ink)) in ends.iter().enumerate() {
        let last = bottom - room + STEP * n as f64;
        let height = py.min(last).max(next);
        next = height + STEP;
        sheet.line(&[[px + 4.0, *py], [right + 10.0, height]], 0.8, *ink, true);
        let at = [right + 14.0, height + 0.35 * FONT];
        sheet.items.push(Item::Text {
            at,
            text: (*name).into(),
            ink: *ink,
            anchor: Anchor::Start,
            bold: true,
        });
    }
    Some(sheet)
}
