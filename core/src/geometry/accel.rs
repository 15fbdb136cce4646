//! The public face of the tree.

use glam::Vec3;

use super::analytic::Ray64;
use super::layout::{Block, Node, Tree};
use super::offset::{Margins, segment};
use super::primitives::PrimRef;
use super::traverse::Doubt;
use super::{GeometryError, Primitives, build, lanes, traverse};
use crate::math::Ray;

/// No triangle: what [`Accel::hides`] does not leave out.
pub const NO_PRIM: u32 = u32::MAX;

/// Where a ray meets a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f64,
    /// Primitive: triangles first, then spheres, disks, cylinders.
    pub prim: u32,
    /// Barycentric weight of corner 1 of a triangle; a of a disk's c + a·u + b·v; 0 for a sphere or cylinder.
    pub b1: f64,
    /// Barycentric weight of corner 2 of a triangle; b of a disk; 0 for a sphere or cylinder.
    pub b2: f64,
}

/// Size of a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stats {
    /// Inner nodes of eight children.
    pub nodes: usize,
    /// Blocks of eight triangles.
    pub blocks: usize,
    /// Spheres, disks and cylinders in leaves.
    pub analytic: usize,
    /// Levels of inner nodes.
    pub depth: usize,
    /// Bytes of nodes and leaves together, without the primitives themselves.
    pub bytes: usize,
}

/// Immutable ray-traversal structure over [`Primitives`]; see the [module](super).
///
/// A ray's hits are those with tmin < t < tmax and t > 0. A ray that is not finite, whose direction
/// is shorter than the smallest normal f32, or whose interval is empty hits nothing.
pub struct Accel {
    tree: Tree,
    prims: Primitives,
    /// Where the lanes of f32 are exact enough for silhouettes.
    near: Near,
    /// What positions on a triangle need, per triangle.
    margins: Vec<Margins>,
    wide: bool,
}

impl Accel {
    /// Builds the tree; the same input gives the same tree for any number of threads.
    ///
    /// The smallest primitive is the smallest thing whose outline matters, see [`Accel::build_for`].
    ///
    /// # Errors
    /// Numbers that are not finite or beyond 10⁹, radii that are not positive, too many primitives.
    pub fn build(prims: Primitives) -> Result<Accel, GeometryError> {
        Self::build_for(prims, f32::INFINITY)
    }

    /// Builds the tree for shapes of which the smallest is `smallest` wide, or its largest triangle if that is less.
    ///
    /// Where the rounding of edge functions, which grows with the size of triangles and the distance of
    /// origins, would move outlines by 10⁻² of that, rays take a walk that allows for it.
    ///
    /// # Errors
    /// As [`Accel::build`].
    pub fn build_for(prims: Primitives, smallest: f32) -> Result<Accel, GeometryError> {
        prims.validate()?;
        let near = Near::new(&prims.triangles, smallest);
        let tree = build::build(&prims);
        let margins = prims.triangles.iter().map(Margins::new).collect();
        Ok(Accel { tree, prims, near, margins, wide: has_avx2() })
    }

    /// The primitives the tree was built of.
    pub fn primitives(&self) -> &Primitives {
        &self.prims
    }

    /// Closest hit; among equal t the smallest primitive id.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        #[cfg(target_arch = "x86_64")]
        if self.wide {
            if self.near.contains(ray.o) {
                // SAFETY: `wide` says that the processor has AVX2.
                if let Ok(hit) = unsafe { closest_avx2(&self.tree, ray) } {
                    return hit;
                }
            }
            // SAFETY: as above.
            return unsafe { closest_careful_avx2(&self.tree, ray) };
        }
        self.closest_portable(ray)
    }

    /// Whether the ray hits anything: 1 − V for an unbounded shadow ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.hidden(ray, &Ray64::new(ray.o, ray.d), [NO_PRIM; 2])
    }

    /// [`Accel::occluded`] for a ray that starts on the triangle `from`, which it does not meet again.
    #[inline]
    pub fn occluded_from(&self, ray: &Ray, from: u32) -> bool {
        self.hidden(ray, &Ray64::new(ray.o, ray.d), [from, NO_PRIM])
    }

    /// Whether anything lies between `p` and `q`: 1 − V. Symmetric to the bit. `on` are the triangles that they lie
    /// on ([`NO_PRIM`] for none), which the segment does not meet again.
    ///
    /// The direction is the exact difference, so that the segment ends where it should however long it is.
    #[inline]
    pub fn hides(&self, p: Vec3, q: Vec3, on: [u32; 2]) -> bool {
        let ray = segment(p, q);
        let o = ray.o.as_dvec3();
        let end = if ray.o == p { q } else { p };
        self.hidden(&ray, &Ray64 { o, d: end.as_dvec3() - o }, on)
    }

    #[inline]
    fn hidden(&self, ray: &Ray, exact: &Ray64, skip: [u32; 2]) -> bool {
        #[cfg(target_arch = "x86_64")]
        if self.wide {
            if self.near.contains(ray.o) {
                // SAFETY: `wide` says that the processor has AVX2.
                if let Ok(hit) = unsafe { occluded_avx2(&self.tree, ray, exact, skip) } {
                    return hit;
                }
            }
            // SAFETY: as above.
            return unsafe { occluded_careful_avx2(&self.tree, ray, exact, skip) };
        }
        self.hidden_portable(ray, exact, skip)
    }

    /// [`Accel::closest`] by the code path for any processor: the same bits, only slower.
    pub fn closest_portable(&self, ray: &Ray) -> Option<Hit> {
        if self.near.contains(ray.o)
            && let Ok(hit) = traverse::closest::<lanes::Portable, false>(&self.tree, ray)
        {
            return hit;
        }
        traverse::closest::<lanes::Portable, true>(&self.tree, ray).unwrap_or(None)
    }

    /// [`Accel::occluded`] by the code path for any processor.
    pub fn occluded_portable(&self, ray: &Ray) -> bool {
        self.hidden_portable(ray, &Ray64::new(ray.o, ray.d), [NO_PRIM; 2])
    }

    fn hidden_portable(&self, ray: &Ray, exact: &Ray64, skip: [u32; 2]) -> bool {
        let tree = &self.tree;
        if self.near.contains(ray.o)
            && let Ok(hit) = traverse::occluded::<lanes::Portable, false>(tree, ray, exact, skip)
        {
            return hit;
        }
        traverse::occluded::<lanes::Portable, true>(tree, ray, exact, skip).unwrap_or(true)
    }

    /// Whether rays take the AVX2 path.
    pub fn is_wide(&self) -> bool {
        self.wide
    }

    /// Size of the tree.
    pub fn stats(&self) -> Stats {
        let t = &self.tree;
        Stats {
            nodes: t.nodes.len(),
            blocks: t.blocks.len(),
            analytic: t.analytic.len(),
            depth: t.depth,
            bytes: t.nodes.len() * size_of::<Node>()
                + t.blocks.len() * size_of::<Block>()
                + size_of_val(t.analytic.as_slice()),
        }
    }

    #[inline]
    pub(super) fn margins(&self, prim: u32) -> Margins {
        self.margins[prim as usize]
    }

    #[inline]
    pub(super) fn prim(&self, prim: u32) -> Option<PrimRef<'_>> {
        self.prims.get(prim)
    }
}

/// Origins from where the lanes' rounding moves no outline by a visible part of the smallest shape: |o − center|∞ ≤ reach.
#[derive(Clone, Copy, Debug)]
struct Near {
    center: Vec3,
    reach: f32,
}

/// How many times the smallest shape an origin may be away from the farthest corner: edges err by 8·2⁻²⁴ of that,
/// at most 2⁻⁷ of the smallest shape.
const MAX_RATIO: f32 = 16_384.0;

impl Near {
    fn new(triangles: &[[Vec3; 3]], smallest: f32) -> Near {
        let (mut lo, mut hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let mut largest = 0.0_f32;
        for [a, b, c] in triangles {
            let (min, max) = (a.min(*b).min(*c), a.max(*b).max(*c));
            (lo, hi) = (lo.min(min), hi.max(max));
            largest = largest.max((max - min).max_element());
        }
        if !lo.is_finite() {
            return Near { center: Vec3::ZERO, reach: f32::INFINITY };
        }
        let half = ((hi - lo) * 0.5).max_element();
        Near { center: lo * 0.5 + hi * 0.5, reach: smallest.min(largest) * MAX_RATIO - half }
    }

    #[inline]
    fn contains(&self, o: Vec3) -> bool {
        (o - self.center).abs().max_element() <= self.reach
    }
}

impl std::fmt::Debug for Accel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Accel").field("stats", &self.stats()).field("wide", &self.wide).finish()
    }
}

#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    std::arch::is_x86_feature_detected!("avx2")
        && std::arch::is_x86_feature_detected!("bmi1")
        && std::arch::is_x86_feature_detected!("bmi2")
        && std::arch::is_x86_feature_detected!("lzcnt")
        && std::arch::is_x86_feature_detected!("popcnt")
}

#[cfg(not(target_arch = "x86_64"))]
fn has_avx2() -> bool {
    false
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn closest_avx2(tree: &Tree, ray: &Ray) -> Result<Option<Hit>, Doubt> {
    traverse::closest::<lanes::Avx2, false>(tree, ray)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn closest_careful_avx2(tree: &Tree, ray: &Ray) -> Option<Hit> {
    // A careful walk has no doubts.
    traverse::closest::<lanes::Avx2, true>(tree, ray).unwrap_or(None)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn occluded_avx2(tree: &Tree, ray: &Ray, exact: &Ray64, skip: [u32; 2]) -> Result<bool, Doubt> {
    traverse::occluded::<lanes::Avx2, false>(tree, ray, exact, skip)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn occluded_careful_avx2(tree: &Tree, ray: &Ray, exact: &Ray64, skip: [u32; 2]) -> bool {
    traverse::occluded::<lanes::Avx2, true>(tree, ray, exact, skip).unwrap_or(true)
}
