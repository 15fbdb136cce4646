//! What the principled models share (Burley 2012, "Physically-Based Shading at Disney"; 2015,
//! "Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering"), with the meaning
//! that the parameters have in Mitsuba 3.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{DVec3, Vec3};

use crate::color::Rgb;
use crate::random::nearest_coordinate;

/// Luminance of a linear sRGB colour.
#[inline]
pub(super) fn luminance(c: Rgb) -> f32 {
    0.212_671 * c.r + 0.715_160 * c.g + 0.072_169 * c.b
}

/// The colour over its luminance; white where it is black.
#[inline]
pub(super) fn tint(c: Rgb) -> Rgb {
    let l = luminance(c);
    if l > 0.0 { c * (1.0 / l) } else { Rgb::WHITE }
}

#[inline]
fn mix(a: Rgb, b: Rgb, t: f32) -> Rgb {
    a * (1.0 - t) + b * t
}

/// (1 − cos)⁵.
#[inline]
pub(super) fn schlick_weight(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    (m * m) * (m * m) * m
}

/// Schlick's Fresnel term from r0 to 1 for the cosine `cos` on the side of the facet whose index is
/// η⁻¹ of the other, or η of it where `cos` < 0: towards the thinner side the cosine of refraction
/// counts.
#[inline]
pub(super) fn schlick(r0: Rgb, cos: f32, eta: f32) -> Rgb {
    let eta = if cos >= 0.0 { eta } else { 1.0 / eta };
    let weight = if eta > 1.0 {
        schlick_weight(cos.abs())
    } else {
        let cos2 = 1.0 - (1.0 - cos * cos) / (eta * eta);
        schlick_weight(cos2.max(0.0).sqrt())
    };
    mix(r0, Rgb::WHITE, weight)
}

/// ((η − 1)/(η + 1))².
#[inline]
pub(super) fn normal_reflectance(eta: f32) -> f32 {
    let r = (eta - 1.0) / (eta + 1.0);
    r * r
}

/// The reflectance `f` of a dielectric with a share of Schlick's term from `r0`.
#[inline]
pub(super) fn tinted(f: f32, r0: Rgb, cos: f32, eta: f32, share: f32) -> Rgb {
    if share > 0.0 { mix(Rgb::grey(f), schlick(r0, cos, eta), share) } else { Rgb::grey(f) }
}

/// Roughness α along both axes: at least 0.001, the square of `roughness` stretched by √(1 − 0.9
/// anisotropic).
#[inline]
pub(super) fn alphas(roughness: f32, anisotropic: f32) -> [f32; 2] {
    let square = roughness * roughness;
    let aspect = (1.0 - 0.9 * anisotropic).max(0.0).sqrt();
    [(square / aspect).clamp(0.001, 1e4), (square * aspect).max(0.001)]
}

/// Diffuse and retro-reflection over ρ/π, flattened towards a subsurface look; `cos_d` is the
/// cosine between half vector and direction.
#[inline]
pub(super) fn base(roughness: f32, flatness: f32, cos_o: f32, cos_i: f32, cos_d: f32) -> f32 {
    let (fo, fi) = (schlick_weight(cos_o), schlick_weight(cos_i));
    let diffuse = (1.0 - 0.5 * fi) * (1.0 - 0.5 * fo);
    let rr = 2.0 * roughness * cos_d * cos_d;
    let retro = rr * (fo + fi + fo * fi * (rr - 1.0));
    if flatness == 0.0 {
        return diffuse + retro;
    }
    let fss90 = 0.5 * rr;
    let towards = |f: f32| 1.0 + (fss90 - 1.0) * f;
    let fss = towards(fo) * towards(fi);
    let subsurface = 1.25 * (fss * (1.0 / (cos_o + cos_i) - 0.5) + 0.5);
    (diffuse + retro) * (1.0 - flatness) + subsurface * flatness
}

/// Colour of the sheen.
#[inline]
pub(super) fn sheen_colour(base: Rgb, sheen_tint: f32) -> Rgb {
    if sheen_tint > 0.0 { mix(Rgb::WHITE, tint(base), sheen_tint) } else { Rgb::WHITE }
}

/// GTR₁, the long-tailed distribution of the coat (Burley 2012, eq. 4 and appendix B.2).
#[derive(Clone, Copy, Debug)]
pub(super) struct Gtr1 {
    alpha2: f32,
}

impl Gtr1 {
    /// α between 0.1 for a gloss of 0 and 0.001 for 1.
    pub fn of_gloss(gloss: f32) -> Self {
        let alpha = 0.1 + (0.001 - 0.1) * gloss;
        Gtr1 { alpha2: alpha * alpha }
    }

    /// D(m).
    #[inline]
    pub fn d(&self, m: Vec3) -> f32 {
        // 1 + (α² − 1) cos² = sin² + α² cos², without cancellation.
        let spread = m.truncate().length_squared() + self.alpha2 * m.z * m.z;
        (self.alpha2 - 1.0) * FRAC_1_PI / (self.alpha2.ln() * spread)
    }

    /// A normal with density D(m) m.z.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Vec3 {
        let (sin_phi, cos_phi) = (TAU * u[0]).sin_cos();
        let cos2 = (1.0 - self.alpha2.powf(1.0 - u[1])) / (1.0 - self.alpha2);
        let sin = (1.0 - cos2).max(0.0).sqrt();
        Vec3::new(sin * cos_phi, sin * sin_phi, cos2.max(0.0).sqrt())
    }

    pub fn invert(&self, m: DVec3) -> [f32; 2] {
        let turn = m.y.atan2(m.x) / std::f64::consts::TAU;
        let a2 = f64::from(self.alpha2);
        // α²^(1−u) = 1 − (1 − α²) cos².
        let power = m.truncate().length_squared() + a2 * m.z * m.z;
        let u = 1.0 - power.ln() / a2.ln();
        let turn = if turn < 0.0 { turn + 1.0 } else { turn };
        [turn, u].map(nearest_coordinate)
    }
}

/// Smith's G₁ of GGX for the coat.
#[inline]
pub(super) fn coat_g1(w: Vec3) -> f32 {
    const ALPHA2: f32 = 0.0625;
    let cos2 = w.z * w.z;
    2.0 / (1.0 + (1.0 + ALPHA2 * (1.0 - cos2).max(0.0) / cos2).sqrt())
}
