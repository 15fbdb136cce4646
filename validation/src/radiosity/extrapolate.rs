//! Richardson's extrapolation of three levels.

/// The limit of a sequence of values at edges h, h/2, h/4, and how far it may be off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extrapolated {
    /// B*.
    pub value: f64,
    /// Half-width of an interval about it.
    pub uncertainty: f64,
    /// Order p of the error hᵖ that was taken; `None` where the last level was taken as it is.
    pub order: Option<f64>,
}

/// Factor of safety of an estimated error (Roache 1994, for three levels).
const SAFETY: f64 = 1.25;
/// The slowest order that is believed: an error is at most 1/(√2 − 1) = 2.4 times the last
/// difference.
const SLOWEST: f64 = 0.5;

impl Extrapolated {
    /// The limit of means of constant elements, whose error is a h + b h² to its leading orders,
    /// with the differences Δ₁ = B_{h/2} − B_h and Δ₂ = B_{h/4} − B_{h/2}:
    ///
    /// | observed | B* | uncertainty |
    /// | --- | --- | --- |
    /// | 2 ≤ Δ₁/Δ₂ ≤ 4: order p = log₂ Δ₁/Δ₂ between those of both terms | B_{h/4} + Δ₂/(2ᵖ − 1) | 1.25 \|B* − B_{h/4}\| (Roache 1994), at least \|Δ₂\| |
    /// | 1 < Δ₁/Δ₂ < 2: slower than either | B_{h/4} | 1.25 \|Δ₂\|/(2ᵖ − 1), p at least ½ |
    /// | all else: both terms of opposite signs, or noise | B_{h/4} | 1.25 max(\|Δ₂\|, \|5Δ₂ − Δ₁\|/3) |
    ///
    /// The last is what eliminating both terms makes of the error, B** − B_{h/4} = (5Δ₂ − Δ₁)/3, so
    /// that no a and b whatever leave the interval; and never less than what the last halving has
    /// moved.
    pub fn new([coarse, middle, fine]: [f64; 3]) -> Self {
        let (first, second) = (middle - coarse, fine - middle);
        let ratio = first / second;
        // Rounding must not turn a pure power away.
        if second != 0.0 && (2.0 - 1e-9..=4.0 + 1e-9).contains(&ratio) {
            let order = ratio.log2().clamp(1.0, 2.0);
            let correction = second / (order.exp2() - 1.0);
            let value = fine + correction;
            let uncertainty = (SAFETY * correction.abs()).max(second.abs());
            return Extrapolated { value, uncertainty, order: Some(order) };
        }
        let error = if second != 0.0 && ratio > 1.0 && ratio < 2.0 {
            second.abs() / (ratio.log2().max(SLOWEST).exp2() - 1.0)
        } else {
            second.abs().max((5.0 * second - first).abs() / 3.0)
        };
        Extrapolated { value: fine, uncertainty: SAFETY * error, order: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn levels(of: impl Fn(f64) -> f64) -> Extrapolated {
        Extrapolated::new([of(1.0), of(0.5), of(0.25)])
    }

    #[test]
    fn a_pure_power_is_extrapolated_exactly() {
        for p in [1.0, 1.5, 2.0] {
            let e = levels(|h| 3.0 + 0.4 * h.powf(p));
            assert!((e.value - 3.0).abs() < 1e-12, "{e:?}");
            assert!((e.order.unwrap_or(0.0) - p).abs() < 1e-9, "{e:?}");
            let moved = 0.5_f64.powf(p) - 0.25_f64.powf(p);
            let expected = 0.4 * moved.max(1.25 * 0.25_f64.powf(p));
            assert!((e.uncertainty - expected).abs() < 1e-12);
        }
    }

    /// Oscillating sequences and those that seem to converge too fast or too slowly among them.
    #[test]
    fn the_interval_holds_the_limit_of_any_sum_of_a_linear_and_a_quadratic_error() {
        for k in 0..2000 {
            let angle = std::f64::consts::TAU * f64::from(k) / 2000.0;
            // Both terms are of one size at h/4 where the angle is that of a diagonal.
            let (a, b) = (4.0 * angle.cos(), 16.0 * angle.sin());
            let e = levels(|h| 1.0 + a * h + b * h * h);
            assert!((e.value - 1.0).abs() <= e.uncertainty * (1.0 + 1e-9), "{a} {b} {e:?}");
        }
    }

    #[test]
    fn the_interval_holds_the_limit_of_other_orders() {
        for p in [0.5, 0.7, 0.9, 1.2, 1.5, 2.5, 3.0, 4.0] {
            let e = levels(|h| 1.0 - 0.3 * h.powf(p));
            assert!((e.value - 1.0).abs() <= e.uncertainty * (1.0 + 1e-9), "{p} {e:?}");
        }
    }

    /// An error that hops about with the way elements meet edges, and falls with the root of h.
    #[test]
    fn the_interval_holds_the_limit_where_errors_of_any_sign_fall_slowly() {
        let sign = |k: u32, bit: u32| if k >> bit & 1 == 0 { 1.0 } else { -1.0 };
        for k in 0..8 {
            let e = Extrapolated::new([2.0 * sign(k, 0), 1.4 * sign(k, 1), sign(k, 2)]);
            // 2, 1.4, 1 are on the edge.
            assert!(e.value.abs() <= e.uncertainty * (1.0 + 1e-9), "{k} {e:?}");
        }
    }

    #[test]
    fn an_oscillation_is_not_extrapolated() {
        let e = Extrapolated::new([1.0, 1.01, 0.995]);
        assert_eq!((e.value, e.order), (0.995, None));
        assert!((e.uncertainty - 1.25 * 0.085 / 3.0).abs() < 1e-12, "{e:?}");
        assert_eq!(Extrapolated::new([2.0; 3]).uncertainty, 0.0);
    }
}
