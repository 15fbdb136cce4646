//! The scene's geometry: rays, visibility, and the surface points that they meet.

use glam::Vec3;

use super::{AreaSample, Scene, ShapeKind};
use crate::geometry::{Accel, Hit, offset_origin};
use crate::math::{Frame, NO_PRIM, Ray};
use crate::rays::count_ray;
use crate::vertex::{SurfacePoint, Vertex};

impl Scene {
    /// Closest surface along a ray: the ray-casting function x_M(x, ω).
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<SurfacePoint> {
        count_ray();
        self.accel.closest(ray).map(|hit| self.surface_point(&hit, ray))
    }

    /// V(x, y): 1 where nothing stands between two vertices. Symmetric to the bit.
    #[inline]
    pub fn visible(&self, x: &Vertex, y: &Vertex) -> bool {
        count_ray();
        let (d, from, p) = match (x.position(), y.position()) {
            (Some(px), Some(py)) => {
                let (p, q) = (leave(x, px, py - px), leave(y, py, px - py));
                return !self.accel.hides(p, q, [triangle(x), triangle(y)]);
            }
            (Some(p), None) => (y.direction_from(p), x, p),
            (None, Some(p)) => (x.direction_from(p), y, p),
            (None, None) => return false,
        };
        !self.accel.occluded(&Ray { from: triangle(from), ..Ray::new(leave(from, p, d), d) })
    }

    pub(crate) fn surface_point(&self, hit: &Hit, ray: &Ray) -> SurfacePoint {
        let (p, [b1, b2]) = self.accel.place(hit, ray);
        self.complete(hit.prim, b1, b2, p)
    }

    pub(crate) fn area_sample_point(&self, sample: AreaSample) -> SurfacePoint {
        match sample {
            AreaSample::Flat { prim, b1, b2 } => {
                let hit = Hit { t: 0.0, prim, b1: b1.into(), b2: b2.into() };
                // Triangles and disks ignore the ray.
                let (p, [b1, b2]) = self.accel.place(&hit, &Ray::new(Vec3::ZERO, Vec3::Z));
                self.complete(prim, b1, b2, p)
            }
            AreaSample::Curved { prim, p } => self.curved_point(prim, p),
        }
    }

    /// A point given directly on a sphere or a cylinder.
    pub(crate) fn curved_point(&self, prim: u32, p: Vec3) -> SurfacePoint {
        self.complete(prim, 0.0, 0.0, p)
    }

    /// Normals, frame and indices at position `p` of primitive `prim`.
    #[inline]
    pub(super) fn complete(&self, prim: u32, b1: f32, b2: f32, p: Vec3) -> SurfacePoint {
        self.complete_in(&self.accel, &self.prim_shape, prim, b1, b2, p)
    }

    /// The same of a given tree.
    #[inline]
    pub(super) fn complete_in(
        &self,
        accel: &Accel,
        prim_shape: &[u32],
        prim: u32,
        b1: f32,
        b2: f32,
        p: Vec3,
    ) -> SurfacePoint {
        let shape_index = prim_shape[prim as usize];
        let shape = &self.shapes[shape_index as usize];
        let local = (prim - shape.first) as usize;
        let tangent = self.tangents[shape.material as usize];
        let (n_g, n_s, dp_du) = match &shape.kind {
            ShapeKind::Mesh(mesh) => {
                let n_g = accel.triangle_normal(prim);
                let corners = || mesh.triangles[local].map(|i| i as usize);
                let n_s = if mesh.normals.is_empty() {
                    n_g
                } else {
                    let [i0, i1, i2] = corners();
                    let n = &mesh.normals;
                    (n[i0] * (1.0 - b1 - b2) + n[i1] * b1 + n[i2] * b2).normalize_or(n_g)
                };
                let dp_du = if !tangent {
                    Vec3::ZERO
                } else {
                    let [v0, v1, v2] = accel.primitives().triangles[prim as usize];
                    if mesh.uvs.is_empty() {
                        // Mitsuba's choice where there are no texture coordinates.
                        v1 - v0
                    } else {
                        let [i0, i1, i2] = corners();
                        let (a, b) = (mesh.uvs[i1] - mesh.uvs[i0], mesh.uvs[i2] - mesh.uvs[i0]);
                        let det = a.x * b.y - a.y * b.x;
                        let d = (v1 - v0) * b.y - (v2 - v0) * a.y;
                        if det == 0.0 { Vec3::ZERO } else { d / det }
                    }
                };
                (n_g, n_s, dp_du)
            }
            ShapeKind::Rectangle { n, dp_du } => (*n, *n, *dp_du),
            ShapeKind::Cube { faces, .. } => {
                let face = &faces[local / 2];
                (face.n, face.n, face.dp_du)
            }
            ShapeKind::Sphere { center, radius, axes } => {
                let n = ((p.as_dvec3() - *center) / *radius).as_vec3().normalize();
                // ∂p/∂φ in the sphere's own axes.
                let dp_du = axes[1] * n.dot(axes[0]) - axes[0] * n.dot(axes[1]);
                (n, n, dp_du)
            }
            // ∂p/∂r: Mitsuba parameterises the disk by (r, φ).
            ShapeKind::Disk { n, u, v } => (*n, *n, *u * b1 + *v * b2),
            ShapeKind::Cylinder(c) => {
                let n = c.foot(p.as_dvec3()).1.as_vec3();
                // Along growing φ, which a mirrored cylinder has the other way round.
                let [s, t] = shape.around;
                let turns = if s.cross(t).dot(c.axis) < 0.0 { -1.0 } else { 1.0 };
                (n, n, c.axis.cross(n) * turns)
            }
        };
        let (n_g, n_s) = (n_g * shape.sign, n_s * shape.sign);
        let frame = if tangent {
            Frame::from_normal_and_tangent(n_s, dp_du)
        } else {
            Frame::from_normal(n_s)
        };
        SurfacePoint {
            p,
            n_g,
            frame,
            error: accel.error_along(prim, p, n_g),
            shape: shape_index,
            prim,
            material: shape.material,
            emitter: shape.emitter,
            media: shape.media,
        }
    }
}

/// The primitive that a vertex lies on; not met again where it is a triangle.
#[inline]
fn triangle(vertex: &Vertex) -> u32 {
    vertex.surface().map_or(NO_PRIM, |s| s.prim)
}

/// Where a segment leaves a vertex: surfaces push the origin off to the side of `d`.
#[inline]
fn leave(vertex: &Vertex, p: Vec3, d: Vec3) -> Vec3 {
    match vertex {
        Vertex::Surface(s) => offset_origin(s.p, s.n_g, s.error, d),
        _ => p,
    }
}
