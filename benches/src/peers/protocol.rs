//! What an adapter is asked and what it answers; docs/peers.md is its description.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Place, Request};
use crate::budget::Budget;

/// Version of the protocol.
const PROTOCOL: u32 = 1;

/// A request, one line of JSON.
#[derive(Debug, Serialize)]
pub(super) struct Wanted<'a> {
    protocol: u32,
    /// `describe` or `render`.
    ask: &'static str,
    scene: &'a Path,
    define: &'a BTreeMap<String, String>,
    width: u32,
    height: u32,
    /// −1 is unlimited.
    max_depth: i64,
    options: &'a BTreeMap<String, String>,
    #[serde(flatten)]
    render: Option<Render<'a>>,
}

#[derive(Debug, Serialize)]
struct Render<'a> {
    /// Below 2³¹, which every renderer takes.
    seed: u64,
    replicate: u32,
    spp: Option<u64>,
    seconds: Option<f64>,
    threads: usize,
    output: &'a Path,
}

impl<'a> Wanted<'a> {
    pub(super) fn describe(place: &'a Place, options: &'a BTreeMap<String, String>) -> Self {
        Wanted {
            protocol: PROTOCOL,
            ask: "describe",
            scene: &place.file,
            define: &place.define,
            width: place.width,
            height: place.height,
            max_depth: place.max_depth.map_or(-1, i64::from),
            options,
            render: None,
        }
    }

    pub(super) fn render(
        place: &'a Place,
        options: &'a BTreeMap<String, String>,
        request: &Request,
        output: &'a Path,
    ) -> Self {
        let (spp, seconds) = match request.budget {
            Budget::Samples(n) => (Some(n), None),
            Budget::Seconds(s) => (None, Some(s)),
        };
        let (replicate, threads) = (request.replicate, request.threads);
        let seed = request.seed & 0x7fff_ffff;
        Wanted {
            ask: "render",
            render: Some(Render { seed, replicate, spp, seconds, threads, output }),
            ..Wanted::describe(place, options)
        }
    }
}

/// A family of techniques by its name in the protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Technique {
    S0,
    S1,
    Inner,
    T1,
    T0,
}

/// An answer, one line of JSON; every field may be left out.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Described {
    pub absent: Option<String>,
    pub error: Option<String>,
    pub version: String,
    pub techniques: Vec<Technique>,
    #[serde(flatten)]
    pub cost: Answer,
}

/// What a render of another renderer cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Answer {
    /// Wall-clock seconds of rendering alone.
    pub seconds: f64,
    /// Processor seconds of rendering, of all threads.
    pub cpu_seconds: Option<f64>,
    /// Seconds for loading and compiling that this request needed besides.
    pub startup_seconds: f64,
    /// Samples per pixel.
    pub spp: f64,
    /// Rays traced; 0 where the renderer does not tell.
    pub rays: u64,
}
