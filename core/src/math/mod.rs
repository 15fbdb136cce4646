//! Rays, frames and warps.

mod frame;
mod ray;

pub use frame::Frame;
pub use ray::Ray;
