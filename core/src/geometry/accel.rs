//! The public face of the tree.

use glam::Vec3;

use super::analytic::Ray64;
use super::layout::{Block, Node, Tree};
use super::offset::{Facet, segment};
use super::primitives::PrimRef;
use super::{GeometryError, Primitives, build, lanes, traverse};
use crate::math::{NO_PRIM, Ray};

/// Where a ray meets a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f64,
    /// Primitive: triangles first, then spheres, disks, cylinders.
    pub prim: u32,
    /// Barycentric weight of corner 1 of a triangle; a of a disk's c + a·u + b·v; 0 for a sphere or
    /// cylinder.
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
    /// InstructionSets of inner nodes.
    pub depth: usize,
    /// Bytes of nodes and leaves together, without the primitives themselves.
    pub bytes: usize,
}

/// Instruction sets that the walk is compiled for. The same bits on all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum InstructionSet {
    /// What every processor of the target has.
    Portable,
    /// AVX2.
    Avx2,
    /// AVX-512F beside AVX2.
    Avx512,
}

/// Immutable ray-traversal structure over [`Primitives`]; see the [module](super).
///
/// A ray's hits are those with tmin < t < tmax and t > 0 on triangles other than the one it starts
/// on. A ray that is not finite, whose direction is shorter than the smallest normal f32, or whose
/// interval is empty hits nothing.
pub struct Accel {
    tree: Tree,
    prims: Primitives,
    /// Of each triangle.
    facets: Vec<Facet>,
    instructions: InstructionSet,
}

impl Accel {
    /// Builds the tree; the same input gives the same tree for any number of threads.
    ///
    /// # Errors
    /// Numbers that are not finite or beyond 10⁹, radii that are not positive, too many primitives.
    pub fn build(prims: Primitives) -> Result<Accel, GeometryError> {
        prims.validate()?;
        let tree = build::build(&prims);
        let facets = prims.triangles.iter().map(Facet::new).collect();
        Ok(Accel { tree, prims, facets, instructions: best() })
    }

    /// The primitives the tree was built of.
    pub fn primitives(&self) -> &Primitives {
        &self.prims
    }

    /// Closest hit; among equal t the smallest primitive id.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        #[cfg(target_arch = "x86_64")]
        match self.instructions {
            // SAFETY: `best` says what the processor has.
            InstructionSet::Avx512 => return unsafe { wide::closest_avx512(&self.tree, ray) },
            // SAFETY: as above.
            InstructionSet::Avx2 => return unsafe { wide::closest_avx2(&self.tree, ray) },
            InstructionSet::Portable => {}
        }
        self.closest_portable(ray)
    }

    /// Whether the ray hits anything: 1 − V for an unbounded shadow ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.hidden(ray, &Ray64::new(ray.o, ray.d), NO_PRIM)
    }

    /// Whether anything lies between `p` and `q`: 1 − V. Symmetric to the bit. `on` are the
    /// triangles that they lie on ([`NO_PRIM`] for none), which the segment does not meet again.
    ///
    /// The direction is the exact difference, so that the segment ends where it should however long
    /// it is.
    #[inline]
    pub fn hides(&self, p: Vec3, q: Vec3, on: [u32; 2]) -> bool {
        let ray = segment(p, q);
        let o = ray.o.as_dvec3();
        let (end, [from, to]) = if ray.o == p { (q, on) } else { (p, [on[1], on[0]]) };
        self.hidden(&Ray { from, ..ray }, &Ray64 { o, d: end.as_dvec3() - o }, to)
    }

    #[inline]
    fn hidden(&self, ray: &Ray, exact: &Ray64, to: u32) -> bool {
        #[cfg(target_arch = "x86_64")]
        match self.instructions {
            // SAFETY: `best` says what the processor has.
            InstructionSet::Avx512 => {
                return unsafe { wide::occluded_avx512(&self.tree, ray, exact, to) };
            }
            // SAFETY: as above.
            InstructionSet::Avx2 => {
                return unsafe { wide::occluded_avx2(&self.tree, ray, exact, to) };
            }
            InstructionSet::Portable => {}
        }
        self.hidden_portable(ray, exact, to)
    }

    /// [`Accel::closest`] by the code path for any processor: the same bits, only slower.
    pub fn closest_portable(&self, ray: &Ray) -> Option<Hit> {
        traverse::closest::<lanes::Portable<f32>>(&self.tree, ray)
    }

    /// [`Accel::occluded`] by the code path for any processor.
    pub fn occluded_portable(&self, ray: &Ray) -> bool {
        self.hidden_portable(ray, &Ray64::new(ray.o, ray.d), NO_PRIM)
    }

    fn hidden_portable(&self, ray: &Ray, exact: &Ray64, to: u32) -> bool {
        traverse::occluded::<lanes::Portable<f32>>(&self.tree, ray, exact, to)
    }

    /// The instruction set that rays use: the best that the processor has.
    pub fn instruction_set(&self) -> InstructionSet {
        self.instructions
    }

    /// Uses no more than an instruction set, where the processor has more: to compare them.
    pub fn restrict(&mut self, to: InstructionSet) {
        self.instructions = self.instructions.min(to);
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
    pub(super) fn facet(&self, prim: u32) -> Facet {
        self.facets[prim as usize]
    }

    #[inline]
    pub(super) fn prim(&self, prim: u32) -> Option<PrimRef<'_>> {
        self.prims.get(prim)
    }
}

impl std::fmt::Debug for Accel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Accel")
            .field("stats", &self.stats())
            .field("instructions", &self.instructions)
            .finish()
    }
}

#[cfg(target_arch = "x86_64")]
fn best() -> InstructionSet {
    use std::arch::is_x86_feature_detected as has;
    let avx2 = has!("avx2") && has!("bmi1") && has!("bmi2") && has!("lzcnt") && has!("popcnt");
    match avx2 {
        false => InstructionSet::Portable,
        true if has!("avx512f") => InstructionSet::Avx512,
        true => InstructionSet::Avx2,
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn best() -> InstructionSet {
    InstructionSet::Portable
}

/// The same walk, compiled for more of what processors have.
#[cfg(target_arch = "x86_64")]
mod wide {
    use super::super::analytic::Ray64;
    use super::super::lanes::{Avx, Pair, Whole};
    use super::super::layout::Tree;
    use super::super::traverse;
    use super::Hit;
    use crate::math::Ray;

    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    pub fn closest_avx2(tree: &Tree, ray: &Ray) -> Option<Hit> {
        traverse::closest::<Avx<Pair>>(tree, ray)
    }

    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    pub fn occluded_avx2(tree: &Tree, ray: &Ray, exact: &Ray64, to: u32) -> bool {
        traverse::occluded::<Avx<Pair>>(tree, ray, exact, to)
    }

    #[target_feature(enable = "avx512f,avx2,bmi1,bmi2,lzcnt,popcnt")]
    pub fn closest_avx512(tree: &Tree, ray: &Ray) -> Option<Hit> {
        traverse::closest::<Avx<Whole>>(tree, ray)
    }

    #[target_feature(enable = "avx512f,avx2,bmi1,bmi2,lzcnt,popcnt")]
    pub fn occluded_avx512(tree: &Tree, ray: &Ray, exact: &Ray64, to: u32) -> bool {
        traverse::occluded::<Avx<Whole>>(tree, ray, exact, to)
    }
}
