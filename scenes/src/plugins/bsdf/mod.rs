//! Scattering models.

mod made;
mod parameter;
mod plain;
mod principled;

use pathspace_core::description::{MaterialKind, Parameter};

use self::parameter::Varying;
use super::props::Props;
use super::{Context, support};
use crate::error::Result;

/// Reads the bsdf with this index.
pub(super) fn read(context: &mut Context<'_>, index: usize) -> Result<MaterialKind> {
    nested(context, index, &mut Vec::new())
}

/// Reads a model in the models `within`.
fn nested(
    context: &mut Context<'_>,
    index: usize,
    within: &mut Vec<usize>,
) -> Result<MaterialKind> {
    let graph = context.graph;
    let object = &graph.objects[index];
    let mut props = Props::new(graph, object);
    if within.contains(&index) {
        return Err(props.error("refers to itself"));
    }
    within.push(index);
    let mut textures = Varying::new();
    let kind = match object.plugin.as_str() {
        "twosided" => made::two_sided(context, &mut props, within)?,
        "mask" => made::mask(context, &mut props, within, &mut textures)?,
        "blendbsdf" => made::blend(context, &mut props, within, &mut textures)?,
        "mixturebsdf" => made::mixture(context, &mut props, within)?,
        "normalmap" | "bumpmap" => made::relief(context, &mut props, within)?,
        "coating" | "roughcoating" => made::coating(context, &mut props, within)?,
        "principled" => principled::solid(context, &mut props, &mut textures)?,
        "principledthin" => principled::thin(context, &mut props, &mut textures)?,
        name if support::of("bsdf", name) == Some(support::Support::Full) => {
            plain::read(context, &mut props, &mut textures)?
        }
        "difftrans" => plain::diffuse_transmitter(context, &mut props, &mut textures)?,
        _ => return Err(support::unknown(object)),
    };
    within.pop();
    props.finish(context)?;
    Ok(match textures.is_empty() {
        true => kind,
        false => MaterialKind::Textured { model: Box::new(kind), textures },
    })
}

/// True where light may pass.
fn transmits(model: &MaterialKind) -> bool {
    match model {
        MaterialKind::Textured { model, textures } => {
            transmits(model) || textures.iter().any(|(p, _)| *p == Parameter::SpecTrans)
        }
        MaterialKind::Mixture { models } => models.iter().any(|(_, model)| transmits(model)),
        MaterialKind::Relief { model, .. } => transmits(model),
        MaterialKind::Principled(kind) => kind.spec_trans > 0.0,
        other => matches!(
            other,
            MaterialKind::Dielectric { .. }
                | MaterialKind::RoughDielectric { .. }
                | MaterialKind::ThinDielectric { .. }
                | MaterialKind::PrincipledThin(_)
                | MaterialKind::Mask { .. }
                | MaterialKind::Null
        ),
    }
}
