//! Reversible jump Metropolis light transport using inverse mappings (Bitterli, Jakob, Novák and
//! Jarosz 2017).
//!
//! The space and the target are those of [`mmlt`](crate::mmlt): a chain of path length k, n
//! techniques i = (s, t), numbers u that technique i makes the path x̄ = P_i(u) of, f̂(i, u) = n
//! w_i(x̄) f(x̄)/p_i(x̄). Small steps leave the technique as it is; another move, the *jump*,
//! leaves the path as it is and changes the technique: u′ = P_j⁻¹(x̄).
//!
//! **Inverses.** P_j is a bijection in what the path depends on. A number that it does not depend
//! on (the lobe of a surface that has one, a direction of a mirror) is drawn anew, and the number
//! of a choice (emitter, triangle, reflection or refraction) uniformly from all that choose the
//! same. The density of u′ given x̄ is then 1/p_j(x̄) of the image measure, so that the pair of a
//! jump and the jump back has the Jacobian of Green (1995)
//!
//! |∂u′/∂u| = p_j(x̄)/p_i(x̄)
//!
//! with the free numbers counted in. With q(i→j) the probability to pick j, the ratio of
//! Metropolis, Hastings and Green is
//!
//! r = f̂(j, u′)/f̂(i, u) · |∂u′/∂u| · q(j→i)/q(i→j)
//!   = (w_j f/p_j)/(w_i f/p_i) · p_j/p_i · q(j→i)/q(i→j) = w_j q(j→i) / (w_i q(i→j)) .
//!
//! In other words: the joint target of technique and path is w_i(x̄) f(x̄) dμ(x̄), and a jump is a
//! step on i alone. With q(i→j) = w_j it is Gibbs' sampler: r = 1, and no jump is refused. `rjmlt`
//! stays with probability w_i, for which it needs no more than the weight that the state has, and
//! lays the path again only where it leaves.
//!
//! **Rounding.** Numbers are multiples of 2⁻²⁴ and vertices are `f32`, so that P_j(u′) is not x̄
//! but a path ȳ next to it. The new state is the one that u′ makes, with its own f̂, and the ratio
//! is the one of both paths,
//!
//! r = w_j(ȳ) f(ȳ) q(j→i | ȳ) / (w_i(x̄) f(x̄) q(i→j | x̄)), q(i→j | x̄) = (1 − w_i) w_j/Σ_{l≠i}
//! w_l ,
//!
//! that of a move from (i, x̄) to (j, ȳ) whose displacement ȳ − x̄ is as likely as x̄ − ȳ. That
//! alone is assumed of rounding; differences of f between both paths, however steep it is, are
//! judged exactly. Vertices that both techniques walk to keep their numbers, and their positions to
//! the bit. A jump is *lost* where ȳ strays from x̄ by more than [`TOLERANCE`] at some vertex, or
//! by more than the part [`RELATIVE`] of an edge, or does not exist; and also where the jump back
//! from ȳ would be lost, so that a direction in which inversion is hard is as closed as the other
//! one. What is left of a bias is second order: rounding displaces a path by some 10⁻⁶ of the
//! scene, without a preferred direction.
//!
//! Every sampler of the core has an inverse; where one finds no numbers, the jump is lost and the
//! chain goes on by its other moves.

mod jump;

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::film::{Contribution, Families, Sink};
use pathspace_core::integrator::{Integrator, IntegratorError, Run, State};
use pathspace_core::random::{PrimarySample, RandomStream, Stream};

use crate::chain::{Candidates, ChainRun, ImageWeight};
use crate::mmlt::{Mmlt, Multiplexed};
use crate::primary::{Integrand, Jump, PrimaryOptions, PrimaryPoint, PrimaryTarget, PrimaryVector};
use crate::spec::{Defaults, Spec, SpecError};

pub use jump::{RELATIVE, TOLERANCE};

/// Name in the registry.
pub const NAME: &str = "rjmlt";

/// Reversible jump Metropolis light transport.
#[derive(Clone, Debug)]
pub struct Rjmlt {
    /// Its paths.
    pub techniques: Reversible,
    /// Its chains.
    pub options: PrimaryOptions,
    spec: String,
}

impl Rjmlt {
    /// From options: `jump`, the probability of a jump, and those of [`Mmlt::from_spec`].
    ///
    /// # Errors
    /// Where an option is unknown or its value out of range.
    pub fn from_spec(spec: &Spec, defaults: &Defaults) -> Result<Self, SpecError> {
        let mut options = spec.options();
        let mmlt = Mmlt::from_options(&mut options, defaults)?;
        let most = 1.0 - mmlt.options.large;
        let jump = options.number("jump", f64::min(0.05, most), 0.0..=most)?;
        options.finish()?;
        Ok(Rjmlt {
            techniques: Reversible(mmlt.techniques),
            options: PrimaryOptions { jump, ..mmlt.options },
            spec: spec.to_string(),
        })
    }
}

impl Integrator for Rjmlt {
    fn name(&self) -> &str {
        NAME
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn families(&self, scene: &Scene) -> Families {
        self.techniques.0.bdpt.families(scene)
    }

    fn sees_media(&self) -> bool {
        true
    }

    fn resume(
        &self,
        scene: Arc<Scene>,
        seed: u64,
        state: &State,
    ) -> Result<Box<dyn Run>, IntegratorError> {
        let target = PrimaryTarget::new(self.techniques.clone(), self.options);
        let run = ChainRun::resume(NAME, target, scene, seed, state, self.options.chain)?;
        Ok(Box::new(run))
    }
}

/// All techniques of one path length as one integrand, with jumps between them.
#[derive(Clone, Debug)]
pub struct Reversible(pub Multiplexed);

impl Integrand for Reversible {
    fn part(&self, u: &mut RandomStream) -> (u16, f64) {
        self.0.part(u)
    }

    fn probability(&self, part: u16) -> f64 {
        self.0.probability(part)
    }

    fn evaluate<U: PrimarySample, S: Sink>(&self, scene: &Scene, k: u16, u: &mut U, sink: &mut S) {
        self.0.evaluate(scene, k, u, sink);
    }

    fn candidates(
        &self,
        scene: &Scene,
        u: &mut RandomStream,
        scalar: impl Fn(&Contribution) -> f64,
        found: &mut Candidates,
    ) {
        self.0.candidates(scene, u, scalar, found);
    }

    fn start(
        &self,
        scene: &Scene,
        u: &mut RandomStream,
        index: u32,
    ) -> (u16, Box<dyn PrimarySample>) {
        self.0.start(scene, u, index)
    }

    fn held(&self) -> Option<(Stream, usize)> {
        Some(Multiplexed::SELECTOR)
    }

    fn jump(
        &self,
        scene: &Scene,
        x: &mut PrimaryPoint,
        y: &mut PrimaryVector,
        u: &mut RandomStream,
    ) -> Jump {
        jump::jump(&self.0, scene, x, y, u)
    }

    fn image_weight(&self, scene: &Scene, seed: u64, samples: u64) -> ImageWeight {
        self.0.image_weight(scene, seed, samples)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_steps_and_jumps_share_the_moves() {
        let spec = |text: &str| Rjmlt::from_spec(&text.parse().unwrap(), &Defaults::default());
        assert!(spec("rjmlt:large=0.5,jump=0.5").is_ok());
        assert!(spec("rjmlt:large=0.5,jump=0.6").is_err());
        assert_eq!(spec("rjmlt:large=1").unwrap().options.jump, 0.0);
    }
}
