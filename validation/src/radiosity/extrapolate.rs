//! Richardson's extrapolation of three levels.

/// The limit of a sequence of values at edges h, h/2, h/4, and how far it may be off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extrapolated {
    /// B*.
    pub value: f64,
    /// 1.25 |B* − B_{h/4}| (Roache 1994), the half-width of an interval.
    pub uncertainty: f64,
    /// Order p of the error hᵖ that was taken.
    pub order: f64,
}

impl Extrapolated {
    /// B* = B_{h/4} + (B_{h/4} − B_{h/2})/(2ᵖ − 1) with the observed order p = log₂ (B_{h/2} − B_h)/(B_{h/4} − B_{h/2}), at most 2
    /// and at least 1: more than elements promise is an accident.
    ///
    /// Where the sequence oscillates, B* is its last value and the uncertainty half its range (Stern, Wilson, Coleman &
    /// Paterson 2001); where its differences shrink by less than half or not at all, its last value and 1.25 times the larger
    /// difference.
    pub fn new([coarse, middle, fine]: [f64; 3]) -> Self {
        let (first, second) = (middle - coarse, fine - middle);
        let ratio = if second == 0.0 { f64::INFINITY } else { first / second };
        // Rounding must not turn a first order away.
        if ratio >= 2.0 - 1e-9 {
            let order = ratio.log2().clamp(1.0, 2.0);
            let correction = second / (order.exp2() - 1.0);
            let (value, uncertainty) = (fine + correction, 1.25 * correction.abs());
            return Extrapolated { value, uncertainty, order };
        }
        let uncertainty = if ratio < 0.0 {
            0.5 * first.abs().max(second.abs())
        } else {
            1.25 * first.abs().max(second.abs())
        };
        Extrapolated { value: fine, uncertainty, order: 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pure_power_is_extrapolated_exactly() {
        let of = |h: f64, p: f64| 3.0 + 0.4 * h.powf(p);
        for p in [1.0, 1.5, 2.0] {
            let e = Extrapolated::new([of(1.0, p), of(0.5, p), of(0.25, p)]);
            assert!((e.value - 3.0).abs() < 1e-12 && (e.order - p).abs() < 1e-9, "{e:?}");
            assert!((e.uncertainty - 1.25 * (of(0.25, p) - 3.0)).abs() < 1e-12);
        }
    }

    #[test]
    fn the_interval_holds_the_limit_of_faster_and_mixed_sequences() {
        for (a, b, c) in [(0.5, 0.0, 2.6), (0.5, 0.2, 3.0), (-0.3, 0.1, 2.0), (0.0, 0.1, 1.1)] {
            let of = |h: f64| 1.0 + a * h.powf(c) + b * h * h;
            let e = Extrapolated::new([of(0.5), of(0.25), of(0.125)]);
            assert!((e.value - 1.0).abs() <= e.uncertainty, "{e:?}");
        }
    }

    #[test]
    fn an_oscillation_is_not_extrapolated() {
        let e = Extrapolated::new([1.0, 1.01, 0.995]);
        assert_eq!((e.value, e.order), (0.995, 1.0));
        assert!((e.uncertainty - 0.0075).abs() < 1e-12);
        assert_eq!(Extrapolated::new([2.0; 3]).uncertainty, 0.0);
    }
}
