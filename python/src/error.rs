//! Errors of the crates as exceptions.

use std::fmt::Display;

use pyo3::PyErr;
use pyo3::create_exception;
use pyo3::exceptions::PyException;

create_exception!(_native, PathspaceError, PyException, "What pathspace cannot do, in one line.");
create_exception!(
    _native,
    SceneError,
    PathspaceError,
    "A scene that cannot be read or built; the message names file and line."
);

/// Any error as [`PathspaceError`].
pub(crate) fn failed(error: impl Display) -> PyErr {
    PathspaceError::new_err(error.to_string())
}

/// An error of a scene as [`SceneError`].
pub(crate) fn bad_scene(error: impl Display) -> PyErr {
    SceneError::new_err(error.to_string())
}
