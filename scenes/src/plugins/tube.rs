//! The side of a cylinder as a mesh, for transforms that make it elliptic or slanted.

use std::f64::consts::TAU;

use glam::DVec3;
use pathspace_core::description::MeshData;

/// Quadrilaterals round the axis.
pub(super) const SEGMENTS: u32 = 256;

/// The tube in its own space, with smooth normals. `mirrored` turns the triangles, so that they
/// face outwards after a transform that mirrors.
pub(super) fn mesh(p0: DVec3, p1: DVec3, radius: f64, mirrored: bool) -> MeshData {
    let (x, y) = (p1 - p0).normalize().any_orthonormal_pair();
    let mut mesh = MeshData::default();
    for i in 0..=SEGMENTS {
        let turn = f64::from(i) / f64::from(SEGMENTS);
        let (sin, cos) = (TAU * turn).sin_cos();
        let out = x * cos + y * sin;
        for (end, v) in [(p0, 0.0), (p1, 1.0)] {
            mesh.positions.push((end + out * radius).as_vec3().to_array());
            mesh.normals.push(out.as_vec3().to_array());
            mesh.uvs.push([turn as f32, v]);
        }
    }
    for i in 0..SEGMENTS {
        let [a, b, c, d] = [2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1];
        for [p, q, r] in [[a, b, c], [a, c, d]] {
            mesh.triangles.push(if mirrored { [q, p, r] } else { [p, q, r] });
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_face_outwards() {
        let mesh = mesh(DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.0, 2.0, 5.0), 0.5, false);
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| glam::Vec3::from(mesh.positions[i as usize]));
            let normal = glam::Vec3::from(mesh.normals[t[0] as usize]);
            assert!((b - a).cross(c - a).dot(normal) > 0.0);
        }
    }
}
