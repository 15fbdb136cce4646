//! Rays, frames and warps.

mod frame;
mod ray;
pub mod warp;

pub use frame::Frame;
pub use ray::{NO_PRIM, Ray};
