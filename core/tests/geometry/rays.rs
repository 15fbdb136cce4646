//! Random points and directions.

use glam::Vec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// Uniform direction.
pub fn direction(rng: &mut Pcg64Mcg) -> Vec3 {
    let z = 2.0 * rng.random::<f32>() - 1.0;
    let phi = std::f32::consts::TAU * rng.random::<f32>();
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * phi.cos(), r * phi.sin(), z)
}

/// Uniform point of [−s, s]³.
pub fn in_cube(rng: &mut Pcg64Mcg, s: f32) -> Vec3 {
    Vec3::new(rng.random(), rng.random(), rng.random()) * (2.0 * s) - s
}

/// Uniform barycentric weights of corners 1 and 2.
pub fn barycentric(rng: &mut Pcg64Mcg) -> (f32, f32) {
    let r = rng.random::<f32>().sqrt();
    let v = rng.random::<f32>() * r;
    (r - v, v)
}

/// Uniform point of a triangle.
pub fn on_triangle(rng: &mut Pcg64Mcg, t: &[Vec3; 3]) -> Vec3 {
    let (b1, b2) = barycentric(rng);
    t[0] + (t[1] - t[0]) * b1 + (t[2] - t[0]) * b2
}

/// Counts for how many of about `n` draws `f` is true, on all processors, independent of how many.
pub fn count(n: usize, seed: u64, f: impl Fn(&mut Pcg64Mcg) -> bool + Sync) -> usize {
    const CHUNK: usize = 1 << 14;
    (0..n.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let mut rng = Pcg64Mcg::seed_from_u64(seed << 32 | chunk as u64);
            (0..CHUNK.min(n - chunk * CHUNK)).filter(|_| f(&mut rng)).count()
        })
        .sum()
}
