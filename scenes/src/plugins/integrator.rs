//! Integrator elements as defaults for rendering.

use super::Context;
use super::props::Props;
use crate::error::Result;
use crate::note::NoteKind;

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
    /// Mitsuba's `hide_emitters`: light is seen by reflection only. Integrators may leave it out,
    /// with a note of the reader.
    pub hide_emitters: bool,
    /// Samples per pixel of the sensor's sampler.
    pub spp: Option<u32>,
}

impl Default for RenderDefaults {
    fn default() -> Self {
        RenderDefaults {
            integrator: None,
            max_depth: None,
            rr_depth: 5,
            hide_emitters: false,
            spp: None,
        }
    }
}

/// Longest path that is worth naming; larger limits are refused as mistakes.
const MAX_DEPTH: i64 = 1 << 24;

/// Reads the integrator with this index.
pub(super) fn read(context: &mut Context<'_>, index: usize) -> Result<RenderDefaults> {
    read_at(context, index, 0)
}

/// Integrators in integrators: deeper ones are a reference that runs in a circle.
const MAX_NESTING: usize = 8;

/// An integrator that is not known: the one that it wraps counts, or the default.
fn unknown(
    context: &mut Context<'_>,
    mut props: Props<'_>,
    index: usize,
    depth: usize,
) -> Result<RenderDefaults> {
    let object = &context.graph.objects[index];
    let inner = props.nested("integrator")?.first().map(|(inner, _)| *inner);
    let title = object.title();
    let (text, defaults) = match inner {
        Some(inner) if depth < MAX_NESTING => {
            let within = context.graph.objects[inner].title();
            let text = format!("{title} is not understood: {within} in it counts");
            (text, read_at(context, inner, depth + 1)?)
        }
        _ => (format!("{title} is not understood: the default counts"), RenderDefaults::default()),
    };
    context.note(NoteKind::Differs, text, &object.place);
    Ok(defaults)
}

fn read_at(context: &mut Context<'_>, index: usize, depth: usize) -> Result<RenderDefaults> {
    let object = &context.graph.objects[index];
    let mut props = Props::new(context.graph, object);
    let mut defaults = RenderDefaults::default();
    let name = match object.plugin.as_str() {
        "path" | "volpath" | "volpathmis" | "direct" => "pt",
        "ptracer" => "lt",
        _ => return unknown(context, props, index, depth),
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
    defaults.hide_emitters = props.boolean("hide_emitters")?.unwrap_or(false);
    if defaults.hide_emitters {
        let text = "property \"hide_emitters\": emitters are seen all the same";
        context.note(NoteKind::Differs, text, props.place());
    }
    if props.boolean("strict_normals")? == Some(true) {
        let text = "property \"strict_normals\" is ignored: shading normals are used as without it";
        context.note(NoteKind::Differs, text, props.place());
    }
    let technical = ["samples_per_pass", "block_size", "timeout"];
    props.ignore(context, &technical, "the run is divided in its own way");
    props.finish(context)?;
    Ok(defaults)
}
