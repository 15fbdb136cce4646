//! Statistical validation of integrators: how pathspace knows that it is right.
//!
//! [`stats`] holds the statistics: pure functions on numbers that know nothing of rendering.

pub mod stats;
