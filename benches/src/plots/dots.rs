//! Values with intervals, a row each: what one budget gives.

use super::axis::Axis;
use super::drawing::{Anchor, Drawing, FONT, Ink, Item, width_of};

/// A row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Dot {
    pub(super) label: String,
    pub(super) series: usize,
    pub(super) value: f64,
    /// NaN where there is no interval.
    pub(super) low: f64,
    pub(super) high: f64,
    /// Below the others, its interval dashed.
    pub(super) apart: bool,
    /// A ring.
    pub(super) hollow: bool,
}

const WIDTH: f64 = 620.0;
const ROW: f64 = 24.0;
/// Between the rows and those apart.
const GAP: f64 = 12.0;
const RIGHT: f64 = 18.0;
const BELOW: f64 = 44.0;
/// Room of a label on the axis.
const TICK: f64 = 44.0;

/// The plot, with a line at `mark`; `None` where no row has a value.
pub(super) fn dot_plot(rows: &[Dot], axis_label: &str, mark: Option<f64>) -> Option<Drawing> {
    let names = rows.iter().map(|r| width_of(&r.label)).fold(0.0, f64::max);
    let left = (names + 14.0).min(0.45 * WIDTH);
    let values = rows.iter().flat_map(|r| [r.value, r.low, r.high]).chain(mark);
    let axis = Axis::over(values, left, WIDTH - RIGHT)?;
    let gap = if rows.iter().any(|r| r.apart) { GAP } else { 0.0 };
    let bottom = 6.0 + ROW * rows.len() as f64 + gap;
    let mut sheet = Drawing { width: WIDTH, height: bottom + BELOW, items: Vec::new() };
    for (x, label) in axis.ticks(TICK) {
        sheet.line(&[[x, 2.0], [x, bottom]], 1.0, Ink::Line, false);
        sheet.text([x, bottom + 16.0], &label, Ink::Soft, Anchor::Middle);
    }
    if let Some(mark) = mark {
        let x = axis.at(mark);
        sheet.line(&[[x, 2.0], [x, bottom]], 1.2, Ink::Soft, false);
    }
    sheet.line(&[[left, bottom], [WIDTH - RIGHT, bottom]], 1.0, Ink::Soft, false);
    sheet.text(
        [0.5 * (left + WIDTH - RIGHT), bottom + 36.0],
        axis_label,
        Ink::Text,
        Anchor::Middle,
    );
    for (n, row) in rows.iter().enumerate() {
        let y = 6.0 + ROW * (n as f64 + 0.5) + if row.apart { gap } else { 0.0 };
        let ink = Ink::Series(row.series);
        sheet.text([left - 10.0, y + 0.35 * FONT], &row.label, Ink::Text, Anchor::End);
        if row.low.is_finite() && row.high.is_finite() {
            sheet.line(&[[axis.at(row.low), y], [axis.at(row.high), y]], 2.0, ink, row.apart);
        }
        sheet.items.push(Item::Dot {
            at: [axis.at(row.value), y],
            radius: 4.5,
            ink,
            hollow: row.hollow,
        });
    }
    Some(sheet)
}
