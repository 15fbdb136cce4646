//! A render in one call.

use std::ops::ControlFlow;
use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::film::Layers;
use pathspace_core::integrator::{Integrator, IntegratorError};

use crate::budget::Budget;
use crate::session::{Exposure, Plan, Session, Status};
use crate::shard::Shard;

/// Renders until the budget is used up or `watch`, which is called after every step, says to stop.
///
/// Runs on the current rayon pool; the film is the same to the bit for any number of threads.
/// [`Session`] is the same with a place to stop and go on.
///
/// # Errors
/// Where the integrator does not render this scene.
pub fn expose(
    integrator: &dyn Integrator,
    scene: &Arc<Scene>,
    layers: Layers,
    seed: u64,
    budget: Budget,
    watch: &mut dyn FnMut(&Status) -> ControlFlow<()>,
) -> Result<Exposure, IntegratorError> {
    let plan = Plan { integrator, scene, layers, seed, shard: Shard::WHOLE };
    let mut session = Session::start(plan)?;
    session.run(budget, &mut |_, status| watch(status))?;
    Ok(session.finish())
}
