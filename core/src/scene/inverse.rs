//! Inverses of sampling on surfaces: from points and directions to the numbers that make them.

use std::f64::consts::TAU;

use glam::{DVec2, Vec3};

use super::chart::affine;
use super::shape::ShapeKind;
use super::{Scene, SurfacePoint};
use crate::bsdf::Event;
use crate::math::{Frame, warp};
use crate::random::{PrimarySample, nearest_coordinate_in};

impl Scene {
    /// Numbers (lobe, direction) by which [`Scene::sample_scatter`] takes a walk that came from
    /// `from` on towards `to` by `event`; see [`Bsdf::invert`](crate::bsdf::Bsdf::invert).
    pub fn invert_scatter<U: PrimarySample>(
        &self,
        point: &SurfacePoint,
        from: Vec3,
        to: Vec3,
        event: Event,
        free: &mut U,
    ) -> Option<[f32; 3]> {
        let (wo, wi) = (point.frame.to_local(from), point.frame.to_local(to));
        self.bsdf(point).invert(wo, wi, event, free)
    }

    /// Inverse of uniform sampling of the area of the shape that `point` lies on. `None` for a mesh
    /// that does not emit: its areas are not kept.
    pub fn invert_area(&self, point: &SurfacePoint) -> Option<[f32; 2]> {
        let shape = &self.shapes()[point.shape as usize];
        let p = point.p.as_dvec3();
        let local = (point.prim - shape.first) as usize;
        let turn = |x: f64, y: f64| {
            let turn = y.atan2(x) / TAU;
            if turn < 0.0 { turn + 1.0 } else { turn }
        };
        // Coordinates on a triangle by its corners.
        let on_triangle = || {
            let (o, u, v) = self.corner(point.prim);
            let [b1, b2] = affine(p - o, u, v);
            [b1.clamp(0.0, 1.0), b2.clamp(0.0, 1.0)]
        };
        let on_parallelogram = || {
            let [b1, b2] = on_triangle();
            if local.is_multiple_of(2) { [b1 + b2, b2] } else { [b1, b1 + b2] }
        };
        // Where in the interval of its piece a number lies.
        let in_piece = |cdf: &[f64], i: usize, x: f64| {
            let low = if i == 0 { 0.0 } else { cdf[i - 1] };
            let high = *cdf.get(i)?;
            nearest_coordinate_in(low, high, low + x * (high - low))
        };
        let [u, v] = match &shape.kind {
            ShapeKind::Mesh(mesh) => {
                let [b1, b2] = on_triangle();
                let [u, v] = warp::uniform_triangle_inverse([0.0, b1 as f32, b2 as f32]);
                return Some([in_piece(&mesh.cdf, local, u as f64)?, v]);
            }
            ShapeKind::Rectangle { .. } => on_parallelogram(),
            ShapeKind::Cube { cdf, .. } => {
                let [u, v] = on_parallelogram();
                return Some([in_piece(cdf, local / 2, u)?, v as f32]);
            }
            ShapeKind::Sphere { center, radius, .. } => {
                let d = ((p - *center) / *radius).as_vec3().normalize();
                return Some(warp::uniform_sphere_inverse(d));
            }
            ShapeKind::Disk { u, v, .. } => {
                let center = self.disk_center(point.prim);
                let on_disk = DVec2::from(affine(p - center, u.as_dvec3(), v.as_dvec3()));
                return Some(warp::concentric_disk_inverse(on_disk.as_vec2()));
            }
            ShapeKind::Cylinder(c) => {
                let (q, axis) = (p - c.base.as_dvec3(), c.axis.as_dvec3());
                let frame = Frame::from_normal(c.axis.normalize());
                let (s, t) = (frame.s.as_dvec3(), frame.t.as_dvec3());
                [turn(q.dot(s), q.dot(t)), q.dot(axis) / axis.length_squared()]
            }
        };
        Some([u as f32, v as f32])
    }
}
