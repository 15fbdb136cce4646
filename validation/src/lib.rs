//! Statistical validation of integrators: how pathspace knows that it is right.
//!
//! [`stats`] holds the statistics: pure functions on numbers that know nothing of rendering.
//! [`pairs`] judges whether two integrators agree. [`exact`] holds scenes whose image is known and measures integrators against them;
//! [`scene_builder`] writes scenes in code; [`json`] reads numbers that JSON can not write; [`page`] is what pages for the browser have
//! in common.

pub mod exact;
pub mod json;
pub mod page;
pub mod pairs;
pub mod scene_builder;
pub mod stats;
