//! Spheres, disks and cylinders, in f64.

use glam::{DVec3, Vec3};

use super::primitives::{CylinderPrim, DiskPrim, SpherePrim};

/// Analytic primitive prepared for the test.
#[derive(Clone, Copy)]
pub(super) struct Analytic {
    pub prim: u32,
    shape: Shape,
}

#[derive(Clone, Copy)]
enum Shape {
    Sphere {
        center: DVec3,
        radius: f64,
    },
    /// `n` = u × v; `a`, `b`: the dual axes, a·u = b·v = 1, a·v = b·u = 0, both across n.
    Disk {
        center: DVec3,
        n: DVec3,
        a: DVec3,
        b: DVec3,
    },
    /// `axis`: unit vector from `base` to the other end, `length` away.
    Cylinder {
        base: DVec3,
        axis: DVec3,
        length: f64,
        radius: f64,
    },
}

/// Ray as the analytic tests want it.
#[derive(Clone, Copy)]
pub(super) struct Ray64 {
    pub o: DVec3,
    pub d: DVec3,
}

impl Ray64 {
    #[inline]
    pub fn new(o: Vec3, d: Vec3) -> Self {
        Ray64 { o: o.as_dvec3(), d: d.as_dvec3() }
    }
}

impl Analytic {
    pub fn sphere(prim: u32, s: &SpherePrim) -> Self {
        let shape = Shape::Sphere { center: s.center.as_dvec3(), radius: f64::from(s.radius) };
        Analytic { prim, shape }
    }

    pub fn disk(prim: u32, d: &DiskPrim) -> Self {
        let (u, v) = (d.u.as_dvec3(), d.v.as_dvec3());
        let n = u.cross(v);
        let (a, b) = (v.cross(n) / n.length_squared(), n.cross(u) / n.length_squared());
        Analytic { prim, shape: Shape::Disk { center: d.center.as_dvec3(), n, a, b } }
    }

    pub fn cylinder(prim: u32, c: &CylinderPrim) -> Self {
        let (base, axis) = (c.base.as_dvec3(), c.axis.as_dvec3());
        let (axis, length) = (axis.normalize_or_zero(), axis.length());
        Analytic {
            prim,
            shape: Shape::Cylinder { base, axis, length, radius: f64::from(c.radius) },
        }
    }

    /// True where a ray from a point `p` of this surface in direction `d` never meets it again: a
    /// sphere is convex. However `p` is rounded, near the limb too.
    #[inline]
    pub fn is_left_for_good(&self, p: DVec3, d: DVec3) -> bool {
        match self.shape {
            Shape::Sphere { center, .. } => (p - center).dot(d) >= 0.0,
            Shape::Disk { .. } | Shape::Cylinder { .. } => false,
        }
    }

    /// First hit with `tmin` < t < `tmax`, and its coordinates (a, b) for disks, zeros for spheres
    /// and cylinders.
    #[inline]
    pub fn intersect(&self, ray: &Ray64, tmin: f64, tmax: f64) -> Option<(f64, f64, f64)> {
        match self.shape {
            Shape::Sphere { center, radius } => {
                let (t0, t1) = sphere_roots(ray.o - center, ray.d, radius)?;
                // No comparison accepts NaN.
                let accept = |t: f64| (t > tmin && t < tmax).then_some(t);
                accept(t0).or_else(|| accept(t1)).map(|t| (t, 0.0, 0.0))
            }
            Shape::Disk { center, n, a, b } => {
                let oc = ray.o - center;
                let t = -oc.dot(n) / ray.d.dot(n);
                let q = oc + ray.d * t;
                let (qa, qb) = (q.dot(a), q.dot(b));
                // NaN (ray in the plane of the disk) fails the comparisons.
                (qa * qa + qb * qb <= 1.0 && t > tmin && t < tmax).then_some((t, qa, qb))
            }
            Shape::Cylinder { base, axis, length, radius } => {
                // Across the axis the cylinder is a circle; a ray along the axis gives NaN, which
                // nothing accepts.
                let oc = ray.o - base;
                let (along_o, along_d) = (oc.dot(axis), ray.d.dot(axis));
                let (t0, t1) = sphere_roots(oc - axis * along_o, ray.d - axis * along_d, radius)?;
                let accept = |t: f64| {
                    let height = along_o + t * along_d;
                    let on = (0.0..=length).contains(&height);
                    (on && t > tmin && t < tmax).then_some(t)
                };
                accept(t0).or_else(|| accept(t1)).map(|t| (t, 0.0, 0.0))
            }
        }
    }
}

/// Roots t₀ ≤ t₁ of |oc + t·d|² = r². The discriminant is taken from the ray's distance to the
/// centre and the small root from the product of the roots, so that neither suffers cancellation
/// (Hearn & Baker; Press et al., "Numerical Recipes", §5.6).
#[inline]
fn sphere_roots(oc: DVec3, d: DVec3, radius: f64) -> Option<(f64, f64)> {
    let a = d.length_squared();
    let b = -oc.dot(d);
    let across = oc + d * (b / a);
    let disc = radius * radius - across.length_squared();
    if disc < 0.0 {
        return None;
    }
    let q = b + (a * disc).sqrt().copysign(b);
    let (t0, t1) = ((oc.length_squared() - radius * radius) / q, q / a);
    Some(if t0 <= t1 { (t0, t1) } else { (t1, t0) })
}
