//! Memory layout of the tree.

use super::analytic::Analytic;

/// Triangles a block holds.
pub(super) const WIDTH: usize = 8;

/// Analytic primitives a leaf holds at most.
pub(super) const ANALYTIC_LEAF: usize = 8;

/// Slots of the traversal stack.
pub(super) const STACK: usize = 256;

/// Deepest tree the stack carries: a node pushes at most seven children beside the one it enters.
pub(super) const MAX_DEPTH: usize = (STACK - 8) / 7;

/// Inner node: bounds of eight children as six rows (min x, y, z, max x, y, z) and their codes.
/// Empty slots have min = +∞ and max = −∞, so that no ray enters them.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
pub(super) struct Node {
    pub rows: [[f32; WIDTH]; 6],
    pub child: [Child; WIDTH],
}

/// Eight triangles: `rows[3·corner + axis]`, and their ids. Empty lanes are NaN, which no test
/// accepts.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
pub(super) struct Block {
    pub rows: [[f32; WIDTH]; 9],
    pub prim: [u32; WIDTH],
}

/// Where a child lies: node index, run of triangle blocks or run of analytic primitives.
///
/// Bits: 31 leaf, 30 analytic; nodes use the other bits as index; triangle leaves hold the number
/// of blocks − 1 in bit 29 and the first block below; analytic leaves hold the number − 1 in bits
/// 27–29 and the first below.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(pub u32);

impl Child {
    pub const EMPTY: Child = Child(u32::MAX);
    /// Bits of the index of a node or block.
    pub const INDEX: u32 = (1 << 29) - 1;

    pub fn node(index: usize) -> Child {
        debug_assert!(index <= Self::INDEX as usize);
        Child(index as u32)
    }

    pub fn blocks(first: usize, count: usize) -> Child {
        debug_assert!((1..=2).contains(&count) && first <= Self::INDEX as usize);
        Child(1 << 31 | (count as u32 - 1) << 29 | first as u32)
    }

    pub fn analytic(first: usize, count: usize) -> Child {
        debug_assert!((1..=ANALYTIC_LEAF).contains(&count) && first < 1 << 27);
        Child(3 << 30 | (count as u32 - 1) << 27 | first as u32)
    }

    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        (self.0 as i32) < 0
    }

    #[inline(always)]
    pub fn is_analytic(self) -> bool {
        self.0 >= 3 << 30
    }

    #[inline(always)]
    pub fn block_range(self) -> (usize, usize) {
        ((self.0 & Self::INDEX) as usize, 1 + (self.0 >> 29 & 1) as usize)
    }

    #[inline(always)]
    pub fn analytic_range(self) -> (usize, usize) {
        ((self.0 & 0x07ff_ffff) as usize, 1 + (self.0 >> 27 & 7) as usize)
    }
}

/// The tree itself. Every code in it points inside its arrays, and no walk is deeper than
/// [`MAX_DEPTH`] nodes: the traversal relies on both.
pub(super) struct Tree {
    /// `None`: nothing to hit.
    pub root: Option<Child>,
    pub nodes: Vec<Node>,
    pub blocks: Vec<Block>,
    pub analytic: Vec<Analytic>,
    /// Levels of inner nodes.
    pub depth: usize,
}

impl Tree {
    /// Without anything in it.
    pub fn empty() -> Tree {
        Tree { root: None, nodes: vec![], blocks: vec![], analytic: vec![], depth: 0 }
    }
}

impl Node {
    pub const EMPTY: Node = Node {
        rows: [
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
        ],
        child: [Child::EMPTY; WIDTH],
    };
}

impl Block {
    pub const EMPTY: Block = Block { rows: [[f32::NAN; WIDTH]; 9], prim: [u32::MAX; WIDTH] };
}

/// Moves an array to memory that the system is asked to back with huge pages (before the first
/// touch, when the hint still costs nothing): fewer TLB misses on large scenes.
pub(super) fn on_huge_pages<T: Copy>(data: Vec<T>) -> Vec<T> {
    let mut out = Vec::with_capacity(data.len());
    advise_huge_pages(out.spare_capacity_mut());
    out.extend_from_slice(&data);
    out
}

#[cfg(target_os = "linux")]
fn advise_huge_pages<T>(memory: &mut [T]) {
    const HUGE: usize = 2 << 20;
    let start = (memory.as_ptr() as usize).next_multiple_of(HUGE);
    let end = (memory.as_ptr() as usize + size_of_val(memory)) / HUGE * HUGE;
    if start < end {
        // SAFETY: [start, end) lies inside one live allocation and MADV_HUGEPAGE never changes the
        // contents or the validity of memory. It is a hint, whose failure changes nothing.
        unsafe { libc::madvise(start as *mut libc::c_void, end - start, libc::MADV_HUGEPAGE) };
    }
}

#[cfg(not(target_os = "linux"))]
fn advise_huge_pages<T>(_memory: &mut [T]) {}
