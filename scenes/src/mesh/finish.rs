//! From a mesh as the file gives it to one that can be rendered.

use glam::{DAffine3, DMat3, DVec3, Vec3};
use pathspace_core::description::MeshData;

use super::{RawMesh, normals};

/// What the shape element says about its mesh.
pub(crate) struct Options {
    /// Faceted: no vertex normals, neither given nor computed.
    pub(crate) face_normals: bool,
    /// v → 1 − v.
    pub(crate) flip_v: bool,
}

/// Drops triangles without area, gives unit normals, and makes the winding agree with the vertex
/// normals of the file, which decide the side in Mitsuba. Notes are for the user. Where no triangle
/// has area, none is left.
pub(crate) fn finish(
    raw: &RawMesh,
    to_world: &DAffine3,
    options: &Options,
    notes: &mut Vec<String>,
) -> Result<MeshData, String> {
    notes.extend(raw.notes.iter().cloned());
    let mut mesh = MeshData {
        positions: raw.positions.clone(),
        uvs: raw.uvs.clone(),
        triangles: raw.triangles.clone(),
        normals: Vec::new(),
    };
    if options.flip_v {
        mesh.uvs.iter_mut().for_each(|uv| uv[1] = 1.0 - uv[1]);
    }
    let before = mesh.triangles.len();
    mesh.triangles.retain(|t| has_area(&mesh.positions, t));
    match (before, mesh.triangles.len()) {
        (before, 0) => {
            notes.push(format!("all {before} triangles have no area: left out"));
            return Ok(mesh);
        }
        (before, after) if before > after => {
            notes.push(format!("{} of {before} triangles have no area: dropped", before - after));
        }
        _ => {}
    }
    if options.face_normals {
        return Ok(mesh);
    }
    if raw.normals.is_empty() {
        let (normals, borrowed) = normals::smooth(raw, to_world);
        mesh.normals = normals;
        if borrowed > 0 {
            notes.push(format!(
                "the computed normals of {borrowed} vertices vanish: a triangle's is used"
            ));
        }
    } else {
        mesh.normals = unit_normals(raw, &mesh.triangles)?;
        let turned = turn_to_normals(&mut mesh, to_world);
        // In a mirrored mesh all triangles turn; that is as it should be.
        if turned > 0 && turned < mesh.triangles.len() {
            notes.push(format!(
                "{turned} of {} triangles are wound against their vertex normals: turned round",
                mesh.triangles.len()
            ));
        }
    }
    Ok(mesh)
}

fn corners(positions: &[[f32; 3]], triangle: &[u32; 3]) -> [DVec3; 3] {
    triangle.map(|i| Vec3::from(positions[i as usize]).as_dvec3())
}

fn has_area(positions: &[[f32; 3]], triangle: &[u32; 3]) -> bool {
    let [a, b, c] = corners(positions, triangle);
    let area = (b - a).cross(c - a).length_squared();
    area.is_finite() && area > 0.0
}

/// The file's normals with length 1. Vertices that no triangle uses may have any.
fn unit_normals(raw: &RawMesh, triangles: &[[u32; 3]]) -> Result<Vec<[f32; 3]>, String> {
    let mut out: Vec<[f32; 3]> = raw
        .normals
        .iter()
        .map(|n| Vec3::from(*n).as_dvec3().normalize_or_zero().as_vec3().to_array())
        .collect();
    let broken = |n: &[f32; 3]| *n == [0.0; 3] || !n.iter().all(|v| v.is_finite());
    for at in triangles.iter().flatten() {
        if broken(&out[*at as usize]) {
            let [x, y, z] = raw.normals[*at as usize];
            return Err(format!("normal of vertex {at} has no direction: {x} {y} {z}"));
        }
    }
    out.iter_mut().filter(|n| broken(n)).for_each(|n| *n = [0.0, 0.0, 1.0]);
    Ok(out)
}

/// Reverses triangles whose transformed winding is against their transformed vertex normals, and
/// says how many. The first edge keeps its line, because without texture coordinates it is the
/// direction of ∂p/∂u.
fn turn_to_normals(mesh: &mut MeshData, to_world: &DAffine3) -> usize {
    // cross(Ma, Mb) = det(M) M⁻ᵀ cross(a, b): the sign of the dot product with M⁻ᵀn is that of
    // det(M) (M⁻ᵀ cross(a, b))·(M⁻ᵀn).
    let m = to_world.matrix3;
    let side = m.determinant().signum();
    let inverse_transpose: DMat3 = m.inverse().transpose();
    let mut turned = 0;
    for triangle in &mut mesh.triangles {
        let [a, b, c] = corners(&mesh.positions, triangle);
        let geometric = inverse_transpose * (b - a).cross(c - a);
        let shading: DVec3 = triangle
            .map(|i| {
                let own = Vec3::from(mesh.normals[i as usize]).as_dvec3();
                (inverse_transpose * own).normalize_or_zero()
            })
            .into_iter()
            .sum();
        if side * geometric.dot(shading) < 0.0 {
            triangle.swap(0, 1);
            turned += 1;
        }
    }
    turned
}
