//! What the tree is built of.

use std::fmt;

use glam::{DVec3, Vec3, Vec3A};
use obvhs::{Boundable, aabb::Aabb};

use super::GeometryError;
use super::traverse::SLACK;

/// Coordinates beyond this magnitude are refused: three of them and an error bound are multiplied
/// in f32.
const MAX_COORDINATE: f32 = 1e9;

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
    /// Nearest point of the axis between the ends and the unit vector from it, across the axis,
    /// towards `q`; zero where `q` lies on the axis.
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
#[derive(Clone, Copy)]
pub(super) struct Bounded {
    pub prim: u32,
    aabb: Aabb,
}

impl Boundable for Bounded {
    fn aabb(&self) -> Aabb {
        self.aabb
    }
}

impl Bounded {
    /// Bounds widened by what rays and tests err there: see [`SLACK`].
    fn new(prim: u32, aabb: Aabb) -> Bounded {
        let slack = Vec3A::splat(SLACK * aabb.min.abs().max(aabb.max.abs()).max_element());
        Bounded { prim, aabb: Aabb::new(aabb.min - slack, aabb.max + slack) }
    }

    /// The bounds with their corners moved out at random, by up to 2⁻¹⁰ of the size and 2⁻²⁰ of the
    /// coordinates. A builder that merges the pair of least area is linear only where few areas are
    /// equal.
    pub fn jittered(&self) -> Bounded {
        let size = (self.aabb.max - self.aabb.min).max_element();
        let place = self.aabb.min.abs().max(self.aabb.max.abs()).max_element();
        let step = (size / 1024.0).max(place / 1_048_576.0) / 65_536.0;
        let bits = mix(u64::from(self.prim));
        let part = |shift: u32| (bits >> shift & 0xffff) as f32 * step;
        let (low, high) = (Vec3A::new(part(0), part(16), part(32)), Vec3A::splat(part(48)));
        Bounded { prim: self.prim, aabb: Aabb::new(self.aabb.min - low, self.aabb.max + high) }
    }
}

/// A hash of 64 bits (Stafford's variant 13 of the finaliser of MurmurHash3).
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}

/// Bounds of all primitives that have area, widened by the slack of the tests.
pub(super) fn bounds(p: &Primitives) -> Vec<Bounded> {
    let mut out = Vec::with_capacity(p.len());
    let mut prim = 0_u32;
    for tri in &p.triangles {
        if has_area(tri) {
            let [a, b, c] = tri.map(Vec3A::from);
            out.push(Bounded::new(prim, Aabb::new(a.min(b).min(c), a.max(b).max(c))));
        }
        prim += 1;
    }
    for s in &p.spheres {
        let r = DVec3::splat(f64::from(s.radius));
        out.push(Bounded::new(prim, outward(s.center.as_dvec3() - r, s.center.as_dvec3() + r)));
        prim += 1;
    }
    for d in &p.disks {
        let (c, u, v) = (d.center.as_dvec3(), d.u.as_dvec3(), d.v.as_dvec3());
        if u.cross(v) != DVec3::ZERO {
            let e = (u * u + v * v).map(f64::sqrt);
            out.push(Bounded::new(prim, outward(c - e, c + e)));
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
            out.push(Bounded::new(prim, outward(lo, hi)));
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
