//! Paths, their measurement contribution and the densities of the techniques that make them.
//!
//! I_j = ∫_Ω f_j(x̄) dμ(x̄), f(x̄) = L_e(x₀→x₁) G f̄_s G … G W_e(x_{k−1}→x_k) (Veach 1997, eq.
//! 8.7). The functions here take a whole path and work in `f64`: slow, plain, and what every fast
//! recursion is tested against.

mod at_vertex;
mod class;
mod contribution;
mod density;
mod families;
mod scatter;

pub use crate::vertex::Vertex;
pub use class::{Origin, WalkClass};
pub use contribution::contribution;
pub use density::{Technique, WalkRules, families, ln_density, samplable};
pub use families::Families;
pub use scatter::{ScatterSample, ScatterValue, TwoWayScatter};

use crate::bsdf::Event;
use crate::color::Rgb;

/// A light transport path x̄ = x₀x₁…x_k of length k: x₀ on an emitter, x_k on the sensor.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Path {
    /// The vertices x₀ … x_k.
    pub vertices: Vec<Vertex>,
    /// What happens at each of them; at x₀ and x_k nothing, which is written as non-specular.
    pub events: Vec<Event>,
}

impl Path {
    /// The path of these vertices with an event at each of them.
    pub fn new(vertices: Vec<Vertex>, events: Vec<Event>) -> Self {
        debug_assert_eq!(vertices.len(), events.len());
        Path { vertices, events }
    }

    /// The path of these vertices without a specular event.
    pub fn non_specular(vertices: Vec<Vertex>) -> Self {
        let events = vec![Event::NonSpecular; vertices.len()];
        Path { vertices, events }
    }

    /// Whether the event at x_i is specular.
    pub fn is_specular(&self, i: usize) -> bool {
        self.events[i].is_specular()
    }

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
