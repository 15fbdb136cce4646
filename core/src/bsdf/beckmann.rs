//! Slopes of a Beckmann surface of unit roughness as seen from a direction.

/// Inverse error function, relative error 2·10⁻⁷ up to |erf⁻¹| = 3.5 and 10⁻⁵ up to 4, beyond which
/// no random number of 24 bits leads (Giles 2012, "Approximating the erfinv
/// Function", GPU Computing Gems, table 10.4).
#[inline]
pub(super) fn erf_inverse(x: f64) -> f64 {
    let w = -((1.0 - x) * (1.0 + x)).ln();
    let polynomial = |coefficients: [f64; 9], t: f64| {
        coefficients.iter().skip(1).fold(coefficients[0], |sum, c| sum * t + c)
    };
    let p = if w < 5.0 {
        let c = [
            2.81022636e-8,
            3.43273939e-7,
            -3.5233877e-6,
            -4.39150654e-6,
            2.1858087e-4,
            -1.25372503e-3,
            -4.17768164e-3,
            0.246640727,
            1.50140941,
        ];
        polynomial(c, w - 2.5)
    } else {
        let c = [
            -2.00214257e-4,
            1.00950558e-4,
            1.34934322e-3,
            -3.67342844e-3,
            5.73950773e-3,
            -7.6224613e-3,
            9.43887047e-3,
            1.00167406,
            2.83297682,
        ];
        polynomial(c, w.sqrt() - 3.0)
    };
    p * x
}

/// Half a step of the random numbers' grid: keeps `u` off 0, where a slope would be infinite.
const HALF_STEP: f64 = 1.0 / (1 << 25) as f64;

/// Slope across the direction: density exp(−y²)/√π.
#[inline]
pub(super) fn gaussian_slope(u: f32) -> f32 {
    erf_inverse((2.0 * f64::from(u) - 1.0).max(2.0 * HALF_STEP - 1.0)) as f32
}

/// Inverse of [`gaussian_slope`].
pub(super) fn gaussian_slope_inverse(y: f64) -> f32 {
    (0.5 * (1.0 + libm::erf(y))) as f32
}

/// Inverse of [`visible_slope`]: H(erf x)/H(erf(c/s)).
pub(super) fn visible_slope_inverse(c: f64, s: f64, x: f64) -> f32 {
    let k = s * 0.25 * std::f64::consts::FRAC_2_SQRT_PI;
    let h = |x: f64| 0.5 * c * (1.0 + libm::erf(x)) + k * (-x * x).exp();
    (h(x) / h(c / s)) as f32
}

/// Slope x along a direction with cosine `c` and sine `s` (any common scale): density
/// ∝ max(0, c − x s) exp(−x²), the marginal of the visible slopes (Heitz and d'Eon 2014, §4;
/// inverted numerically in b = erf(x) as in Jakob 2014, "An Improved Visible Normal Sampling
/// Routine for the Beckmann Distribution").
///
/// The cumulative function H(b) = ½c(1 + b) + s e^{−x²}/(2√π) has the derivative ½(c − x s) ≥ 0,
/// so that Newton's method inside a bracket meets any accuracy in a few steps.
#[inline]
pub(super) fn visible_slope(c: f32, s: f32, u: f32) -> f32 {
    let (c, s) = (f64::from(c), f64::from(s));
    let k = s * 0.25 * std::f64::consts::FRAC_2_SQRT_PI;
    let u = f64::from(u).max(HALF_STEP);
    // No slope is steeper than the direction: x < c/s.
    let cot = c / s;
    let (top, tail) = if cot < 6.0 { (libm::erf(cot), k * (-cot * cot).exp()) } else { (1.0, 0.0) };
    let all = 0.5 * c * (1.0 + top) + tail;
    let target = u * all;
    // Between the solutions for normal and for grazing incidence: three steps on average.
    let normal = (1.0 + top) * u - 1.0;
    let grazing = top - (1.0 + top) * f64::from(libm::erff((-u.ln()).sqrt() as f32));
    let mut b = normal + s / (c * c + s * s).sqrt() * (grazing - normal);
    let (mut low, mut high) = (-1.0, top);
    let mut x = 0.0;
    for _ in 0..24 {
        x = erf_inverse(b.clamp(-1.0 + 1e-15, 1.0 - 1e-15));
        let error = 0.5 * c * (1.0 + b) + k * (-x * x).exp() - target;
        // Relative to the probability beyond x, so that the tails are as exact as the middle.
        if error.abs() <= 1e-6 * all * u.min(1.0 - u) {
            break;
        }
        if error > 0.0 {
            high = b;
        } else {
            low = b;
        }
        let newton = b - error / (0.5 * (c - x * s));
        b = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
    }
    x as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn erf_inverse_inverts_erf() {
        for i in -600..=600 {
            let x = f64::from(i) / 150.0;
            let y = erf_inverse(libm::erf(x));
            let tolerance = if x.abs() <= 3.5 { 2e-7 } else { 1e-5 };
            assert!((y - x).abs() <= tolerance * x.abs(), "{x}: {y}");
        }
    }

    #[test]
    fn visible_slopes_invert_their_cumulative_function() {
        // H by the trapezoid rule in f64, independent of erf.
        for degrees in [0.0_f64, 10.0, 45.0, 80.0, 89.0, 89.99] {
            let (s, c) = degrees.to_radians().sin_cos();
            let density = |x: f64| (c - x * s).max(0.0) * (-x * x).exp();
            let integral = |to: f64| {
                let n = 20_000;
                let h = (to + 7.0) / f64::from(n);
                let ends = 0.5 * (density(-7.0) + density(to));
                h * (1..n).fold(ends, |sum, i| sum + density(-7.0 + h * f64::from(i)))
            };
            let all = integral((c / s).min(7.0));
            for u in [0.001_f32, 0.05, 0.3, 0.5, 0.9, 0.999] {
                let x = visible_slope(c as f32, s as f32, u);
                let found = integral(x.into()) / all;
                assert!((found - f64::from(u)).abs() < 2e-6, "{degrees}° u {u}: x {x}, H {found}");
            }
        }
    }

    #[test]
    fn extreme_numbers_give_finite_slopes() {
        let edge = 1.0 - f32::EPSILON / 2.0;
        for u in [0.0, 1e-30, 0.5, edge] {
            assert!(gaussian_slope(u).is_finite());
            for (c, s) in [(1.0, 0.0), (1.0, 1e-20), (1e-6, 1.0), (1e-30, 1e-4), (0.7, 0.7)] {
                let x = visible_slope(c, s, u);
                assert!(x.is_finite(), "c {c} s {s} u {u}");
                assert!(x * s <= c * (1.0 + 1e-5) + 1e-6, "c {c} s {s} u {u}: invisible slope {x}");
            }
        }
    }
}
