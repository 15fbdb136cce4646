//! Integrator elements as defaults for rendering.

use super::props::Props;
use super::{Context, unknown_plugin};
use crate::error::Result;

/// What the file says about how to render it; the command line may say otherwise.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RenderDefaults {
    /// "pt" or "lt"; `None` where the file has no integrator.
    pub integrator: Option<String>,
    /// Longest path in edges, the camera edge included: 1 sees emission only, 2 adds direct
    /// light. `None` is unlimited. (Mitsuba's meaning of `max_depth`.)
    pub max_depth: Option<u32>,
    /// Russian roulette starts at paths of this many edges (Mitsuba's `rr_depth`, default 5).
    pub rr_depth: u32,
    /// Samples per pixel of the sensor's sampler.
    pub spp: Option<u32>,
}

impl Default for RenderDefaults {
    fn default() -> Self {
        RenderDefaults { integrator: None, max_depth: None, rr_depth: 5, spp: None }
    }
}

/// Longest path that is worth naming; larger limits are refused as mistakes.
const MAX_DEPTH: i64 = 1 << 24;

/// Reads the integrator with this index.
pub(super) fn read(context: &mut Context<'_>, index: usize) -> Result<RenderDefaults> {
    let object = &context.graph.objects[index];
    let mut props = Props::new(context.graph, object);
    let mut defaults = RenderDefaults::default();
    let name = match object.plugin.as_str() {
        "path" | "volpath" | "volpathmis" | "direct" => "pt",
        "ptracer" => "lt",
        _ => {
            return Err(unknown_plugin(
                object,
                &["direct", "path", "ptracer", "volpath", "volpathmis"],
            ));
        }
    };
    defaults.integrator = Some(name.into());
    if object.plugin == "direct" {
        defaults.max_depth = Some(2);
        let names = ["shading_samples", "emitter_samples", "bsdf_samples"];
        props.ignore(context, &names, "pt takes one sample of each kind");
    } else {
        defaults.max_depth = match props.integer("max_depth")? {
            None | Some(-1) => None,
            Some(depth) if (0..=MAX_DEPTH).contains(&depth) => Some(depth as u32),
            Some(_) => {
                let expected = format!("-1 (unlimited) or an integer from 0 to {MAX_DEPTH}");
                return Err(props.refuse("max_depth", &expected));
            }
        };
        defaults.rr_depth = props.count("rr_depth", 1, u32::MAX)?.unwrap_or(5);
    }
    if props.boolean("hide_emitters")? == Some(true) {
        return Err(props.complain("hide_emitters", "true is not understood, only false"));
    }
    if object.old && props.boolean("strict_normals")? == Some(true) {
        return Err(props.complain("strict_normals", "true is not understood, only false"));
    }
    let technical = ["samples_per_pass", "block_size", "timeout"];
    props.ignore(context, &technical, "the run is divided in its own way");
    props.finish()?;
    Ok(defaults)
}
