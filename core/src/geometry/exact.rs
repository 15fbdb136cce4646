//! Rays and triangles in f64: what decides whether, where and in which order triangles are hit.
//!
//! Origins and corners are f32 and exact. Woop's test in f64 is as watertight as in f32: a shared vertex gives
//! the same bits in both triangles, a shared edge gives edge functions of exactly opposite sign. Depths err by
//! some 10⁻¹⁵ of the triangle's size, so that a sheet 0.1 mm above a ground of 10 km is told from it.

use super::analytic::Ray64;
use super::layout::Block;

/// Ray in the sheared frame of Woop et al. 2013, in f64.
pub(super) struct Exact {
    /// Axes x, y, z of the sheared frame; z is where |d| is largest.
    axis: [usize; 3],
    /// Origin in these axes.
    o: [f64; 3],
    /// Direction in these axes.
    d: [f64; 3],
    tmin: f64,
    tmax: f64,
}

impl Exact {
    #[inline(always)]
    pub fn new(ray: &Ray64, axis: [usize; 3], tmin: f32, tmax: f32) -> Self {
        let (o, d) = (ray.o.to_array(), ray.d.to_array());
        let [x, y, z] = axis;
        Exact {
            axis,
            o: [o[x], o[y], o[z]],
            d: [d[x], d[y], d[z]],
            tmin: f64::from(tmin),
            tmax: f64::from(tmax),
        }
    }

    /// The open interval of t that counts.
    #[inline(always)]
    pub fn interval(&self) -> (f64, f64) {
        (self.tmin, self.tmax)
    }

    #[inline(always)]
    fn corner(&self, block: &Block, lane: usize, c: usize, s: (f64, f64)) -> (f64, f64, f64) {
        let [kx, ky, kz] = self.axis;
        let z = f64::from(block.rows[3 * c + kz][lane & 7]) - self.o[2];
        let x = f64::from(block.rows[3 * c + kx][lane & 7]) - self.o[0];
        let y = f64::from(block.rows[3 * c + ky][lane & 7]) - self.o[1];
        (x - s.0 * z, y - s.1 * z, z)
    }

    /// t and the weights of the corners 1 and 2 where the ray meets the triangle, edges included; both ends of the
    /// interval excluded.
    #[inline(always)]
    pub fn meet(&self, block: &Block, lane: usize) -> Option<(f64, f64, f64)> {
        // Shear and scale: here, since most walks need them once or never.
        let scale = 1.0 / self.d[2];
        let shear = (self.d[0] * scale, self.d[1] * scale);
        let (xa, ya, za) = self.corner(block, lane, 0, shear);
        let (xb, yb, zb) = self.corner(block, lane, 1, shear);
        let (xc, yc, zc) = self.corner(block, lane, 2, shear);
        let u = xc * yb - yc * xb;
        let v = xa * yc - ya * xc;
        let w = xb * ya - yb * xa;
        let det = u + v + w;
        // Without branches: which side a triangle shows is as good as random.
        let least = if u < v { u } else { v };
        let least = if least < w { least } else { w };
        let most = if u > v { u } else { v };
        let most = if most > w { most } else { w };
        let inside = (least >= 0.0) | (most <= 0.0);
        if !inside || det == 0.0 {
            return None;
        }
        let inverse = 1.0 / det;
        let t = (u * za + v * zb + w * zc) * scale * inverse;
        (t > self.tmin && t < self.tmax).then_some((t, v * inverse, w * inverse))
    }
}
