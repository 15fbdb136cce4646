//! The principled model.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::burley::{
    Gtr1, alphas, base, coat_g1, normal_reflectance, schlick, schlick_weight, sheen_colour, tint,
};
use super::error::{BsdfError, check, check_rgb, check_units};
use super::half::{Half, refract, upper};
use super::microfacet::Microfacet;
use super::{BsdfSample, TransportMode, fresnel, lobes};
use crate::color::Rgb;
use crate::description::{MicrofacetKind, Parameter, PrincipledKind};
use crate::math::warp;
use crate::measure::{Density, SolidAngle};
use crate::random::PrimarySample;

/// A diffuse base with sheen, a metallic or dielectric specular lobe, refraction and a clear coat
/// (`bsdf::burley`), as Mitsuba's `principled`. What is behind the normal lies within the
/// material: there only specular reflection and refraction are left. Not reciprocal where it
/// refracts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Principled {
    kind: PrincipledKind,
    facets: Microfacet,
}

/// Diffuse, coat, refraction, specular reflection.
const LOBES: usize = 4;

impl Principled {
    /// A model with checked parameters.
    ///
    /// # Errors
    /// Where a parameter is out of range.
    pub fn new(kind: &PrincipledKind) -> Result<Self, BsdfError> {
        let unit = |v: f32| (0.0..=1.0).contains(&v);
        check_rgb("base_color", kind.base_color, "values in [0, 1]", unit)?;
        check_units(&[
            ("roughness", kind.roughness),
            ("anisotropic", kind.anisotropic),
            ("metallic", kind.metallic),
            ("spec_trans", kind.spec_trans),
            ("spec_tint", kind.spec_tint),
            ("sheen_tint", kind.sheen_tint),
            ("flatness", kind.flatness),
            ("clearcoat", kind.clearcoat),
            ("clearcoat_gloss", kind.clearcoat_gloss),
        ])?;
        check("sheen", kind.sheen, "finite and not negative", |v| v >= 0.0)?;
        check("eta", kind.eta, "between 0.0001 and 10000", |v| (1e-4..=1e4).contains(&v))?;
        for rate in kind.rates {
            check("sampling rate", rate, "finite and positive", |v| v > 0.0)?;
        }
        let mut model = Principled {
            kind: *kind,
            facets: Microfacet::new(MicrofacetKind::Ggx, 1.0, 1.0, true),
        };
        model.update();
        Ok(model)
    }

    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) {
        let number = value.r.clamp(0.0, 1.0);
        let k = &mut self.kind;
        match parameter {
            Parameter::Reflectance => k.base_color = value,
            Parameter::Roughness => k.roughness = number,
            Parameter::Anisotropic => k.anisotropic = number,
            Parameter::Metallic => k.metallic = number,
            Parameter::SpecTrans => k.spec_trans = number,
            Parameter::SpecTint => k.spec_tint = number,
            Parameter::Sheen => k.sheen = number,
            Parameter::SheenTint => k.sheen_tint = number,
            Parameter::Flatness => k.flatness = number,
            Parameter::Clearcoat => k.clearcoat = number,
            Parameter::ClearcoatGloss => k.clearcoat_gloss = number,
            _ => return,
        }
        self.update();
    }

    fn update(&mut self) {
        let [u, v] = alphas(self.kind.roughness, self.kind.anisotropic);
        self.facets = Microfacet::new(MicrofacetKind::Ggx, u, v, true);
    }

    #[inline]
    pub(super) fn is_anisotropic(&self) -> bool {
        self.facets.is_anisotropic()
    }

    /// True where light passes.
    #[inline]
    pub(super) fn transmits(&self) -> bool {
        self.refracts() > 0.0
    }

    /// Weight of refraction.
    #[inline]
    fn refracts(&self) -> f32 {
        (1.0 - self.kind.metallic) * self.kind.spec_trans
    }

    /// Weight of the base.
    #[inline]
    fn base_weight(&self) -> f32 {
        (1.0 - self.kind.metallic) * (1.0 - self.kind.spec_trans)
    }

    /// Probabilities of the lobes where facets let `passes` = 1 − F through.
    #[inline]
    fn shares(&self, wo: Vec3, passes: f32) -> [f32; LOBES] {
        if wo.z <= 0.0 {
            return [0.0, 0.0, passes, 1.0 - passes];
        }
        let [specular, coat, diffuse] = self.kind.rates;
        let passes = self.refracts() * passes;
        let shares = [
            self.base_weight() * diffuse,
            0.25 * self.kind.clearcoat * coat,
            specular * passes,
            specular * (1.0 - passes),
        ];
        let sum: f32 = shares.iter().sum();
        shares.map(|s| s / sum)
    }

    #[inline]
    fn densities(&self, wo: Vec3, wi: Vec3, half: &Half) -> [f32; LOBES] {
        let shares = self.shares(wo, half.passes);
        let facet = self.facets.pdf(upper(wo), half.normal, half.dot_o.abs()) * half.jacobian();
        if !half.reflects {
            return [0.0, 0.0, shares[2] * facet, 0.0];
        }
        let coat = if shares[1] > 0.0 {
            let distribution = Gtr1::of_gloss(self.kind.clearcoat_gloss);
            distribution.d(half.normal) * half.normal.z * half.jacobian()
        } else {
            0.0
        };
        [shares[0] * wi.z.abs() * FRAC_1_PI, shares[1] * coat, 0.0, shares[3] * facet]
    }

    /// Fresnel term of specular reflection.
    #[inline]
    fn specular_fresnel(&self, wo: Vec3, half: &Half) -> Rgb {
        let k = &self.kind;
        if wo.z <= 0.0 {
            return Rgb::grey(self.refracts() * half.fresnel);
        }
        let cos = half.dot_o;
        let mut f = Rgb::grey((1.0 - k.metallic) * (1.0 - k.spec_tint) * half.fresnel);
        if k.metallic > 0.0 {
            f += schlick(k.base_color, cos, k.eta) * k.metallic;
        }
        if k.spec_tint > 0.0 {
            let r0 = tint(k.base_color) * normal_reflectance(k.eta);
            f += schlick(r0, cos, k.eta) * ((1.0 - k.metallic) * k.spec_tint);
        }
        f
    }

    pub(super) fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Rgb {
        let k = &self.kind;
        let Some(half) = Half::of(wo, wi, k.eta) else { return Rgb::BLACK };
        let passes = self.refracts();
        if wo.z < 0.0 && passes <= 0.0 {
            return Rgb::BLACK;
        }
        let dg = self.facets.d(half.normal)
            * (self.facets.g1_over_cos(upper(wo)) * self.facets.g1_over_cos(upper(wi)));
        if !half.reflects {
            let compressed = match mode {
                TransportMode::Radiance => 1.0,
                TransportMode::Importance => half.eta * half.eta,
            };
            let dots = (half.dot_o * half.dot_i).abs() * half.refraction();
            let factor = passes * half.passes * dg * dots * compressed;
            return k.base_color.map(f32::sqrt) * factor;
        }
        let mut f = self.specular_fresnel(wo, &half) * (0.25 * dg);
        if wo.z < 0.0 {
            return f;
        }
        if k.clearcoat > 0.0 {
            let d = Gtr1::of_gloss(k.clearcoat_gloss).d(half.normal);
            let coat = schlick(Rgb::grey(0.04), half.dot_o, k.eta).r;
            f += Rgb::grey(0.25 * k.clearcoat * coat * d * (coat_g1(wo) * coat_g1(wi)));
        }
        let weight = self.base_weight();
        if weight > 0.0 {
            let lobe = base(k.roughness, k.flatness, wo.z, wi.z, half.dot_i);
            f += k.base_color * (weight * FRAC_1_PI * lobe);
            if k.sheen > 0.0 {
                let sheen = k.sheen * (1.0 - k.metallic) * schlick_weight(half.dot_i);
                f += sheen_colour(k.base_color, k.sheen_tint) * sheen;
            }
        }
        f
    }

    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> Density<SolidAngle> {
        if wo.z < 0.0 && !self.transmits() {
            return Density::ZERO;
        }
        match Half::of(wo, wi, self.kind.eta) {
            Some(half) => lobes::together(self.densities(wo, wi, &half)),
            None => Density::ZERO,
        }
    }

    pub(super) fn sample(
        &self,
        wo: Vec3,
        u_lobe: f32,
        u: [f32; 2],
        mode: TransportMode,
    ) -> Option<BsdfSample> {
        if wo.z == 0.0 || (wo.z < 0.0 && !self.transmits()) {
            return None;
        }
        let eta = if wo.z > 0.0 { self.kind.eta } else { 1.0 / self.kind.eta };
        let mirror = |m: Vec3| (2.0 * wo.dot(m) * m - wo).normalize();
        let m = self.facets.sample(upper(wo), u);
        let cos = f64::from(wo.dot(m).abs()).min(1.0);
        let f = fresnel::dielectric(cos, f64::from(eta)).reflectance;
        let lobe = lobes::pick(&self.shares(wo, (1.0 - f) as f32), u_lobe).0;
        let wi = match lobe {
            0 => warp::cosine_hemisphere(u),
            1 => mirror(Gtr1::of_gloss(self.kind.clearcoat_gloss).sample(u)),
            2 => refract(wo, m, eta)?,
            _ => mirror(m),
        };
        if (wo.z * wi.z > 0.0) != (lobe != 2) {
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
        if wo.z < 0.0 && !self.transmits() {
            return None;
        }
        let half = Half::of(wo, wi, self.kind.eta)?;
        // The lobes of facets take their share at the facet that the numbers lead to.
        let shares = self.shares(wo, half.passes);
        let densities = self.densities(wo, wi, &half);
        let (lobe, number) = lobes::invert(&shares, &densities, free)?;
        let [u, v] = match lobe {
            0 => warp::cosine_hemisphere_inverse(wi),
            1 => Gtr1::of_gloss(self.kind.clearcoat_gloss).invert(half.exact),
            _ => self.facets.invert(upper(wo).as_dvec3().normalize(), half.exact),
        };
        Some([number, u, v])
    }

    /// True where the model scatters on the side of `w`.
    #[inline]
    pub(super) fn faces(&self, w: Vec3) -> bool {
        w.z > 0.0 || self.transmits()
    }
}
