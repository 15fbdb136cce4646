//! Why a scene cannot be built.

/// Why a description can not become a scene.
#[derive(Debug, thiserror::Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum SceneError {
    /// A value of a shape is out of range.
    #[error("shape '{shape}': {problem}")]
    Shape {
        /// Name of the shape.
        shape: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A parameter of a scattering model is out of range.
    #[error("bsdf '{material}': {problem}")]
    Material {
        /// Name of the material.
        material: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A value of an emitter is out of range.
    #[error("emitter {index}: {problem}")]
    Emitter {
        /// Index in the description.
        index: usize,
        /// What is wrong with it.
        problem: String,
    },
    /// A value of the sensor is out of range.
    #[error("sensor: {problem}")]
    Sensor {
        /// What is wrong with it.
        problem: String,
    },
    /// A value of the film is out of range.
    #[error("film: {problem}")]
    Film {
        /// What is wrong with it.
        problem: String,
    },
    /// A value of a medium is out of range.
    #[error("medium '{medium}': {problem}")]
    Medium {
        /// Name of the medium.
        medium: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The tree could not be built.
    #[error("geometry: {0}")]
    Geometry(String),
}
