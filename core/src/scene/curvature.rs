//! How normals turn along surfaces.

use glam::{DVec3, Vec3};

use super::{Scene, ShapeKind, SurfacePoint};

impl Scene {
    /// Change of the shading normal n_s per step `d` along the surface (a vector in the tangent
    /// plane of n_g): dn_s = ∂n_s/∂p · d.
    ///
    /// 0 on flat surfaces, d/R on spheres, the part across the axis over R on cylinders; on meshes
    /// the derivative of the interpolated normal.
    pub fn normal_change(&self, point: &SurfacePoint, d: DVec3) -> DVec3 {
        let Some(shape) = self.shapes.get(point.shape as usize) else { return DVec3::ZERO };
        let sign = f64::from(shape.sign);
        match &shape.kind {
            ShapeKind::Rectangle { .. } | ShapeKind::Cube { .. } | ShapeKind::Disk { .. } => {
                DVec3::ZERO
            }
            ShapeKind::Sphere { radius, .. } => d * (sign / radius),
            ShapeKind::Cylinder(c) => {
                let axis = c.axis.as_dvec3().normalize_or_zero();
                (d - axis * axis.dot(d)) * (sign / f64::from(c.radius))
            }
            ShapeKind::Mesh(mesh) => {
                let local = point.prim.checked_sub(shape.first).map(|i| i as usize);
                let (Some(corners), Some(triangle)) = (
                    self.accel.primitives().triangles.get(point.prim as usize),
                    local.and_then(|i| mesh.triangles.get(i)),
                ) else {
                    return DVec3::ZERO;
                };
                if mesh.normals.is_empty() {
                    return DVec3::ZERO;
                }
                let [v0, v1, v2] = corners.map(|v: Vec3| v.as_dvec3());
                let [n0, n1, n2] = triangle.map(|i| mesh.normals[i as usize].as_dvec3());
                // Barycentric coordinates are linear: b₁ = g₁·(p − v₀), b₂ = g₂·(p − v₀).
                let (e1, e2) = (v1 - v0, v2 - v0);
                let normal = e1.cross(e2);
                let area2 = normal.length_squared();
                let (g1, g2) = (e2.cross(normal) / area2, normal.cross(e1) / area2);
                let at = point.p.as_dvec3() - v0;
                let (b1, b2) = (g1.dot(at), g2.dot(at));
                let n = n0 * (1.0 - b1 - b2) + n1 * b1 + n2 * b2;
                let dn = (n1 - n0) * g1.dot(d) + (n2 - n0) * g2.dot(d);
                let length = n.length();
                if length == 0.0 {
                    return DVec3::ZERO;
                }
                let unit = n / length;
                (dn - unit * unit.dot(dn)) * (sign / length)
            }
        }
    }
}
