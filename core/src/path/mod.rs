//! Paths, their measurement contribution and the densities of the techniques that make them.
//!
//! I_j = ∫_Ω f_j(x̄) dμ(x̄), f(x̄) = L_e(x₀→x₁) G f̄_s G … G W_e(x_{k−1}→x_k) (Veach 1997, eq. 8.7). The functions here
//! take a whole path and work in `f64`: slow, plain, and what every fast recursion is tested against.

mod contribution;
mod density;
mod families;
mod scatter;
mod vertex;

pub use contribution::contribution;
pub use density::{Technique, WalkRules, families, ln_density, samplable};
pub use families::{Origin, WalkClass};
pub use scatter::{ScatterSample, ScatterValue, TwoWayScatter};
pub use vertex::Vertex;

use crate::color::Rgb;

/// A light transport path x̄ = x₀x₁…x_k of length k: x₀ on an emitter, x_k on the sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// The vertices x₀ … x_k.
    pub vertices: Vec<Vertex>,
}

impl Path {
    /// Number of edges k.
    pub fn length(&self) -> usize {
        self.vertices.len() - 1
    }
}

/// A path as an integrator made it, with what the integrator itself computed for it.
#[derive(Clone, Debug, PartialEq)]
pub struct PathRecord {
    /// The path.
    pub path: Path,
    /// The technique.
    pub technique: Technique,
    /// ln p_{s,t}(x̄) by the integrator's own sampling code.
    pub ln_pdf: f64,
    /// Its MIS weight.
    pub weight: f64,
    /// w f/p as emitted.
    pub value: Rgb,
}
