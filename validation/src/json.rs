//! Numbers in JSON, which knows no NaN and no infinity: they are written as `null`.

use serde::{Deserialize, Deserializer};

/// Reads a number, and `null` as NaN; for `#[serde(deserialize_with = …)]`.
///
/// # Errors
/// Those of the deserializer, for anything else.
pub fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// Reads a list of [`number`]s.
///
/// # Errors
/// Those of the deserializer, for anything else.
pub fn numbers<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    let values: Vec<Option<f64>> = Vec::deserialize(deserializer)?;
    Ok(values.into_iter().map(|v| v.unwrap_or(f64::NAN)).collect())
}

#[cfg(test)]
mod tests {
    use crate::stats::Estimate;

    #[test]
    fn what_is_not_finite_comes_back_as_nan() {
        let e = Estimate { value: 1.5, low: f64::NEG_INFINITY, high: f64::NAN };
        let text = serde_json::to_string(&e).unwrap();
        assert_eq!(text, r#"{"value":1.5,"low":null,"high":null}"#);
        let back: Estimate = serde_json::from_str(&text).unwrap();
        assert!(back.value == 1.5 && back.low.is_nan() && back.high.is_nan());
    }
}
