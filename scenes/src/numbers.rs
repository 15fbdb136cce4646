//! Numbers in text, of attributes and of files alike.

use crate::error::{Place, Result, SceneFileError};

/// A value that does not fit.
pub(crate) fn bad(place: &Place, what: &str, value: &str, expected: &str) -> SceneFileError {
    // Long lists (a mesh pasted into an attribute) would make a message of many lines.
    let mut shown: String = value.chars().take(60).collect();
    if shown.len() < value.len() {
        shown.push('…');
    }
    let shown = shown.replace(['\n', '\r', '\t'], " ");
    SceneFileError::Value {
        place: place.clone(),
        what: what.into(),
        value: shown,
        expected: expected.into(),
    }
}

/// Splits at commas and white space.
pub(crate) fn tokens(text: &str) -> Vec<&str> {
    text.split(|c: char| c == ',' || c.is_whitespace()).filter(|t| !t.is_empty()).collect()
}

/// One finite number.
pub(crate) fn number(place: &Place, what: &str, text: &str) -> Result<f64> {
    match text.trim().parse::<f64>() {
        Ok(v) if v.is_finite() && v.abs() <= f64::from(f32::MAX) => Ok(v),
        Ok(_) => Err(bad(place, what, text, "a finite number")),
        Err(_) => Err(bad(place, what, text, "a number")),
    }
}
