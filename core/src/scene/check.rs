//! Checks of what a description says of its film and its shapes.

use glam::DMat3;

use super::SceneError;
use crate::description::*;
use crate::emitter::environment;
use crate::texture::Bitmap;

pub(super) fn check_film(film: &FilmDescription) -> Result<(), SceneError> {
    film.problem().map_or(Ok(()), |problem| Err(SceneError::Film { problem }))
}

/// What is wrong with an environment map.
pub(super) fn check_environment(bitmap: &Bitmap, to_world: &DMat3, scale: f32) -> Option<String> {
    let (w, h) = (bitmap.width(), bitmap.height());
    if w > environment::MAX_SIZE || h > environment::MAX_SIZE {
        let most = environment::MAX_SIZE;
        return Some(format!("an environment of {w} × {h} texels is larger than {most} × {most}"));
    }
    if bitmap.min() < 0.0 {
        return Some(format!("an environment has the negative radiance {}", bitmap.min()));
    }
    if !(scale >= 0.0 && (bitmap.max() * scale).is_finite()) {
        return Some(format!("the scale {scale} of the environment is negative or too large"));
    }
    let gram = to_world.transpose() * *to_world;
    let off = (gram - DMat3::IDENTITY).to_cols_array();
    if !off.iter().all(|v| v.abs() < 1e-6) {
        return Some("to_world of the environment is no rotation".into());
    }
    None
}

pub(super) fn check_shape(shape: &ShapeDescription, materials: usize) -> Result<(), SceneError> {
    let bad = |problem: String| Err(SceneError::Shape { shape: shape.name.clone(), problem });
    let to_world = shape.to_world;
    if !to_world.is_finite() {
        return bad("to_world is not finite".into());
    }
    let m = to_world.matrix3;
    // Relative to the lengths of the columns, so that small scenes are not refused.
    let volume = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    let det = m.determinant();
    if !(det.abs() > 1e-12 * volume) {
        // Flat shapes do not need their z axis.
        let flat = matches!(shape.geometry, ShapeGeometry::Rectangle | ShapeGeometry::Disk);
        let across = m.x_axis.cross(m.y_axis).length();
        if !flat || !(across > 1e-12 * m.x_axis.length() * m.y_axis.length()) {
            return bad(format!("to_world is singular (determinant {det})"));
        }
    }
    if shape.material >= materials {
        return bad(format!("material {} does not exist", shape.material));
    }
    if let Some(e) = shape.emission
        && !(e.is_finite() && e.r >= 0.0 && e.g >= 0.0 && e.b >= 0.0)
    {
        return bad(format!(
            "radiance {}, {}, {} is not a finite, non-negative colour",
            e.r, e.g, e.b
        ));
    }
    match &shape.geometry {
        ShapeGeometry::Mesh(mesh) => check_mesh(shape, mesh),
        ShapeGeometry::Sphere { center, radius } => {
            if !(*radius > 0.0 && radius.is_finite() && center.is_finite()) {
                return bad(format!("a sphere of radius {radius} about {center} does not exist"));
            }
            let s = [m.x_axis.length(), m.y_axis.length(), m.z_axis.length()];
            let (lo, hi) = (s[0].min(s[1]).min(s[2]), s[0].max(s[1]).max(s[2]));
            let skew = m
                .x_axis
                .dot(m.y_axis)
                .abs()
                .max(m.y_axis.dot(m.z_axis).abs())
                .max(m.z_axis.dot(m.x_axis).abs());
            if hi - lo > 1e-4 * hi || skew > 1e-4 * hi * hi {
                return bad("to_world of a sphere must scale all axes alike".into());
            }
            Ok(())
        }
        ShapeGeometry::Cylinder { p0, p1, radius } => {
            let axis = *p1 - *p0;
            let sound = *radius > 0.0 && axis.length() > 0.0;
            if !(sound && radius.is_finite() && p0.is_finite() && p1.is_finite()) {
                return bad(format!(
                    "a cylinder of radius {radius} from {p0} to {p1} does not exist"
                ));
            }
            let (x, y) = axis.normalize().any_orthonormal_pair();
            let (u, v, a) = (m * x, m * y, m * axis.normalize());
            let round = (u.length() - v.length()).abs() <= 1e-4 * u.length()
                && u.dot(v).abs() <= 1e-4 * u.length_squared();
            let right = u.dot(a).abs().max(v.dot(a).abs()) <= 1e-4 * u.length() * a.length();
            if !(round && right) {
                return bad("to_world of a cylinder must keep it right and circular".into());
            }
            Ok(())
        }
        ShapeGeometry::Rectangle | ShapeGeometry::Cube | ShapeGeometry::Disk => Ok(()),
    }
}

fn check_mesh(shape: &ShapeDescription, mesh: &MeshData) -> Result<(), SceneError> {
    let bad = |problem: String| Err(SceneError::Shape { shape: shape.name.clone(), problem });
    let n = mesh.positions.len();
    if mesh.triangles.is_empty() {
        return bad("the mesh has no triangle".into());
    }
    for (name, len) in [("normals", mesh.normals.len()), ("texture coordinates", mesh.uvs.len())] {
        if len != 0 && len != n {
            return bad(format!("{len} {name} for {n} vertices"));
        }
    }
    if let Some(t) = mesh.triangles.iter().flatten().find(|&&i| i as usize >= n) {
        return bad(format!("vertex index {t} in a mesh of {n} vertices"));
    }
    if let Some(i) = mesh.positions.iter().position(|p| !p.iter().all(|v| v.is_finite())) {
        return bad(format!("vertex {i} is not finite"));
    }
    if let Some(i) = mesh.normals.iter().position(|p| !p.iter().all(|v| v.is_finite())) {
        return bad(format!("normal {i} is not finite"));
    }
    Ok(())
}
