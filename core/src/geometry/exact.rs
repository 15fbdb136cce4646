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
    /// Shear Sₓ, S_y and scale S_z.
    shear: [f64; 3],
    tmin: f64,
    tmax: f64,
}

impl Exact {
    #[inline(always)]
    pub fn new(ray: &Ray64, axis: [usize; 3], tmin: f32, tmax: f32) -> Self {
        let (o, d) = (ray.o.to_array(), ray.d.to_array());
        let [x, y, z] = axis;
        let scale = 1.0 / d[z];
        Exact {
            axis,
            o: [o[x], o[y], o[z]],
            shear: [d[x] * scale, d[y] * scale, scale],
            tmin: f64::from(tmin),
            tmax: f64::from(tmax),
        }
    }

    /// The open interval of t that counts.
    #[inline(always)]
    pub fn interval(&self) -> (f64, f64) {
        (self.tmin, self.tmax)
    }

    /// Whether t counts.
    #[inline(always)]
    pub fn contains(&self, t: f64) -> bool {
        t > self.tmin && t < self.tmax
    }

    #[inline(always)]
    fn corner(&self, block: &Block, lane: usize, c: usize) -> (f64, f64, f64) {
        let [kx, ky, kz] = self.axis.map(|k| f64::from(block.rows[3 * c + k][lane & 7]));
        let z = kz - self.o[2];
        (kx - self.o[0] - self.shear[0] * z, ky - self.o[1] - self.shear[1] * z, z)
    }

    /// t and the weights of the corners 1 and 2 where the line of the ray meets the triangle, edges included.
    #[inline(always)]
    pub fn meet(&self, block: &Block, lane: usize) -> Option<(f64, f64, f64)> {
        let (xa, ya, za) = self.corner(block, lane, 0);
        let (xb, yb, zb) = self.corner(block, lane, 1);
        let (xc, yc, zc) = self.corner(block, lane, 2);
        let u = xc * yb - yc * xb;
        let v = xa * yc - ya * xc;
        let w = xb * ya - yb * xa;
        let det = u + v + w;
        let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        if !inside || det == 0.0 {
            return None;
        }
        let inverse = 1.0 / det;
        let t = (u * za + v * zb + w * zc) * self.shear[2] * inverse;
        Some((t, v * inverse, w * inverse))
    }
}
