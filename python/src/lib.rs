//! The engine as a Python module, `pathspace._native`: what the package `pathspace` stands on.
//!
//! Everything here is a thin layer: arguments from Python, a call of a public crate, arrays and
//! JSON back. What is Python's business (dataclasses, plots, clusters) is written in Python beside
//! it.
//!
//! A plug-in crate brings its integrators into Python with a module of its own:
//!
//! ```ignore
//! #[pyo3::pymodule]
//! fn my_integrators(module: &Bound<'_, PyModule>) -> PyResult<()> {
//!     pathspace_python::module(module, || Registry::builtin().with("mine", "what it does", factory))
//! }
//! ```
//!
//! and Python takes it by `pathspace.use(my_integrators)`.

mod agree;
mod cell;
mod command;
mod error;
mod image;
mod query;
mod render;
mod scene;
mod worker;

use pathspace::integrators::Registry;
use pyo3::prelude::*;

/// The integrators of a module.
#[pyclass(frozen, module = "pathspace._native")]
pub struct Integrators {
    pub(crate) registry: Registry,
    pub(crate) make: fn() -> Registry,
}

#[pymethods]
impl Integrators {
    /// Names and one-line summaries, in order.
    fn list(&self) -> Vec<(String, String)> {
        self.registry.all().map(|(name, what)| (name.to_owned(), what.to_owned())).collect()
    }

    /// Names of those that take part where none is named.
    fn usual(&self) -> Vec<String> {
        self.registry.list().map(|(name, _)| name.to_owned()).collect()
    }
}

/// Fills a module with everything there is; its integrators are those that `make` gives.
///
/// # Errors
/// Those of Python.
pub fn module(module: &Bound<'_, PyModule>, make: fn() -> Registry) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("integrators", Integrators { registry: make(), make })?;
    module.add_class::<Integrators>()?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<render::Session>()?;
    module.add_class::<query::Hits>()?;
    module.add_class::<query::Lights>()?;
    module.add("SceneError", module.py().get_type::<error::SceneError>())?;
    module.add("PathspaceError", module.py().get_type::<error::PathspaceError>())?;
    module.add_function(wrap_pyfunction!(agree::agree, module)?)?;
    module.add_function(wrap_pyfunction!(cell::render_cell, module)?)?;
    module.add_function(wrap_pyfunction!(command::command, module)?)?;
    module.add_function(wrap_pyfunction!(command::validate, module)?)?;
    module.add_function(wrap_pyfunction!(image::read_image, module)?)?;
    module.add_function(wrap_pyfunction!(image::write_image, module)?)?;
    module.add_function(wrap_pyfunction!(image::png, module)?)?;
    module.add_function(wrap_pyfunction!(image::exposure, module)?)?;
    module.add_function(wrap_pyfunction!(query::intersect, module)?)?;
    module.add_function(wrap_pyfunction!(query::sample_sensor, module)?)?;
    module.add_function(wrap_pyfunction!(render::merge, module)?)?;
    module.add_function(wrap_pyfunction!(scene::library, module)?)
}

#[pymodule]
fn _native(py_module: &Bound<'_, PyModule>) -> PyResult<()> {
    module(py_module, Registry::builtin)
}
