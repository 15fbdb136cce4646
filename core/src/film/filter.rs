//! Reconstruction filters, normalised once for camera samples and splats alike.

use crate::description::FilterKind;

/// A separable filter h(x)·h(y) with ∫h = 1; lengths in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    kind: FilterKind,
    radius: f64,
    norm: f64,
}

impl Filter {
    /// The filter of a description.
    pub fn new(kind: FilterKind) -> Self {
        let radius = match kind {
            FilterKind::Box => 0.5,
            FilterKind::Tent { radius } => radius,
            FilterKind::Gaussian { stddev } => 4.0 * stddev,
        };
        let mut filter = Filter { kind, radius, norm: 1.0 };
        filter.norm = 1.0 / (filter.antiderivative(radius) - filter.antiderivative(-radius));
        filter
    }

    /// Half width in pixels: h is 0 beyond.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// True for the box of one pixel, under which a sample belongs to exactly one pixel.
    pub fn is_box(&self) -> bool {
        matches!(self.kind, FilterKind::Box)
    }

    /// h(x).
    pub fn eval(&self, x: f64) -> f64 {
        let x = x.abs();
        let raw = match self.kind {
            FilterKind::Box => f64::from(x < 0.5),
            FilterKind::Tent { radius } => (1.0 - x / radius).max(0.0),
            FilterKind::Gaussian { stddev } => {
                let g = |x: f64| (-x * x / (2.0 * stddev * stddev)).exp();
                (g(x) - g(self.radius)).max(0.0)
            }
        };
        raw * self.norm
    }

    /// ∫_a^b h(x) dx.
    pub fn integral(&self, a: f64, b: f64) -> f64 {
        (self.antiderivative(b) - self.antiderivative(a)) * self.norm
    }

    /// ∫_0^x of the unnormalised filter.
    fn antiderivative(&self, x: f64) -> f64 {
        let r = self.radius;
        let a = x.abs().min(r);
        let half = match self.kind {
            FilterKind::Box => a,
            FilterKind::Tent { .. } => a - 0.5 * a * a / r,
            FilterKind::Gaussian { stddev } => {
                // Simpson on [0, a]; the integrand is smooth and 64 panels are exact to 1e-10.
                let g = |x: f64| (-x * x / (2.0 * stddev * stddev)).exp();
                let n = 64;
                let h = a / n as f64;
                let sum: f64 = (0..=n)
                    .map(|i| {
                        let w = if i == 0 || i == n { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
                        w * (g(i as f64 * h) - g(r))
                    })
                    .sum();
                sum * h / 3.0
            }
        };
        half.copysign(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_filter_has_unit_integral() {
        for kind in [
            FilterKind::Box,
            FilterKind::Tent { radius: 1.0 },
            FilterKind::Tent { radius: 2.5 },
            FilterKind::Gaussian { stddev: 0.5 },
        ] {
            let f = Filter::new(kind);
            let n = 400_000;
            let h = 2.0 * f.radius() / n as f64;
            let sum: f64 =
                (0..n).map(|i| f.eval(-f.radius() + (i as f64 + 0.5) * h)).sum::<f64>() * h;
            assert!((sum - 1.0).abs() < 1e-5, "{kind:?}: {sum}");
            assert!((f.integral(-9.0, 9.0) - 1.0).abs() < 1e-9, "{kind:?}");
            assert!((f.integral(-9.0, 0.0) - 0.5).abs() < 1e-9, "{kind:?}");
        }
    }
}
