//! Small steps of one coordinate.

use pathspace_core::random::PrimarySample;

/// Coordinates are multiples of 2⁻²⁴, as those of a random stream are: a perturbation adds an
/// integer modulo 2²⁴, symmetric to the bit.
pub(super) const BITS: u32 = 24;
/// 2²⁴.
pub(super) const GRID: f64 = (1u32 << BITS) as f64;

/// A symmetric perturbation of a coordinate on the circle [0, 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kernel {
    /// u ± s₂ exp(−ln(s₂/s₁) ξ), sizes between s₁ and s₂ with density ∝ 1/size (Kelemen et al.
    /// 2002, §4).
    Kelemen {
        /// Smallest size.
        s1: f64,
        /// Largest size.
        s2: f64,
    },
    /// u + σ ξ, ξ normal.
    Gaussian {
        /// Standard deviation σ.
        sigma: f64,
    },
}

impl Kernel {
    /// Kelemen's own sizes, 1/1024 and 1/64.
    pub const KELEMEN: Kernel = Kernel::Kelemen { s1: 1.0 / 1024.0, s2: 1.0 / 64.0 };

    /// The kernel with what all perturbations share computed once.
    pub fn prepare(self) -> Perturbation {
        match self {
            Kernel::Kelemen { s1, s2 } => {
                Perturbation::Kelemen { s2, ln_ratio: -(s2 / s1).ln() as f32 }
            }
            Kernel::Gaussian { sigma } => Perturbation::Gaussian { sigma },
        }
    }

    /// Density of the signed perturbation `d`, not wrapped round the circle.
    pub fn density(self, d: f64) -> f64 {
        match self {
            Kernel::Kelemen { s1, s2 } => {
                let size = d.abs();
                let inside = size >= s1 && size <= s2;
                if inside { 0.5 / (size * (s2 / s1).ln()) } else { 0.0 }
            }
            Kernel::Gaussian { sigma } => {
                (-0.5 * (d / sigma).powi(2)).exp() / (sigma * (std::f64::consts::TAU).sqrt())
            }
        }
    }
}

/// A [`Kernel`] ready for use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Perturbation {
    /// [`Kernel::Kelemen`].
    Kelemen {
        /// Largest size.
        s2: f64,
        /// −ln(s₂/s₁).
        ln_ratio: f32,
    },
    /// [`Kernel::Gaussian`].
    Gaussian {
        /// Standard deviation.
        sigma: f64,
    },
}

impl Perturbation {
    /// The coordinate `value`·2⁻²⁴ after `times` perturbations.
    #[inline]
    pub fn apply<U: PrimarySample>(self, value: u32, times: u32, u: &mut U) -> u32 {
        match self {
            Perturbation::Kelemen { s2, ln_ratio } => (0..times).fold(value, |value, _| {
                let (back, xi) = sign_and_rest(u.next());
                shift(value, s2 * (ln_ratio * xi).exp() as f64, back)
            }),
            // n normal steps are one of √n times the size.
            Perturbation::Gaussian { .. } if times == 0 => value,
            Perturbation::Gaussian { sigma } => {
                let radius = (-2.0 * (-(u.next() as f64)).ln_1p()).sqrt();
                let (back, xi) = sign_and_rest(u.next());
                let normal = radius * (std::f64::consts::FRAC_PI_2 * xi as f64).cos();
                shift(value, sigma * (times as f64).sqrt() * normal, back)
            }
        }
    }
}

/// A fair choice and a number in [0, 1) that does not depend on it.
#[inline]
fn sign_and_rest(u: f32) -> (bool, f32) {
    let doubled = 2.0 * u;
    if doubled < 1.0 { (false, doubled) } else { (true, doubled - 1.0) }
}

/// Adds or subtracts the distance `d` ≥ 0 on the circle: the same rounded one either way.
#[inline]
fn shift(value: u32, d: f64, back: bool) -> u32 {
    let steps = (d * GRID + 0.5) as u64 as u32;
    let moved = if back { value.wrapping_sub(steps) } else { value.wrapping_add(steps) };
    // 2²⁴ divides 2³²: wrapping there is wrapping here.
    moved & ((1 << BITS) - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pathspace_core::random::{Address, RandomStream};

    const KERNELS: [Kernel; 2] = [Kernel::KELEMEN, Kernel::Gaussian { sigma: 0.02 }];

    fn steps(kernel: Kernel, times: u32, n: u64) -> Vec<f64> {
        (0..n)
            .map(|item| {
                let mut u = RandomStream::new(Address { seed: 1, step: times.into(), item });
                // From the middle of the circle: no step of these sizes wraps.
                (f64::from(kernel.prepare().apply(1 << 23, times, &mut u)) - f64::from(1 << 23))
                    / GRID
            })
            .collect()
    }

    #[test]
    fn perturbations_follow_their_density() {
        for kernel in KERNELS {
            let n = 200_000;
            let (cells, width) = (64, 0.002);
            let mut counts = vec![0.0; cells];
            for d in steps(kernel, 1, n) {
                let cell = (d / width + cells as f64 / 2.0).floor();
                if cell >= 0.0 && cell < cells as f64 {
                    counts[cell as usize] += 1.0;
                }
            }
            let mut chi2 = 0.0;
            let mut used = 0;
            for (i, count) in counts.iter().enumerate() {
                let lo = (i as f64 - cells as f64 / 2.0) * width;
                let fine = 400;
                let sum: f64 = (0..fine)
                    .map(|k| kernel.density(lo + (k as f64 + 0.5) / fine as f64 * width))
                    .sum();
                let expected = n as f64 * sum * width / fine as f64;
                if expected > 20.0 {
                    chi2 += (count - expected).powi(2) / expected;
                    used += 1;
                }
            }
            // Mean and standard deviation of χ² are df and √(2 df).
            let df = used as f64;
            assert!(used >= 14 && chi2 < df + 6.0 * (2.0 * df).sqrt(), "{kernel:?}: {chi2}, {df}");
        }
    }

    #[test]
    fn pending_steps_add_their_variances() {
        for kernel in KERNELS {
            let variance = |times| {
                let d = steps(kernel, times, 20_000);
                d.iter().map(|d| d * d).sum::<f64>() / d.len() as f64
            };
            let ratio = variance(5) / variance(1);
            assert!((ratio - 5.0).abs() < 0.25, "{kernel:?}: {ratio}");
            assert_eq!(variance(0), 0.0);
        }
    }

    #[test]
    fn opposite_numbers_make_opposite_steps_round_the_circle() {
        for d in [1e-7, 0.3 / GRID, 0.5 / GRID, 0.01, 0.4999] {
            for value in [0, 1, 77, (1 << BITS) - 1] {
                assert_eq!(shift(shift(value, d, false), d, true), value);
            }
        }
        assert_eq!(shift(0, 1.0 / GRID, true), (1 << BITS) - 1);
    }
}
