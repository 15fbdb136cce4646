//! The command, and `validate`.

use std::ffi::OsString;
use std::sync::Arc;

use pathspace::cli;
use pathspace::integrators::Defaults;
use pathspace::validation::validate::{Config, validate as compare_all};
use pyo3::prelude::*;

use crate::Integrators;
use crate::error::failed;
use crate::scene::Scene;
use crate::worker::pool;

/// Runs the command with its arguments, the program's name first; the answer is the exit status.
#[pyfunction]
pub(crate) fn command(py: Python<'_>, integrators: &Integrators, arguments: Vec<OsString>) -> u8 {
    let registry = integrators.make;
    py.detach(|| cli::status_from(registry(), arguments))
}

/// How `validate` compares, a dictionary.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Options {
    seed: u64,
    alpha: f64,
    replicates: usize,
    rays: u64,
    mdb: f64,
    threads: Option<usize>,
}

/// Compares integrators on a scene, every pair; the answer is a JSON report, its text, and whether
/// nothing is wrong.
#[pyfunction]
pub(crate) fn validate(
    py: Python<'_>,
    integrators: &Integrators,
    scene: &Scene,
    specs: Vec<String>,
    options: Options,
) -> PyResult<(String, String, bool)> {
    let Options { seed, alpha, replicates, rays, mdb, threads } = options;
    let defaults = Defaults { rules: scene.rules };
    let mut made = Vec::new();
    for spec in &specs {
        let spec = spec.parse().map_err(failed)?;
        made.push(integrators.registry.create(&spec, &defaults).map_err(failed)?);
    }
    let config = Config { seed, alpha, replicates, rays, mdb, ..Config::default() };
    let world = Arc::clone(&scene.world);
    let pool = pool(threads)?;
    let report = py.detach(|| {
        let all: Vec<_> = made.iter().map(|i| &**i).collect();
        pool.install(|| compare_all(&world, &all, &config))
    });
    let json = serde_json::to_string(&report).map_err(failed)?;
    Ok((json, report.to_string(), report.passed()))
}
