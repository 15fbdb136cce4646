//! Smooth plastic: a diffuse base under a dielectric coat.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::error::{BsdfError, check, check_factor, check_rgb};
use super::{
    BsdfSample, Component, Event, ScatterPdf, ScatterSide, SpecularSample, fresnel, reflect_about_z,
};
use crate::color::Rgb;
use crate::math::warp;
use crate::measure::{Density, Mass, SolidAngle};
use crate::random::coordinate_between;

/// Mirror reflection F(ω_o) at the coat, and what passes it, scatters in the base and comes out
/// again after any number of reflections inside:
///
/// f = (ρ/π) (1 − F(ω_o)) (1 − F(ω_i)) / (η² (1 − ρ' F_int)), ρ' = ρ if `nonlinear` (colours
/// shift), else 1,
///
/// with F_int the mean internal reflectance of the coat (Mitsuba's `plastic`; Shirley et al. 1997).
/// Black behind. One side has a specular and a non-specular component; the first is taken with
/// probability F w / (F w + (1 − F)(1 − w)), w the share of the specular reflectance in the sum of
/// both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plastic {
    eta: f64,
    /// F_int.
    inside: f64,
    nonlinear: bool,
    /// ρ.
    reflectance: Rgb,
    specular_reflectance: Rgb,
    /// ρ/(η² (1 − ρ' F_int)).
    base: Rgb,
    specular_share: f64,
}

impl Plastic {
    /// A coat of index `int_ior` under a medium of index `ext_ior`, over a base of reflectance ρ.
    ///
    /// # Errors
    /// Where an index is not finite and positive, ρ not in \[0, 1\] or the factor not finite or
    /// negative.
    pub fn new(
        int_ior: f32,
        ext_ior: f32,
        diffuse_reflectance: Rgb,
        specular_reflectance: Rgb,
        nonlinear: bool,
    ) -> Result<Self, BsdfError> {
        let expected = "between 0.0001 and 10000";
        let valid = |v| (1e-4..=1e4).contains(&v);
        let int_ior = f64::from(check("int_ior", int_ior, expected, valid)?);
        let ext_ior = f64::from(check("ext_ior", ext_ior, expected, valid)?);
        let unit = |v| (0.0..=1.0).contains(&v);
        check_rgb("diffuse_reflectance", diffuse_reflectance, "values in [0, 1]", unit)?;
        check_factor("specular_reflectance", specular_reflectance)?;
        let eta = int_ior / ext_ior;
        let mut plastic = Plastic {
            eta,
            inside: diffuse_fresnel(1.0 / eta),
            nonlinear,
            reflectance: diffuse_reflectance,
            specular_reflectance,
            base: Rgb::BLACK,
            specular_share: 0.0,
        };
        plastic.update();
        Ok(plastic)
    }

    /// Sets ρ, in \[0, 1\].
    pub(super) fn set_reflectance(&mut self, reflectance: Rgb) {
        self.reflectance = reflectance;
        self.update();
    }

    /// Sets the factor on the mirror reflection.
    pub(super) fn set_factor(&mut self, factor: Rgb) {
        self.specular_reflectance = factor;
        self.update();
    }

    /// What follows from the parameters.
    fn update(&mut self) {
        let (eta, inside, nonlinear) = (self.eta, self.inside, self.nonlinear);
        self.base = self.reflectance.map(|rho| {
            let again = if nonlinear { f64::from(rho) * inside } else { inside };
            (f64::from(rho) / (eta * eta * (1.0 - again))) as f32
        });
        let mean = |c: Rgb| f64::from(c.r + c.g + c.b);
        let (diffuse, specular) = (mean(self.reflectance), mean(self.specular_reflectance));
        self.specular_share = if specular > 0.0 { specular / (diffuse + specular) } else { 0.0 };
    }

    #[inline]
    fn fresnel(&self, cos: f32) -> f64 {
        fresnel::dielectric(f64::from(cos).min(1.0), self.eta).reflectance
    }

    /// Probability to take the specular component.
    #[inline]
    fn specular_mass(&self, reflectance: f64) -> f64 {
        let specular = reflectance * self.specular_share;
        let base = (1.0 - reflectance) * (1.0 - self.specular_share);
        if specular + base > 0.0 { specular / (specular + base) } else { 0.0 }
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Rgb::BLACK;
        }
        let passed = (1.0 - self.fresnel(wo.z)) * (1.0 - self.fresnel(wi.z));
        self.base * (FRAC_1_PI * passed as f32)
    }

    #[inline]
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> Density<SolidAngle> {
        if wo.z <= 0.0 {
            return Density::ZERO;
        }
        let mass = 1.0 - self.specular_mass(self.fresnel(wo.z));
        warp::cosine_hemisphere_pdf(wi.z) * Mass::new(mass)
    }

    pub(super) fn specular(&self, wo: Vec3, component: Component) -> Option<SpecularSample> {
        if wo.z <= 0.0 || component != Component::REFLECTION {
            return None;
        }
        let reflectance = self.fresnel(wo.z);
        let mass = self.specular_mass(reflectance);
        (mass > 0.0).then(|| SpecularSample {
            wi: reflect_about_z(wo),
            value: self.specular_reflectance * reflectance as f32,
            mass: Mass::new(mass),
        })
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let mass = self.specular_mass(self.fresnel(wo.z));
        if f64::from(u_lobe) < mass {
            let sample = self.specular(wo, Component::REFLECTION)?;
            return Some(BsdfSample {
                wi: sample.wi,
                weight: sample.value * (1.0 / mass) as f32,
                pdf: ScatterPdf::Specular(Component::REFLECTION, sample.mass),
                value: sample.value,
                side: ScatterSide::Reflection,
                eta: 1.0,
            });
        }
        let wi = warp::cosine_hemisphere(u);
        let pdf = self.pdf(wo, wi);
        if pdf.is_zero() {
            return None;
        }
        let value = self.eval(wo, wi);
        Some(BsdfSample {
            wi,
            weight: value * (wi.z / pdf.value() as f32),
            pdf: ScatterPdf::NonSpecular(pdf),
            value,
            side: ScatterSide::Reflection,
            eta: 1.0,
        })
    }

    /// A number that makes [`Plastic::sample`] take the component of `event`, by the uniform number
    /// `u`.
    pub(super) fn invert_lobe(&self, wo: Vec3, event: Event, u: f32) -> Option<f32> {
        let mass = self.specular_mass(self.fresnel(wo.z));
        match event {
            Event::Specular(Component::REFLECTION) => coordinate_between(0.0, mass, u),
            Event::Specular(_) => None,
            Event::NonSpecular => coordinate_between(mass, 1.0, u),
        }
    }
}

/// Mean reflectance of a smooth boundary of relative index η for diffuse light: the fits that
/// Mitsuba takes, of Egan and Hilgeman 1973 for η < 1 and d'Eon and Irving 2011 (appendix A) else.
fn diffuse_fresnel(eta: f64) -> f64 {
    let inverse = 1.0 / eta;
    if eta < 1.0 {
        return 0.0636 * inverse + (eta * (eta * -1.4399 + 0.7099) + 0.6681);
    }
    [-1.36881, 4.98554, -7.80989, 6.75335, -3.4793, 0.919317]
        .into_iter()
        .fold(0.0, |sum, c| sum * inverse + c)
}
