//! Diffuse scenes that finite elements and Monte Carlo are compared on.

use pathspace_core::description::{FilmDescription, SceneDescription};
use pathspace_scenes::{SceneFileError, library};

/// A scene of the library with a small film.
///
/// # Errors
/// Where there is none of that name, the error of a file that does not exist.
pub fn of_library(name: &str) -> Result<SceneDescription, SceneFileError> {
    let mut description = match library::find(name) {
        Some(scene) => scene.load(&[])?.description,
        None => pathspace_scenes::load(std::path::Path::new(name), &[])?.description,
    };
    description.film = FilmDescription::new(64, 64);
    Ok(description)
}
