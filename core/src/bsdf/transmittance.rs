//! How much light passes a rough boundary between dielectrics, in all directions together.

use std::f64::consts::PI;

use glam::Vec3;

use super::fresnel;
use super::half::refract;
use super::microfacet::Microfacet;
use crate::description::MicrofacetKind;

/// Angles of the table, equal steps of the cosine.
const ANGLES: usize = 64;

/// Nodes of the quadrature along both numbers of a facet.
const NODES: usize = 32;

/// Transmittance T(cos θ) from outside, and the mean reflectance R = 2∫ R(μ) μ dμ for light from
/// inside: tables of 64 cosines as Mitsuba has them, with its separable shadowing.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Transmittance {
    outside: [f32; ANGLES],
    inside: f32,
}

impl Transmittance {
    /// Of a boundary with roughness `alpha` and index n_int/n_ext = `eta`.
    pub fn new(distribution: MicrofacetKind, alpha: f32, eta: f32) -> Self {
        let facets = Microfacet::new(distribution, alpha, alpha, true);
        let nodes = gauss_legendre(NODES);
        let mut outside = [0.0; ANGLES];
        let mut inside = 0.0;
        for (i, t) in outside.iter_mut().enumerate() {
            let mu = (i as f32 / (ANGLES - 1) as f32).max(1e-6);
            let wo = Vec3::new(((1.0 - mu) * (1.0 + mu)).sqrt(), 0.0, mu);
            *t = mean(&facets, &nodes, wo, eta, false) as f32;
            inside += 2.0 * f64::from(mu) * mean(&facets, &nodes, wo, 1.0 / eta, true);
        }
        Transmittance { outside, inside: (inside / ANGLES as f64) as f32 }
    }

    /// T at the cosine `mu` in \[0, 1\], linear between the entries.
    #[inline]
    pub fn at(&self, mu: f32) -> f32 {
        let x = mu.clamp(0.0, 1.0) * (ANGLES - 1) as f32;
        let i = (x as usize).min(ANGLES - 2);
        let t = x - i as f32;
        self.outside[i] * (1.0 - t) + self.outside[i + 1] * t
    }

    /// R.
    #[inline]
    pub fn inside(&self) -> f32 {
        self.inside
    }
}

/// Mean over visible facets of F G₁(ω_i) for reflection, (1 − F) G₁(ω_i) for refraction.
fn mean(facets: &Microfacet, nodes: &[(f64, f64)], wo: Vec3, eta: f32, reflects: bool) -> f64 {
    let mut sum = 0.0;
    for &(u, w_u) in nodes {
        for &(v, w_v) in nodes {
            let m = facets.sample(wo, [u as f32, v as f32]);
            let cos = wo.dot(m);
            let f = fresnel::dielectric(f64::from(cos).clamp(0.0, 1.0), f64::from(eta));
            let (wi, share) = if reflects {
                (2.0 * cos * m - wo, f.reflectance)
            } else {
                let Some(wi) = refract(wo, m, eta) else { continue };
                (-wi, 1.0 - f.reflectance)
            };
            // Seen from the side on which it leaves.
            let sees = if reflects { wi.dot(m) } else { -wi.dot(-m) };
            if wi.z > 0.0 && sees > 0.0 {
                sum += w_u * w_v * share * f64::from(facets.g1_over_cos(wi) * wi.z);
            }
        }
    }
    sum
}

/// Nodes and weights of Gauss and Legendre on \[0, 1\], by Newton's method.
fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let node = |i: usize| {
        let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..8 {
            let (mut p, mut before) = (1.0, 0.0);
            for k in 0..n {
                let k = k as f64;
                (p, before) = (((2.0 * k + 1.0) * x * p - k * before) / (k + 1.0), p);
            }
            slope = n as f64 * (x * p - before) / (x * x - 1.0);
            x -= p / slope;
        }
        (0.5 + 0.5 * x, 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadrature_is_exact_for_polynomials() {
        let nodes = gauss_legendre(8);
        let sum = |k: i32| nodes.iter().map(|(x, w)| w * x.powi(k)).sum::<f64>();
        for k in 0..16 {
            assert!((sum(k) - 1.0 / f64::from(k + 1)).abs() < 1e-13, "x^{k}");
        }
    }

    #[test]
    fn a_nearly_smooth_boundary_passes_what_fresnel_says() {
        let table = Transmittance::new(MicrofacetKind::Ggx, 1e-3, 1.5);
        for i in [20, 40, 63] {
            let mu = i as f32 / 63.0;
            let f = 1.0 - fresnel::dielectric(mu.into(), 1.5).reflectance as f32;
            assert!((table.at(mu) - f).abs() < 2e-3, "{mu}: {} {f}", table.at(mu));
        }
        // The mean internal reflectance of a smooth boundary of index 1.5 is 0.596.
        assert!((table.inside() - 0.596).abs() < 0.01, "{}", table.inside());
    }
}
