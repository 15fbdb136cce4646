//! Seconds to build the tree of inputs that once took quadratic time: equal boxes, and boxes whose
//! areas underflow beside a huge one.
//!
//! ```text
//! cargo bench -p pathspace-benches --bench build
//! ```

use std::time::Instant;

use glam::Vec3;
use pathspace_core::geometry::{Accel, Primitives};

const SIZES: [usize; 4] = [8_000, 16_000, 64_000, 256_000];

fn triangle(at: Vec3, size: f32) -> [Vec3; 3] {
    [at, at + Vec3::X * size, at + Vec3::new(0.3, 1.0, 0.2) * size]
}

/// A point of a lattice that is not in any order.
fn place(i: usize) -> Vec3 {
    let at = |step: usize| ((i * step) % 1009) as f32 / 1009.0;
    Vec3::new(at(1), at(31), at(577))
}

fn inputs(n: usize) -> [(&'static str, Vec<[Vec3; 3]>); 4] {
    let equal = vec![triangle(Vec3::splat(0.1), 0.3); n];
    let row = (0..n).map(|i| triangle(Vec3::X * i as f32, 1.0)).collect();
    let spread = (0..n).map(|i| triangle(place(i), 0.01)).collect();
    let mut tiny: Vec<_> = (0..n).map(|i| triangle(place(i) * 1e-15, 1e-17)).collect();
    tiny.push(triangle(Vec3::ZERO, 1e5));
    [("equal", equal), ("in a row", row), ("spread", spread), ("10^22 apart", tiny)]
}

fn main() {
    println!("| triangles | input | s | depth |");
    println!("| --- | --- | --- | --- |");
    for n in SIZES {
        for (name, triangles) in inputs(n) {
            let clock = Instant::now();
            match Accel::build(Primitives { triangles, ..Primitives::default() }) {
                Ok(accel) => {
                    let seconds = clock.elapsed().as_secs_f64();
                    println!("| {n} | {name} | {seconds:.3} | {} |", accel.stats().depth);
                }
                Err(error) => println!("| {n} | {name} | {error} | |"),
            }
        }
    }
}
