//! Phase functions: where a medium scatters to.
//!
//! Both directions point away from the vertex, as everywhere: cos θ = −ω_from·ω_to, so that θ = 0
//! goes straight on. All are functions of θ alone, hence reciprocal, and are sampled exactly: f/p
//! is the albedo.

use std::f64::consts::{PI, TAU};

use glam::Vec3;

use crate::description::PhaseKind;
use crate::math::Frame;
use crate::measure::{Density, SolidAngle};
use crate::random::nearest_coordinate;

/// A phase function ρ(θ), ∫ρ dσ = 1.
#[derive(Clone, Debug, PartialEq)]
pub enum Phase {
    /// 1/4π.
    Isotropic,
    /// (1 − g²)/(4π (1 + g² − 2g cos θ)^{3/2}) (Henyey and Greenstein 1941).
    HenyeyGreenstein {
        /// Mean cosine, in (−1, 1); positive scatters forward.
        g: f64,
    },
    /// 3/(16π) (1 + cos² θ).
    Rayleigh,
    /// (1 − w) a + w b.
    Blend {
        /// w, in \[0, 1\].
        weight: f64,
        /// Both functions.
        pair: Box<[Phase; 2]>,
    },
}

/// Below this |g| the function is the isotropic one to the last digit of f32.
const NO_G: f64 = 1e-9;

impl Phase {
    /// # Errors
    /// What is wrong with a parameter, in words.
    pub(crate) fn new(kind: &PhaseKind) -> Result<Self, String> {
        Ok(match kind {
            PhaseKind::Isotropic => Phase::Isotropic,
            PhaseKind::Rayleigh => Phase::Rayleigh,
            &PhaseKind::HenyeyGreenstein { g } => {
                if !(g.abs() < 1.0) {
                    return Err(format!("the mean cosine g = {g} is not in (−1, 1)"));
                }
                Phase::HenyeyGreenstein { g }
            }
            PhaseKind::Blend { weight, pair } => {
                if !(0.0..=1.0).contains(weight) {
                    return Err(format!("the weight {weight} of a blend is not in [0, 1]"));
                }
                let pair = [Phase::new(&pair[0])?, Phase::new(&pair[1])?];
                Phase::Blend { weight: *weight, pair: Box::new(pair) }
            }
        })
    }

    /// ρ(from, to): its value, and the density with which [`Phase::sample`] makes `to`.
    pub fn pdf(&self, from: Vec3, to: Vec3) -> Density<SolidAngle> {
        Density::new(self.value(from, to))
    }

    fn value(&self, from: Vec3, to: Vec3) -> f64 {
        match self {
            Phase::Isotropic => 0.25 / PI,
            Phase::HenyeyGreenstein { g } => {
                // 1 + g² − 2g cos θ without the cancellation at its least: (1 − |g|)² + |g| ‖ω_to ±
                // ω_from‖².
                let (from, to) = (from.as_dvec3(), to.as_dvec3());
                let apart = if *g >= 0.0 { from + to } else { from - to };
                let (a, rest) = (g.abs(), 1.0 - g.abs());
                let base = rest * rest + a * apart.length_squared();
                0.25 / PI * rest * (1.0 + a) / (base * base.sqrt())
            }
            Phase::Rayleigh => {
                let cos = from.as_dvec3().dot(to.as_dvec3());
                3.0 / (16.0 * PI) * (1.0 + cos * cos)
            }
            Phase::Blend { weight, pair } => {
                (1.0 - weight) * pair[0].value(from, to) + weight * pair[1].value(from, to)
            }
        }
    }

    /// A direction, and its density. `component` chooses among the functions of a blend.
    pub fn sample(&self, from: Vec3, component: f32, u: [f32; 2]) -> (Vec3, Density<SolidAngle>) {
        let cos = self.cosine(f64::from(component), f64::from(u[0])).clamp(-1.0, 1.0);
        let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
        let (sin_phi, cos_phi) = (TAU * f64::from(u[1])).sin_cos();
        let local = glam::DVec3::new(sin * cos_phi, sin * sin_phi, cos).as_vec3();
        let to = Frame::from_normal(-from).to_world(local).normalize();
        (to, self.pdf(from, to))
    }

    /// cos θ by the inverse of its cumulative function.
    fn cosine(&self, component: f64, u: f64) -> f64 {
        match self {
            Phase::HenyeyGreenstein { g } if g.abs() > NO_G => {
                let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
                (1.0 + g * g - s * s) / (2.0 * g)
            }
            Phase::Isotropic | Phase::HenyeyGreenstein { .. } => 2.0 * u - 1.0,
            // c³ + 3c + 4 = 8u by Cardano.
            Phase::Rayleigh => {
                let z = 4.0 * u - 2.0;
                let root = (z * z + 1.0).sqrt();
                libm::cbrt(z + root) + libm::cbrt(z - root)
            }
            Phase::Blend { weight, pair } => {
                // What is left of the number is uniform again.
                if component < *weight {
                    pair[1].cosine(component / weight, u)
                } else {
                    pair[0].cosine((component - weight) / (1.0 - weight), u)
                }
            }
        }
    }

    /// Numbers by which [`Phase::sample`] makes `to`, by the uniform number `free` where several
    /// do.
    pub fn invert(&self, from: Vec3, to: Vec3, free: f32) -> [f32; 3] {
        let local = Frame::from_normal(-from).to_local(to).as_dvec3();
        let turn = local.y.atan2(local.x) / TAU;
        let (component, u) = self.number(local.z.clamp(-1.0, 1.0), from, to, f64::from(free));
        let turn = if turn < 0.0 { turn + 1.0 } else { turn };
        [component, u, turn].map(nearest_coordinate)
    }

    /// Numbers of the component and of cos θ.
    fn number(&self, cos: f64, from: Vec3, to: Vec3, free: f64) -> (f64, f64) {
        match self {
            Phase::HenyeyGreenstein { g } if g.abs() > NO_G => {
                let s = (1.0 + g * g - 2.0 * g * cos).sqrt();
                (free, ((1.0 - g * g) / s - (1.0 - g)) / (2.0 * g))
            }
            Phase::Isotropic | Phase::HenyeyGreenstein { .. } => (free, 0.5 * (1.0 + cos)),
            Phase::Rayleigh => (free, (cos * cos * cos + 3.0 * cos + 4.0) / 8.0),
            Phase::Blend { weight, pair } => {
                // Which of them made it, in proportion to their shares.
                let second = weight * pair[1].value(from, to);
                let share = second / (second + (1.0 - weight) * pair[0].value(from, to));
                if free < share {
                    let (inner, u) = pair[1].number(cos, from, to, free / share);
                    (inner * weight, u)
                } else {
                    let rest = (free - share) / (1.0 - share);
                    let (inner, u) = pair[0].number(cos, from, to, rest);
                    (weight + inner * (1.0 - weight), u)
                }
            }
        }
    }
}
