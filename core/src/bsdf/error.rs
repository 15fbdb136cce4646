//! Parameters that make no scattering model.

use crate::color::Rgb;

/// Why a material can not be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BsdfError {
    /// A parameter is NaN, infinite or outside its range.
    #[error("{parameter} is {value}, expected {expected}")]
    Parameter {
        /// Name of the parameter.
        parameter: &'static str,
        /// The offending value.
        value: String,
        /// The range.
        expected: &'static str,
    },
    /// `twosided` holds a model that is not opaque (or has two sides itself).
    #[error("twosided can hold opaque models only, not {model}")]
    NotOpaque {
        /// Name of the model.
        model: &'static str,
    },
}

/// Checks one number.
pub(super) fn check(
    parameter: &'static str,
    value: f32,
    expected: &'static str,
    valid: impl Fn(f32) -> bool,
) -> Result<f32, BsdfError> {
    if value.is_finite() && valid(value) {
        return Ok(value);
    }
    Err(BsdfError::Parameter { parameter, value: value.to_string(), expected })
}

/// Checks numbers that lie between 0 and 1.
pub(super) fn check_units(parameters: &[(&'static str, f32)]) -> Result<(), BsdfError> {
    for (name, value) in parameters {
        check(name, *value, "between 0 and 1", |v| (0.0..=1.0).contains(&v))?;
    }
    Ok(())
}

/// Checks each channel of a colour.
pub(super) fn check_rgb(
    parameter: &'static str,
    value: Rgb,
    expected: &'static str,
    valid: impl Fn(f32) -> bool,
) -> Result<Rgb, BsdfError> {
    if value.is_finite() && value.to_array().into_iter().all(valid) {
        return Ok(value);
    }
    let value = format!("({}, {}, {})", value.r, value.g, value.b);
    Err(BsdfError::Parameter { parameter, value, expected })
}

/// Factor on a specular lobe: any finite number ≥ 0, as in Mitsuba.
pub(super) fn check_factor(parameter: &'static str, value: Rgb) -> Result<Rgb, BsdfError> {
    check_rgb(parameter, value, "finite and not negative", |v| v >= 0.0)
}
