//! Texture coordinates (u, v) of points on surfaces, as Mitsuba 3 parametrises its shapes.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, Vec2};

use super::chart::affine;
use super::shape::ShapeKind;
use super::{Scene, SurfacePoint};

impl Scene {
    /// Texture coordinates of a point, from its position and its primitive.
    ///
    /// | shape | u | v |
    /// | --- | --- | --- |
    /// | mesh | interpolated, or the barycentric coordinate of the second corner | of the third corner |
    /// | rectangle | (x + 1)/2 | (y + 1)/2 |
    /// | cube | each face the whole square | |
    /// | sphere | φ/2π | θ/π, from +z |
    /// | disk | radius | φ/2π |
    /// | cylinder | φ/2π | along the axis |
    pub fn uv(&self, point: &SurfacePoint) -> Vec2 {
        let shape = &self.shapes()[point.shape as usize];
        let local = (point.prim - shape.first) as usize;
        let p = point.p.as_dvec3();
        let on_triangle = || {
            let (o, u, v) = self.corner(point.prim);
            let [b1, b2] = affine(p - o, u, v).map(|b| if b.is_finite() { b } else { 0.0 });
            let (b1, b2) = (b1.clamp(0.0, 1.0), b2.clamp(0.0, 1.0));
            (b1, b2.min(1.0 - b1))
        };
        let on_parallelogram = || {
            let (b1, b2) = on_triangle();
            if local.is_multiple_of(2) { (b1 + b2, b2) } else { (b1, b1 + b2) }
        };
        let (u, v) = match &shape.kind {
            ShapeKind::Mesh(mesh) => {
                let (b1, b2) = on_triangle();
                if mesh.uvs.is_empty() {
                    (b1, b2)
                } else {
                    let [a, b, c] = mesh.triangles[local].map(|i| mesh.uvs[i as usize].as_dvec2());
                    let uv: DVec2 = a * (1.0 - b1 - b2) + b * b1 + c * b2;
                    (uv.x, uv.y)
                }
            }
            ShapeKind::Rectangle { .. } => on_parallelogram(),
            ShapeKind::Cube { .. } => {
                let (a, b) = on_parallelogram();
                // The faces +y and −z run the other way.
                if matches!(local / 2, 3 | 4) { (1.0 - b, 1.0 - a) } else { (b, a) }
            }
            ShapeKind::Sphere { center, axes, .. } => {
                let n = (p - *center).normalize_or_zero();
                let [x, y, z] = axes.map(|a| a.as_dvec3().dot(n));
                (turn(x, y), x.hypot(y).atan2(z) / PI)
            }
            ShapeKind::Disk { u, v, .. } => {
                let center = self.disk_center(point.prim);
                let [x, y] = affine(p - center, u.as_dvec3(), v.as_dvec3());
                (x.hypot(y), turn(x, y))
            }
            ShapeKind::Cylinder(c) => {
                let (q, axis) = (p - c.base.as_dvec3(), c.axis.as_dvec3());
                let [s, t] = shape.around.map(|a| a.as_dvec3());
                (turn(q.dot(s), q.dot(t)), q.dot(axis) / axis.length_squared())
            }
        };
        Vec2::new(u as f32, v as f32)
    }
}

/// Angle about the axis, 0 to 1.
fn turn(x: f64, y: f64) -> f64 {
    let turn = y.atan2(x) / TAU;
    if turn < 0.0 { turn + 1.0 } else { turn }
}
