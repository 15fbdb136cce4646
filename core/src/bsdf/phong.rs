//! Phong's model.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::Vec3;

use super::error::{BsdfError, check, check_rgb};
use super::{BsdfSample, lobes, reflect_about_z};
use crate::color::Rgb;
use crate::description::Parameter;
use crate::math::{Frame, warp};
use crate::measure::{Density, SolidAngle};
use crate::random::{PrimarySample, nearest_coordinate};

/// f = ρ_d/π + ρ_s (n + 2)/(2π) max(0, ω_i·r)ⁿ with r the mirror direction of ω_o (Lafortune and
/// Willems 1994); black behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phong {
    exponent: f32,
    diffuse_reflectance: Rgb,
    specular_reflectance: Rgb,
}

impl Phong {
    /// An exponent n and the reflectances of both parts.
    ///
    /// # Errors
    /// Where n is negative or not finite or a reflectance not in \[0, 1\].
    pub fn new(exponent: f32, diffuse: Rgb, specular: Rgb) -> Result<Self, BsdfError> {
        let unit = |v| (0.0..=1.0).contains(&v);
        check("exponent", exponent, "between 0 and 10⁷", |v| (0.0..=1e7).contains(&v))?;
        check_rgb("diffuse_reflectance", diffuse, "values in [0, 1]", unit)?;
        check_rgb("specular_reflectance", specular, "values in [0, 1]", unit)?;
        Ok(Phong { exponent, diffuse_reflectance: diffuse, specular_reflectance: specular })
    }

    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) {
        match parameter {
            Parameter::Reflectance => self.diffuse_reflectance = value,
            Parameter::SpecularReflectance => self.specular_reflectance = value,
            Parameter::Exponent => self.exponent = value.r.clamp(0.0, 1e7),
            _ => {}
        }
    }

    /// Probabilities of the glossy and the diffuse part.
    #[inline]
    fn shares(&self) -> [f32; 2] {
        let (d, s) = (self.diffuse_reflectance.mean(), self.specular_reflectance.mean());
        if d + s > 0.0 { [s / (d + s), d / (d + s)] } else { [0.0, 1.0] }
    }

    /// cosⁿ of the angle to the mirror direction.
    #[inline]
    fn lobe(&self, wo: Vec3, wi: Vec3) -> f32 {
        // Symmetric to the bit.
        let cos = wo.z * wi.z - (wo.x * wi.x + wo.y * wi.y);
        if cos > 0.0 { cos.min(1.0).powf(self.exponent) } else { 0.0 }
    }

    #[inline]
    fn densities(&self, wo: Vec3, wi: Vec3) -> [f32; 2] {
        let [glossy, diffuse] = self.shares();
        let lobe = (self.exponent + 1.0) / TAU * self.lobe(wo, wi);
        [glossy * lobe, diffuse * wi.z.max(0.0) * FRAC_1_PI]
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Rgb::BLACK;
        }
        let glossy = (self.exponent + 2.0) / TAU * self.lobe(wo, wi);
        self.diffuse_reflectance * FRAC_1_PI + self.specular_reflectance * glossy
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
        let wi = match lobes::pick(&self.shares(), u_lobe).0 {
            0 => {
                // 1 − cos α by the logarithm: narrow lobes keep their digits.
                let less =
                    -((1.0 - u[0]).max(f32::MIN_POSITIVE).ln() / (self.exponent + 1.0)).exp_m1();
                let sin = (less * (2.0 - less)).max(0.0).sqrt();
                let (s, c) = (TAU * u[1]).sin_cos();
                let local = Vec3::new(sin * c, sin * s, 1.0 - less);
                Frame::from_normal(reflect_about_z(wo)).to_world(local).normalize()
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
        let (lobe, number) = lobes::invert(&self.shares(), &self.densities(wo, wi), free)?;
        let [u, v] = match lobe {
            0 => {
                let local = Frame::from_normal(reflect_about_z(wo)).to_local(wi);
                // ln cos α from the sine, which small angles keep.
                let sin2 = local.truncate().length_squared().min(1.0);
                let ln = 0.5 * (-sin2).ln_1p() * (self.exponent + 1.0);
                let turn = local.y.atan2(local.x) / TAU;
                [-ln.exp_m1(), if turn < 0.0 { turn + 1.0 } else { turn }]
            }
            _ => warp::cosine_hemisphere_inverse(wi),
        };
        Some([number, nearest_coordinate(u.into()), nearest_coordinate(v.into())])
    }
}
