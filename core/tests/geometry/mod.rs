//! Ray traversal.

mod agree;
mod analytic;
mod degenerate;
mod leaks;
mod local;
mod meshes;
mod offsets;
mod rays;
