//! Statistical validation of integrators: how pathspace knows that it is right.
//!
//! [`stats`] holds the statistics: pure functions on numbers that know nothing of rendering.
//! [`scene_builder`] writes scenes in code.

pub mod scene_builder;
pub mod stats;
