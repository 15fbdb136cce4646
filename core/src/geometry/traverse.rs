//! The walk: one source for all code paths, generic over [`Lanes`].

use std::mem::MaybeUninit;

use super::Hit;
use super::analytic::Ray64;
use super::lanes::Lanes;
use super::layout::{Block, Child, Node, STACK, Tree};
use crate::math::Ray;

/// Widening of the slabs, in units of (extent of the scene + largest coordinate of the origin).
///
/// Let u = 2⁻²⁴. A sheared coordinate (v − o)ₓ − Sₓ(v − o)_z carries an error of at most
/// 6u·(|v| + |o|), which bounds how far from the exact ray an accepted triangle may lie; the slab
/// value (plane − o)·(1/d) is relatively wrong by 3u, that is by 3u·(|v| + |o|) along the axis; the
/// rest is reserve.
const SLACK: f32 = 12.0 / 16_777_216.0;

/// Ray prepared for the node and block tests.
struct Setup<L> {
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
    /// Axes x, y, z of the sheared frame; z is where |d| is largest.
    axis: [usize; 3],
    /// Origin in the sheared frame's axes.
    o: [L; 3],
    /// Shear Sₓ, S_y and scale S_z (Woop et al. 2013, §2.1).
    shear: [L; 3],
    tmin_scalar: f32,
    /// The largest t that counts.
    last: f32,
}

// The methods are spelt out instead of mapping arrays: closures and library functions do not take on
// the target features of their caller, and where they are not inlined every lane operation in them
// would be a call.
impl<L: Lanes> Setup<L> {
    /// `None` for rays that hit nothing by definition: not finite, without direction, empty
    /// interval.
    #[inline(always)]
    fn new(ray: &Ray, extent: f32) -> Option<Self> {
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
        let slack = SLACK * (extent + o[0].abs().max(o[1].abs()).max(o[2].abs()));
        let rd = [1.0 / d[0], 1.0 / d[1], 1.0 / d[2]];
        let sz = rd[z];
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
            axis: [x, y, z],
            o: [L::splat(o[x]), L::splat(o[y]), L::splat(o[z])],
            shear: [L::splat(d[x] * sz), L::splat(d[y] * sz), L::splat(sz)],
            tmin_scalar: tmin,
            last: ray.tmax.next_down(),
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
        (L::bits(near.le(far)), near)
    }

    /// Corner `c` of eight triangles in the sheared frame, z not yet scaled.
    #[inline(always)]
    fn shear(&self, block: &Block, c: usize) -> (L, L, L) {
        let [kx, ky, kz] = self.axis;
        let z = L::load(&block.rows[3 * c + kz]).sub(self.o[2]);
        let x = L::load(&block.rows[3 * c + kx]).sub(self.o[0]).sub(self.shear[0].mul(z));
        let y = L::load(&block.rows[3 * c + ky]).sub(self.o[1]).sub(self.shear[1].mul(z));
        (x, y, z)
    }

    /// Woop's test of eight triangles: lanes with a hit at `tmin` < t ≤ `last`.
    #[inline(always)]
    fn hits(&self, block: &Block, last: L) -> (u32, BlockHits<L>) {
        let (xa, ya, za) = self.shear(block, 0);
        let (xb, yb, zb) = self.shear(block, 1);
        let (xc, yc, zc) = self.shear(block, 2);
        let u = xc.mul(yb).sub(yc.mul(xb));
        let v = xa.mul(yc).sub(ya.mul(xc));
        let w = xb.mul(ya).sub(yb.mul(xa));
        let zero = L::splat(0.0);
        let inside = L::or(zero.le(u.min(v).min(w)), u.max(v).max(w).le(zero));
        let det = u.add(v).add(w);
        let inside = L::and(inside, det.ne(zero));
        if L::bits(inside) == 0 {
            return (0, BlockHits { t: zero, v, w, det });
        }
        let t = u.mul(za).add(v.mul(zb)).add(w.mul(zc)).mul(self.shear[2]).div(det);
        let within = L::and(self.tmin.lt(t), t.le(last));
        (L::bits(L::and(inside, within)), BlockHits { t, v, w, det })
    }
}

/// Results of a block test, lane by lane.
struct BlockHits<L> {
    t: L,
    v: L,
    w: L,
    det: L,
}

/// Best hit so far.
struct Best {
    t: f32,
    prim: u32,
    b: (f32, f32),
}

impl Best {
    #[inline(always)]
    fn offer(&mut self, t: f32, prim: u32, b: impl FnOnce() -> (f32, f32)) {
        if t < self.t || (t == self.t && prim < self.prim) {
            *self = Best { t, prim, b: b() };
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
pub(super) fn closest<L: Lanes>(tree: &Tree, extent: f32, ray: &Ray) -> Option<Hit> {
    let setup = Setup::<L>::new(ray, extent)?;
    let mut current = tree.root?;
    let mut best = Best { t: setup.last, prim: u32::MAX, b: (0.0, 0.0) };
    let places = Places::new(tree);
    let mut slots: Slots<u64> = [const { MaybeUninit::uninit() }; STACK];
    let mut len = 0;
    'walk: loop {
        while !current.is_leaf() {
            let node = tree.node(current);
            let (mut bits, near) = setup.enter(node, L::splat(best.t));
            if bits == 0 {
                match pop(&slots, &mut len, best.t) {
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
            let ray = Ray64::new(ray.o, ray.d);
            for a in &tree.analytic[first..first + count] {
                if let Some((t, x, y)) = a.intersect(&ray, setup.tmin_scalar, best.t) {
                    best.offer(t, a.prim, || (x, y));
                }
            }
        } else {
            let (first, count) = current.block_range();
            for i in first..first + count {
                let block = tree.block(i);
                let (mut bits, h) = setup.hits(block, L::splat(best.t));
                if bits != 0 {
                    let (t, v, w, det) = (h.t.store(), h.v.store(), h.w.store(), h.det.store());
                    while bits != 0 {
                        let i = bits.trailing_zeros() as usize & 7;
                        best.offer(t[i], block.prim[i], || (v[i] / det[i], w[i] / det[i]));
                        bits &= bits - 1;
                    }
                }
            }
        }
        match pop(&slots, &mut len, best.t) {
            Some(c) => current = c,
            None => break,
        }
    }
    (best.prim != u32::MAX).then_some(Hit {
        t: best.t,
        prim: best.prim,
        b1: best.b.0,
        b2: best.b.1,
    })
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

/// Whether anything is hit.
#[inline(always)]
pub(super) fn occluded<L: Lanes>(tree: &Tree, extent: f32, ray: &Ray) -> bool {
    let Some(setup) = Setup::<L>::new(ray, extent) else { return false };
    let Some(mut current) = tree.root else { return false };
    let last = L::splat(setup.last);
    let places = Places::new(tree);
    let mut slots: Slots<u32> = [const { MaybeUninit::uninit() }; STACK];
    let mut len = 0;
    loop {
        if current.is_leaf() {
            if current.is_analytic() {
                let (first, count) = current.analytic_range();
                let ray = Ray64::new(ray.o, ray.d);
                let hit = tree.analytic[first..first + count]
                    .iter()
                    .any(|a| a.intersect(&ray, setup.tmin_scalar, setup.last).is_some());
                if hit {
                    return true;
                }
            } else {
                let (first, count) = current.block_range();
                for i in first..first + count {
                    if setup.hits(tree.block(i), last).0 != 0 {
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
