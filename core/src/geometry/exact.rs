//! Rays and triangles in f64, eight triangles at once.
//!
//! Origins and corners are f32 and exact. Woop's test in f64 is as watertight as in f32: a shared
//! vertex gives the same bits in both triangles, a shared edge gives edge functions of exactly
//! opposite sign. Depths err by some 10⁻¹⁵ of the triangle's size, so that a sheet 0.1 mm above a
//! ground of 10 km is told from it.

use super::analytic::Ray64;
use super::lanes::{Doubles, Lanes};
use super::layout::Block;

/// Ray in the sheared frame of Woop et al. 2013, §2.1.
pub(super) struct Exact<D> {
    /// Axes x, y, z of the sheared frame; z is where |d| is largest.
    axis: [usize; 3],
    /// Origin in these axes.
    o: [D; 3],
    /// Sₓ and S_y.
    shear: [D; 2],
    /// S_z.
    scale: D,
    /// Least t that counts.
    first: D,
}

/// Where a ray meets the triangles of a block, lane by lane.
pub(super) struct BlockHits {
    /// Lanes with a hit.
    pub bits: u32,
    pub t: [f64; 8],
    /// Weight of corner 1.
    pub b1: [f64; 8],
    /// Weight of corner 2.
    pub b2: [f64; 8],
}

impl<D: Doubles> Exact<D> {
    /// `tmin` itself does not count.
    #[inline(always)]
    pub fn new(ray: &Ray64, axis: [usize; 3], tmin: f32) -> Self {
        let (o, d) = (ray.o.to_array(), ray.d.to_array());
        let [x, y, z] = axis;
        let scale = 1.0 / d[z];
        Exact {
            axis,
            o: [D::splat(o[x]), D::splat(o[y]), D::splat(o[z])],
            shear: [D::splat(d[x] * scale), D::splat(d[y] * scale)],
            scale: D::splat(scale),
            first: D::splat(f64::from(tmin).next_up()),
        }
    }

    /// Corner `c` in the sheared frame, z not yet scaled.
    #[inline(always)]
    fn corner(&self, block: &Block, c: usize) -> (D, D, D) {
        let [kx, ky, kz] = self.axis;
        let z = D::widen(&block.rows[3 * c + kz]).sub(self.o[2]);
        let x = D::widen(&block.rows[3 * c + kx]).sub(self.o[0]).sub(self.shear[0].mul(z));
        let y = D::widen(&block.rows[3 * c + ky]).sub(self.o[1]).sub(self.shear[1].mul(z));
        (x, y, z)
    }

    /// Woop's test: hits with tmin < t ≤ `last`, edges of the triangles included, those of the ids
    /// `skip` left out. Empty lanes are NaN, and so is t where a triangle is seen from its edge: no
    /// comparison accepts them.
    #[inline(always)]
    pub fn meet<L: Lanes>(&self, block: &Block, last: f64, skip: [u32; 2]) -> Option<BlockHits> {
        let (xa, ya, za) = self.corner(block, 0);
        let (xb, yb, zb) = self.corner(block, 1);
        let (xc, yc, zc) = self.corner(block, 2);
        let u = xc.mul(yb).sub(yc.mul(xb));
        let v = xa.mul(yc).sub(ya.mul(xc));
        let w = xb.mul(ya).sub(yb.mul(xa));
        let zero = D::splat(0.0);
        let inside = zero.le(u.min(v).min(w)) | u.max(v).max(w).le(zero);
        // No branch on `inside`: it is as good as random, and what follows costs less than a wrong
        // guess.
        let inverse = D::splat(1.0).div(u.add(v).add(w));
        let t = u.mul(za).add(v.mul(zb)).add(w.mul(zc)).mul(self.scale).mul(inverse);
        let within = inside & self.first.le(t) & t.le(D::splat(last));
        let bits = within & !L::same(&block.prim, skip[0]) & !L::same(&block.prim, skip[1]);
        if bits == 0 {
            return None;
        }
        Some(BlockHits {
            bits,
            t: t.store(),
            b1: v.mul(inverse).store(),
            b2: w.mul(inverse).store(),
        })
    }
}
