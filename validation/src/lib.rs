//! Statistical validation of integrators: how pathspace knows that it is right.
//!
//! [`stats`] holds the statistics: pure functions on numbers that know nothing of rendering.
//! [`exact`] holds scenes whose image is known and measures integrators against them;
//! [`scene_builder`] writes scenes in code.

pub mod exact;
pub mod scene_builder;
pub mod stats;
