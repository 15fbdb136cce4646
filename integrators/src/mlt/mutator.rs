//! What a mutation is.

use pathspace_core::Scene;
use pathspace_core::random::RandomStream;

use super::path::MltPath;

/// The part of a path that a mutation leaves alone: its first `light` and its last `sensor`
/// vertices.
///
/// A proposal is judged by the way it was made. Two ways that lead from x̄ to the same ȳ (possible
/// where specular vertices make a vertex again) are two kernels, each balanced on its own, so that
/// their mixture is balanced too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kept {
    /// Vertices x₀, x₁, … that stay.
    pub light: usize,
    /// Vertices x_k, x_{k−1}, … that stay.
    pub sensor: usize,
}

impl Kept {
    /// Number of vertices of `path` that do not stay, if so many are there at all.
    pub fn replaced(&self, path: &MltPath) -> Option<usize> {
        (path.length() + 1).checked_sub(self.light + self.sensor)
    }
}

/// A proposed path ȳ and the way it was made.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// ȳ, with f(ȳ) > 0 and all its edges visible.
    pub path: MltPath,
    /// What it shares with x̄, by construction.
    pub kept: Kept,
}

/// A mutation of paths (Veach and Guibas 1997; Veach 1997, §11.4): a proposal with a transition
/// density that can be evaluated.
///
/// Metropolis–Hastings accepts ȳ with a = min(1, f*(ȳ) T(ȳ→x̄) / (f*(x̄) T(x̄→ȳ))). T is a density
/// in the product area measure of the vertices that are replaced. A vertex with a delta lobe counts
/// relative to the common delta function of f(x̄) and of all densities (see
/// [`pathspace_core::path`]); so the ratio of f/T on both sides is exact whatever vertices are
/// deltas.
pub trait Mutator: Send + Sync {
    /// Short name, as in options.
    fn name(&self) -> &'static str;

    /// Whether the mutation knows what to do with x̄. One that knows it on x̄ alone, or on ȳ alone,
    /// is rejected.
    fn applies(&self, x: &MltPath) -> bool;

    /// Proposes ȳ; `None` where f(ȳ) would be 0 or no path comes about: a rejection.
    fn propose(&self, scene: &Scene, x: &MltPath, u: &mut RandomStream) -> Option<Candidate>;

    /// ln T(x̄→ȳ) of the way that keeps `kept`, summed over all choices that lead to ȳ on that way;
    /// `None` where T = 0. A function of the two paths alone, and the same function for the way
    /// back.
    fn ln_transition(&self, scene: &Scene, x: &MltPath, y: &MltPath, kept: Kept) -> Option<f64>;

    /// ln T(ȳ→x̄) − ln T(x̄→ȳ); `None` where one of them is 0, so that there is no way back.
    fn ln_transition_ratio(&self, scene: &Scene, x: &MltPath, y: &Candidate) -> Option<f64> {
        let forward = self.ln_transition(scene, x, &y.path, y.kept)?;
        let back = self.ln_transition(scene, &y.path, x, y.kept)?;
        Some(back - forward)
    }
}
