//! Equal-area charts of surfaces: what a method that meshes surfaces (finite elements) needs to
//! know of them.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::shape::{Shape, ShapeKind};
use super::{Scene, SurfacePoint};

/// Maps the unit square, or its half u + v ≤ 1 for a triangle, onto one smooth piece of a surface
/// so that equal areas stay equal: dA = area · du dv (twice that for a triangle).
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Index of the shape.
    pub shape: u32,
    /// First primitive of the piece; a parallelogram has two.
    pub prim: u32,
    map: Map,
}

#[derive(Clone, Debug, PartialEq)]
enum Map {
    Parallelogram {
        o: DVec3,
        u: DVec3,
        v: DVec3,
    },
    Triangle {
        o: DVec3,
        u: DVec3,
        v: DVec3,
    },
    /// u = φ/2π, v = (z + 1)/2.
    Sphere {
        center: DVec3,
        radius: f64,
    },
    /// u = φ/2π, v = r².
    Disk {
        center: DVec3,
        a: DVec3,
        b: DVec3,
    },
    /// u = φ/2π, v along the axis; `a` and `b` are the unit axes across it.
    Cylinder {
        base: DVec3,
        axis: DVec3,
        a: DVec3,
        b: DVec3,
        radius: f64,
    },
}

impl Chart {
    /// Area in the normalised scene.
    pub fn area(&self) -> f64 {
        match &self.map {
            Map::Parallelogram { u, v, .. } => u.cross(*v).length(),
            Map::Triangle { u, v, .. } => 0.5 * u.cross(*v).length(),
            Map::Sphere { radius, .. } => 4.0 * PI * radius * radius,
            Map::Disk { a, b, .. } => PI * a.cross(*b).length(),
            Map::Cylinder { axis, radius, .. } => TAU * radius * axis.length(),
        }
    }

    /// Lengths of the longest lines of constant v and of constant u.
    pub fn extent(&self) -> [f64; 2] {
        match &self.map {
            Map::Parallelogram { u, v, .. } => [u.length(), v.length()],
            Map::Triangle { u, v, .. } => {
                let longest = u.length().max(v.length()).max((*u - *v).length());
                [longest; 2]
            }
            Map::Sphere { radius, .. } => [TAU * radius, PI * radius],
            Map::Disk { a, b, .. } => {
                let r = a.length().max(b.length());
                [TAU * r, r]
            }
            Map::Cylinder { axis, radius, .. } => [TAU * radius, axis.length()],
        }
    }

    /// True where the chart is the half square u + v ≤ 1.
    pub fn is_triangle(&self) -> bool {
        matches!(self.map, Map::Triangle { .. })
    }

    /// True where the chart is affine: straight lines stay straight, so that cells are polygons.
    pub fn is_affine(&self) -> bool {
        matches!(self.map, Map::Parallelogram { .. } | Map::Triangle { .. })
    }

    /// True where u = 0 and u = 1 are the same line.
    pub fn is_periodic(&self) -> bool {
        !self.is_affine()
    }

    /// Position of a point of the chart in the normalised scene.
    pub fn position(&self, [u, v]: [f64; 2]) -> DVec3 {
        match &self.map {
            Map::Parallelogram { o, u: a, v: b } | Map::Triangle { o, u: a, v: b } => {
                *o + *a * u + *b * v
            }
            Map::Sphere { center, radius } => {
                let ((sin, cos), z) = ((TAU * u).sin_cos(), 2.0 * v - 1.0);
                let r = (1.0 - z * z).max(0.0).sqrt();
                *center + DVec3::new(r * cos, r * sin, z) * *radius
            }
            Map::Disk { center, a, b } => {
                let ((sin, cos), r) = ((TAU * u).sin_cos(), v.sqrt());
                *center + *a * (r * cos) + *b * (r * sin)
            }
            Map::Cylinder { base, axis, a, b, radius } => {
                let (sin, cos) = (TAU * u).sin_cos();
                *base + *axis * v + (*a * cos + *b * sin) * *radius
            }
        }
    }

    /// Coordinates of the point of the chart nearest to a position on the surface, in \[0, 1\].
    pub fn locate(&self, p: Vec3) -> [f64; 2] {
        let p = p.as_dvec3();
        let turn = |sin: f64, cos: f64| {
            let u = sin.atan2(cos) / TAU;
            if u < 0.0 { u + 1.0 } else { u }
        };
        let [u, v] = match &self.map {
            Map::Parallelogram { o, u, v } | Map::Triangle { o, u, v } => affine(p - *o, *u, *v),
            Map::Sphere { center, radius } => {
                let q = (p - *center) / *radius;
                [turn(q.y, q.x), 0.5 * (q.z + 1.0)]
            }
            Map::Disk { center, a, b } => {
                let [x, y] = affine(p - *center, *a, *b);
                [turn(y, x), x * x + y * y]
            }
            Map::Cylinder { base, axis, a, b, .. } => {
                let q = p - *base;
                [turn(q.dot(*b), q.dot(*a)), q.dot(*axis) / axis.length_squared()]
            }
        };
        [u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)]
    }
}

/// Coordinates of q = x·a + y·b.
pub(super) fn affine(q: DVec3, a: DVec3, b: DVec3) -> [f64; 2] {
    let (aa, ab, bb, qa, qb) = (a.dot(a), a.dot(b), b.dot(b), q.dot(a), q.dot(b));
    let det = aa * bb - ab * ab;
    [(qa * bb - qb * ab) / det, (qb * aa - qa * ab) / det]
}

impl Scene {
    /// Charts that cover every surface once, in the order of primitives within each shape. A
    /// primitive without area has none.
    pub fn charts(&self) -> Vec<Chart> {
        let mut charts = Vec::new();
        for (index, shape) in self.shapes().iter().enumerate().filter(|(_, s)| !s.passed) {
            let mut add = |prim: u32, map: Map| {
                let chart = Chart { shape: index as u32, prim, map };
                if chart.area() > 0.0 {
                    charts.push(chart);
                }
            };
            let first = shape.first;
            match &shape.kind {
                ShapeKind::Mesh(mesh) => {
                    for prim in first..first + mesh.triangles.len() as u32 {
                        let (o, u, v) = self.corner(prim);
                        add(prim, Map::Triangle { o, u, v });
                    }
                }
                ShapeKind::Rectangle { .. } => add(first, self.parallelogram(first)),
                ShapeKind::Cube { .. } => {
                    for face in 0..6 {
                        add(first + 2 * face, self.parallelogram(first + 2 * face));
                    }
                }
                ShapeKind::Sphere { center, radius, .. } => {
                    add(first, Map::Sphere { center: *center, radius: *radius });
                }
                ShapeKind::Disk { u, v, .. } => {
                    let center = self.disk_center(first);
                    add(first, Map::Disk { center, a: u.as_dvec3(), b: v.as_dvec3() });
                }
                ShapeKind::Cylinder(c) => {
                    let axis = c.axis.as_dvec3();
                    let (a, b) = axis.normalize().any_orthonormal_pair();
                    let (base, radius) = (c.base.as_dvec3(), c.radius as f64);
                    add(first, Map::Cylinder { base, axis, a, b, radius });
                }
            }
        }
        charts
    }

    /// The surface point at coordinates of a chart.
    pub fn chart_point(&self, chart: &Chart, [u, v]: [f64; 2]) -> SurfacePoint {
        let p = chart.position([u, v]).as_vec3();
        let prim = match chart.map {
            // The diagonal from corner 0 to corner 2 parts the two triangles.
            Map::Parallelogram { .. } if u < v => chart.prim + 1,
            _ => chart.prim,
        };
        // Only meshes look at these: barycentric weights of the corners 1 and 2.
        self.complete(prim, u as f32, v as f32, p)
    }

    /// Whether the shading normal of a shape is its geometric one everywhere, to within 10⁻³.
    pub fn is_faceted(&self, shape: &Shape) -> bool {
        let ShapeKind::Mesh(mesh) = &shape.kind else { return true };
        mesh.normals.is_empty()
            || mesh.triangles.iter().enumerate().all(|(i, corners)| {
                let (_, u, v) = self.corner(shape.first + i as u32);
                let n = u.cross(v).normalize_or_zero().as_vec3();
                corners.iter().all(|c| (mesh.normals[*c as usize] - n).length() < 1e-3)
            })
    }

    /// Corner 0 of a triangle and the edges to corners 1 and 2.
    pub(super) fn corner(&self, prim: u32) -> (DVec3, DVec3, DVec3) {
        let [a, b, c] = self.accel().primitives().triangles[prim as usize].map(|v| v.as_dvec3());
        (a, b - a, c - a)
    }

    /// The parallelogram whose halves are the triangles `prim` (corners 0, 1, 2) and the next one
    /// (0, 2, 3).
    fn parallelogram(&self, prim: u32) -> Map {
        let (o, u, _) = self.corner(prim);
        let (_, _, v) = self.corner(prim + 1);
        Map::Parallelogram { o, u, v }
    }

    pub(super) fn disk_center(&self, prim: u32) -> DVec3 {
        let primitives = self.accel().primitives();
        let index = prim as usize - primitives.triangles.len() - primitives.spheres.len();
        primitives.disks[index].center.as_dvec3()
    }
}
