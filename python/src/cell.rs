//! One render of a comparison, made apart from the others.

use std::ops::ControlFlow;
use std::path::PathBuf;

use pathspace::benches::experiment::{Cell, Key, Store};
use pathspace::benches::{Budget, expose};
use pathspace::integrators::{Defaults, Spec};
use pathspace::validation::pairs::{Observation, Tiles};
use pyo3::prelude::*;

use crate::Integrators;
use crate::error::failed;
use crate::scene::Scene;
use crate::worker::pool;

/// One replicate of an experiment, a dictionary.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Replicate {
    spp: Option<u64>,
    seconds: Option<f64>,
    replicate: u32,
    seed: u64,
    threads: usize,
}

/// Renders one replicate and keeps it in `folder`, where `pathspace compare` finds it; or only asks
/// (`ask`). True where it was there already.
#[pyfunction]
#[pyo3(signature = (integrators, scene, spec, replicate, folder, *, ask=false))]
pub(crate) fn render_cell(
    py: Python<'_>,
    integrators: &Integrators,
    scene: &Scene,
    spec: &str,
    replicate: Replicate,
    folder: PathBuf,
    ask: bool,
) -> PyResult<bool> {
    let Replicate { spp, seconds, replicate, seed, threads } = replicate;
    let budget = match (spp, seconds) {
        (Some(n), _) => Budget::Samples(n),
        (None, Some(s)) => Budget::Seconds(s),
        (None, None) => return Err(failed("a budget is missing")),
    };
    let spec: Spec = spec.parse().map_err(failed)?;
    let defaults = Defaults { rules: scene.rules };
    let integrator = integrators.registry.create(&spec, &defaults).map_err(failed)?;
    let pool = pool(Some(threads))?;
    py.detach(|| {
        let store = Store::open(&folder).map_err(failed)?;
        let (name, words) = (integrator.spec(), budget.words());
        let key = Key {
            scene: &scene.key,
            integrator: &name,
            budget: &words,
            replicate,
            seed,
            threads: pool.current_num_threads(),
        };
        if store.has(&key) || ask {
            return Ok(store.has(&key));
        }
        let crop = scene.world.film().crop;
        let tiles = Tiles::new(crop.width as usize, crop.height as usize);
        let own = key.seed();
        let exposed = pool.install(|| {
            let go_on = &mut |_: &_| ControlFlow::Continue(());
            expose(&*integrator, &scene.world, Observation::LAYERS, own, budget, go_on)
        });
        let cell = Cell::of(&exposed.map_err(failed)?, own, &tiles);
        store.put(&key, &cell).map_err(failed)?;
        Ok(false)
    })
}
