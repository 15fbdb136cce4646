//! Primary-sample-space Metropolis light transport (Kelemen, Szirmay-Kalos, Antal and Csonka 2002,
//! "A Simple and Robust Mutation Strategy for the Metropolis Light Transport Algorithm").
//!
//! A [`PathEstimator`] maps a point u of the unit cube to contributions f_j(u); a chain walks the
//! cube with density f*(u)/b, f* the luminance of their sum. Large steps draw u anew, small steps
//! perturb every coordinate by a symmetric kernel, so that both are accepted with min(1,
//! f*(v)/f*(u)). Any estimator will do, those of plug-ins included.

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::film::{Families, Sink};
use pathspace_core::integrator::{Integrator, IntegratorError, PathEstimator, Run, State};
use pathspace_core::random::{PrimarySample, RandomStream};

use crate::bdpt::{self, Bdpt};
use crate::chain::{ChainRun, ImageWeight};
use crate::primary::{Integrand, PrimaryOptions, PrimaryTarget};
use crate::pt::{self, PathTracer};
use crate::spec::{Defaults, Spec, SpecError};

/// Name in the registry.
pub const NAME: &str = "pssmlt";

/// Metropolis light transport on the primary sample space of an estimator.
#[derive(Debug)]
pub struct Pssmlt<E> {
    /// The estimator.
    pub estimator: Arc<E>,
    /// The chains.
    pub options: PrimaryOptions,
    spec: String,
}

impl<E> Pssmlt<E> {
    /// Chains over `estimator`; `spec` names them in reports.
    pub fn new(estimator: E, options: PrimaryOptions, spec: impl Into<String>) -> Self {
        Pssmlt { estimator: Arc::new(estimator), options, spec: spec.into() }
    }
}

/// From options: `over` = bdpt | pt with the options of that estimator; `mis`; and those of
/// [`PrimaryOptions::from_options`].
///
/// # Errors
/// Where an option is unknown or its value out of range.
pub fn from_spec(spec: &Spec, defaults: &Defaults) -> Result<Box<dyn Integrator>, SpecError> {
    let mut options = spec.options();
    let over_bdpt = options.choice("over", &[(bdpt::NAME, true), (pt::NAME, false)])?;
    let chain = PrimaryOptions::from_options(&mut options)?;
    let chain = PrimaryOptions { mis: options.boolean("mis", true)?, ..chain };
    Ok(if over_bdpt {
        let inner = Bdpt::from_options(&mut options, defaults, false)?;
        options.finish()?;
        Box::new(Pssmlt::new(inner, chain, spec.to_string()))
    } else {
        let inner = PathTracer::from_options(&mut options, defaults)?;
        options.finish()?;
        Box::new(Pssmlt::new(inner, chain, spec.to_string()))
    })
}

impl<E: PathEstimator + Integrator> Integrator for Pssmlt<E> {
    fn name(&self) -> &str {
        NAME
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn families(&self, scene: &Scene) -> Families {
        self.estimator.families(scene)
    }

    fn sees_media(&self) -> bool {
        self.estimator.sees_media()
    }

    fn resume(
        &self,
        scene: Arc<Scene>,
        seed: u64,
        state: &State,
    ) -> Result<Box<dyn Run>, IntegratorError> {
        let target = PrimaryTarget::new(Estimated(self.estimator.clone()), self.options);
        let run = ChainRun::resume(NAME, target, scene, seed, state, self.options.chain)?;
        Ok(Box::new(run))
    }
}

/// An estimator as an integrand on one cube.
#[derive(Debug)]
pub struct Estimated<E>(pub Arc<E>);

impl<E: PathEstimator> Integrand for Estimated<E> {
    fn part(&self, _: &mut RandomStream) -> (u16, f64) {
        (0, 1.0)
    }

    fn probability(&self, _: u16) -> f64 {
        1.0
    }

    fn evaluate<U: PrimarySample, S: Sink>(&self, scene: &Scene, _: u16, u: &mut U, sink: &mut S) {
        self.0.estimate(scene, None, u, sink);
    }

    fn image_weight(&self, scene: &Scene, seed: u64, samples: u64) -> ImageWeight {
        ImageWeight::pilot(scene, &*self.0, seed, samples)
    }
}
