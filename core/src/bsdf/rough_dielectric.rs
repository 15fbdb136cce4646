//! Rough boundary between two dielectrics.

use glam::Vec3;

use super::error::{BsdfError, check, check_factor};
use super::half::{Half, refract, upper};
use super::microfacet::{Microfacet, check_alpha};
use super::{BsdfSample, TransportMode, fresnel, lobes};
use crate::color::Rgb;
use crate::description::{MicrofacetKind, Parameter};
use crate::measure::{Density, SolidAngle};
use crate::random::{PrimarySample, coordinate_between};

/// Microfacet reflection and refraction (Walter et al. 2007, eqs. 20 and 21); the normal points to
/// the side of `ext_ior`.
///
/// f_r = F D G/(4 |cos θ_o cos θ_i|), f_t = (1 − F) D G |ω_o·m ω_i·m| / (|cos θ_o cos θ_i| (ω_o·m +
/// η ω_i·m)²) for radiance, with η the index on the side of ω_i over that on the side of ω_o; η²
/// times that for importance. A facet reflects with probability F. Not reciprocal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDielectric {
    /// n_int/n_ext.
    eta: f32,
    microfacet: Microfacet,
    specular_reflectance: Rgb,
    specular_transmittance: Rgb,
}

/// Two refractive indices as their quotient n_int/n_ext.
pub(super) fn check_indices(int_ior: f32, ext_ior: f32) -> Result<f32, BsdfError> {
    let expected = "between 0.0001 and 10000";
    let valid = |v| (1e-4..=1e4).contains(&v);
    check("int_ior", int_ior, expected, valid)?;
    check("ext_ior", ext_ior, expected, valid)?;
    Ok(int_ior / ext_ior)
}

impl RoughDielectric {
    /// A boundary with the indices behind and in front of the normal, and factors on its two lobes.
    ///
    /// # Errors
    /// Where an index is not finite and positive, both are equal, a factor is negative or α not
    /// positive.
    pub fn new(
        distribution: MicrofacetKind,
        alpha: [f32; 2],
        sample_visible: bool,
        [int_ior, ext_ior]: [f32; 2],
        specular_reflectance: Rgb,
        specular_transmittance: Rgb,
    ) -> Result<Self, BsdfError> {
        let eta = check_indices(int_ior, ext_ior)?;
        check("int_ior", int_ior, "different from ext_ior", |v| v != ext_ior)?;
        check_factor("specular_reflectance", specular_reflectance)?;
        check_factor("specular_transmittance", specular_transmittance)?;
        let [u, v] = check_alpha(alpha)?;
        let microfacet = Microfacet::new(distribution, u, v, sample_visible);
        Ok(RoughDielectric { eta, microfacet, specular_reflectance, specular_transmittance })
    }

    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) {
        match parameter {
            Parameter::SpecularReflectance => self.specular_reflectance = value,
            Parameter::SpecularTransmittance => self.specular_transmittance = value,
            other => self.microfacet.set(other, value.r),
        }
    }

    #[inline]
    pub(super) fn is_anisotropic(&self) -> bool {
        self.microfacet.is_anisotropic()
    }

    pub(super) fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Rgb {
        let Some(half) = Half::of(wo, wi, self.eta) else { return Rgb::BLACK };
        let g = self.microfacet.g1_over_cos(upper(wo)) * self.microfacet.g1_over_cos(upper(wi));
        let dg = self.microfacet.d(half.normal) * g;
        if half.reflects {
            return self.specular_reflectance * (0.25 * half.fresnel * dg);
        }
        let compressed = match mode {
            TransportMode::Radiance => 1.0,
            TransportMode::Importance => half.eta * half.eta,
        };
        let dots = (half.dot_o * half.dot_i).abs() * half.refraction();
        self.specular_transmittance * (half.passes * dg * dots * compressed)
    }

    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> Density<SolidAngle> {
        let Some(half) = Half::of(wo, wi, self.eta) else { return Density::ZERO };
        let lobe = if half.reflects { half.fresnel } else { half.passes };
        let facet = self.microfacet.pdf(upper(wo), half.normal, half.dot_o.abs());
        Density::new(f64::from(lobe * facet * half.jacobian()))
    }

    pub(super) fn sample(
        &self,
        wo: Vec3,
        u_lobe: f32,
        u: [f32; 2],
        mode: TransportMode,
    ) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let eta = if wo.z > 0.0 { self.eta } else { 1.0 / self.eta };
        let m = self.microfacet.sample(upper(wo), u);
        let cos = wo.dot(m);
        if cos * wo.z <= 0.0 {
            return None;
        }
        let reflectance = fresnel::dielectric(f64::from(cos.abs()).min(1.0), f64::from(eta));
        let reflects = f64::from(u_lobe) < reflectance.reflectance;
        let wi = match reflects {
            true => (2.0 * cos * m - wo).normalize(),
            false => refract(wo, m, eta)?,
        };
        if (wo.z * wi.z > 0.0) != reflects {
            return None;
        }
        lobes::sampled(wo, wi, self.eval(wo, wi, mode), self.pdf(wo, wi))
    }

    pub(super) fn invert<U: PrimarySample>(
        &self,
        wo: Vec3,
        wi: Vec3,
        free: &mut U,
    ) -> Option<[f32; 3]> {
        let half = Half::of(wo, wi, self.eta)?;
        let f = 1.0 - f64::from(half.passes);
        let (low, high) = if half.reflects { (0.0, f) } else { (f, 1.0) };
        let lobe = coordinate_between(low, high, free.next())?;
        let [u, v] = self.microfacet.invert(upper(wo).as_dvec3().normalize(), half.exact);
        Some([lobe, u, v])
    }
}
