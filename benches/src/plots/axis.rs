//! Logarithmic axes.

/// A range of positive values on a length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    /// The axis over values that are positive and finite, with a margin, from one place to another;
    /// `None` without any.
    pub(super) fn over(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Option<Axis> {
        let values: Vec<f64> = values.filter(|v| *v > 0.0 && v.is_finite()).collect();
        let low = values.iter().copied().reduce(f64::min)?;
        let high = values.iter().copied().reduce(f64::max)?;
        let margin = (high / low).powf(0.05).max(1.25);
        Some(Axis { low: low / margin, high: high * margin, from, to })
    }

    /// Where a value is; ends of intervals that are not known are at the ends of the axis.
    pub(super) fn at(&self, value: f64) -> f64 {
        let share = (value / self.low).ln() / (self.high / self.low).ln();
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        self.from + share * (self.to - self.from)
    }

    /// Places of ticks with their labels: 1, 2 and 5 times powers of ten as long as there is room,
    /// else the powers alone.
    pub(super) fn ticks(&self, room: f64) -> Vec<(f64, String)> {
        let decades = (self.high / self.low).log10();
        let length = (self.to - self.from).abs() / decades;
        let steps: &[f64] = if length > 4.5 * room { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let every = (room / length).ceil().max(1.0) as i32;
        let (first, last) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
        let powers = (first..=last).filter(|e| e.rem_euclid(every) == 0);
        let values = powers.flat_map(|e| steps.iter().map(move |m| m * 10.0_f64.powi(e)));
        let inside = values.filter(|v| *v >= self.low && *v <= self.high);
        inside.map(|v| (self.at(v), label(v))).collect()
    }
}

/// A round number, short.
fn label(v: f64) -> String {
    if (1e-3..1e5).contains(&v) {
        // 0.30000000000000004 has too many digits.
        let digits = (2 - v.log10().floor() as i32).max(0) as usize;
        let text = format!("{v:.digits$}");
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').into()
        } else {
            text
        }
    } else {
        format!("{v:.0e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_axis_has_ticks() {
        for (low, high) in [(1.0, 1.0), (0.9, 1.2), (0.3, 40.0), (1e-9, 1e7)] {
            let axis = Axis::over([low, high].into_iter(), 0.0, 400.0).unwrap();
            let ticks = axis.ticks(50.0);
            assert!((1..=12).contains(&ticks.len()), "{low} to {high}: {ticks:?}");
            assert!(ticks.windows(2).all(|t| t[1].0 - t[0].0 > 15.0), "{ticks:?}");
        }
        assert!(Axis::over([f64::NAN, -1.0].into_iter(), 0.0, 1.0).is_none());
    }

    #[test]
    fn labels_are_short() {
        assert_eq!(
            (label(0.2), label(50.0), label(1e-6)),
            ("0.2".into(), "50".into(), "1e-6".into())
        );
    }
}
