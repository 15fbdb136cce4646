//! Fresnel's equations for unpolarised light.

use crate::color::Rgb;

/// Reflectance and the cosine of refraction at a smooth boundary between dielectrics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DielectricFresnel {
    /// Reflectance F in \[0, 1\]; 1 in total internal reflection.
    pub reflectance: f64,
    /// |cos θ_t| of the refracted direction; 0 in total internal reflection.
    pub cos_t: f64,
}

/// F = ½(r_s² + r_p²) with r_s = (cos θ_i − η cos θ_t)/(cos θ_i + η cos θ_t) and
/// r_p = (cos θ_t − η cos θ_i)/(cos θ_t + η cos θ_i) for `cos_i` = |cos θ_i| and η = n_t/n_i
/// (Born and Wolf, Principles of Optics, §1.5.2).
///
/// cos²θ_t = (cos²θ_i + (η−1)(η+1))/η² has no cancellation of its own at the critical angle; the
/// few operations run in `f64` because R and T split one unit of energy there.
#[inline]
pub fn dielectric(cos_i: f64, eta: f64) -> DielectricFresnel {
    let cos2_t = (cos_i * cos_i + (eta - 1.0) * (eta + 1.0)) / (eta * eta);
    if cos2_t <= 0.0 || cos_i <= 0.0 {
        return DielectricFresnel { reflectance: 1.0, cos_t: 0.0 };
    }
    let cos_t = cos2_t.sqrt();
    let rs = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let rp = (cos_t - eta * cos_i) / (cos_t + eta * cos_i);
    DielectricFresnel { reflectance: 0.5 * (rs * rs + rp * rp), cos_t }
}

/// Reflectance of a conductor with the complex index η + ik relative to the outside, per channel
/// (Born and Wolf, §14.2), for `cos_i` in \[0, 1\].
#[inline]
pub fn conductor(cos_i: f32, eta: Rgb, k: Rgb) -> Rgb {
    Rgb::new(
        conductor_channel(cos_i, eta.r, k.r),
        conductor_channel(cos_i, eta.g, k.g),
        conductor_channel(cos_i, eta.b, k.b),
    )
}

/// With (a + ib)² = (η + ik)² − sin²θ and q = a² + b²:
/// R_s = (q − 2a cos θ + cos²θ)/(q + 2a cos θ + cos²θ),
/// R_p = R_s (q cos²θ − 2a cos θ sin²θ + sin⁴θ)/(q cos²θ + 2a cos θ sin²θ + sin⁴θ).
#[inline]
fn conductor_channel(cos_i: f32, eta: f32, k: f32) -> f32 {
    let cos2 = cos_i * cos_i;
    let sin2 = (1.0 - cos_i) * (1.0 + cos_i);
    let (eta2, k2) = (eta * eta, k * k);
    let t = eta2 - k2 - sin2;
    let q = (t * t + 4.0 * eta2 * k2).sqrt();
    // a² = (q + t)/2 cancels for t < 0, where a²b² = η²k² and b² = (q − t)/2 serve instead.
    let a = if t >= 0.0 { 0.5 * (q + t) } else { 2.0 * eta2 * k2 / (q - t) }.sqrt();
    let m = 2.0 * a * cos_i;
    let (s, p, ms) = (q + cos2, cos2 * q + sin2 * sin2, m * sin2);
    // ½(R_s + R_p) with R_p/R_s = (p − ms)/(p + ms).
    (s - m) * p / ((s + m) * (p + ms))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// |r|² of both polarisations from complex amplitudes: the textbook form with complex cos θ_t.
    fn complex_reference(cos_i: f64, eta: f64, k: f64) -> f64 {
        type C = (f64, f64);
        let mul = |a: C, b: C| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
        let sub = |a: C, b: C| (a.0 - b.0, a.1 - b.1);
        let add = |a: C, b: C| (a.0 + b.0, a.1 + b.1);
        let norm2 = |a: C| a.0 * a.0 + a.1 * a.1;
        let sqrt = |a: C| {
            let r = norm2(a).sqrt();
            let s = ((r + a.0) / 2.0).sqrt();
            (s, ((r - a.0) / 2.0).sqrt().copysign(a.1))
        };
        let n = (eta, k);
        let c: C = (cos_i, 0.0);
        // n cos θ_t = √(n² − sin²θ_i)
        let nct = sqrt(sub(mul(n, n), (1.0 - cos_i * cos_i, 0.0)));
        let rs = norm2(sub(c, nct)) / norm2(add(c, nct));
        let n2c = mul(mul(n, n), c);
        let rp = norm2(sub(n2c, nct)) / norm2(add(n2c, nct));
        0.5 * (rs + rp)
    }

    /// Transmittance T = (η cos θ_t/cos θ_i)·½(t_s² + t_p²) from the transmitted amplitudes.
    fn transmittance_reference(cos_i: f64, eta: f64) -> f64 {
        let sin_t = (1.0 - cos_i * cos_i).max(0.0).sqrt() / eta;
        if sin_t >= 1.0 {
            return 0.0;
        }
        let cos_t = ((1.0 - sin_t) * (1.0 + sin_t)).sqrt();
        let ts = 2.0 * cos_i / (cos_i + eta * cos_t);
        let tp = 2.0 * cos_i / (cos_t + eta * cos_i);
        eta * cos_t / cos_i * 0.5 * (ts * ts + tp * tp)
    }

    #[test]
    fn dielectric_reflection_and_transmission_sum_to_one() {
        for eta in [1.5, 1.0 / 1.5, 1.33, 2.4, 1.0 / 2.4, 1.0001, 0.9999] {
            for i in 1..=2000 {
                let c = f64::from(i) / 2000.0;
                let r = dielectric(c, eta).reflectance;
                let t = transmittance_reference(c, eta);
                assert!((r + t - 1.0).abs() < 1e-6, "η {eta} cos {c}: {r} + {t}");
            }
        }
    }

    #[test]
    fn critical_angle_is_exact() {
        for eta in [1.0 / 1.5_f64, 1.0 / 1.33, 1.0 / 2.4] {
            let critical = ((1.0 - eta) * (1.0 + eta)).sqrt();
            for d in [-1e-7, -1e-9, 0.0, 1e-9, 1e-7] {
                let c = critical + d;
                let f = dielectric(c, eta);
                assert!((0.0..=1.0).contains(&f.reflectance), "{f:?}");
                let t = transmittance_reference(c, eta);
                assert!((f.reflectance + t - 1.0).abs() < 1e-6, "η {eta} d {d}: {f:?} T {t}");
                if d < 0.0 {
                    assert_eq!(f, DielectricFresnel { reflectance: 1.0, cos_t: 0.0 });
                }
                if d > 0.0 {
                    assert!(f.reflectance < 1.0 && f.cos_t > 0.0, "{f:?}");
                }
            }
        }
    }

    #[test]
    fn matched_indices_reflect_nothing() {
        for c in [1e-30, 1e-6, 0.3, 1.0] {
            assert_eq!(dielectric(c, 1.0), DielectricFresnel { reflectance: 0.0, cos_t: c });
        }
    }

    #[test]
    fn dielectric_limits() {
        assert!((dielectric(1.0, 1.5).reflectance - 0.04).abs() < 1e-15);
        assert_eq!(dielectric(0.0, 1.5).reflectance, 1.0);
        assert_eq!(dielectric(0.0, 1.0).reflectance, 1.0);
        assert!(dielectric(1e-9, 1.5).reflectance > 1.0 - 1e-7);
    }

    #[test]
    fn dielectric_is_symmetric_across_the_boundary() {
        for i in 1..=100 {
            let c = f64::from(i) / 100.0;
            let out = dielectric(c, 1.5);
            let back = dielectric(out.cos_t, 1.0 / 1.5);
            assert!((out.reflectance - back.reflectance).abs() < 1e-12);
            assert!((back.cos_t - c).abs() < 1e-12);
        }
    }

    #[test]
    fn conductor_agrees_with_complex_amplitudes() {
        let indices =
            [(0.2004, 3.9129), (0.143, 4.5), (2.7, 3.0), (1.5, 0.0), (0.05, 8.0), (1.2, 7.3)];
        for (eta, k) in indices {
            for i in 0..=1000 {
                let c = i as f32 / 1000.0;
                let r = conductor_channel(c, eta, k);
                let exact = complex_reference(c.into(), eta.into(), k.into());
                assert!((f64::from(r) - exact).abs() < 2e-6, "{eta}+{k}i cos {c}: {r} {exact}");
                assert!((0.0..=1.0).contains(&r));
            }
        }
    }

    #[test]
    fn imaginary_index_is_a_perfect_mirror() {
        for i in 0..=100 {
            let c = i as f32 / 100.0;
            assert_eq!(conductor(c, Rgb::BLACK, Rgb::WHITE), Rgb::WHITE);
        }
    }
}
