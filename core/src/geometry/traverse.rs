//! The walk: one source for all code paths, generic over [`Lanes`].
//!
//! Boxes are tested in f32, widened by their error; triangles in f64 ([`Exact`]).

use std::mem::MaybeUninit;

use super::Hit;
use super::analytic::Ray64;
use super::exact::Exact;
use super::lanes::Lanes;
use super::layout::{Block, Child, Node, STACK, Tree};
use crate::math::Ray;

/// Half an ulp of 1: the relative error of one rounding to f32.
pub(super) const U: f32 = 1.0 / 16_777_216.0;

/// Widening of the slabs, in units of the largest coordinate: of the origin here, of a primitive
/// when the tree is built ([`super::primitives::bounds`]).
///
/// The slab value (plane − o)·(1/d) is relatively wrong by 3u, that is by 3u·(|v| + |o|) along the
/// axis; the rest is reserve.
pub(super) const SLACK: f32 = 16.0 * U;

/// Ray prepared for the node and block tests.
struct Setup<L: Lanes> {
    /// Rows of the node's near planes.
    near: [usize; 3],
    /// Rows of the node's far planes.
    far: [usize; 3],
    /// Origin shifted so that near planes come nearer.
    o_near: [L; 3],
    /// Origin shifted so that far planes go farther.
    o_far: [L; 3],
    /// 1/d, ±∞ where d vanishes.
    rd: [L; 3],
    tmin: L,
    /// The ray for triangles.
    exact: Exact<L::Double>,
}

// The methods are spelt out instead of mapping arrays: closures and library functions do not take
// on the target features of their caller, and where they are not inlined every lane operation in
// them would be a call.
impl<L: Lanes> Setup<L> {
    /// `None` for rays that hit nothing by definition: not finite, without direction, empty
    /// interval.
    ///
    /// `exact` is the direction before it was rounded.
    #[inline(always)]
    fn new(ray: &Ray, exact: &Ray64) -> Option<Self> {
        let (o, d) = (ray.o.to_array(), ray.d.to_array());
        let a = [d[0].abs(), d[1].abs(), d[2].abs()];
        // By table, since directions are random and a branch on them would be mispredicted.
        const LARGEST: [usize; 8] = [2, 2, 2, 0, 1, 2, 1, 0];
        let z = LARGEST[usize::from(a[0] > a[1])
            | usize::from(a[0] > a[2]) << 1
            | usize::from(a[1] > a[2]) << 2];
        // t ≤ 0 never counts; the addition turns −0 into +0, whose bits order as the numbers do.
        let tmin = ray.tmin.max(0.0) + 0.0;
        let sound = ray.o.is_finite()
            && ray.d.is_finite()
            && a[z] >= f32::MIN_POSITIVE
            && ray.tmin < ray.tmax
            && tmin < ray.tmax;
        if !sound {
            return None;
        }
        const NEXT: [usize; 5] = [0, 1, 2, 0, 1];
        let (x, y) = (NEXT[z + 1], NEXT[z + 2]);
        let slack = SLACK * o[0].abs().max(o[1].abs()).max(o[2].abs());
        let rd = [1.0 / d[0], 1.0 / d[1], 1.0 / d[2]];
        let (bx, by, bz) = (
            3 * usize::from(d[0].is_sign_negative()),
            3 * usize::from(d[1].is_sign_negative()),
            3 * usize::from(d[2].is_sign_negative()),
        );
        let shift = [slack.copysign(d[0]), slack.copysign(d[1]), slack.copysign(d[2])];
        Some(Setup {
            near: [bx, 1 + by, 2 + bz],
            far: [3 - bx, 4 - by, 5 - bz],
            o_near: [
                L::splat(o[0] + shift[0]),
                L::splat(o[1] + shift[1]),
                L::splat(o[2] + shift[2]),
            ],
            o_far: [
                L::splat(o[0] - shift[0]),
                L::splat(o[1] - shift[1]),
                L::splat(o[2] - shift[2]),
            ],
            rd: [L::splat(rd[0]), L::splat(rd[1]), L::splat(rd[2])],
            tmin: L::splat(tmin),
            exact: Exact::new(exact, [x, y, z], tmin),
        })
    }

    /// Children the ray may meet at t ≤ `last`, and where it enters them. NaN (0·∞: the ray lies in
    /// a plane of the box) makes `max` and `min` keep their second argument, the slab so far.
    #[inline(always)]
    fn enter(&self, node: &Node, last: L) -> (u32, L) {
        let mut near = self.tmin;
        let mut far = last;
        for i in 0..3 {
            let (n, f) = (&node.rows[self.near[i]], &node.rows[self.far[i]]);
            near = L::load(n).sub(self.o_near[i]).mul(self.rd[i]).max(near);
            far = L::load(f).sub(self.o_far[i]).mul(self.rd[i]).min(far);
        }
        (near.le(far), near)
    }
}

/// Best hit so far.
struct Best {
    /// Largest t of a hit that is as good or better.
    last: f64,
    /// The same for the entry of boxes: at least `last`.
    boxes: f32,
    /// t without its last bits.
    key: f64,
    hit: Hit,
}

impl Best {
    /// `tmax` itself does not count.
    #[inline(always)]
    fn none(tmax: f32) -> Self {
        let hit = Hit { t: f64::INFINITY, prim: u32::MAX, b1: 0.0, b2: 0.0 };
        Best { last: f64::from(tmax).next_down(), boxes: tmax, key: f64::INFINITY, hit }
    }

    /// Equal for values of t that agree to 2⁻³⁶: coincident surfaces are told apart by their ids.
    #[inline(always)]
    fn key(t: f64) -> f64 {
        f64::from_bits(t.to_bits() & !0xffff)
    }

    #[inline(always)]
    fn offer(&mut self, hit: Hit) {
        let key = Self::key(hit.t);
        if key < self.key || (key == self.key && hit.prim < self.hit.prim) {
            let last = f64::from_bits(hit.t.to_bits() | 0xffff).min(self.last);
            *self = Best { last, boxes: (hit.t as f32).next_up(), key, hit };
        }
    }
}

/// Entry of the stack: the bits of the entry t (ordered as t is, since t ≥ +0) above the code.
#[inline(always)]
fn pack(near: f32, child: Child) -> u64 {
    u64::from(near.to_bits()) << 32 | u64::from(child.0)
}

/// Slots of the stack; how many are in use is a variable of the walk's own, which the compiler then
/// keeps in a register.
type Slots<T> = [MaybeUninit<T>; STACK];

/// Writes the slot `len` and counts it. The stack is deep enough by construction: each level of the
/// tree leaves at most seven entries behind, one more while a node is being unpacked, and trees are
/// at most [`super::layout::MAX_DEPTH`] deep.
#[inline(always)]
fn push<T: Copy>(slots: &mut Slots<T>, len: &mut usize, x: T) {
    debug_assert!(*len < STACK);
    // SAFETY: len < STACK, see above.
    unsafe { slots.get_unchecked_mut(*len).write(x) };
    *len += 1;
}

/// Slot `i`, which must be one that was pushed and not popped.
#[inline(always)]
fn slot<T: Copy>(slots: &Slots<T>, len: usize, i: usize) -> T {
    debug_assert!(i < len && len <= STACK);
    // SAFETY: `push` wrote every slot below len, and len ≤ STACK.
    unsafe { slots.get_unchecked(i).assume_init() }
}

/// Sorts the entries from `from` on so that the least is popped first.
#[inline(always)]
fn sort(slots: &mut Slots<u64>, len: usize, from: usize) {
    for i in from + 1..len {
        let x = slot(slots, len, i);
        let mut j = i;
        while j > from {
            let y = slot(slots, len, j - 1);
            if y >= x {
                break;
            }
            // SAFETY: j ≤ i < len ≤ STACK.
            unsafe { slots.get_unchecked_mut(j).write(y) };
            j -= 1;
        }
        // SAFETY: as above.
        unsafe { slots.get_unchecked_mut(j).write(x) };
    }
}

/// Where the children lie, for prefetching without a branch on their kind.
#[derive(Clone, Copy)]
struct Places {
    base: [*const u8; 2],
    size: [usize; 2],
}

impl Places {
    #[inline(always)]
    fn new(tree: &Tree) -> Self {
        Places {
            base: [tree.nodes.as_ptr().cast(), tree.blocks.as_ptr().cast()],
            size: [size_of::<Node>(), size_of::<Block>()],
        }
    }

    /// Fetches the lines of a node, or the most of a block; something harmless for other leaves.
    #[inline(always)]
    fn prefetch<L: Lanes>(&self, code: u32) {
        let kind = (code >> 31) as usize;
        let offset = (code & Child::INDEX) as usize * self.size[kind];
        L::prefetch(self.base[kind].wrapping_add(offset));
    }
}

impl Tree {
    #[inline(always)]
    fn node(&self, child: Child) -> &Node {
        debug_assert!((child.0 as usize) < self.nodes.len());
        // SAFETY: codes that are not leaves index `nodes` by construction (`build::emit`).
        unsafe { self.nodes.get_unchecked(child.0 as usize) }
    }

    #[inline(always)]
    fn block(&self, i: usize) -> &Block {
        debug_assert!(i < self.blocks.len());
        // SAFETY: runs of blocks lie inside `blocks` by construction (`build::leaf`).
        unsafe { self.blocks.get_unchecked(i) }
    }
}

/// Closest hit.
#[inline(always)]
pub(super) fn closest<L: Lanes>(tree: &Tree, ray: &Ray) -> Option<Hit> {
    let ray64 = Ray64::new(ray.o, ray.d);
    let setup = Setup::<L>::new(ray, &ray64)?;
    let mut current = tree.root?;
    let mut best = Best::none(ray.tmax);
    let (tmin, tmax) = (f64::from(ray.tmin.max(0.0)), f64::from(ray.tmax));
    let places = Places::new(tree);
    let mut slots: Slots<u64> = [const { MaybeUninit::uninit() }; STACK];
    let mut len = 0;
    'walk: loop {
        while !current.is_leaf() {
            let node = tree.node(current);
            let (mut bits, near) = setup.enter(node, L::splat(best.boxes));
            if bits == 0 {
                match pop(&slots, &mut len, best.boxes) {
                    Some(c) => current = c,
                    None => break 'walk,
                }
                continue;
            }
            let near = near.store();
            let first = bits.trailing_zeros() as usize & 7;
            bits &= bits - 1;
            if bits == 0 {
                current = node.child[first];
                continue;
            }
            // The nearest child is entered, the others wait, the nearest of them on top.
            let a = fetch::<L>(&places, node, &near, first as u32);
            let b = fetch::<L>(&places, node, &near, bits.trailing_zeros());
            bits &= bits - 1;
            let (a, b) = (a.min(b), a.max(b));
            if bits == 0 {
                push(&mut slots, &mut len, b);
                current = Child(a as u32);
                continue;
            }
            let c = fetch::<L>(&places, node, &near, bits.trailing_zeros());
            bits &= bits - 1;
            let (b, c) = (b.min(c), b.max(c));
            let (a, b) = (a.min(b), a.max(b));
            if bits == 0 {
                push(&mut slots, &mut len, c);
                push(&mut slots, &mut len, b);
                current = Child(a as u32);
                continue;
            }
            let from = len;
            push(&mut slots, &mut len, c);
            push(&mut slots, &mut len, b);
            let mut least = a;
            while bits != 0 {
                let d = fetch::<L>(&places, node, &near, bits.trailing_zeros());
                bits &= bits - 1;
                push(&mut slots, &mut len, least.max(d));
                least = least.min(d);
            }
            sort(&mut slots, len, from);
            current = Child(least as u32);
        }
        if current.is_analytic() {
            let (first, count) = current.analytic_range();
            for a in &tree.analytic[first..first + count] {
                if let Some((t, b1, b2)) = a.intersect(&ray64, tmin, tmax) {
                    best.offer(Hit { t, prim: a.prim, b1, b2 });
                }
            }
        } else {
            let (first, count) = current.block_range();
            for i in first..first + count {
                let block = tree.block(i);
                let Some(hits) = setup.exact.meet::<L>(block, best.last, [ray.from; 2]) else {
                    continue;
                };
                let mut bits = hits.bits;
                while bits != 0 {
                    let lane = bits.trailing_zeros() as usize & 7;
                    bits &= bits - 1;
                    let (b1, b2) = (hits.b1[lane], hits.b2[lane]);
                    best.offer(Hit { t: hits.t[lane], prim: block.prim[lane], b1, b2 });
                }
            }
        }
        match pop(&slots, &mut len, best.boxes) {
            Some(c) => current = c,
            None => break,
        }
    }
    (best.hit.prim != u32::MAX).then_some(best.hit)
}

/// Stack entry of the child in slot `i` of a node, whose memory is fetched ahead.
#[inline(always)]
fn fetch<L: Lanes>(places: &Places, node: &Node, near: &[f32; 8], i: u32) -> u64 {
    let i = i as usize & 7;
    places.prefetch::<L>(node.child[i].0);
    pack(near[i], node.child[i])
}

/// Next entry that is not beyond `last`.
#[inline(always)]
fn pop(slots: &Slots<u64>, len: &mut usize, last: f32) -> Option<Child> {
    while *len > 0 {
        let key = slot(slots, *len, *len - 1);
        *len -= 1;
        if (key >> 32) as u32 <= last.to_bits() {
            return Some(Child(key as u32));
        }
    }
    None
}

/// Whether anything is hit but the triangles `ray.from` and `to`. `exact` is the ray before its
/// direction was rounded.
#[inline(always)]
pub(super) fn occluded<L: Lanes>(tree: &Tree, ray: &Ray, exact: &Ray64, to: u32) -> bool {
    let Some(setup) = Setup::<L>::new(ray, exact) else { return false };
    let Some(mut current) = tree.root else { return false };
    let last = L::splat(ray.tmax);
    let (tmin, tmax) = (f64::from(ray.tmin.max(0.0)), f64::from(ray.tmax));
    let end = tmax.next_down();
    let places = Places::new(tree);
    let mut slots: Slots<u32> = [const { MaybeUninit::uninit() }; STACK];
    let mut len = 0;
    loop {
        if current.is_leaf() {
            if current.is_analytic() {
                let (first, count) = current.analytic_range();
                let hit = tree.analytic[first..first + count].iter().any(|a| {
                    let own = (a.prim == ray.from && a.is_left_for_good(exact.o, exact.d))
                        || (a.prim == to && a.is_left_for_good(exact.o + exact.d, -exact.d));
                    !own && a.intersect(exact, tmin, tmax).is_some()
                });
                if hit {
                    return true;
                }
            } else {
                let (first, count) = current.block_range();
                for i in first..first + count {
                    if setup.exact.meet::<L>(tree.block(i), end, [ray.from, to]).is_some() {
                        return true;
                    }
                }
            }
        } else {
            let node = tree.node(current);
            let (mut bits, _) = setup.enter(node, last);
            if bits != 0 {
                loop {
                    let child = node.child[bits.trailing_zeros() as usize & 7];
                    bits &= bits - 1;
                    if bits == 0 {
                        current = child;
                        break;
                    }
                    places.prefetch::<L>(child.0);
                    push(&mut slots, &mut len, child.0);
                }
                continue;
            }
        }
        if len == 0 {
            return false;
        }
        current = Child(slot(&slots, len, len - 1));
        len -= 1;
    }
}
