//! Transforms, composed in the order of the file: the first element acts first.
//!
//! The conventions are Mitsuba's: angles in degrees, column vectors, matrices row by row, and
//! `lookat` builds a left-handed looking camera frame with +x to the left of the image.

use glam::{DAffine3, DMat3, DVec3};

use super::element::Element;
use super::value::{bad, number, one_or_three, tokens, triple};
use crate::error::{Known, Place, Result, SceneFileError};

/// Elements that may stand in a `<transform>`.
const KNOWN: [&str; 5] = ["translate", "rotate", "scale", "lookat", "matrix"];

/// Product of the elements of a `<transform>`.
pub(crate) fn compose(parts: &[Element], old_file: bool, place: &Place) -> Result<DAffine3> {
    let mut all = DAffine3::IDENTITY;
    for part in parts {
        all = one(part, old_file)? * all;
    }
    check(&all, place)?;
    Ok(all)
}

/// Refuses transforms that flatten space, or that are too large for single precision.
fn check(t: &DAffine3, place: &Place) -> Result<()> {
    let m = t.matrix3;
    let size = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    let bad_value = |reason: &str| {
        Err(SceneFileError::Scene { place: place.clone(), reason: format!("transform {reason}") })
    };
    if !t.is_finite() || t.to_cols_array().iter().any(|v| v.abs() > f64::from(f32::MAX)) {
        return bad_value("is not finite");
    }
    // Relative to the lengths of the columns: small transforms are fine, flat ones are not.
    if m.determinant().abs() <= 1e-14 * size {
        return bad_value("is singular: it flattens space and has no inverse");
    }
    Ok(())
}

fn one(e: &Element, old_file: bool) -> Result<DAffine3> {
    match e.tag.as_str() {
        "translate" => Ok(DAffine3::from_translation(vector(e, &[], 0.0)?)),
        "scale" => Ok(DAffine3::from_scale(vector(e, &[], 1.0)?)),
        "rotate" => rotate(e),
        "lookat" => look_at(e),
        // Mitsuba 0.5 wrote it so; Mitsuba 3 refuses it.
        "lookAt" if old_file => look_at(e),
        "matrix" => matrix(e),
        other => Err(SceneFileError::Element {
            place: e.place.clone(),
            element: other.into(),
            within: "<transform>".into(),
            known: Known::new(KNOWN),
        }),
    }
}

/// `x`, `y`, `z`, each with a default, or `value` with one or three numbers.
fn vector(e: &Element, others: &[&str], default: f64) -> Result<DVec3> {
    let mut known = vec!["value", "x", "y", "z"];
    known.extend(others);
    e.only(&known)?;
    let component = |name: &str| match e.get(name) {
        Some(text) => number(&e.place, &format!("<{}> {name}", e.tag), text),
        None => Ok(default),
    };
    match e.get("value") {
        Some(text) => {
            if let Some(double) = ["x", "y", "z"].iter().find(|n| e.get(n).is_some()) {
                let what = format!("<{}> {double}", e.tag);
                let value = e.get(double).unwrap_or_default();
                return Err(bad(&e.place, &what, value, "allowed beside \"value\""));
            }
            one_or_three(&e.place, &format!("<{}> value", e.tag), text)
        }
        None => Ok(DVec3::new(component("x")?, component("y")?, component("z")?)),
    }
}

fn rotate(e: &Element) -> Result<DAffine3> {
    let axis = vector(e, &["angle"], 0.0)?;
    let angle = number(&e.place, "<rotate> angle", e.need("angle", &["angle", "x", "y", "z"])?)?;
    match axis.try_normalize() {
        Some(axis) => Ok(DAffine3::from_axis_angle(axis, angle.to_radians())),
        None => Err(bad(&e.place, "<rotate> axis", "0, 0, 0", "a direction")),
    }
}

/// Camera frame: z towards the target, x = up × z (left in the image), y = z × x.
fn look_at(e: &Element) -> Result<DAffine3> {
    let known = ["origin", "target", "up"];
    e.only(&known)?;
    let point = |name: &str| triple(&e.place, &format!("<lookat> {name}"), e.need(name, &known)?);
    let (origin, target) = (point("origin")?, point("target")?);
    let Some(z) = (target - origin).try_normalize() else {
        let value = e.get("target").unwrap_or_default();
        return Err(bad(&e.place, "<lookat> target", value, "different from the origin"));
    };
    let up = match e.get("up") {
        Some(text) if !text.trim().is_empty() => triple(&e.place, "<lookat> up", text)?,
        _ => DVec3::ZERO,
    };
    let up = if up == DVec3::ZERO { any_perpendicular(z) } else { up };
    let Some(x) = up.cross(z).try_normalize() else {
        let value = e.get("up").unwrap_or_default();
        return Err(bad(&e.place, "<lookat> up", value, "a direction other than the view's"));
    };
    let m = DMat3::from_cols(x, z.cross(x), z);
    Ok(DAffine3 { matrix3: m, translation: origin })
}

/// First tangent of the frame of Duff et al., "Building an Orthonormal Basis, Revisited" (2017),
/// which Mitsuba uses where `up` is missing.
fn any_perpendicular(n: DVec3) -> DVec3 {
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    DVec3::new(1.0 + sign * n.x * n.x * a, sign * n.x * n.y * a, -sign * n.x)
}

fn matrix(e: &Element) -> Result<DAffine3> {
    e.only(&["value"])?;
    let text = e.need("value", &["value"])?;
    let values = tokens(text)
        .iter()
        .map(|t| number(&e.place, "<matrix> value", t))
        .collect::<Result<Vec<f64>>>()?;
    let n = match values.len() {
        9 => 3,
        16 => 4,
        count => {
            let shown = format!("{count} numbers");
            return Err(bad(&e.place, "<matrix> value", &shown, "9 or 16 numbers"));
        }
    };
    if n == 4 && values[12..] != [0.0, 0.0, 0.0, 1.0] {
        let last = values[12..].iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        return Err(bad(&e.place, "<matrix> last row", &last, "0 0 0 1 (affine)"));
    }
    let column = |c: usize| DVec3::new(values[c], values[n + c], values[2 * n + c]);
    Ok(DAffine3 {
        matrix3: DMat3::from_cols(column(0), column(1), column(2)),
        translation: if n == 4 { column(3) } else { DVec3::ZERO },
    })
}
