//! Numbers, vectors and colours as they stand in attributes.

use glam::DVec3;

use crate::error::{Place, Result};
pub(crate) use crate::numbers::{bad, number, tokens};
use crate::spectrum::Sampled;

/// A property's value as the file gives it.
#[derive(Clone, Debug)]
pub(crate) enum Value {
    Boolean(bool),
    Integer(i64),
    Float(f64),
    String(String),
    Vector(DVec3),
    /// Linear sRGB triple.
    Rgb([f64; 3]),
    /// The same value at every wavelength.
    Spectrum(f64),
    /// Values at some wavelengths.
    Sampled(Sampled),
    Transform(glam::DAffine3),
    /// A nested object, by index.
    Object(usize),
    /// A reference to an object by its id.
    Reference(String),
}

impl Value {
    /// The tag that makes such a value, for messages.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Value::Boolean(_) => "boolean",
            Value::Integer(_) => "integer",
            Value::Float(_) => "float",
            Value::String(_) => "string",
            Value::Vector(_) => "vector",
            Value::Rgb(_) => "rgb",
            Value::Spectrum(_) | Value::Sampled(_) => "spectrum",
            Value::Transform(_) => "transform",
            Value::Object(_) | Value::Reference(_) => "object",
        }
    }

    /// The value as text, for messages.
    pub(crate) fn text(&self) -> String {
        match self {
            Value::Boolean(v) => v.to_string(),
            Value::Integer(v) => v.to_string(),
            Value::Float(v) | Value::Spectrum(v) => decimal(*v),
            Value::String(v) | Value::Reference(v) => v.clone(),
            Value::Vector(v) => format!("{}, {}, {}", v.x, v.y, v.z),
            Value::Rgb(v) => format!("{}, {}, {}", v[0], v[1], v[2]),
            Value::Sampled(_) => "a list of wavelength:value".into(),
            Value::Transform(_) => "a transform".into(),
            Value::Object(_) => "a nested object".into(),
        }
    }
}

/// A number as one would write it: very small and very large ones with an exponent.
fn decimal(v: f64) -> String {
    if v == 0.0 || (1e-4..1e9).contains(&v.abs()) { v.to_string() } else { format!("{v:e}") }
}

/// An integer in decimal.
pub(crate) fn integer(place: &Place, what: &str, text: &str) -> Result<i64> {
    text.trim().parse().map_err(|_| bad(place, what, text, "an integer"))
}

/// `true` or `false` in any case.
pub(crate) fn boolean(place: &Place, what: &str, text: &str) -> Result<bool> {
    match text.trim().to_ascii_lowercase().as_str() {
        "true" => Ok(true),
        "false" => Ok(false),
        _ => Err(bad(place, what, text, "true or false")),
    }
}

/// Three numbers.
pub(crate) fn triple(place: &Place, what: &str, text: &str) -> Result<DVec3> {
    match tokens(text).as_slice() {
        [x, y, z] => Ok(DVec3::new(
            number(place, what, x)?,
            number(place, what, y)?,
            number(place, what, z)?,
        )),
        _ => Err(bad(place, what, text, "three numbers")),
    }
}

/// Three numbers, or one for all three.
pub(crate) fn one_or_three(place: &Place, what: &str, text: &str) -> Result<DVec3> {
    match tokens(text).as_slice() {
        [v] => Ok(DVec3::splat(number(place, what, v)?)),
        [_, _, _] => triple(place, what, text),
        _ => Err(bad(place, what, text, "one or three numbers")),
    }
}

/// `<rgb>`: one or three linear values, or `#rrggbb` in sRGB.
pub(crate) fn rgb(place: &Place, what: &str, text: &str) -> Result<[f64; 3]> {
    if text.trim_start().starts_with('#') {
        return hex(place, what, text);
    }
    Ok(one_or_three(place, what, text)?.to_array())
}

/// `<srgb>`: `#rrggbb`, or one or three values with the sRGB transfer function.
pub(crate) fn srgb(place: &Place, what: &str, text: &str) -> Result<[f64; 3]> {
    if text.trim_start().starts_with('#') {
        return hex(place, what, text);
    }
    Ok(one_or_three(place, what, text)?.to_array().map(srgb_to_linear))
}

fn hex(place: &Place, what: &str, text: &str) -> Result<[f64; 3]> {
    let expected = "a colour such as #ff8000";
    let digits = text.trim().trim_start_matches('#');
    if digits.len() != 6 || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return Err(bad(place, what, text, expected));
    }
    let mut out = [0.0; 3];
    for (i, channel) in out.iter_mut().enumerate() {
        let byte = u8::from_str_radix(&digits[2 * i..2 * i + 2], 16)
            .map_err(|_| bad(place, what, text, expected))?;
        *channel = srgb_to_linear(f64::from(byte) / 255.0);
    }
    Ok(out)
}

/// IEC 61966-2-1: the sRGB value v → linear.
fn srgb_to_linear(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// `<spectrum value="…">`: one value for all wavelengths, or a list of wavelength:value. In files
/// of 0.x a single value is the same in every channel, and three values are linear sRGB.
pub(crate) fn spectrum(place: &Place, what: &str, text: &str, old: bool) -> Result<Value> {
    match tokens(text).as_slice() {
        [first, ..] if first.contains(':') => {
            Ok(Value::Sampled(Sampled::from_pairs(place, what, text)?))
        }
        [v] if old => Ok(Value::Float(number(place, what, v)?)),
        [v] => Ok(Value::Spectrum(number(place, what, v)?)),
        [_, _, _] if old => Ok(Value::Rgb(triple(place, what, text)?.to_array())),
        _ => Err(bad(place, what, text, "a number or a list of wavelength:value")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hex_colours_are_decoded_from_srgb() {
        let place = Place::file("t");
        let c = rgb(&place, "c", "#ff8000").unwrap();
        assert_eq!(c[0], 1.0);
        assert!((c[1] - 0.215_860_5).abs() < 1e-6);
        assert_eq!(c[2], 0.0);
    }

    #[test]
    fn exponents_with_three_digits_are_numbers() {
        assert_eq!(number(&Place::file("t"), "v", " -4.37114e-008 ").unwrap(), -4.37114e-8);
    }

    #[test]
    fn nan_is_no_number() {
        assert!(number(&Place::file("t"), "v", "nan").is_err());
        assert!(number(&Place::file("t"), "v", "1e39").is_err());
    }
}
