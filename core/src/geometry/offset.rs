//! From a hit to the next ray: positions, their error bounds, offsets and shadow segments.

use glam::Vec3;

use super::primitives::PrimRef;
use super::traverse::U;
use super::{Accel, Hit};
use crate::math::Ray;

impl Accel {
    /// Position of a hit on its primitive: barycentric interpolation for triangles, o + t·d brought
    /// onto the surface for spheres and cylinders, c + a·u + b·v for disks; in f64, rounded once,
    /// so that it errs by half an ulp of its own coordinates.
    ///
    /// A hit within rounding of an edge of its triangle is taken for one a little further in. On
    /// the edge itself it would lie on a wall that meets the triangle there too, and what leaves it
    /// through that wall would not meet the wall.
    ///
    /// A hit that is not of this tree gives o + t·d.
    #[inline]
    pub fn position(&self, hit: &Hit, ray: &Ray) -> Vec3 {
        self.place(hit, ray).0
    }

    /// [`Accel::position`], and the hit's two coordinates at that place.
    #[inline]
    pub(crate) fn place(&self, hit: &Hit, ray: &Ray) -> (Vec3, [f32; 2]) {
        let (mut b1, mut b2) = (hit.b1, hit.b2);
        let p = match self.prim(hit.prim) {
            Some(PrimRef::Triangle(&[a, b, c])) => {
                let origin = a.as_dvec3();
                let (e, f) = (b.as_dvec3() - origin, c.as_dvec3() - origin);
                let mut p = origin + e * b1 + f * b2;
                let least = self.facet(hit.prim).least_weight(p.as_vec3());
                if b1.min(b2).min(1.0 - b1 - b2) < least {
                    [b1, b2] = off_edges([b1, b2], least);
                    p = origin + e * b1 + f * b2;
                }
                // The rounded weights may sum to more than 1; the box keeps the point from slipping
                // through a neighbouring wall that the box touches.
                p.as_vec3().clamp(a.min(b).min(c), a.max(b).max(c))
            }
            Some(PrimRef::Sphere(s)) => {
                let c = s.center.as_dvec3();
                let q = ray.o.as_dvec3() + ray.d.as_dvec3() * hit.t - c;
                (c + q.normalize_or_zero() * f64::from(s.radius)).as_vec3()
            }
            Some(PrimRef::Disk(d)) => {
                (d.center.as_dvec3() + d.u.as_dvec3() * b1 + d.v.as_dvec3() * b2).as_vec3()
            }
            Some(PrimRef::Cylinder(c)) => {
                let q = ray.o.as_dvec3() + ray.d.as_dvec3() * hit.t;
                let (foot, out) = c.foot(q);
                (foot + out * f64::from(c.radius)).as_vec3()
            }
            None => ray.at(hit.t as f32),
        };
        (p, [b1 as f32, b2 as f32])
    }

    /// Unit geometric normal at a point `p` of the primitive: (v₁ − v₀) × (v₂ − v₀) for triangles,
    /// p − c for spheres, u × v for disks, away from the axis for cylinders, normalised in f64.
    ///
    /// Zero for a primitive that does not exist or has no area.
    pub fn normal(&self, prim: u32, p: Vec3) -> Vec3 {
        let n = match self.prim(prim) {
            Some(PrimRef::Triangle(_)) => return self.facet(prim).normal,
            Some(PrimRef::Sphere(s)) => p.as_dvec3() - s.center.as_dvec3(),
            Some(PrimRef::Disk(d)) => d.u.as_dvec3().cross(d.v.as_dvec3()),
            Some(PrimRef::Cylinder(c)) => c.foot(p.as_dvec3()).1,
            None => return Vec3::ZERO,
        };
        n.normalize_or_zero().as_vec3()
    }

    /// Distance along the normal by which a ray or segment must leave the primitive `prim` at the
    /// point `p` so that it does not meet the same primitive again: a bound on the distance of `p`
    /// from the surface and on the error of the intersection test. It depends on the coordinates of
    /// `p` and on the size of the primitive alone.
    pub fn error_bound(&self, prim: u32, p: Vec3) -> f32 {
        self.error_along(prim, p, self.normal(prim, p))
    }

    /// Unit geometric normal of a triangle.
    #[inline]
    pub(crate) fn triangle_normal(&self, prim: u32) -> Vec3 {
        self.facet(prim).normal
    }

    /// [`Accel::error_bound`] where the geometric normal is known, to either side.
    #[inline]
    pub(crate) fn error_along(&self, prim: u32, p: Vec3, n: Vec3) -> f32 {
        // Rounding of p, by at most U times each coordinate: a coordinate along the surface does
        // not count.
        let rounding = U * p.abs().dot(n.abs());
        let test = match self.prim(prim) {
            Some(PrimRef::Triangle(_)) => self.facet(prim).test,
            Some(PrimRef::Sphere(s)) => TEST_ERROR * s.radius,
            Some(PrimRef::Disk(d)) => TEST_ERROR * (d.u.abs() + d.v.abs()).max_element(),
            Some(PrimRef::Cylinder(c)) => TEST_ERROR * (c.radius + c.axis.abs().max_element()),
            None => 0.0,
        };
        rounding + test
    }
}

/// What is known of a triangle beside its corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// Unit normal (v₁ − v₀) × (v₂ − v₀); zero without an area.
    normal: Vec3,
    /// Error of the triangle test for origins near the triangle, as a distance across it.
    test: f32,
    /// Barycentric weight of a point per distance from an edge; less in slivers.
    weight: f32,
}

impl Facet {
    pub(super) fn new(&[a, b, c]: &[Vec3; 3]) -> Self {
        let (e, f, g) = (b - a, c - a, c - b);
        let length2 = e.length_squared().max(f.length_squared()).max(g.length_squared());
        // In f64: the area of a sliver is a difference, and squares of small lengths underflow.
        let (e, f) = (b.as_dvec3() - a.as_dvec3(), c.as_dvec3() - a.as_dvec3());
        let length = f64::from(length2).sqrt();
        let across = e.cross(f);
        let slimness = length * length / across.length();
        // Edge functions err by 2⁻⁵³·L²; they are divided by twice the area and multiply heights ≤
        // L.
        let test = f64::from(TEST_ERROR) * length * slimness.min(MAX_SLIMNESS);
        // The least height is 2A/L. A weight of x moves a point by x·L at most.
        let weight = slimness.min(MAX_EDGE_SLIMNESS) / length;
        let normal = across.normalize_or_zero().as_vec3();
        Facet { normal, test: test as f32, weight: weight as f32 }
    }

    /// The least barycentric weight of a point near `p`.
    #[inline]
    fn least_weight(&self, p: Vec3) -> f64 {
        let error = 2.0 * U * p.abs().max_element() + self.test;
        f64::from((EDGE * error * self.weight).min(1.0 / 16.0))
    }
}

/// Weights b₁ and b₂ of a point like [b₁, b₂] none of whose three weights is below `least` ≤ 1/16.
#[inline]
fn off_edges([b1, b2]: [f64; 2], least: f64) -> [f64; 2] {
    let mut b = [1.0 - b1 - b2, b1, b2].map(|b| b.max(least));
    // The largest weight, at least 1/3, makes up for it.
    let surplus = b[0] + b[1] + b[2] - 1.0;
    let largest = (0..3).fold(0, |i, j| if b[j] > b[i] { j } else { i });
    b[largest] -= surplus;
    [b[1], b[2]]
}

/// How far from an edge a hit is, in errors of its position (2·2⁻²⁴ of its largest coordinate). A
/// wall that meets the triangle there at an angle θ is then EDGE·sin θ errors away.
const EDGE: f32 = 16.0;

/// Slivers beyond this ratio of L² to twice the area keep less distance from their edges, so that
/// no point moves far.
const MAX_EDGE_SLIMNESS: f64 = 8.0;

/// Error of the intersection test in f64 near a primitive of size 1: some 2⁻⁴⁸, with reserve.
const TEST_ERROR: f32 = 1.0 / (1_u64 << 46) as f32;

/// Slivers beyond this ratio of L² to twice the area get no larger offset.
const MAX_SLIMNESS: f64 = 65_536.0;

/// Pushes the origin `p` of a ray off the surface with unit normal `n_g`, by `bound` to the side
/// into which the direction `toward` points, and rounds every coordinate away from the surface
/// (Pharr, Jakob & Humphreys 2023, "Physically Based Rendering", 4th ed., §6.8.6).
#[inline]
pub fn offset_origin(p: Vec3, n_g: Vec3, bound: f32, toward: Vec3) -> Vec3 {
    let side = if toward.dot(n_g) < 0.0 { -n_g } else { n_g };
    let q = p + side * bound;
    // At least one ulp and at most two, without a branch per coordinate.
    let ulp = q.abs() * (2.0 * U);
    let sign = |n: f32| f32::from(n > 0.0) - f32::from(n < 0.0);
    q + Vec3::new(sign(side.x), sign(side.y), sign(side.z)) * ulp
}

/// Ray for the visibility of two points that were pushed off their surfaces: o + t·d with t in
/// (0, 1) between them.
///
/// The ends are put in an order of their own, so that V(x, y) = V(y, x) to the bit: first the one
/// with the smaller coordinates, where a rounded direction does least harm.
pub fn segment(p: Vec3, q: Vec3) -> Ray {
    let (near, far) = (p.abs().max_element(), q.abs().max_element());
    let order = near
        .total_cmp(&far)
        .then_with(|| p.x.total_cmp(&q.x))
        .then_with(|| p.y.total_cmp(&q.y))
        .then_with(|| p.z.total_cmp(&q.z));
    let (o, e) = if order.is_le() { (p, q) } else { (q, p) };
    Ray { tmax: 1.0, ..Ray::new(o, e - o) }
}
