//! Transforms, composed in the order of the file: the first element acts first.
//!
//! The conventions are Mitsuba's: angles in degrees, column vectors, matrices row by row, and
//! `lookat` builds a left-handed looking camera frame with +x to the left of the image.

use glam::{DAffine3, DMat3, DVec3};

use super::element::Element;
use super::value::{bad, number, one_or_three, tokens, triple};
use crate::error::{Known, Place, Result, SceneFileError};
use crate::note::{NoteKind, Notes};

/// Elements that may stand in a `<transform>`.
const KNOWN: [&str; 5] = ["translate", "rotate", "scale", "lookat", "matrix"];

/// Product of the elements of a `<transform>`.
///
/// `notes` takes what is mended.
pub(crate) fn compose(
    parts: &[Element],
    old_file: bool,
    place: &Place,
    notes: &mut Notes,
) -> Result<DAffine3> {
    let mut all = DAffine3::IDENTITY;
    for part in parts {
        all = one(part, old_file, notes)? * all;
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
    if m.determinant().abs() <= 2e-12 * size {
        return bad_value("is singular: it flattens space and has no inverse");
    }
    Ok(())
}

fn one(e: &Element, old_file: bool, notes: &mut Notes) -> Result<DAffine3> {
    match e.tag.as_str() {
        "translate" => Ok(DAffine3::from_translation(vector(e, &[], 0.0)?)),
        "scale" => Ok(DAffine3::from_scale(vector(e, &[], 1.0)?)),
        "rotate" => rotate(e, notes),
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

/// Rotation about an axis, which is normalised. Mitsuba 3.9.1 forgets to do so and shears the shape
/// where the axis is no unit vector; earlier versions rotate, and so does every author expect.
fn rotate(e: &Element, notes: &mut Notes) -> Result<DAffine3> {
    let axis = vector(e, &["angle"], 0.0)?;
    let angle =
        number(&e.place, "<rotate> angle", e.need("angle", &["angle", "value", "x", "y", "z"])?)?;
    let Some(unit) = axis.try_normalize() else {
        return Err(bad(&e.place, "<rotate> axis", "0, 0, 0", "a direction"));
    };
    if (axis.length() - 1.0).abs() > 1e-4 {
        let axis = format!("{}, {}, {}", axis.x, axis.y, axis.z);
        let text = format!("<rotate>: the axis {axis} is normalised (Mitsuba 3.9 would shear)");
        notes.add(NoteKind::Mended, text, &e.place);
    }
    Ok(DAffine3::from_axis_angle(unit, angle.to_radians()))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// An element with attributes in the form `tag a=b c=d`, values without spaces but with commas.
    fn element(text: &str) -> Element {
        let mut words = text.split(' ');
        let tag = words.next().unwrap().to_string();
        let attributes = words
            .map(|w| w.split_once('=').map(|(k, v)| (k.to_string(), v.to_string())).unwrap())
            .collect();
        Element { tag, place: Place::file("t"), attributes }
    }

    fn of(parts: &[&str]) -> Result<DAffine3> {
        let parts: Vec<Element> = parts.iter().map(|p| element(p)).collect();
        compose(&parts, false, &Place::file("t"), &mut Notes::default())
    }

    /// Rows of the upper 3 × 4 part, as Mitsuba 3.9.1 gives them for the same elements.
    fn assert_rows(parts: &[&str], rows: [[f64; 4]; 3]) {
        let t = of(parts).unwrap();
        let columns = [t.matrix3.x_axis, t.matrix3.y_axis, t.matrix3.z_axis, t.translation];
        for (r, row) in rows.iter().enumerate() {
            for (c, expected) in row.iter().enumerate() {
                let value = columns[c][r];
                assert!((value - expected).abs() < 1e-6, "{parts:?} row {r} column {c}: {value}");
            }
        }
    }

    #[test]
    fn elements_act_in_the_order_of_the_file() {
        assert_rows(
            &["rotate y=1 angle=90", "scale x=2", "translate z=1", "rotate value=0,0,1 angle=30"],
            [[0.0, -0.5, 1.7320508, 0.0], [0.0, 0.8660254, 1.0, 0.0], [-1.0, 0.0, 0.0, 1.0]],
        );
    }

    #[test]
    fn lookat_builds_the_camera_frame_of_mitsuba() {
        assert_rows(
            &["lookat origin=1,2,3 target=-1,0.5,0.2 up=0,1,0"],
            [
                [-0.8137335, -0.2322683, -0.5328126, 1.0],
                [0.0, 0.9166855, -0.3996095, 2.0],
                [0.5812382, -0.3251756, -0.7459377, 3.0],
            ],
        );
    }

    #[test]
    fn lookat_finds_an_up_where_none_is_given() {
        assert_rows(
            &["lookat origin=1,2,3 target=-1,0.5,0.2"],
            [
                [-0.1219499, 0.8374001, -0.5328126, 1.0],
                [0.9085376, -0.1219499, -0.3996095, 2.0],
                [-0.3996095, -0.5328126, -0.7459377, 3.0],
            ],
        );
        assert_rows(
            &["lookat origin=0,0,0 target=0.2,0.3,-1"],
            [
                [-0.0273596, 0.9817603, 0.1881442, 0.0],
                [0.9589606, -0.0273596, 0.2822163, 0.0],
                [0.2822163, 0.1881442, -0.9407209, 0.0],
            ],
        );
    }

    #[test]
    fn matrices_are_given_row_by_row() {
        let rows = [[1.0, 2.0, 3.0, 0.0], [4.0, 5.0, 6.0, 0.0], [7.0, 8.0, 10.0, 0.0]];
        assert_rows(&["matrix value=1,2,3,4,5,6,7,8,10"], rows);
        let rows = [[1.0, 2.0, 3.0, -1.0], [4.0, 5.0, 6.0, -2.0], [7.0, 8.0, 10.0, -3.0]];
        assert_rows(&["matrix value=1,2,3,-1,4,5,6,-2,7,8,10,-3,0,0,0,1"], rows);
    }

    #[test]
    fn missing_components_are_0_for_translate_and_1_for_scale() {
        let rows = [[1.0, 0.0, 0.0, 1.0], [0.0, 3.0, 0.0, 6.0], [0.0, 0.0, 1.0, 0.0]];
        assert_rows(&["translate x=1 y=2", "scale y=3"], rows);
        let rows = [[2.0, 0.0, 0.0, 1.0], [0.0, 2.0, 0.0, 2.0], [0.0, 0.0, 2.0, 3.0]];
        assert_rows(&["scale value=2", "translate value=1,2,3"], rows);
    }

    #[test]
    fn a_rotation_about_a_long_axis_is_a_rotation_with_a_note() {
        let mut notes = Notes::default();
        let part = element("rotate x=1 y=2 z=-0.5 angle=37");
        let t = compose(&[part], false, &Place::file("t"), &mut notes).unwrap();
        assert!((t.matrix3.determinant() - 1.0).abs() < 1e-12);
        assert!(t.matrix3.x_axis.is_normalized());
        assert_eq!(notes.into_list().len(), 1);
    }

    #[test]
    fn small_transforms_are_not_singular_but_flat_ones_are() {
        assert!(of(&["scale value=1e-9"]).is_ok());
        assert!(of(&["scale x=1e-7"]).is_ok());
        assert!(of(&["scale z=0"]).is_err());
        assert!(of(&["matrix value=1,2,3,2,4,6,0,0,1"]).is_err());
    }
}
