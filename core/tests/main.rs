//! Integration tests of the core: one binary, a module per subject.

mod bsdf;
mod bsdf_compound;
mod bsdf_mitsuba;
mod bsdf_models;
mod bsdf_properties;
mod chi2;
mod delta;
mod emitters;
mod far;
mod geometry;
mod inverses;
mod measure;
mod media;
mod paths;
mod scatter;
mod sensor;
mod uv;
