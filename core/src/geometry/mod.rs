//! Ray traversal: closest hits and visibility V(x, y) in the normalised scene.
//!
//! # What is here
//!
//! [`Accel`] holds triangles, spheres, disks and cylinders ([`Primitives`]) in one tree and answers
//! two questions: which primitive does a ray meet first ([`Accel::closest`]), and does it meet any
//! ([`Accel::occluded`], the 1 − V of the rendering equation). [`Accel::position`],
//! [`Accel::error_bound`], [`offset_origin`] and [`segment`] turn a hit into the origin of the next
//! ray or the end of a shadow segment without scene-unit epsilons.
//!
//! # Why a walk of our own
//!
//! `obvhs` builds good binary trees quickly (PLOC with reinsertion), and we use it for that alone.
//! Its traversal cannot carry V: the compressed eight-wide walk drops every hit with t < 10⁻⁴ on
//! flat boxes, its triangle test (Möller–Trumbore) leaves gaps along shared edges and at vertices,
//! and its box test is not conservative. Rays aimed at shared edges leak by the percent, which
//! shows as light under walls and as bias that no number of samples removes. So:
//!
//! - **Tree.** The binary tree is collapsed to nodes of eight children by dynamic programming over
//!   the surface-area cost (Ylitie et al. 2017, §3.2, with leaves that are whole blocks of eight
//!   triangles), uncompressed, 256 bytes a node.
//! - **Triangles.** Woop, Benthin & Wald 2013, "Watertight Ray/Triangle Intersection": the vertices
//!   are sheared into the ray's frame and the signs of three edge functions decide, in f64. A
//!   shared vertex gives the same bits in both triangles and a shared edge gives edge functions of
//!   exactly opposite sign, so one of two neighbours always accepts. This needs *bit-equal* shared
//!   vertices in the input. Edge functions that vanish count as inside on both sides. No fused
//!   multiply-add may enter an edge function: it would break the antisymmetry.
//! - **Boxes.** A triangle is accepted when the *rounded* vertices surround the ray, so the exact
//!   ray may pass its box at a distance of a few ulps. The slabs are therefore widened per ray by a
//!   bound on that distance plus the slab test's own rounding (the idea of Ize 2013, "Robust BVH
//!   Ray Traversal", but absolute instead of relative): boxes by a part of their coordinates when
//!   the tree is built, rays by the same part of their origin's.
//! - **Boxes in f32, triangles in f64.** Eight triangles at once are tested in f64: hits are exact
//!   to 10⁻¹⁵ of the triangle, and a sheet close over a huge ground is told from it.
//! - **Spheres, disks and cylinders** are tested in f64, so that surfaces 10⁻⁷ apart are told
//!   apart.
//! - **One source for all instruction sets.** The kernels are generic over eight lanes; AVX-512 or
//!   AVX2 is used where the processor has it (asked once, when the tree is built), otherwise arrays
//!   that the compiler turns into what the target has. All perform the same IEEE operations in the
//!   same order, so that hits agree to the bit. Fused operations are avoided everywhere: without
//!   hardware support they would be library calls.
//! - **Ties.** Among equal t the smallest primitive id wins, whatever the order of the walk.

mod accel;
mod analytic;
mod build;
mod collapse;
mod exact;
mod lanes;
mod layout;
mod offset;
mod primitives;
mod traverse;

pub use accel::{Accel, Hit, InstructionSet, Stats};
pub use offset::{offset_origin, segment};
pub use primitives::{CylinderPrim, DiskPrim, PrimKind, Primitives, SpherePrim};

/// Why a tree cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GeometryError {
    /// A coordinate, axis or radius is NaN or infinite.
    #[error("{kind} {index}: {what} is not finite")]
    NotFinite {
        /// Sort of primitive.
        kind: PrimKind,
        /// Index in the list of that sort.
        index: usize,
        /// The offending value, in words and numbers.
        what: String,
    },
    /// The radius of a sphere or a cylinder is not positive.
    #[error("{kind} {index}: radius {radius} is not positive")]
    Radius {
        /// Sort of primitive.
        kind: PrimKind,
        /// Index in the list of that sort.
        index: usize,
        /// The radius.
        radius: f32,
    },
    /// A coordinate is so large that products of coordinates overflow.
    #[error("{kind} {index}: {value} is out of range; normalise the scene first")]
    OutOfRange {
        /// Sort of primitive.
        kind: PrimKind,
        /// Index in the list of that sort.
        index: usize,
        /// The largest magnitude.
        value: f32,
    },
    /// More primitives than the tree can number.
    #[error("{count} {kind}s are more than the tree can hold ({limit})")]
    TooMany {
        /// Sort of primitive.
        kind: PrimKind,
        /// How many were given.
        count: usize,
        /// The limit.
        limit: usize,
    },
}
