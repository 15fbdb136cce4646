//! Metropolis light transport on path space (Veach and Guibas 1997; Veach 1997, chapter 11).
//!
//! The state of a chain is a whole path x̄; mutations propose another one, and Metropolis–Hastings
//! accepts it so that paths come up in proportion to the luminance f*(x̄) of what they bring. A
//! path that is hard to find is found once, and its neighbours from there.
//!
//! | step | file |
//! | --- | --- |
//! | a path with f(x̄) and what mutations ask of it | `path` |
//! | what a mutation is: [`Mutator`] | `mutator` |
//! | replacing a part of the path from both ends | `bidirectional` |
//! | small moves: lens, caustic and multi-chain perturbation | `perturb` |
//! | specular vertices found again between two that are not | `manifold` |
//! | starts by bidirectional path tracing | `start` |
//! | choice of mutations and acceptance | `target` |
//! | bytes of checkpoints | `codec` |

mod bidirectional;
mod codec;
mod emission;
mod manifold;
mod mutator;
mod path;
mod perturb;
mod start;
mod target;

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::film::Families;
use pathspace_core::integrator::{Integrator, IntegratorError, Run, State};

pub use self::bidirectional::Bidirectional;
pub use self::manifold::Manifold;
pub use self::mutator::{Candidate, Kept, Mutator};
pub use self::path::MltPath;
pub use self::perturb::{Caustic, Lens, LogUniform, MultiChain, Sizes};
pub use self::start::Seeds;
pub(crate) use self::start::not_finite;
pub use self::target::{PathChain, Weighted};
use crate::bdpt::Bdpt;
use crate::chain::{ChainOptions, ChainRun};
use crate::spec::{Defaults, Options, Spec, SpecError};

/// Name in the registry.
pub const NAME: &str = "mlt";

/// Path-space Metropolis light transport.
#[derive(Clone, Debug)]
pub struct Mlt {
    /// How often each mutation is tried.
    pub shares: Shares,
    /// How far perturbations go.
    pub sizes: Sizes,
    /// Chains and bootstrap.
    pub chains: ChainOptions,
    /// Luminance over a coarse pilot image of it as the target, so that dark regions get their
    /// share of the mutations.
    pub two_stage: bool,
    seeds: Seeds,
    spec: String,
}

/// How often each mutation is tried among those that apply to a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shares {
    /// Bidirectional mutation.
    pub bidir: f64,
    /// Lens perturbation.
    pub lens: f64,
    /// Caustic perturbation.
    pub caustic: f64,
    /// Multi-chain perturbation.
    pub multi: f64,
    /// Manifold perturbation.
    pub manifold: f64,
}

impl Default for Shares {
    fn default() -> Self {
        Shares { bidir: 1.0, lens: 1.0, caustic: 1.0, multi: 1.0, manifold: 1.0 }
    }
}

impl Shares {
    /// From options named as the mutations. One that is not named keeps its default.
    ///
    /// # Errors
    /// [`SpecError::BadValue`].
    pub fn from_options(options: &mut Options<'_>) -> Result<Self, SpecError> {
        let default = Shares::default();
        let range = || 0.0..=1e3;
        let shares = Shares {
            bidir: options.number("bidir", default.bidir, range())?,
            lens: options.number("lens", default.lens, range())?,
            caustic: options.number("caustic", default.caustic, range())?,
            multi: options.number("multi", default.multi, range())?,
            manifold: options.number("manifold", default.manifold, range())?,
        };
        let Shares { bidir, lens, caustic, multi, manifold } = shares;
        if bidir + lens + caustic + multi + manifold == 0.0 {
            return Err(options.bad("bidir", "0", "a positive share of some mutation"));
        }
        Ok(shares)
    }

    /// The mutations for a scene.
    pub fn mutators(&self, scene: &Scene, sizes: &Sizes, max_length: Option<u32>) -> Vec<Weighted> {
        let weighted = |mutator, share| Weighted { mutator, share };
        vec![
            weighted(Box::new(Bidirectional::new(scene, max_length)) as Box<_>, self.bidir),
            weighted(Box::new(Lens::new(scene, sizes)), self.lens),
            weighted(Box::new(Caustic::new(scene, sizes)), self.caustic),
            weighted(Box::new(MultiChain::new(scene, sizes)), self.multi),
            weighted(Box::new(Manifold::new(scene, sizes)), self.manifold),
        ]
    }
}

impl Sizes {
    /// From options: `step` (pixels) and `area` (share of the film).
    ///
    /// # Errors
    /// [`SpecError::BadValue`].
    pub fn from_options(options: &mut Options<'_>) -> Result<Self, SpecError> {
        let default = Sizes::default();
        Ok(Sizes {
            smallest: options.number("step", default.smallest, 1e-3..=1e3)?,
            area: options.number("area", default.area, 1e-6..=1.0)?,
        })
    }
}

impl Mlt {
    /// From options: `bidir`, `lens`, `caustic`, `multi` (shares of the mutations), `step` and
    /// `area` (sizes of perturbations), `target` = luminance | two-stage, `chains`, `bootstrap`,
    /// `max_depth`.
    ///
    /// # Errors
    /// Where an option is unknown or its value out of range.
    pub fn from_spec(spec: &Spec, defaults: &Defaults) -> Result<Self, SpecError> {
        let mut options = spec.options();
        let shares = Shares::from_options(&mut options)?;
        let mlt = Mlt {
            shares,
            sizes: Sizes::from_options(&mut options)?,
            chains: ChainOptions::from_options(&mut options)?,
            two_stage: options.choice("target", &[("luminance", false), ("two-stage", true)])?,
            seeds: Seeds::Bdpt(Bdpt::for_starts(options.max_length(defaults)?)),
            spec: spec.to_string(),
        };
        options.finish()?;
        Ok(mlt)
    }

    /// The chain on a scene.
    pub fn target(&self, scene: &Scene) -> PathChain {
        let mutators = self.shares.mutators(scene, &self.sizes, self.seeds.max_length());
        PathChain::new(scene, self.seeds.clone(), self.two_stage, mutators)
    }
}

impl Integrator for Mlt {
    fn name(&self) -> &str {
        NAME
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn families(&self, scene: &Scene) -> Families {
        self.seeds.families(scene)
    }

    fn resume(
        &self,
        scene: Arc<Scene>,
        seed: u64,
        state: &State,
    ) -> Result<Box<dyn Run>, IntegratorError> {
        let target = self.target(&scene);
        Ok(Box::new(ChainRun::resume(NAME, target, scene, seed, state, self.chains)?))
    }
}
