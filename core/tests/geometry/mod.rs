//! Ray traversal.

mod agree;
mod analytic;
mod degenerate;
mod leaks;
mod meshes;
mod offsets;
mod rays;
