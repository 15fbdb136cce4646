//! Mitsuba's XML: elements, parameters, includes, ids and the upgrade of old files.

mod dom;
mod element;
mod encoding;
mod files;
pub(crate) mod graph;
mod params;
mod parse;
mod transform;
mod upgrade;
pub(crate) mod value;

pub(crate) use files::Files;
pub(crate) use graph::{Graph, Object, Property};
pub(crate) use params::Parameters;
pub(crate) use parse::parse_scene;
