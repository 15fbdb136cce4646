//! Distributions of microfacet normals, their shadowing and their sampling.

use std::f32::consts::{FRAC_1_PI, FRAC_2_SQRT_PI, TAU};

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::beckmann;
use super::error::{BsdfError, check};
use crate::description::{MicrofacetKind, Parameter};

/// Smallest roughness; Mitsuba clamps `alpha` to the same value.
pub const MIN_ALPHA: f32 = 1e-4;

/// Largest roughness: beyond it, squares of slopes leave the range of `f32`.
const MAX_ALPHA: f32 = 1e6;
const EXPECTED: &str = "finite and positive, at most 10⁶";

/// Checks the roughness along both axes.
pub(super) fn check_alpha(alpha: [f32; 2]) -> Result<[f32; 2], BsdfError> {
    let valid = |a| a > 0.0 && a <= MAX_ALPHA;
    let u = check("alpha_u", alpha[0], EXPECTED, valid)?;
    let v = check("alpha_v", alpha[1], EXPECTED, valid)?;
    Ok([u, v])
}

/// Anisotropic distribution of microfacet normals over the slopes (x/z, y/z).
///
/// Shadowing is Smith's with separable masking and shadowing, G(ω_o, ω_i) = G₁(ω_o) G₁(ω_i), as in
/// Mitsuba 3. For GGX G₁ is exact. For Beckmann the *value* of the BSDF uses the rational form of
/// Walter et al. 2007 (as Mitsuba does; within 0.32 % of the exact one, so that the albedo of a
/// perfect reflector may exceed 1 by about 0.2 %), while the *density* of visible normals uses the
/// exact form with erf, because the sampled normals follow it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacet {
    kind: MicrofacetKind,
    sample_visible: bool,
    alpha: Vec2,
    inverse_alpha: Vec2,
    /// 1/(π α_u α_v).
    peak: f32,
}

impl Microfacet {
    /// A distribution with roughness `alpha_u` along x and `alpha_v` along y, at least
    /// [`MIN_ALPHA`].
    pub fn new(kind: MicrofacetKind, alpha_u: f32, alpha_v: f32, sample_visible: bool) -> Self {
        let alpha = Vec2::new(alpha_u, alpha_v).max(Vec2::splat(MIN_ALPHA));
        let peak = FRAC_1_PI / (alpha.x * alpha.y);
        Microfacet { kind, sample_visible, alpha, inverse_alpha: alpha.recip(), peak }
    }

    /// Takes a roughness that a texture has at a point; nothing for other parameters.
    pub(super) fn set(&mut self, parameter: Parameter, value: f32) {
        let value = if value.is_finite() { value.min(MAX_ALPHA) } else { MIN_ALPHA };
        let [u, v] = match parameter {
            Parameter::Alpha => [value; 2],
            Parameter::AlphaU => [value, self.alpha.y],
            Parameter::AlphaV => [self.alpha.x, value],
            _ => return,
        };
        *self = Microfacet::new(self.kind, u, v, self.sample_visible);
    }

    /// Density of [`Microfacet::sample`] per solid angle of normals, for `cos` = ω_o·m > 0.
    #[inline]
    pub(super) fn pdf(&self, wo: Vec3, m: Vec3, cos: f32) -> f32 {
        let d = self.d(m);
        if self.sample_visible { d * self.visible_g1_over_cos(wo) * cos } else { d * m.z }
    }

    /// True where [`Microfacet::sample`] draws visible normals.
    #[inline]
    pub fn samples_visible(&self) -> bool {
        self.sample_visible
    }

    /// True where roughness differs along x and y.
    #[inline]
    pub fn is_anisotropic(&self) -> bool {
        self.alpha.x != self.alpha.y
    }

    /// D(m) per steradian for m.z > 0 (Walter et al. 2007, eq. 25 and 33, anisotropic), with
    /// t² = ((m.x/α_u)² + (m.y/α_v)²)/m.z²: exp(−t²)/(π α_u α_v m.z⁴) for Beckmann and
    /// 1/(π α_u α_v m.z⁴ (1+t²)²) for GGX. No term cancels, at any α.
    #[inline]
    pub fn d(&self, m: Vec3) -> f32 {
        let z2 = m.z * m.z;
        let r2 = (m.truncate() * self.inverse_alpha).length_squared();
        match self.kind {
            MicrofacetKind::Beckmann => {
                let t2 = r2 / z2;
                // exp(−t²) underflows beyond; the test also keeps 0/0 out.
                if t2 < 87.0 { (-t2).exp() * self.peak / (z2 * z2) } else { 0.0 }
            }
            MicrofacetKind::Ggx => {
                let q = z2 + r2;
                self.peak / (q * q)
            }
        }
    }

    /// (α_u w.x)² + (α_v w.y)²: squared roughness along `w`, times sin²θ.
    #[inline]
    fn projected_alpha2(&self, w: Vec3) -> f32 {
        (self.alpha * w.truncate()).length_squared()
    }

    /// G₁(w)/cos θ for the value of the BSDF, finite down to grazing angles.
    #[inline]
    pub fn g1_over_cos(&self, w: Vec3) -> f32 {
        let s2 = self.projected_alpha2(w);
        match self.kind {
            MicrofacetKind::Ggx => 2.0 / (w.z + (w.z * w.z + s2).sqrt()),
            MicrofacetKind::Beckmann => {
                let s = s2.sqrt();
                if w.z >= 1.6 * s {
                    return 1.0 / w.z;
                }
                // Walter et al. 2007, eq. 27 and below, with a = w.z/s, both sides times s².
                let (z, z2) = (w.z, w.z * w.z);
                (3.535 * s + 2.181 * z) / (s2 + 2.276 * s * z + 2.577 * z2)
            }
        }
    }

    /// G₁(w)/cos θ = 1/∫ D(m) max(0, w·m) dm, exact, for the density of visible normals.
    #[inline]
    pub fn visible_g1_over_cos(&self, w: Vec3) -> f32 {
        match self.kind {
            MicrofacetKind::Ggx => self.g1_over_cos(w),
            MicrofacetKind::Beckmann => {
                // cos θ (1 + Λ) with Λ of Walter et al. 2007 (a = cos θ/s), no division by cos θ.
                let s = self.projected_alpha2(w).sqrt();
                let a = w.z / s;
                if a > 6.0 {
                    return 1.0 / w.z;
                }
                let upper = 0.5 * (1.0 + libm::erff(a)) * w.z;
                1.0 / (upper + 0.25 * FRAC_2_SQRT_PI * s * (-a * a).exp())
            }
        }
    }

    /// A normal m for the known direction `wo` (wo.z > 0): visible normals with density
    /// D(m) G₁(wo) max(0, wo·m)/cos θ_o, or all normals with density D(m) m.z.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        match (self.sample_visible, self.kind) {
            (true, MicrofacetKind::Ggx) => self.sample_visible_ggx(wo, u),
            (true, MicrofacetKind::Beckmann) => self.sample_visible_beckmann(wo, u),
            (false, kind) => {
                // Radial inversion of P(slope² < r²), stretched: 1 − exp(−r²), r²/(1+r²).
                let r = match kind {
                    MicrofacetKind::Beckmann => (-(-u[0]).ln_1p()).sqrt(),
                    MicrofacetKind::Ggx => (u[0] / (1.0 - u[0])).sqrt(),
                };
                let (sin, cos) = (TAU * u[1]).sin_cos();
                (self.alpha * (r * Vec2::new(cos, sin))).extend(1.0).normalize()
            }
        }
    }

    /// Inverse of [`Microfacet::sample`] for a normal `m` on the side of `wo`.
    pub fn invert(&self, wo: DVec3, m: DVec3) -> [f32; 2] {
        let alpha = self.alpha.as_dvec2();
        if self.sample_visible && self.kind == MicrofacetKind::Ggx {
            let w = (alpha * wo.truncate()).extend(wo.z).normalize();
            let h = (m.truncate() / alpha).extend(m.z).normalize();
            // c = λh − w has length 1 for λ = 2 h·w.
            let h = h * (2.0 * h.dot(w));
            return [(1.0 - h.z / (1.0 + w.z)) as f32, turn(h.truncate() - w.truncate())];
        }
        let slope = m.truncate() / (alpha * m.z);
        if !self.sample_visible {
            let r2 = slope.length_squared();
            let u = match self.kind {
                MicrofacetKind::Beckmann => -(-r2).exp_m1(),
                MicrofacetKind::Ggx => r2 / (1.0 + r2),
            };
            return [u as f32, turn(slope)];
        }
        let stretched = alpha * wo.truncate();
        let s = stretched.length();
        let dir = if s > 0.0 { stretched / s } else { DVec2::X };
        let along = beckmann::visible_slope_inverse(wo.z, s, -slope.dot(dir));
        [along, beckmann::gaussian_slope_inverse(-slope.dot(dir.perp()))]
    }

    /// Visible GGX normals: in the stretched space the reflected direction is uniform on a
    /// spherical cap z > −ω_o.z (Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with
    /// Spherical Caps"). Heights are kept as differences to 1, so that small α lose no digits.
    #[inline]
    fn sample_visible_ggx(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let w = (self.alpha * wo.truncate()).extend(wo.z).normalize();
        let up = 1.0 + w.z;
        let down = (w.x * w.x + w.y * w.y) / up;
        // c uniform on the cap, c.z = 1 − u₀(1 + ω.z), and m ∝ c + ω.
        let sin2 = u[0] * up * ((1.0 - u[0]) * up + down);
        let sin = sin2.max(0.0).sqrt();
        let (s, c) = (TAU * u[1]).sin_cos();
        let h = Vec3::new(sin * c + w.x, sin * s + w.y, (1.0 - u[0]) * up);
        (self.alpha * h.truncate()).extend(h.z).normalize()
    }

    /// Visible Beckmann normals: slopes in the stretched space along and across the direction
    /// (Heitz and d'Eon 2014, "Importance Sampling Microfacet-Based BSDFs using the Distribution
    /// of Visible Normals", algorithm 1).
    #[inline]
    fn sample_visible_beckmann(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let stretched = self.alpha * wo.truncate();
        let s = stretched.length();
        let along = beckmann::visible_slope(wo.z, s, u[0]);
        let across = beckmann::gaussian_slope(u[1]);
        let dir = if s > 0.0 { stretched / s } else { Vec2::X };
        let slope = Vec2::new(dir.x * along - dir.y * across, dir.y * along + dir.x * across);
        (-(self.alpha * slope)).extend(1.0).normalize()
    }
}

/// Azimuth as a fraction of the circle, in \[0, 1).
fn turn(v: DVec2) -> f32 {
    let turn = v.y.atan2(v.x) / std::f64::consts::TAU;
    (if turn < 0.0 { turn + 1.0 } else { turn }) as f32
}
