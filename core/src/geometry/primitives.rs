//! What the tree is built of.

use std::fmt;

use glam::{DVec3, Vec3, Vec3A};
use obvhs::{Boundable, aabb::Aabb};

use super::GeometryError;

/// Coordinates beyond this magnitude are refused: the scene is meant to lie in the unit sphere, and
/// far beyond it the products of the triangle test would overflow.
const MAX_COORDINATE: f32 = 1e6;

/// Sorts of primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PrimKind {
    /// Flat triangle.
    Triangle,
    /// Full sphere.
    Sphere,
    /// Flat disk or ellipse.
    Disk,
    /// Side of a right circular cylinder.
    Cylinder,
}

impl fmt::Display for PrimKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            PrimKind::Triangle => "triangle",
            PrimKind::Sphere => "sphere",
            PrimKind::Disk => "disk",
            PrimKind::Cylinder => "cylinder",
        })
    }
}

/// Sphere |x − c| = r, hit from outside and from inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpherePrim {
    /// Centre c.
    pub center: Vec3,
    /// Radius r > 0.
    pub radius: f32,
}

/// Disk c + a·u + b·v with a² + b² ≤ 1; an ellipse where |u| ≠ |v|. The axes need not be
/// perpendicular.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiskPrim {
    /// Centre c.
    pub center: Vec3,
    /// First half axis.
    pub u: Vec3,
    /// Second half axis.
    pub v: Vec3,
}

/// Side of the cylinder about the segment from `base` to `base` + `axis`, hit from outside and from
/// inside; its ends are open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CylinderPrim {
    /// Centre of the first end.
    pub base: Vec3,
    /// From the centre of the first end to that of the other.
    pub axis: Vec3,
    /// Radius r > 0.
    pub radius: f32,
}

impl CylinderPrim {
    /// Nearest point of the axis between the ends and the unit vector from it, across the axis, towards `q`; zero
    /// where `q` lies on the axis.
    #[inline]
    pub(crate) fn foot(&self, q: DVec3) -> (DVec3, DVec3) {
        let (base, axis) = (self.base.as_dvec3(), self.axis.as_dvec3());
        let from = q - base;
        let along = from.dot(axis) / axis.length_squared();
        (base + axis * along.clamp(0.0, 1.0), (from - axis * along).normalize_or_zero())
    }
}

/// All primitives of a scene in normalised coordinates. Ids run over the triangles, then the
/// spheres, the disks and the cylinders.
///
/// Rectangles and cubes are given as triangles; where neighbours share corners, the corners must be
/// equal to the bit for the seam to be watertight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Primitives {
    /// Triangles by their three corners. One without area is never hit.
    pub triangles: Vec<[Vec3; 3]>,
    /// Spheres.
    pub spheres: Vec<SpherePrim>,
    /// Disks. One without area is never hit.
    pub disks: Vec<DiskPrim>,
    /// Cylinders. One without length is never hit.
    pub cylinders: Vec<CylinderPrim>,
}

/// One primitive, looked up by id.
#[derive(Clone, Copy, Debug)]
pub(super) enum PrimRef<'a> {
    Triangle(&'a [Vec3; 3]),
    Sphere(&'a SpherePrim),
    Disk(&'a DiskPrim),
    Cylinder(&'a CylinderPrim),
}

impl Primitives {
    /// Number of all primitives.
    pub fn len(&self) -> usize {
        self.triangles.len() + self.spheres.len() + self.disks.len() + self.cylinders.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sort of the primitive `prim` and its index in the list of that sort; `None` if there is no
    /// such primitive.
    pub fn locate(&self, prim: u32) -> Option<(PrimKind, usize)> {
        let i = prim as usize;
        let (t, s, d) = (self.triangles.len(), self.spheres.len(), self.disks.len());
        if i < t {
            Some((PrimKind::Triangle, i))
        } else if i < t + s {
            Some((PrimKind::Sphere, i - t))
        } else if i < t + s + d {
            Some((PrimKind::Disk, i - t - s))
        } else if i < self.len() {
            Some((PrimKind::Cylinder, i - t - s - d))
        } else {
            None
        }
    }

    pub(super) fn get(&self, prim: u32) -> Option<PrimRef<'_>> {
        let (kind, i) = self.locate(prim)?;
        Some(match kind {
            PrimKind::Triangle => PrimRef::Triangle(&self.triangles[i]),
            PrimKind::Sphere => PrimRef::Sphere(&self.spheres[i]),
            PrimKind::Disk => PrimRef::Disk(&self.disks[i]),
            PrimKind::Cylinder => PrimRef::Cylinder(&self.cylinders[i]),
        })
    }

    /// Checks every number: finite, in range, radii positive, counts within the limits.
    pub(super) fn validate(&self) -> Result<(), GeometryError> {
        use PrimKind::*;
        for (kind, count, limit) in [
            (Triangle, self.triangles.len(), 1 << 28),
            (Sphere, self.spheres.len(), 1 << 23),
            (Disk, self.disks.len(), 1 << 23),
            (Cylinder, self.cylinders.len(), 1 << 23),
        ] {
            if count > limit {
                return Err(GeometryError::TooMany { kind, count, limit });
            }
        }
        for (i, tri) in self.triangles.iter().enumerate() {
            for (corner, v) in tri.iter().enumerate() {
                check(Triangle, i, *v, || format!("corner {corner}"))?;
            }
        }
        for (i, s) in self.spheres.iter().enumerate() {
            check(Sphere, i, s.center, || "the centre".into())?;
            check(Sphere, i, Vec3::splat(s.radius), || "the radius".into())?;
            if s.radius <= 0.0 {
                return Err(GeometryError::Radius { kind: Sphere, index: i, radius: s.radius });
            }
        }
        for (i, d) in self.disks.iter().enumerate() {
            check(Disk, i, d.center, || "the centre".into())?;
            check(Disk, i, d.u, || "the axis u".into())?;
            check(Disk, i, d.v, || "the axis v".into())?;
        }
        for (i, c) in self.cylinders.iter().enumerate() {
            check(Cylinder, i, c.base, || "the end".into())?;
            check(Cylinder, i, c.axis, || "the axis".into())?;
            check(Cylinder, i, Vec3::splat(c.radius), || "the radius".into())?;
            if c.radius <= 0.0 {
                return Err(GeometryError::Radius { kind: Cylinder, index: i, radius: c.radius });
            }
        }
        Ok(())
    }
}

fn check(
    kind: PrimKind,
    index: usize,
    v: Vec3,
    name: impl Fn() -> String,
) -> Result<(), GeometryError> {
    if !v.is_finite() {
        let what = format!("{} ({}, {}, {})", name(), v.x, v.y, v.z);
        return Err(GeometryError::NotFinite { kind, index, what });
    }
    let value = v.abs().max_element();
    if value > MAX_COORDINATE {
        return Err(GeometryError::OutOfRange { kind, index, value });
    }
    Ok(())
}

/// Bounds of one primitive with its id, as the builder wants them.
pub(super) struct Bounded {
    pub prim: u32,
    aabb: Aabb,
}

impl Boundable for Bounded {
    fn aabb(&self) -> Aabb {
        self.aabb
    }
}

/// Bounds of all primitives that have area. The bounds of spheres, disks and cylinders are rounded outwards.
pub(super) fn bounds(p: &Primitives) -> Vec<Bounded> {
    let mut out = Vec::with_capacity(p.len());
    let mut prim = 0_u32;
    for tri in &p.triangles {
        if has_area(tri) {
            let [a, b, c] = tri.map(Vec3A::from);
            out.push(Bounded { prim, aabb: Aabb::new(a.min(b).min(c), a.max(b).max(c)) });
        }
        prim += 1;
    }
    for s in &p.spheres {
        let r = DVec3::splat(f64::from(s.radius));
        out.push(Bounded { prim, aabb: outward(s.center.as_dvec3() - r, s.center.as_dvec3() + r) });
        prim += 1;
    }
    for d in &p.disks {
        let (c, u, v) = (d.center.as_dvec3(), d.u.as_dvec3(), d.v.as_dvec3());
        if u.cross(v) != DVec3::ZERO {
            let e = (u * u + v * v).map(f64::sqrt);
            out.push(Bounded { prim, aabb: outward(c - e, c + e) });
        }
        prim += 1;
    }
    for c in &p.cylinders {
        let (base, axis) = (c.base.as_dvec3(), c.axis.as_dvec3());
        if axis != DVec3::ZERO {
            // The circle across the unit axis n reaches r·√(1 − n_i²) along coordinate i.
            let n = axis.normalize();
            let e = (1.0 - n * n).max(DVec3::ZERO).map(f64::sqrt) * f64::from(c.radius);
            let (lo, hi) = (base.min(base + axis) - e, base.max(base + axis) + e);
            out.push(Bounded { prim, aabb: outward(lo, hi) });
        }
        prim += 1;
    }
    out
}

/// Whether the corners span an area, judged in f64: what remains is rounding of the products.
fn has_area(tri: &[Vec3; 3]) -> bool {
    let [a, b, c] = tri.map(|v| v.as_dvec3());
    let (e, f) = (b - a, c - a);
    e.cross(f).length_squared() > 1e-30 * e.length_squared() * f.length_squared()
}

fn outward(min: DVec3, max: DVec3) -> Aabb {
    Aabb::new(
        Vec3A::from(min.as_vec3().to_array().map(f32::next_down)),
        Vec3A::from(max.as_vec3().to_array().map(f32::next_up)),
    )
}
