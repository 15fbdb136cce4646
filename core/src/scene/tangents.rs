//! Derivatives of the position by the texture coordinates of [`Scene::uv`].

use std::f32::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::shape::ShapeKind;
use super::{Scene, SurfacePoint};
use crate::bsdf::Tangents;

impl Scene {
    /// ∂p/∂u and ∂p/∂v at a point, in its shading frame; 0 where texture coordinates do not change
    /// over a triangle.
    pub(crate) fn tangents(&self, point: &SurfacePoint) -> Tangents {
        let shape = &self.shapes()[point.shape as usize];
        let local = (point.prim - shape.first) as usize;
        let edges = || {
            let (_, u, v) = self.corner(point.prim);
            (u.as_vec3(), v.as_vec3())
        };
        // Of the two triangles of a parallelogram: its corners are 0, 1, 2 and 0, 2, 3.
        let of_parallelogram = || {
            let (u, v) = edges();
            if local.is_multiple_of(2) { (u, v - u) } else { (u - v, v) }
        };
        let (du, dv) = match &shape.kind {
            ShapeKind::Mesh(mesh) if mesh.uvs.is_empty() => edges(),
            ShapeKind::Mesh(mesh) => {
                let [a, b, c] = mesh.triangles[local].map(|i| mesh.uvs[i as usize].as_dvec2());
                let ((s, t), (_, p, q)) = ((b - a, c - a), self.corner(point.prim));
                let det = s.perp_dot(t);
                if det == 0.0 {
                    (Vec3::ZERO, Vec3::ZERO)
                } else {
                    let by = |x: f64, y: f64| -> DVec3 { (p * x + q * y) / det };
                    (by(t.y, -s.y).as_vec3(), by(-t.x, s.x).as_vec3())
                }
            }
            ShapeKind::Rectangle { .. } => of_parallelogram(),
            ShapeKind::Cube { .. } => {
                let (a, b) = of_parallelogram();
                if matches!(local / 2, 3 | 4) { (-b, -a) } else { (b, a) }
            }
            ShapeKind::Sphere { center, radius, axes } => {
                let n = ((point.p.as_dvec3() - *center) / *radius).as_vec3();
                let [x, y, z] = axes.map(|a| a.dot(n));
                let r = *radius as f32;
                let round = x.hypot(y).max(1e-6);
                let (cos, sin) = (x / round, y / round);
                let du = (axes[1] * x - axes[0] * y) * (TAU * r);
                let dv = (axes[0] * (cos * z) + axes[1] * (sin * z) - axes[2] * round) * (PI * r);
                (du, dv)
            }
            ShapeKind::Disk { u, v, .. } => {
                let p = point.p - self.disk_center(point.prim).as_vec3();
                let [x, y] = [u, v].map(|a| p.dot(*a) / a.length_squared());
                let r = x.hypot(y).max(1e-6);
                ((*u * x + *v * y) / r, (*v * x - *u * y) * TAU)
            }
            ShapeKind::Cylinder(c) => {
                let [s, t] = shape.around;
                let q = point.p - c.base;
                let (x, y) = (q.dot(s), q.dot(t));
                ((t * x - s * y) * TAU, c.axis)
            }
        };
        Tangents {
            du: point.frame.to_local(du),
            dv: point.frame.to_local(dv),
            n_g: point.frame.to_local(point.n_g),
            scale: self.normalisation().scale as f32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::*;
    use crate::math::Ray;
    use glam::DAffine3;

    /// Differences of texture coordinates between neighbouring hits agree with the derivatives.
    #[test]
    fn derivatives_are_those_of_the_coordinates() {
        let mesh = MeshData {
            positions: vec![[-1.0, -1.0, 0.0], [1.0, -0.8, 0.1], [0.2, 1.1, 0.3]],
            uvs: vec![[0.1, 0.2], [0.9, 0.3], [0.4, 0.8]],
            triangles: vec![[0, 1, 2]],
            ..MeshData::default()
        };
        let sphere = ShapeGeometry::Sphere { center: DVec3::ZERO, radius: 0.9 };
        let cylinder = ShapeGeometry::Cylinder { p0: DVec3::NEG_X, p1: DVec3::X, radius: 0.7 };
        for geometry in [
            ShapeGeometry::Mesh(mesh.into()),
            ShapeGeometry::Rectangle,
            ShapeGeometry::Cube,
            sphere,
            ShapeGeometry::Disk,
            cylinder,
        ] {
            let name = format!("{geometry:?}");
            let description = SceneDescription {
                shapes: vec![ShapeDescription {
                    name: "s".into(),
                    geometry,
                    to_world: DAffine3::from_rotation_z(0.3),
                    flip_normals: false,
                    material: 0,
                    emission: None,
                }],
                materials: vec![MaterialDescription { name: "m".into(), kind: MaterialKind::Null }],
                ..SceneDescription::default()
            };
            let scene = Scene::new(&description).unwrap();
            let hit = |x: f32, y: f32| {
                let ray = Ray::new(Vec3::new(x, y, 3.0), Vec3::NEG_Z);
                scene.intersect(&ray).unwrap()
            };
            let (x, y) = (0.11, 0.07);
            let here = hit(x, y);
            let at = scene.tangents(&here);
            for (dx, dy) in [(2e-3, 0.0), (0.0, 2e-3)] {
                let there = hit(x + dx, y + dy);
                let uv = scene.uv(&there) - scene.uv(&here);
                let step = here.frame.to_local(there.p - here.p);
                let linear = at.du * uv.x + at.dv * uv.y;
                assert!((linear - step).length() < 2e-5, "{name}: {linear} {step}");
            }
        }
    }
}
