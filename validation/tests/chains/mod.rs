//! L4: Markov chains, the driver and every mutation.

mod answers;
mod features;
mod invariance;
mod jumps;
mod starts;
mod toy;

use glam::Vec2;
use pathspace_core::Rgb;
use pathspace_core::film::{Contribution, Families};

/// What a made-up state splats: `weight` at a film position.
fn grey(film: Vec2, weight: f64) -> Contribution {
    let value = Rgb::grey(weight as f32);
    Contribution { film, value, weight: 1.0, s: 1, t: 1, emitter: 0, families: Families::ALL }
}
