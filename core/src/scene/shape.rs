//! Surfaces of the built scene: normals, tangents, and uniform sampling of their area.

use glam::{DVec3, Vec2, Vec3};

use crate::geometry::CylinderPrim;
use crate::math::{Frame, warp};
use crate::medium::MediumIndex;

/// One surface, built.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Name for messages.
    pub name: String,
    pub(crate) kind: ShapeKind,
    pub(crate) material: u32,
    pub(crate) emitter: u32,
    /// −1 where `flip_normals` turns the normals round.
    pub(crate) sign: f32,
    /// Area in the normalised scene.
    pub(crate) area: f64,
    /// First primitive in the tree's numbering.
    pub(crate) first: u32,
    /// Of a cylinder: the directions from its axis at which φ is 0 and π/2.
    pub(crate) around: [Vec3; 2],
    /// The media on the side of the normal and behind, where it bounds one; of an emitter those
    /// around it.
    pub(crate) media: [MediumIndex; 2],
    /// True where it bounds a medium.
    pub(crate) bounds: bool,
    /// True where edges go through it: index-matched, in a scene with media. It is in the tree of
    /// boundaries then.
    pub(crate) passed: bool,
}

#[derive(Clone, Debug)]
pub(crate) enum ShapeKind {
    Mesh(Mesh),
    /// Two triangles of one parallelogram.
    Rectangle {
        n: Vec3,
        dp_du: Vec3,
    },
    /// Twelve triangles of one parallelepiped.
    Cube {
        faces: Box<[Face; 6]>,
        cdf: [f64; 6],
    },
    Sphere {
        center: DVec3,
        radius: f64,
        axes: [Vec3; 3],
    },
    Disk {
        n: Vec3,
        u: Vec3,
        v: Vec3,
    },
    Cylinder(Box<CylinderPrim>),
}

#[derive(Clone, Debug)]
pub(crate) struct Mesh {
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Empty or one per vertex.
    pub(crate) normals: Vec<Vec3>,
    /// Empty or one per vertex.
    pub(crate) uvs: Vec<Vec2>,
    /// Running sum of triangle areas over the whole area; only kept for emitters.
    pub(crate) cdf: Vec<f64>,
}

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Face {
    pub(crate) n: Vec3,
    pub(crate) dp_du: Vec3,
}

/// A point of a shape by primitive and coordinates on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum AreaSample {
    /// Primitive and its coordinates as in a hit.
    Flat { prim: u32, b1: f32, b2: f32 },
    /// A point of a sphere or a cylinder.
    Curved { prim: u32, p: Vec3 },
}

impl Shape {
    /// Area in the normalised scene; over `scale`² of [`super::Normalisation`] it is that in world
    /// units.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// A point uniform on the area; the density is 1/area.
    pub(crate) fn sample_area(&self, u: [f32; 2]) -> AreaSample {
        match &self.kind {
            ShapeKind::Mesh(mesh) => {
                // The choice of a triangle leaves the rest of the first number uniform again.
                let x = u[0] as f64;
                let i = mesh.cdf.partition_point(|&c| c <= x).min(mesh.cdf.len() - 1);
                let lo = if i == 0 { 0.0 } else { mesh.cdf[i - 1] };
                let rest = ((x - lo) / (mesh.cdf[i] - lo)).clamp(0.0, ONE_MINUS_EPSILON);
                let [_, b1, b2] = warp::uniform_triangle([rest as f32, u[1]]);
                AreaSample::Flat { prim: self.first + i as u32, b1, b2 }
            }
            ShapeKind::Rectangle { .. } => self.parallelogram(0, u),
            ShapeKind::Cube { cdf, .. } => {
                let x = u[0] as f64;
                let i = cdf.partition_point(|&c| c <= x).min(5);
                let lo = if i == 0 { 0.0 } else { cdf[i - 1] };
                let rest = ((x - lo) / (cdf[i] - lo)).clamp(0.0, ONE_MINUS_EPSILON);
                self.parallelogram(2 * i as u32, [rest as f32, u[1]])
            }
            ShapeKind::Sphere { center, radius, .. } => {
                let d = warp::uniform_sphere(u).as_dvec3().normalize();
                AreaSample::Curved { prim: self.first, p: (*center + d * *radius).as_vec3() }
            }
            ShapeKind::Disk { .. } => {
                let d = warp::concentric_disk(u);
                AreaSample::Flat { prim: self.first, b1: d.x, b2: d.y }
            }
            ShapeKind::Cylinder(c) => {
                let (sin, cos) = (std::f64::consts::TAU * u[0] as f64).sin_cos();
                let frame = Frame::from_normal(c.axis.normalize());
                let out = frame.s.as_dvec3() * cos + frame.t.as_dvec3() * sin;
                let foot = c.base.as_dvec3() + c.axis.as_dvec3() * u[1] as f64;
                let p = (foot + out.normalize() * c.radius as f64).as_vec3();
                AreaSample::Curved { prim: self.first, p }
            }
        }
    }

    /// A point of the parallelogram that the triangles `first + offset` (corners 0, 1, 2) and the
    /// next one (corners 0, 2, 3) tile.
    fn parallelogram(&self, offset: u32, [u, v]: [f32; 2]) -> AreaSample {
        let prim = self.first + offset;
        // Corner 0 is (0,0), 1 is (1,0), 2 is (1,1), 3 is (0,1).
        if u >= v {
            AreaSample::Flat { prim, b1: u - v, b2: v }
        } else {
            AreaSample::Flat { prim: prim + 1, b1: u, b2: v - u }
        }
    }
}

/// Largest `f32` below 1.
const ONE_MINUS_EPSILON: f64 = 1.0 - 1.0 / 16_777_216.0;
