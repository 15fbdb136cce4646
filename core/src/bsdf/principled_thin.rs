//! The principled model of thin sheets.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::burley::{alphas, base, normal_reflectance, schlick_weight, sheen_colour, tint, tinted};
use super::error::{BsdfError, check, check_rgb, check_units};
use super::microfacet::Microfacet;
use super::{BsdfSample, TransportMode, fresnel, lobes, mirror};
use crate::color::Rgb;
use crate::description::{MicrofacetKind, Parameter, PrincipledThinKind};
use crate::math::warp;
use crate::measure::{Density, SolidAngle};
use crate::random::PrimarySample;

/// Diffuse reflection and transmission with sheen, specular reflection, and specular transmission
/// with a roughness that follows the index (`bsdf::burley`), as Mitsuba's `principledthin`. The
/// same from both sides. Specular transmission asks whether the light lies behind its facet, and
/// not whether the sensor does: it is not reciprocal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipledThin {
    kind: PrincipledThinKind,
    reflecting: Microfacet,
    transmitting: Microfacet,
}

/// Specular reflection, specular transmission, diffuse reflection, diffuse transmission.
const LOBES: usize = 4;

/// A pair of directions turned so that the known one lies in front, and the half vector of both in
/// front.
struct Folded {
    wo: Vec3,
    /// The other one, and its mirror image in front.
    wi: Vec3,
    front: Vec3,
    half: Vec3,
    /// ω_o·h.
    cos: f32,
}

impl PrincipledThin {
    /// A model with checked parameters.
    ///
    /// # Errors
    /// Where a parameter is out of range.
    pub fn new(kind: &PrincipledThinKind) -> Result<Self, BsdfError> {
        let unit = |v: f32| (0.0..=1.0).contains(&v);
        check_rgb("base_color", kind.base_color, "values in [0, 1]", unit)?;
        check_units(&[
            ("roughness", kind.roughness),
            ("anisotropic", kind.anisotropic),
            ("spec_trans", kind.spec_trans),
            ("spec_tint", kind.spec_tint),
            ("sheen_tint", kind.sheen_tint),
            ("flatness", kind.flatness),
        ])?;
        check("diff_trans", kind.diff_trans, "between 0 and 2", |v| (0.0..=2.0).contains(&v))?;
        check("sheen", kind.sheen, "finite and not negative", |v| v >= 0.0)?;
        check("eta", kind.eta, "between 0.0001 and 10000", |v| (1e-4..=1e4).contains(&v))?;
        for rate in kind.rates {
            check("sampling rate", rate, "finite and positive", |v| v > 0.0)?;
        }
        let any = Microfacet::new(MicrofacetKind::Ggx, 1.0, 1.0, true);
        let mut model = PrincipledThin { kind: *kind, reflecting: any, transmitting: any };
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
            Parameter::SpecTrans => k.spec_trans = number,
            Parameter::SpecTint => k.spec_tint = number,
            Parameter::Sheen => k.sheen = number,
            Parameter::SheenTint => k.sheen_tint = number,
            Parameter::Flatness => k.flatness = number,
            Parameter::DiffTrans => k.diff_trans = value.r.clamp(0.0, 2.0),
            Parameter::Eta => k.eta = value.r.clamp(1e-4, 1e4),
            _ => return,
        }
        self.update();
    }

    fn update(&mut self) {
        let k = &self.kind;
        let of = |roughness: f32| {
            let [u, v] = alphas(roughness, k.anisotropic);
            Microfacet::new(MicrofacetKind::Ggx, u, v, true)
        };
        self.reflecting = of(k.roughness);
        // Burley 2015, figure 15.
        self.transmitting = of((0.65 * k.eta - 0.35) * k.roughness);
    }

    #[inline]
    pub(super) fn is_reciprocal(&self) -> bool {
        self.kind.spec_trans == 0.0
    }

    #[inline]
    pub(super) fn is_anisotropic(&self) -> bool {
        self.reflecting.is_anisotropic()
    }

    /// Share of diffuse transmission, 0 to 1.
    #[inline]
    fn through(&self) -> f32 {
        0.5 * self.kind.diff_trans
    }

    /// Probabilities of the lobes.
    #[inline]
    fn shares(&self) -> [f32; LOBES] {
        let k = &self.kind;
        let [reflection, transmission, through, diffuse] = k.rates;
        let shares = [
            0.5 * k.spec_trans * reflection,
            0.5 * k.spec_trans * transmission,
            diffuse * (1.0 - k.spec_trans) * (1.0 - self.through()),
            through * (1.0 - k.spec_trans) * self.through(),
        ];
        let sum: f32 = shares.iter().sum();
        shares.map(|s| s / sum)
    }

    #[inline]
    fn fold(&self, wo: Vec3, wi: Vec3) -> Option<Folded> {
        if wo.z == 0.0 || wi.z == 0.0 {
            return None;
        }
        let (wo, wi) = if wo.z < 0.0 { (-wo, -wi) } else { (wo, wi) };
        let front = mirror(wi, 1.0_f32.copysign(wi.z));
        let sum = wo + front;
        let length = sum.length();
        // Both ends see the facet from the same side.
        (length > 0.0).then(|| Folded { wo, wi, front, half: sum / length, cos: 0.5 * length })
    }

    /// True where the direction towards the light lies behind the facet of specular transmission,
    /// whose half vector is that of mirrored directions.
    #[inline]
    fn passes(p: &Folded, mode: TransportMode) -> bool {
        match mode {
            TransportMode::Radiance => p.wi.dot(p.half) < 0.0,
            // As the other direction sees it.
            TransportMode::Importance => p.wo.dot(mirror(p.half, -1.0)) < 0.0,
        }
    }

    #[inline]
    fn densities(&self, p: &Folded) -> [f32; LOBES] {
        let shares = self.shares();
        let cosine = p.front.z * FRAC_1_PI;
        let jacobian = 0.25 / p.cos;
        if p.wi.z > 0.0 {
            let facet = self.reflecting.pdf(p.wo, p.half, p.cos) * jacobian;
            return [shares[0] * facet, 0.0, shares[2] * cosine, 0.0];
        }
        let facet = self.transmitting.pdf(p.wo, p.half, p.cos) * jacobian;
        [0.0, shares[1] * facet, 0.0, shares[3] * cosine]
    }

    pub(super) fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Rgb {
        let Some(p) = self.fold(wo, wi) else { return Rgb::BLACK };
        let k = &self.kind;
        let (specular, diffuse) = (k.spec_trans, 1.0 - k.spec_trans);
        let cos = f64::from(p.cos).min(1.0);
        let f = fresnel::dielectric(cos, f64::from(k.eta)).reflectance as f32;
        let dg = |facets: &Microfacet| {
            let g = facets.g1_over_cos(p.wo) * facets.g1_over_cos(p.front);
            0.25 * facets.d(p.half) * g
        };
        if p.wi.z < 0.0 {
            let mut value = k.base_color * (diffuse * self.through() * FRAC_1_PI);
            if specular > 0.0 && Self::passes(&p, mode) {
                let facet = specular * (1.0 - f) * dg(&self.transmitting);
                value += k.base_color * facet;
            }
            return value;
        }
        let lobe = base(k.roughness, k.flatness, p.wo.z, p.wi.z, p.cos);
        let kept = diffuse * (1.0 - self.through());
        let mut value = k.base_color * (kept * FRAC_1_PI * lobe);
        if k.sheen > 0.0 {
            let sheen = k.sheen * kept * schlick_weight(p.cos);
            value += sheen_colour(k.base_color, k.sheen_tint) * sheen;
        }
        if specular > 0.0 {
            let r0 = tint(k.base_color) * normal_reflectance(k.eta);
            let fresnel = tinted(f, r0, p.cos, k.eta, k.spec_tint);
            value += fresnel * (specular * dg(&self.reflecting));
        }
        value
    }

    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> Density<SolidAngle> {
        match self.fold(wo, wi) {
            Some(p) => lobes::together(self.densities(&p)),
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
        if wo.z == 0.0 {
            return None;
        }
        let up = if wo.z < 0.0 { -wo } else { wo };
        let turned = |m: Vec3| (2.0 * up.dot(m) * m - up).normalize();
        let (wi, sign) = match lobes::pick(&self.shares(), u_lobe).0 {
            0 => (turned(self.reflecting.sample(up, u)), 1.0),
            1 => (turned(self.transmitting.sample(up, u)), -1.0),
            2 => (warp::cosine_hemisphere(u), 1.0),
            _ => (warp::cosine_hemisphere(u), -1.0),
        };
        if wi.z <= 0.0 {
            return None;
        }
        let wi = mirror(wi, sign);
        let wi = if wo.z < 0.0 { -wi } else { wi };
        lobes::sampled(wo, wi, self.eval(wo, wi, mode), self.pdf(wo, wi))
    }

    pub(super) fn invert<U: PrimarySample>(
        &self,
        wo: Vec3,
        wi: Vec3,
        free: &mut U,
    ) -> Option<[f32; 3]> {
        let p = self.fold(wo, wi)?;
        let (lobe, number) = lobes::invert(&self.shares(), &self.densities(&p), free)?;
        let (o, i) = (p.wo.as_dvec3().normalize(), p.front.as_dvec3().normalize());
        let half = (o + i).normalize();
        let [u, v] = match lobe {
            0 => self.reflecting.invert(o, half),
            1 => self.transmitting.invert(o, half),
            _ => warp::cosine_hemisphere_inverse(p.front),
        };
        Some([number, u, v])
    }
}
