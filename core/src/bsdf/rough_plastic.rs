//! Rough plastic: a diffuse base under a rough dielectric coat.

use std::f32::consts::FRAC_1_PI;
use std::sync::Arc;

use glam::Vec3;

use super::error::{BsdfError, check_factor, check_rgb};
use super::half::Half;
use super::microfacet::{Microfacet, check_alpha};
use super::rough_dielectric::check_indices;
use super::transmittance::Transmittance;
use super::{BsdfSample, lobes};
use crate::color::Rgb;
use crate::description::{MicrofacetKind, Parameter};
use crate::math::warp;
use crate::measure::{Density, SolidAngle};
use crate::random::PrimarySample;

/// Microfacet reflection at the coat, and what passes it, scatters in the base and comes out again:
///
/// f = F D G/(4 cos θ_o cos θ_i) + (ρ/π) T(ω_o) T(ω_i) / (η² (1 − ρ' R)), ρ' = ρ if `nonlinear`,
/// else 1,
///
/// with T the transmittance of the rough coat from outside and R its mean reflectance from inside
/// (Mitsuba's `roughplastic`). Black behind. The coat is sampled with probability (1 − T) w/((1 −
/// T) w + T (1 − w)), w the share of the specular reflectance.
#[derive(Clone, Debug, PartialEq)]
pub struct RoughPlastic {
    eta: f32,
    nonlinear: bool,
    reflectance: Rgb,
    specular_reflectance: Rgb,
    microfacet: Microfacet,
    coat: Arc<Transmittance>,
    /// ρ/(η² (1 − ρ' R)).
    base: Rgb,
    specular_share: f32,
}

impl RoughPlastic {
    /// A coat of index `indices[0]` and roughness `alpha` under a medium of index `indices[1]`,
    /// over a base of reflectance ρ.
    ///
    /// # Errors
    /// Where an index is not positive, ρ not in \[0, 1\], α not positive or the factor negative.
    pub fn new(
        distribution: MicrofacetKind,
        alpha: f32,
        sample_visible: bool,
        indices: [f32; 2],
        diffuse_reflectance: Rgb,
        specular_reflectance: Rgb,
        nonlinear: bool,
    ) -> Result<Self, BsdfError> {
        let eta = check_indices(indices[0], indices[1])?;
        check_alpha([alpha; 2])?;
        let unit = |v| (0.0..=1.0).contains(&v);
        check_rgb("diffuse_reflectance", diffuse_reflectance, "values in [0, 1]", unit)?;
        check_factor("specular_reflectance", specular_reflectance)?;
        let mut plastic = RoughPlastic {
            eta,
            nonlinear,
            reflectance: diffuse_reflectance,
            specular_reflectance,
            microfacet: Microfacet::new(distribution, alpha, alpha, sample_visible),
            coat: Arc::new(Transmittance::new(distribution, alpha, eta)),
            base: Rgb::BLACK,
            specular_share: 0.0,
        };
        plastic.update();
        Ok(plastic)
    }

    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) {
        match parameter {
            Parameter::Reflectance => self.reflectance = value,
            Parameter::SpecularReflectance => self.specular_reflectance = value,
            _ => return,
        }
        self.update();
    }

    fn update(&mut self) {
        let inside = self.coat.inside();
        self.base = self.reflectance.map(|rho| {
            let again = if self.nonlinear { rho * inside } else { inside };
            rho / (self.eta * self.eta * (1.0 - again))
        });
        let (diffuse, specular) = (self.reflectance.mean(), self.specular_reflectance.mean());
        self.specular_share = if specular > 0.0 { specular / (diffuse + specular) } else { 0.0 };
    }

    /// Probabilities of coat and base.
    #[inline]
    fn shares(&self, wo: Vec3) -> [f32; 2] {
        let t = self.coat.at(wo.z);
        let (coat, base) = ((1.0 - t) * self.specular_share, t * (1.0 - self.specular_share));
        if coat + base > 0.0 { [coat / (coat + base), base / (coat + base)] } else { [0.0, 1.0] }
    }

    /// Densities of both lobes, their probabilities included.
    #[inline]
    fn densities(&self, wo: Vec3, wi: Vec3) -> [f32; 2] {
        let [coat, base] = self.shares(wo);
        let facet = Half::of(wo, wi, self.eta)
            .map_or(0.0, |h| self.microfacet.pdf(wo, h.normal, h.dot_o) * h.jacobian());
        [coat * facet, base * wi.z * FRAC_1_PI]
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Rgb::BLACK;
        }
        let passed = self.coat.at(wo.z) * self.coat.at(wi.z);
        let base = self.base * (FRAC_1_PI * passed);
        let Some(half) = Half::of(wo, wi, self.eta) else { return base };
        let g = self.microfacet.g1_over_cos(wo) * self.microfacet.g1_over_cos(wi);
        let coat = 0.25 * half.fresnel * (self.microfacet.d(half.normal) * g);
        base + self.specular_reflectance * coat
    }

    #[inline]
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> Density<SolidAngle> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Density::ZERO;
        }
        lobes::together(self.densities(wo, wi))
    }

    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let wi = match lobes::pick(&self.shares(wo), u_lobe).0 {
            0 => {
                let m = self.microfacet.sample(wo, u);
                (2.0 * wo.dot(m) * m - wo).normalize()
            }
            _ => warp::cosine_hemisphere(u),
        };
        lobes::sampled(wo, wi, self.eval(wo, wi), self.pdf(wo, wi))
    }

    pub(super) fn invert<U: PrimarySample>(
        &self,
        wo: Vec3,
        wi: Vec3,
        free: &mut U,
    ) -> Option<[f32; 3]> {
        let (lobe, number) = lobes::invert(&self.shares(wo), &self.densities(wo, wi), free)?;
        let [u, v] = match lobe {
            0 => {
                let half = Half::of(wo, wi, self.eta)?;
                self.microfacet.invert(wo.as_dvec3().normalize(), half.exact)
            }
            _ => warp::cosine_hemisphere_inverse(wi),
        };
        Some([number, u, v])
    }
}
