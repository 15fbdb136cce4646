//! Half vectors of reflection and refraction, and how their densities become those of directions.

use glam::{DVec3, Vec3};

use super::fresnel;

/// What a pair of directions says of the microfacet that takes one to the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Half {
    /// Unit normal m of the facet, on the side of the surface's normal.
    pub normal: Vec3,
    /// The same with all digits, for inverses.
    pub exact: DVec3,
    /// True where both directions lie on one side.
    pub reflects: bool,
    /// Index on the side of `wi` over the index on the side of `wo` for refraction: of the other
    /// side over that of `wo`.
    pub eta: f32,
    /// ω_o·m, with the sign of ω_o.z.
    pub dot_o: f32,
    /// ω_i·m, with the sign of ω_i.z.
    pub dot_i: f32,
    /// Fresnel reflectance of a dielectric of index `eta` at the facet.
    pub fresnel: f32,
    /// 1 − F with its digits.
    pub passes: f32,
}

impl Half {
    /// m ∝ ω_o + ω_i for reflection, ω_o + η ω_i for refraction (Walter et al. 2007, eqs. 13 and
    /// 16). `eta` is the index behind over the index in front. `None` in the tangent plane and
    /// where a direction sees the facet from its other side.
    #[inline]
    pub fn of(wo: Vec3, wi: Vec3, eta: f32) -> Option<Half> {
        let side = wo.z * wi.z;
        if side == 0.0 {
            return None;
        }
        let reflects = side > 0.0;
        let eta = if wo.z > 0.0 { eta } else { 1.0 / eta };
        let (o, i) = (wo.as_dvec3(), wi.as_dvec3());
        let sum = if reflects { o + i } else { o + i * f64::from(eta) };
        let length = sum.length();
        if length <= 0.0 {
            return None;
        }
        let exact = sum * (1.0 / length).copysign(sum.z);
        let (dot_o, dot_i) = (o.dot(exact), i.dot(exact));
        if dot_o * o.z <= 0.0 || dot_i * i.z <= 0.0 {
            return None;
        }
        let (cos_o, n) = (dot_o.abs().min(1.0), f64::from(eta));
        let fresnel = if reflects {
            fresnel::dielectric(cos_o, n).reflectance
        } else {
            // From both cosines, so that both ends find the same next to the critical angle.
            let cos_i = dot_i.abs().min(1.0);
            let rs = (cos_o - n * cos_i) / (cos_o + n * cos_i);
            let rp = (cos_i - n * cos_o) / (cos_i + n * cos_o);
            0.5 * (rs * rs + rp * rp)
        };
        Some(Half {
            normal: exact.as_vec3(),
            exact,
            reflects,
            eta,
            dot_o: dot_o as f32,
            dot_i: dot_i as f32,
            fresnel: fresnel as f32,
            passes: (1.0 - fresnel) as f32,
        })
    }

    /// |dω_m/dω_i|: 1/(4 |ω_i·m|) for reflection, η² |ω_i·m|/(ω_o·m + η ω_i·m)² for refraction (Walter et al. 2007, eqs. 14 and 17).
    #[inline]
    pub fn jacobian(&self) -> f32 {
        if self.reflects {
            0.25 / self.dot_i.abs()
        } else {
            self.eta * self.eta * self.dot_i.abs() * self.refraction()
        }
    }

    /// 1/(ω_o·m + η ω_i·m)².
    #[inline]
    pub fn refraction(&self) -> f32 {
        let sum = self.dot_o + self.eta * self.dot_i;
        1.0 / (sum * sum)
    }
}

/// The direction refracted at a facet with normal `m`; `None` in total reflection. `eta` is the
/// index on the far side over that of `wo`.
#[inline]
pub(super) fn refract(wo: Vec3, m: Vec3, eta: f32) -> Option<Vec3> {
    let (o, m) = (wo.as_dvec3(), m.as_dvec3());
    let cos = o.dot(m);
    let eta = f64::from(eta);
    let f = fresnel::dielectric(cos.abs().min(1.0), eta);
    if f.cos_t <= 0.0 {
        return None;
    }
    let along = cos / eta - f.cos_t.copysign(cos);
    Some((m * along - o / eta).normalize().as_vec3())
}

/// A direction turned to the side of the normal through the point: the same for every facet
/// distribution, which is even.
#[inline]
pub(super) fn upper(w: Vec3) -> Vec3 {
    if w.z < 0.0 { -w } else { w }
}
