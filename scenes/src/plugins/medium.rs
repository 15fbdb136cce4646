//! Participating media and phase functions.

use pathspace_core::Rgb;
use pathspace_core::description::{MediumDescription, MediumKind, PhaseKind};

use super::props::{Props, rounded};
use super::{Context, support};
use crate::error::Result;
use crate::spectrum::Meaning;

/// Phase functions in phase functions: deeper ones are a reference that runs in a circle.
const MAX_NESTING: usize = 8;

/// Reads the medium with this index.
pub(super) fn read(context: &mut Context<'_>, index: usize) -> Result<MediumDescription> {
    let object = &context.graph.objects[index];
    let mut props = Props::new(context.graph, object);
    let kind = match object.plugin.as_str() {
        "homogeneous" => homogeneous(context, &mut props)?,
        _ => return Err(support::unknown(object)),
    };
    let phase = match props.nested_one("phase")? {
        Some(index) => phase(context, index, 0)?,
        None => PhaseKind::Isotropic,
    };
    let why = "emitters are always sampled, and channels apart";
    props.ignore(context, &["sample_emitters", "has_spectral_extinction"], why);
    props.finish(context)?;
    Ok(MediumDescription { name: object.name(), kind, phase })
}

/// `sigma_t` and `albedo`, or `sigma_a` and `sigma_s` as files of 0.x have them, times `scale`.
fn homogeneous(context: &mut Context<'_>, props: &mut Props<'_>) -> Result<MediumKind> {
    let scale = props.float("scale")?.unwrap_or(1.0);
    if !(scale >= 0.0) {
        return Err(props.refuse("scale", "a number ≥ 0"));
    }
    if props.has("material") {
        let reason = "media by name are not known: give sigma_t and albedo";
        return Err(props.complain("material", reason));
    }
    let apart = props.has("sigma_a") || props.has("sigma_s");
    if apart && (props.has("sigma_t") || props.has("albedo")) {
        return Err(props.error("has sigma_a or sigma_s beside sigma_t or albedo: give one pair"));
    }
    let any = [0.0, f64::INFINITY];
    let (extinction, albedo) = if apart {
        let absorbs = coefficient(context, props, "sigma_a", any)?.unwrap_or([0.0; 3]);
        let scatters = coefficient(context, props, "sigma_s", any)?.unwrap_or([0.0; 3]);
        let both = [0, 1, 2].map(|c| absorbs[c] + scatters[c]);
        let share = |c: usize| if both[c] > 0.0 { scatters[c] / both[c] } else { 0.0 };
        (both, [0, 1, 2].map(share))
    } else {
        let extinction = coefficient(context, props, "sigma_t", any)?.unwrap_or([1.0; 3]);
        let albedo = coefficient(context, props, "albedo", [0.0, 1.0])?.unwrap_or([0.75; 3]);
        (extinction, albedo)
    };
    let extinction = extinction.map(|v| v * scale);
    let albedo: Rgb = rounded(albedo);
    Ok(MediumKind::Homogeneous { extinction, albedo })
}

/// A colour, or a volume that is the same everywhere.
fn coefficient(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    name: &str,
    range: [f64; 2],
) -> Result<Option<[f64; 3]>> {
    let Some(index) = props.named(name, "volume")? else {
        return props.colour(context, name, Meaning::Factor, range);
    };
    let object = &context.graph.objects[index];
    if object.plugin != "constvolume" {
        return Err(support::unknown(object));
    }
    let mut inner = Props::new(context.graph, object);
    let value = inner.colour(context, "value", Meaning::Factor, range)?;
    inner.finish(context)?;
    Ok(Some(value.unwrap_or([1.0; 3])))
}

fn phase(context: &mut Context<'_>, index: usize, depth: usize) -> Result<PhaseKind> {
    let object = &context.graph.objects[index];
    let mut props = Props::new(context.graph, object);
    if depth > MAX_NESTING {
        return Err(props.error(format!("phase functions are nested deeper than {MAX_NESTING}")));
    }
    let kind = match object.plugin.as_str() {
        "isotropic" => PhaseKind::Isotropic,
        "rayleigh" => PhaseKind::Rayleigh,
        "hg" => {
            let g = props.float("g")?.unwrap_or(0.8);
            if !(g.abs() < 1.0) {
                return Err(props.refuse("g", "a number between −1 and 1"));
            }
            PhaseKind::HenyeyGreenstein { g }
        }
        "blendphase" => {
            let weight = props.float("weight")?.unwrap_or(0.5);
            if !(0.0..=1.0).contains(&weight) {
                return Err(props.refuse("weight", "a number from 0 to 1"));
            }
            let children = props.nested("phase")?;
            let [(first, _), (second, _)] = children.as_slice() else {
                let n = children.len();
                return Err(props.error(format!("needs two nested <phase>, not {n}")));
            };
            let pair = [phase(context, *first, depth + 1)?, phase(context, *second, depth + 1)?];
            PhaseKind::Blend { weight, pair: Box::new(pair) }
        }
        _ => return Err(support::unknown(object)),
    };
    props.finish(context)?;
    Ok(kind)
}
