//! Lambert's model.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::error::{BsdfError, check_rgb};
use super::{BsdfSample, ScatterPdf, ScatterSide};
use crate::color::Rgb;
use crate::math::warp;
use crate::measure::{Density, SolidAngle};

/// f = ρ/π in front, black behind (Lambert 1760).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    reflectance: Rgb,
}

impl Diffuse {
    /// Takes the value that a texture has at a point, in \[0, 1\].
    #[inline]
    pub(super) fn set_reflectance(&mut self, value: Rgb) {
        self.reflectance = value;
    }

    /// A surface of reflectance ρ.
    ///
    /// # Errors
    /// Where ρ is not in \[0, 1\].
    pub fn new(reflectance: Rgb) -> Result<Self, BsdfError> {
        let valid = |v| (0.0..=1.0).contains(&v);
        check_rgb("diffuse reflectance", reflectance, "values in [0, 1]", valid)?;
        Ok(Diffuse { reflectance })
    }

    /// ρ.
    pub fn reflectance(&self) -> Rgb {
        self.reflectance
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        if wo.z > 0.0 && wi.z > 0.0 { self.reflectance * FRAC_1_PI } else { Rgb::BLACK }
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
        let pdf = self.pdf(wo, wi);
        if pdf.is_zero() {
            return None;
        }
        Some(BsdfSample {
            wi,
            weight: self.reflectance,
            pdf: ScatterPdf::NonSpecular(pdf),
            value: self.eval(wo, wi),
            side: ScatterSide::Reflection,
            eta: 1.0,
        })
    }
}
