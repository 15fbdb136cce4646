//! From a description to a scene: validation, normalisation, primitives in order, emitters.

mod light;

use std::f64::consts::PI;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};

use super::check::{check_film, check_shape};
use super::shape::{Face, Mesh, Shape, ShapeKind};
use super::warnings::Sizes;
use super::{Ball, NO_EMITTER, Normalisation, Scene, SceneError, media_build};
use crate::bsdf::{Bsdf, Textures};
use crate::description::*;
use crate::emitter::{Beam, Emitter, Emitters, Environment};
use crate::geometry::{Accel, CylinderPrim, DiskPrim, Primitives, SpherePrim};
use crate::medium::MediumIndex;
use crate::sensor::Sensor;

/// Scenes that were built so far.
static SCENES: AtomicU64 = AtomicU64::new(0);

impl Scene {
    /// Builds a scene: checks every value, normalises, builds the tree.
    ///
    /// # Errors
    /// One error that names the shape, material, emitter, sensor or film value that is out of
    /// range.
    pub fn new(description: &SceneDescription) -> Result<Scene, SceneError> {
        check_film(&description.film)?;
        let mut materials = Vec::with_capacity(description.materials.len());
        for m in &description.materials {
            materials.push(Bsdf::new(&m.kind).map_err(|e| SceneError::Material {
                material: m.name.clone(),
                problem: e.to_string(),
            })?);
        }
        for s in &description.shapes {
            check_shape(s, materials.len())?;
        }
        let (normalisation, ball, start) = normalise(description)?;
        let sensor = Sensor::new(&description.sensor, &description.film, normalisation, start)?;
        let mut builder = Builder { normalisation, ball, ..Builder::default() };
        let media = media_build::has_media(&description.media);
        for s in &description.shapes {
            // Where there are media, edges go through index-matched surfaces: those have a tree of
            // their own.
            let passed = media && description.materials[s.material].kind == MaterialKind::Null;
            if passed && s.emission.is_some() {
                let problem = "emits and is index-matched: not both in a scene with media";
                return Err(SceneError::Shape { shape: s.name.clone(), problem: problem.into() });
            }
            builder.add_to(passed, s)?;
        }
        builder.number_primitives();
        for (index, e) in description.emitters.iter().enumerate() {
            builder.add_emitter(index, e)?;
        }
        let Builder {
            primitives, mut shapes, prim_shape, emitters, power, environment, beams, ..
        } = builder;
        let [solid_shape, passed_shape] = prim_shape;
        let [primitives, boundaries] = primitives;
        let sizes = Sizes::of(description, normalisation);
        sizes.check()?;
        let warnings = sizes.warnings(&sensor, &emitters, &ball);
        let tree =
            |primitives| Accel::build(primitives).map_err(|e| SceneError::Geometry(e.to_string()));
        let accel = tree(primitives)?;
        let boundaries = match boundaries.len() {
            0 => None,
            _ => Some((tree(boundaries)?, passed_shape)),
        };
        let volumes =
            media_build::build(description, normalisation.scale, &mut shapes, boundaries)?;
        let emitters = Emitters::new(emitters, &power, ball, environment)
            .ok_or_else(|| SceneError::Geometry("more than 2²⁴ emitters".into()))?
            .with_beams(beams);
        let textures: Vec<_> =
            description.materials.iter().map(|m| Textures::of(&m.kind)).collect();
        let tangents = materials.iter().zip(&textures).map(|(model, textures)| {
            model.needs_tangent() || textures.as_ref().is_some_and(Textures::need_tangent)
        });
        let tangents = tangents.collect();
        let mut scene = Scene {
            accel,
            shapes,
            prim_shape: solid_shape,
            materials,
            textures,
            tangents,
            id: SCENES.fetch_add(1, Ordering::Relaxed),
            emitters,
            sensor,
            film: description.film,
            normalisation,
            warnings,
            volumes,
        };
        scene.settle_media(&description.media)?;
        Ok(scene)
    }
}

/// Scale and shift by what surfaces occupy, the ball that beams must cover, and the ball from whose
/// border far cameras look.
fn normalise(
    description: &SceneDescription,
) -> Result<(Normalisation, Ball, Option<Ball>), SceneError> {
    let surfaces = |f: &mut dyn FnMut(DVec3, f64)| {
        for s in &description.shapes {
            for_each_bound(s, &mut *f);
        }
    };
    let camera = description.sensor.to_world.translation;
    let (center, radius) = bounding_ball(surfaces).unwrap_or((camera, 0.0));
    if !center.is_finite() || !radius.is_finite() {
        return Err(SceneError::Geometry("the extent of the surfaces is not finite".into()));
    }
    // Only along axes on which the surfaces are farther from the origin than from each other: there
    // a difference of two f32 is exact, and elsewhere the origin stays where the author's details
    // are.
    let shift = |x: f64| if x.abs() >= 3.0 * radius { f64::from(x as f32) } else { 0.0 };
    let center_shift = DVec3::new(shift(center.x), shift(center.y), shift(center.z));
    let exponent = if radius > 0.0 { radius.log2().ceil().clamp(-1000.0, 1000.0) } else { 0.0 };
    let normalisation = Normalisation { center: center_shift, scale: (-exponent).exp2() };
    let normalised = |(c, r): (DVec3, f64)| Ball {
        center: ((c - center_shift) * normalisation.scale).as_vec3(),
        radius: (r * normalisation.scale * 1.0001) as f32,
    };
    let start = (!description.shapes.is_empty()).then(|| normalised((center, radius)));
    let lens = description.sensor.aperture_radius;
    let covered = bounding_ball(|f| {
        surfaces(&mut *f);
        if lens > 0.0 {
            f(camera, lens);
        }
    });
    let ball = normalised(covered.unwrap_or((camera, 1.0)));
    Ok((normalisation, ball, start))
}

/// Centre and radius of a ball about the balls that `each` calls its argument with; `None` where
/// there are none.
fn bounding_ball(each: impl Fn(&mut dyn FnMut(DVec3, f64))) -> Option<(DVec3, f64)> {
    let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    each(&mut |p, r| {
        lo = lo.min(p - DVec3::splat(r));
        hi = hi.max(p + DVec3::splat(r));
    });
    if lo.x > hi.x {
        return None;
    }
    let center = (lo + hi) * 0.5;
    let mut radius = 0.0_f64;
    each(&mut |p, r| radius = radius.max((p - center).length() + r));
    Some((center, radius))
}

/// Calls `f` with balls whose union holds the shape.
pub(super) fn for_each_bound(s: &ShapeDescription, f: &mut dyn FnMut(DVec3, f64)) {
    let t = &s.to_world;
    match &s.geometry {
        ShapeGeometry::Mesh(mesh) => {
            for p in &mesh.positions {
                f(t.transform_point3(position(p)), 0.0);
            }
        }
        ShapeGeometry::Rectangle => {
            for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                f(t.transform_point3(DVec3::new(x, y, 0.0)), 0.0);
            }
        }
        ShapeGeometry::Cube => {
            for corner in 0..8 {
                f(t.transform_point3(cube_corner(corner)), 0.0);
            }
        }
        ShapeGeometry::Sphere { center, radius } => {
            f(t.transform_point3(*center), radius * t.matrix3.x_axis.length());
        }
        ShapeGeometry::Disk => {
            let r = t.matrix3.x_axis.length().max(t.matrix3.y_axis.length());
            f(t.translation, r);
        }
        ShapeGeometry::Cylinder { p0, p1, radius } => {
            let r = radius * cylinder_scale(&t.matrix3, *p1 - *p0);
            f(t.transform_point3(*p0), r);
            f(t.transform_point3(*p1), r);
        }
    }
}

fn position(p: &[f32; 3]) -> DVec3 {
    DVec3::new(p[0] as f64, p[1] as f64, p[2] as f64)
}

/// Corner of [−1,1]³ by the bits of `index`.
fn cube_corner(index: usize) -> DVec3 {
    let c = |bit: usize| if index >> bit & 1 == 1 { 1.0 } else { -1.0 };
    DVec3::new(c(0), c(1), c(2))
}

/// Own axis along ±∂p/∂u of each face, as Mitsuba lays its texture coordinates.
const CUBE_TANGENTS: [usize; 6] = [1, 1, 2, 0, 1, 1];

/// Corners of each face counter-clockwise from outside.
const CUBE_FACES: [[usize; 4]; 6] = [
    [0, 4, 6, 2], // −x
    [5, 1, 3, 7], // +x
    [0, 1, 5, 4], // −y
    [2, 6, 7, 3], // +y
    [1, 0, 2, 3], // −z
    [4, 5, 7, 6], // +z
];

#[derive(Default)]
struct Builder {
    normalisation: Normalisation,
    ball: Ball,
    /// Of surfaces that are vertices, and of those that edges go through.
    primitives: [Primitives; 2],
    /// Which of both the next shape adds to.
    side: usize,
    shapes: Vec<Shape>,
    prim_shape: [Vec<u32>; 2],
    emitters: Vec<Emitter>,
    power: Vec<f64>,
    environment: Option<Environment>,
    beams: Vec<Beam>,
}

impl Builder {
    fn add_to(&mut self, passed: bool, s: &ShapeDescription) -> Result<(), SceneError> {
        self.side = usize::from(passed);
        self.add(s)
    }

    fn add(&mut self, s: &ShapeDescription) -> Result<(), SceneError> {
        let n = self.normalisation;
        // Own space → normalised scene in f64; only the result is rounded.
        let t = DAffine3::from_scale(DVec3::splat(n.scale))
            * DAffine3::from_translation(-n.center)
            * s.to_world;
        let normal = normal_transform(t.matrix3);
        let (first, kind, area) = match &s.geometry {
            ShapeGeometry::Mesh(mesh) => self.mesh(mesh, &t, normal, s.emission.is_some()),
            ShapeGeometry::Rectangle => self.rectangle(&t),
            ShapeGeometry::Cube => self.cube(&t, normal),
            ShapeGeometry::Sphere { center, radius } => self.sphere(&t, *center, *radius),
            ShapeGeometry::Disk => self.disk(&t),
            ShapeGeometry::Cylinder { p0, p1, radius } => self.cylinder(&t, *p0, *p1, *radius),
        };
        if !(area > 0.0) {
            return Err(SceneError::Shape { shape: s.name.clone(), problem: "has no area".into() });
        }
        let shape = self.shapes.len() as u32;
        let emitter = match s.emission {
            Some(radiance) => {
                self.emitters.push(Emitter::Area { shape, radiance });
                self.power.push(radiance.mean() as f64 * PI * area);
                self.emitters.len() as u32 - 1
            }
            None => NO_EMITTER,
        };
        self.shapes.push(Shape {
            name: s.name.clone(),
            kind,
            material: s.material as u32,
            emitter,
            sign: if s.flip_normals { -1.0 } else { 1.0 },
            area,
            first,
            around: around(s),
            media: [MediumIndex::NONE; 2],
            bounds: false,
            passed: self.side == 1,
        });
        Ok(())
    }

    fn mesh(
        &mut self,
        mesh: &MeshData,
        t: &DAffine3,
        normal: DMat3,
        emits: bool,
    ) -> (u32, ShapeKind, f64) {
        let first = self.primitives[self.side].triangles.len() as u32;
        let positions: Vec<Vec3> =
            mesh.positions.iter().map(|p| t.transform_point3(position(p)).as_vec3()).collect();
        let mut running = 0.0;
        let mut cdf = Vec::new();
        for tri in &mesh.triangles {
            let v = tri.map(|i| positions[i as usize]);
            let [a, b, c] = v.map(|p| p.as_dvec3());
            running += 0.5 * (b - a).cross(c - a).length();
            if emits {
                cdf.push(running);
            }
            self.primitives[self.side].triangles.push(v);
        }
        for c in &mut cdf {
            *c /= running;
        }
        let normals =
            mesh.normals.iter().map(|n| (normal * position(n)).normalize_or_zero().as_vec3());
        let kind = ShapeKind::Mesh(Mesh {
            triangles: mesh.triangles.clone(),
            normals: normals.collect(),
            uvs: mesh.uvs.iter().map(|&uv| Vec2::from(uv)).collect(),
            cdf,
        });
        (first, kind, running)
    }

    fn quad(&mut self, c: [Vec3; 4]) {
        self.primitives[self.side].triangles.push([c[0], c[1], c[2]]);
        self.primitives[self.side].triangles.push([c[0], c[2], c[3]]);
    }

    fn rectangle(&mut self, t: &DAffine3) -> (u32, ShapeKind, f64) {
        let first = self.primitives[self.side].triangles.len() as u32;
        let corner = |x, y| t.transform_point3(DVec3::new(x, y, 0.0)).as_vec3();
        self.quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
        let (u, v) = (t.matrix3.x_axis, t.matrix3.y_axis);
        let n = flat_normal(t);
        let kind = ShapeKind::Rectangle { n, dp_du: u.as_vec3() };
        (first, kind, 4.0 * u.cross(v).length())
    }

    fn cube(&mut self, t: &DAffine3, normal: DMat3) -> (u32, ShapeKind, f64) {
        let first = self.primitives[self.side].triangles.len() as u32;
        let corners: [Vec3; 8] =
            std::array::from_fn(|i| t.transform_point3(cube_corner(i)).as_vec3());
        let mut faces = Box::new([Face::default(); 6]);
        let mut cdf = [0.0; 6];
        let mut area = 0.0;
        for (i, corner) in CUBE_FACES.iter().enumerate() {
            self.quad(corner.map(|c| corners[c]));
            let [a, b, _, d] = corner.map(|c| t.transform_point3(cube_corner(c)));
            area += (b - a).cross(d - a).length();
            cdf[i] = area;
            let own: DVec3 = corner.iter().map(|&c| cube_corner(c)).sum::<DVec3>() * 0.25;
            faces[i] = Face {
                n: (normal * own).normalize().as_vec3(),
                // The faces +y and −z run the other way.
                dp_du: t.matrix3.col(CUBE_TANGENTS[i]).as_vec3()
                    * if matches!(i, 3 | 4) { -1.0 } else { 1.0 },
            };
        }
        (first, ShapeKind::Cube { faces, cdf: cdf.map(|c| c / area) }, area)
    }

    fn sphere(&mut self, t: &DAffine3, center: DVec3, radius: f64) -> (u32, ShapeKind, f64) {
        let m = t.matrix3;
        let scale = (m.x_axis.length() + m.y_axis.length() + m.z_axis.length()) / 3.0;
        // The tree intersects the rounded sphere: normals and area are those of the same one.
        let center = t.transform_point3(center).as_vec3();
        let radius = (radius * scale) as f32;
        let first = self.primitives[self.side].spheres.len() as u32;
        self.primitives[self.side].spheres.push(SpherePrim { center, radius });
        let axes = [m.x_axis, m.y_axis, m.z_axis].map(|a| a.normalize().as_vec3());
        let r = radius as f64;
        let kind = ShapeKind::Sphere { center: center.as_dvec3(), radius: r, axes };
        (first, kind, 4.0 * PI * r * r)
    }

    fn disk(&mut self, t: &DAffine3) -> (u32, ShapeKind, f64) {
        let first = self.primitives[self.side].disks.len() as u32;
        let (u, v) = (t.matrix3.x_axis.as_vec3(), t.matrix3.y_axis.as_vec3());
        self.primitives[self.side].disks.push(DiskPrim { center: t.translation.as_vec3(), u, v });
        let kind = ShapeKind::Disk { n: flat_normal(t), u, v };
        (first, kind, PI * t.matrix3.x_axis.cross(t.matrix3.y_axis).length())
    }

    fn cylinder(
        &mut self,
        t: &DAffine3,
        p0: DVec3,
        p1: DVec3,
        radius: f64,
    ) -> (u32, ShapeKind, f64) {
        let first = self.primitives[self.side].cylinders.len() as u32;
        // As with spheres, normals and area are those of the rounded cylinder.
        let prim = CylinderPrim {
            base: t.transform_point3(p0).as_vec3(),
            axis: t.transform_vector3(p1 - p0).as_vec3(),
            radius: (radius * cylinder_scale(&t.matrix3, p1 - p0)) as f32,
        };
        self.primitives[self.side].cylinders.push(prim);
        let area = 2.0 * PI * prim.radius as f64 * prim.axis.as_dvec3().length();
        (first, ShapeKind::Cylinder(Box::new(prim)), area)
    }

    /// Numbers primitives as the tree does: triangles, then spheres, disks, cylinders.
    fn number_primitives(&mut self) {
        for side in 0..2 {
            self.number_primitives_of(side);
        }
    }

    fn number_primitives_of(&mut self, side: usize) {
        let primitives = &self.primitives[side];
        let triangles = primitives.triangles.len() as u32;
        let spheres = primitives.spheres.len() as u32;
        let disks = primitives.disks.len() as u32;
        let prim_shape = &mut self.prim_shape[side];
        *prim_shape = vec![0; primitives.len()];
        for (index, shape) in self.shapes.iter_mut().enumerate() {
            if usize::from(shape.passed) != side {
                continue;
            }
            let count = match &shape.kind {
                ShapeKind::Mesh(mesh) => mesh.triangles.len() as u32,
                ShapeKind::Rectangle { .. } => 2,
                ShapeKind::Cube { .. } => 12,
                ShapeKind::Sphere { .. } => {
                    shape.first += triangles;
                    1
                }
                ShapeKind::Disk { .. } => {
                    shape.first += triangles + spheres;
                    1
                }
                ShapeKind::Cylinder(_) => {
                    shape.first += triangles + spheres + disks;
                    1
                }
            };
            let range = shape.first as usize..(shape.first + count) as usize;
            prim_shape[range].fill(index as u32);
        }
    }

    fn has_environment(&self) -> bool {
        let is = |e: &Emitter| matches!(e, Emitter::Constant { .. } | Emitter::Environment { .. });
        self.emitters.iter().any(is)
    }
}

/// Cofactor matrix: transforms normals, and keeps the side for mirrored transforms up to its sign.
fn normal_transform(m: DMat3) -> DMat3 {
    let det = m.determinant().signum();
    DMat3::from_cols(
        m.y_axis.cross(m.z_axis) * det,
        m.z_axis.cross(m.x_axis) * det,
        m.x_axis.cross(m.y_axis) * det,
    )
}

/// Where φ is 0 and π/2 about a cylinder: the tangents of its own axis by Duff et al., "Building an
/// Orthonormal Basis, Revisited" (2017), as Mitsuba lays its texture coordinates.
fn around(s: &ShapeDescription) -> [Vec3; 2] {
    let ShapeGeometry::Cylinder { p0, p1, .. } = &s.geometry else { return [Vec3::ZERO; 2] };
    let n = (*p1 - *p0).normalize();
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [
        DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        DVec3::new(b, sign + n.y * n.y * a, -n.y),
    ]
    .map(|t| s.to_world.transform_vector3(t).normalize_or_zero().as_vec3())
}

/// By how much a transform stretches a cylinder of this axis across it.
fn cylinder_scale(m: &DMat3, axis: DVec3) -> f64 {
    let (x, y) = axis.normalize().any_orthonormal_pair();
    0.5 * ((*m * x).length() + (*m * y).length())
}

/// Normal of rectangles and disks: the transformed +z, which does not need an invertible z axis.
fn flat_normal(t: &DAffine3) -> Vec3 {
    let m = t.matrix3;
    let n = m.x_axis.cross(m.y_axis).normalize();
    // A mirror in the plane turns the cross product but not the side that +z is mapped to.
    let mirrored = m.determinant() < 0.0;
    let side = if mirrored { -1.0 } else { 1.0 };
    (n * side).as_vec3()
}
