//! Rough conductor.

use glam::Vec3;

use super::conductor::ConductorIndex;
use super::error::{BsdfError, check_factor};
use super::microfacet::{Microfacet, check_alpha};
use super::{BsdfSample, ScatterPdf, ScatterSide};
use crate::color::Rgb;
use crate::description::{MicrofacetKind, Parameter};
use crate::measure::{Density, SolidAngle};

/// f = F(ω_o·m) D(m) G(ω_o, ω_i) / (4 cos θ_o cos θ_i) with m half way between ω_o and ω_i
/// (Cook and Torrance 1982; Walter et al. 2007, eq. 20); black behind. Distribution and shadowing:
/// [`Microfacet`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughConductor {
    index: ConductorIndex,
    specular_reflectance: Rgb,
    microfacet: Microfacet,
}

/// What value and density share for one pair of directions in front of the surface.
struct Facet {
    /// m, unit length.
    normal: Vec3,
    /// ω_o·m = ω_i·m.
    cos: f32,
    /// D(m).
    d: f32,
}

impl RoughConductor {
    /// Takes the value that a texture has at a point.
    #[inline]
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) {
        match parameter {
            Parameter::SpecularReflectance => self.specular_reflectance = value,
            other => self.microfacet.set(other, value.r),
        }
    }

    /// A conductor of index η + ik, a factor on its reflection, and roughness α along x and y.
    ///
    /// # Errors
    /// Where a value is not finite, negative, η = k = 0 in a channel, or α is 0 or over 10⁶. An α
    /// below [`super::microfacet::MIN_ALPHA`] counts as that.
    pub fn new(
        distribution: MicrofacetKind,
        alpha: [f32; 2],
        sample_visible: bool,
        eta: Rgb,
        k: Rgb,
        specular_reflectance: Rgb,
    ) -> Result<Self, BsdfError> {
        let index = ConductorIndex::new(eta, k)?;
        check_factor("specular_reflectance", specular_reflectance)?;
        let [u, v] = check_alpha(alpha)?;
        let microfacet = Microfacet::new(distribution, u, v, sample_visible);
        Ok(RoughConductor { index, specular_reflectance, microfacet })
    }

    #[inline]
    fn facet(&self, wo: Vec3, wi: Vec3) -> Option<Facet> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        let sum = wo + wi;
        let length = sum.length();
        if length <= 0.0 {
            return None;
        }
        let normal = sum / length;
        // ‖ω_o + ω_i‖/2 is the cosine to both, symmetric to the bit.
        Some(Facet { normal, cos: 0.5 * length, d: self.microfacet.d(normal) })
    }

    #[inline]
    fn fresnel(&self, facet: &Facet) -> Rgb {
        self.index.reflectance(facet.cos) * self.specular_reflectance
    }

    /// D G / (4 cos θ_o cos θ_i).
    #[inline]
    fn value(&self, wo: Vec3, wi: Vec3, facet: &Facet) -> f32 {
        let g = self.microfacet.g1_over_cos(wo) * self.microfacet.g1_over_cos(wi);
        0.25 * facet.d * g
    }

    /// D G₁(ω_o)/(4 cos θ_o) for visible normals (Heitz 2014, eq. 17 with dω_m/dω_i =
    /// 1/(4 ω_o·m)), D m.z/(4 ω_o·m) for all normals.
    #[inline]
    fn density(&self, wo: Vec3, facet: &Facet) -> f32 {
        if self.microfacet.samples_visible() {
            0.25 * facet.d * self.microfacet.visible_g1_over_cos(wo)
        } else {
            facet.d * facet.normal.z / (4.0 * facet.cos)
        }
    }

    #[inline]
    pub(super) fn is_anisotropic(&self) -> bool {
        self.microfacet.is_anisotropic()
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        match self.facet(wo, wi) {
            Some(facet) => self.fresnel(&facet) * self.value(wo, wi, &facet),
            None => Rgb::BLACK,
        }
    }

    #[inline]
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> Density<SolidAngle> {
        match self.facet(wo, wi) {
            Some(facet) => Density::new(f64::from(self.density(wo, &facet))),
            None => Density::ZERO,
        }
    }

    /// Inverse of [`RoughConductor::sample`] for two directions in front of the surface.
    pub(super) fn invert(&self, wo: Vec3, wi: Vec3) -> [f32; 2] {
        let (wo, wi) = (wo.as_dvec3().normalize(), wi.as_dvec3().normalize());
        self.microfacet.invert(wo, (wo + wi).normalize())
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let m = self.microfacet.sample(wo, u);
        let wi = (2.0 * wo.dot(m) * m - wo).normalize();
        // All from the rounded ω_i, so that eval() and pdf() give the same to the bit.
        let facet = self.facet(wo, wi)?;
        let density = self.density(wo, &facet);
        if density <= 0.0 {
            return None;
        }
        let fresnel = self.fresnel(&facet);
        // f cos θ_i/p with D cancelled: finite where D is huge and where it underflows.
        let g_o = self.microfacet.g1_over_cos(wo);
        let g_i = self.microfacet.g1_over_cos(wi);
        let ratio = if self.microfacet.samples_visible() {
            g_o / self.microfacet.visible_g1_over_cos(wo)
        } else {
            g_o * facet.cos / facet.normal.z
        };
        Some(BsdfSample {
            wi,
            weight: fresnel * (ratio * g_i * wi.z),
            pdf: ScatterPdf::NonSpecular(Density::new(f64::from(density))),
            value: fresnel * (0.25 * facet.d * (g_o * g_i)),
            side: ScatterSide::Reflection,
            eta: 1.0,
        })
    }
}
