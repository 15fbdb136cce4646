//! Rough diffuse surfaces.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::error::{BsdfError, check, check_rgb};
use super::{BsdfSample, lobes};
use crate::color::Rgb;
use crate::description::Parameter;
use crate::math::warp;
use crate::measure::{Density, SolidAngle};

/// The model of Oren and Nayar 1994 (eq. 30, or in its short form), black behind. σ = α/√2 is the
/// standard deviation of the facets' slopes, as Mitsuba 0.6 takes it for its `roughdiffuse`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDiffuse {
    reflectance: Rgb,
    alpha: f32,
    fast: bool,
}

impl RoughDiffuse {
    /// A surface of reflectance ρ and roughness α.
    ///
    /// # Errors
    /// Where ρ is not in \[0, 1\] or α negative or not finite.
    pub fn new(reflectance: Rgb, alpha: f32, fast: bool) -> Result<Self, BsdfError> {
        check_rgb("reflectance", reflectance, "values in [0, 1]", |v| (0.0..=1.0).contains(&v))?;
        check("alpha", alpha, "finite and not negative", |v| v >= 0.0)?;
        Ok(RoughDiffuse { reflectance, alpha, fast })
    }

    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) {
        match parameter {
            Parameter::Reflectance => self.reflectance = value,
            Parameter::Alpha => self.alpha = value.r.max(0.0),
            _ => {}
        }
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Rgb::BLACK;
        }
        let sigma2 = 0.5 * self.alpha * self.alpha;
        let sin = |w: Vec3| w.truncate().length().min(1.0);
        let (sin_o, sin_i) = (sin(wo), sin(wi));
        let across = wo.truncate().dot(wi.truncate());
        let cos_phi =
            if sin_o * sin_i > 1e-8 { (across / (sin_o * sin_i)).clamp(-1.0, 1.0) } else { 0.0 };
        // α is the larger angle, β the smaller one.
        let (sin_alpha, sin_beta, cos_beta) =
            if wo.z > wi.z { (sin_i, sin_o, wo.z) } else { (sin_o, sin_i, wi.z) };
        let tan_beta = sin_beta / cos_beta;
        let rho = self.reflectance;
        if self.fast {
            let a = 1.0 - 0.5 * sigma2 / (sigma2 + 0.33);
            let b = 0.45 * sigma2 / (sigma2 + 0.09);
            return rho * (FRAC_1_PI * (a + b * cos_phi.max(0.0) * sin_alpha * tan_beta));
        }
        let angle = |z: f32| z.min(1.0).acos();
        let (alpha, beta) = (angle(wo.z.min(wi.z)), angle(wo.z.max(wi.z)));
        let share = sigma2 / (sigma2 + 0.09);
        let both = 4.0 * FRAC_1_PI * FRAC_1_PI * alpha * beta;
        let turn = 2.0 * beta * FRAC_1_PI;
        let c1 = 1.0 - 0.5 * sigma2 / (sigma2 + 0.33);
        let c2 = 0.45 * share * (sin_alpha - if cos_phi >= 0.0 { 0.0 } else { turn.powi(3) });
        let c3 = 0.125 * share * both * both;
        let tan_half = (0.5 * (alpha + beta)).tan();
        let single = c1 + cos_phi * c2 * tan_beta + (1.0 - cos_phi.abs()) * c3 * tan_half;
        let double = 0.17 * sigma2 / (sigma2 + 0.13) * (1.0 - cos_phi * turn * turn);
        (rho * single + rho * rho * double) * FRAC_1_PI
    }

    #[inline]
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> Density<SolidAngle> {
        if wo.z > 0.0 { warp::cosine_hemisphere_pdf(wi.z) } else { Density::ZERO }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let wi = warp::cosine_hemisphere(u);
        lobes::sampled(wo, wi, self.eval(wo, wi), self.pdf(wo, wi))
    }
}
