//! Multiple importance sampling: heuristics as values.

/// How the weights of the techniques that can make a path share it out (Veach and Guibas 1995;
/// Veach 1997, §9.2).
///
/// All heuristics give Σ w = 1 over the techniques with positive density. Densities are compared as
/// numbers, so they must be of one path, with equal numbers of samples per technique.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Heuristic {
    /// w_i = p_i / Σ p_j (eq. 9.8).
    Balance,
    /// w_i = p_i^β / Σ p_j^β (eq. 9.13); β = 2 is customary.
    Power {
        /// Exponent β ≥ 1.
        beta: f64,
    },
    /// Techniques below α·p_max are dropped, the rest share by balance (eq. 9.12).
    Cutoff {
        /// Threshold in [0, 1].
        alpha: f64,
    },
    /// The technique of largest density takes all; equal ones share (eq. 9.14).
    Maximum,
    /// Every technique that can make the path takes the same share.
    Uniform,
    /// A heuristic of one's own.
    Custom(CustomHeuristic),
}

/// A heuristic that is none of the published ones: w_i = g(p_i/p_max) / Σ g(p_j/p_max).
///
/// Whatever g is, Σ w = 1 over the techniques that can make the path, so that an integrator stays
/// unbiased.
///
/// ```
/// use pathspace_core::mis::Heuristic;
///
/// // Between balance and power, and no technique below a thousandth of the best.
/// let heuristic = Heuristic::custom("soft", |r| if r < 1e-3 { 0.0 } else { r * r.sqrt() });
/// let w = heuristic.weight(0, &[4.0, 1.0]);
/// assert!((w - 8.0 / 9.0).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct CustomHeuristic {
    name: &'static str,
    share: fn(f64) -> f64,
}

/// By name: what functions compute can not be compared.
impl PartialEq for CustomHeuristic {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Heuristic {
    /// A heuristic of one's own: `share` is g(r) of the ratio r = p/p_max in (0, 1] (a technique
    /// that can not make the path takes no part). It must be finite, not negative, and positive
    /// at 1. `name` is what it is printed as.
    pub const fn custom(name: &'static str, share: fn(f64) -> f64) -> Self {
        Heuristic::Custom(CustomHeuristic { name, share })
    }

    /// Unnormalised share of a technique whose density is `p`, where the largest one is `max`.
    #[inline]
    fn share(self, p: f64, max: f64) -> f64 {
        // Relative to the largest: powers of densities of long paths neither overflow nor vanish. A
        // density beyond every number (a connection in a corner) takes all.
        let r = if max.is_finite() { p / max } else { f64::from(p == max) };
        match self {
            Heuristic::Balance => r,
            Heuristic::Power { beta } => {
                if beta == 2.0 {
                    r * r
                } else {
                    r.powf(beta)
                }
            }
            Heuristic::Cutoff { alpha } => {
                if r < alpha {
                    0.0
                } else {
                    r
                }
            }
            Heuristic::Maximum => f64::from(r >= 1.0),
            Heuristic::Uniform => f64::from(r > 0.0),
            Heuristic::Custom(custom) => {
                if r > 0.0 {
                    (custom.share)(r)
                } else {
                    0.0
                }
            }
        }
    }

    /// Weight of technique `own`; densities of techniques that can not make the path are left out
    /// or 0.
    pub fn weight(self, own: usize, densities: &[f64]) -> f64 {
        let max = densities.iter().copied().fold(0.0, f64::max);
        if !(max > 0.0) || densities[own] == 0.0 {
            return 0.0;
        }
        let sum: f64 = densities.iter().map(|&p| self.share(p, max)).sum();
        self.share(densities[own], max) / sum
    }

    /// Weight from logarithms of densities; `None` is an impossible technique.
    pub fn weight_ln(self, own: usize, ln_densities: &[Option<f64>]) -> f64 {
        let max = ln_densities.iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
        let relative: Vec<f64> =
            ln_densities.iter().map(|l| l.map_or(0.0, |l| (l - max).exp())).collect();
        self.weight(own, &relative)
    }

    /// Weight of the first of two techniques.
    #[inline]
    pub fn weight2(self, own: f64, other: f64) -> f64 {
        if own == 0.0 {
            return 0.0;
        }
        let max = own.max(other);
        let a = self.share(own, max);
        a / (a + self.share(other, max))
    }
}

impl std::fmt::Display for Heuristic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Heuristic::Balance => write!(f, "balance"),
            Heuristic::Power { beta } => write!(f, "power,beta={beta}"),
            Heuristic::Cutoff { alpha } => write!(f, "cutoff,alpha={alpha}"),
            Heuristic::Maximum => write!(f, "maximum"),
            Heuristic::Uniform => write!(f, "uniform"),
            Heuristic::Custom(custom) => write!(f, "{}", custom.name),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Heuristic; 7] = [
        Heuristic::Balance,
        Heuristic::Power { beta: 2.0 },
        Heuristic::Power { beta: 3.5 },
        Heuristic::Cutoff { alpha: 0.1 },
        Heuristic::Maximum,
        Heuristic::Uniform,
        Heuristic::custom("root", f64::sqrt),
    ];

    #[test]
    fn weights_of_all_techniques_sum_to_one() {
        let p = [1e-300, 3e-3, 0.0, 5.0, 5.0, 2e250];
        for h in ALL {
            let sum: f64 = (0..p.len()).map(|i| h.weight(i, &p)).sum();
            assert!((sum - 1.0).abs() < 1e-14, "{h}: {sum}");
            assert_eq!(h.weight(2, &p), 0.0, "{h}: impossible technique");
        }
    }

    #[test]
    fn weights_are_those_of_the_published_formulas() {
        let half = Heuristic::Cutoff { alpha: 0.5 };
        for (h, p, expected) in [
            (Heuristic::Balance, [1.0, 2.0, 4.0], [1.0 / 7.0, 2.0 / 7.0, 4.0 / 7.0]),
            (Heuristic::Power { beta: 2.0 }, [1.0, 2.0, 4.0], [1.0, 4.0, 16.0].map(|w| w / 21.0)),
            (Heuristic::Power { beta: 3.0 }, [1.0, 2.0, 4.0], [1.0, 8.0, 64.0].map(|w| w / 73.0)),
            // Half of the largest is not below it.
            (half, [1.0, 2.0, 4.0], [0.0, 1.0 / 3.0, 2.0 / 3.0]),
            (Heuristic::Maximum, [1.0, 2.0, 4.0], [0.0, 0.0, 1.0]),
            (Heuristic::Maximum, [4.0, 1.0, 4.0], [0.5, 0.0, 0.5]),
            (Heuristic::Uniform, [1.0, 2.0, 4.0], [1.0 / 3.0; 3]),
            (Heuristic::Uniform, [1.0, 0.0, 4.0], [0.5, 0.0, 0.5]),
        ] {
            for (i, expected) in expected.into_iter().enumerate() {
                let w = h.weight(i, &p);
                assert!((w - expected).abs() < 1e-15, "{h}, {p:?}, technique {i}: {w}");
            }
        }
    }

    #[test]
    fn no_technique_has_a_weight_where_none_has_a_density() {
        for h in ALL {
            assert_eq!(h.weight(0, &[0.0, 0.0]), 0.0, "{h}");
            assert_eq!(h.weight2(0.0, 0.0), 0.0, "{h}");
            assert_eq!(h.weight_ln(1, &[None, None]), 0.0, "{h}");
        }
    }

    #[test]
    fn a_technique_that_can_not_make_the_path_takes_no_part_whatever_g_is() {
        let equal = Heuristic::custom("equal", |_| 1.0);
        assert_eq!(equal.weight(0, &[3.0, 0.0, 1.0]), 0.5);
        assert_eq!(equal.weight2(3.0, 0.0), 1.0);
    }

    #[test]
    fn heuristics_of_ones_own_are_equal_by_name() {
        let root = Heuristic::custom("root", f64::sqrt);
        assert_eq!(root, Heuristic::custom("root", |r| r));
        assert_ne!(root, Heuristic::custom("cube", f64::sqrt));
    }

    #[test]
    fn two_technique_form_equals_general_form() {
        for h in ALL {
            for (a, b) in [(1.0, 2.0), (3.0, 0.0), (1e-200, 1e200), (4.0, 4.0), (0.0, 1.0)] {
                assert!((h.weight2(a, b) - h.weight(0, &[a, b])).abs() < 1e-15, "{h} {a} {b}");
            }
        }
    }

    #[test]
    fn a_density_beyond_all_numbers_takes_all() {
        for h in ALL.into_iter().filter(|h| *h != Heuristic::Uniform) {
            assert_eq!(h.weight(0, &[1.0, f64::INFINITY]), 0.0, "{h}");
            assert_eq!(h.weight2(f64::INFINITY, 3.0), 1.0, "{h}");
        }
    }

    #[test]
    fn a_custom_power_is_the_power_heuristic() {
        let custom = Heuristic::custom("cube", |r| r * r * r);
        let p = [0.3, 0.0, 7.0, 2.0];
        for i in 0..p.len() {
            let power = Heuristic::Power { beta: 3.0 }.weight(i, &p);
            assert!((custom.weight(i, &p) - power).abs() < 1e-15);
        }
        assert_eq!(custom.to_string(), "cube");
    }

    #[test]
    fn logarithms_reach_beyond_the_range_of_f64() {
        let w = Heuristic::Balance.weight_ln(0, &[Some(-5000.0), Some(-5000.0 + 2f64.ln()), None]);
        assert!((w - 1.0 / 3.0).abs() < 1e-10);
    }
}
