//! Integration tests of the reader: one binary, a module per subject.

mod bad_input;
mod features;
mod lights;
mod materials;
mod media;
mod meshes;
mod mutated;
mod plugins;
mod references;
mod shared_cases;
mod shared_scenes;
mod tolerant;
