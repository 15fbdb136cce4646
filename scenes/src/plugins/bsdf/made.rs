//! Models made of others: sides, masks, blends, mixtures, normal and bump maps, coats.

use std::sync::Arc;

use pathspace_core::description::{MaterialKind, MicrofacetKind, Parameter, ReliefMap};
use pathspace_core::texture::Texture;

use super::super::props::Props;
use super::super::{Context, texture};
use super::parameter::{Varying, distribution, factor, index_of_refraction, number, one_roughness};
use super::{nested, transmits};
use crate::error::{Result, SceneFileError};
use crate::note::NoteKind;

/// The nested models, in the order of the file: `count` of them.
fn models(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    within: &mut Vec<usize>,
    count: usize,
) -> Result<Vec<MaterialKind>> {
    let children = props.nested("bsdf")?;
    if children.len() != count {
        let n = children.len();
        return Err(props.error(format!("needs {count} nested <bsdf>, not {n}")));
    }
    children.iter().map(|(child, _)| nested(context, *child, within)).collect()
}

/// The one nested model.
fn model(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    within: &mut Vec<usize>,
) -> Result<Box<MaterialKind>> {
    let mut all = models(context, props, within, 1)?;
    Ok(Box::new(all.remove(0)))
}

/// `twosided`: one or two models that let no light through.
pub(super) fn two_sided(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    within: &mut Vec<usize>,
) -> Result<MaterialKind> {
    let graph = props.graph();
    let children = props.nested("bsdf")?;
    let mut models = Vec::new();
    for (child, place) in &children {
        let model = nested(context, *child, within)?;
        if transmits(&model) {
            let title = graph.objects[*child].title();
            let reason = format!("{title} lets light through and cannot be twosided");
            return Err(SceneFileError::Scene { place: (*place).clone(), reason });
        }
        models.push(model);
    }
    // A twosided model within a twosided one stands for the side that it is seen from.
    let mut sides = models.into_iter().map(|model| match model {
        MaterialKind::TwoSided { front, .. } => front,
        other => Box::new(other),
    });
    match (sides.next(), sides.next(), sides.next()) {
        (Some(front), back, None) => {
            let back = back.unwrap_or_else(|| front.clone());
            Ok(MaterialKind::TwoSided { front, back })
        }
        (None, ..) => Err(props.error("needs one or two nested <bsdf>, not 0")),
        (_, _, Some(_)) => Err(props.error("needs one or two nested <bsdf>, not more")),
    }
}

/// `mask`.
pub(super) fn mask(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    within: &mut Vec<usize>,
    textures: &mut Varying,
) -> Result<MaterialKind> {
    let range = (0.5, [0.0, 1.0]);
    let opacity = number(context, props, "opacity", range, Parameter::Weight, textures)?;
    Ok(MaterialKind::Mask { opacity, model: model(context, props, within)? })
}

/// `blendbsdf`: `weight` is that of the second model.
pub(super) fn blend(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    within: &mut Vec<usize>,
    textures: &mut Varying,
) -> Result<MaterialKind> {
    if !props.has("weight") && !props.object.old {
        return Err(props.error("needs the property \"weight\""));
    }
    let range = (0.5, [0.0, 1.0]);
    let weight = number(context, props, "weight", range, Parameter::Weight, textures)?;
    let weights = [1.0 - weight, weight];
    let models = models(context, props, within, 2)?;
    Ok(MaterialKind::Mixture { models: weights.into_iter().zip(models).collect() })
}

/// `mixturebsdf` of Mitsuba 0.x: a weight for each model; weights whose sum is over 1 are divided
/// by it.
pub(super) fn mixture(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    within: &mut Vec<usize>,
) -> Result<MaterialKind> {
    let weights = props.numbers("weights")?;
    if weights.is_empty() || weights.iter().any(|w| *w < 0.0) {
        return Err(props.refuse("weights", "numbers ≥ 0"));
    }
    let models = models(context, props, within, weights.len())?;
    let sum: f64 = weights.iter().sum();
    let scale = if sum > 1.0 { 1.0 / sum } else { 1.0 };
    if sum > 1.0 {
        let text = "weights of \"mixturebsdf\" whose sum is over 1 are divided by it";
        context.note(NoteKind::Mended, text, props.place());
    }
    let weights = weights.into_iter().map(|w| ((w * scale) as f32).min(1.0));
    Ok(MaterialKind::Mixture { models: weights.zip(models).collect() })
}

/// `normalmap` and `bumpmap`.
pub(super) fn relief(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    within: &mut Vec<usize>,
) -> Result<MaterialKind> {
    let map = map(context, props)?;
    // Files of Mitsuba 0.x know neither guard, and its images have none.
    let guards = !props.object.old;
    let flip_invalid_normals = props.boolean("flip_invalid_normals")?.unwrap_or(guards);
    let use_shadowing = props.boolean("use_shadowing_function")?.unwrap_or(guards);
    let scale = props.float("scale")?;
    let map = match props.object.plugin.as_str() {
        "normalmap" => {
            if scale.is_some_and(|s| s != 1.0) {
                return Err(props.refuse("scale", "nothing: a normal map has no scale"));
            }
            ReliefMap::Normals(map)
        }
        _ => ReliefMap::Heights { texture: map, scale: scale.unwrap_or(1.0) as f32 },
    };
    let model = model(context, props, within)?;
    Ok(MaterialKind::Relief { model, map, flip_invalid_normals, use_shadowing })
}

/// The nested texture, whatever its name.
fn map(context: &mut Context<'_>, props: &mut Props<'_>) -> Result<Arc<Texture>> {
    if let Some(colour) = props.has("normalmap").then(|| props.texture("normalmap")).transpose()?
        && let Some(index) = colour
    {
        return texture::read(context, index, 0);
    }
    match props.nested_one("texture")? {
        Some(index) => texture::read(context, index, 0),
        None => Err(props.error("needs a nested texture")),
    }
}

/// `coating` and `roughcoating` of Mitsuba 0.x, which Mitsuba 3 does not have. Over a diffuse base
/// they are plastic; other models lose their coat.
pub(super) fn coating(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    within: &mut Vec<usize>,
) -> Result<MaterialKind> {
    let rough = props.object.plugin == "roughcoating";
    let int_ior = index_of_refraction(props, "int_ior", "bk7")?;
    let ext_ior = index_of_refraction(props, "ext_ior", "air")?;
    let (distribution, alpha) = match rough {
        true => (distribution(context, props)?, one_roughness(context, props, 0.1)?),
        false => (MicrofacetKind::Beckmann, 0.0),
    };
    let mut own = Varying::new();
    let specular_reflectance = factor(context, props, "specular_reflectance", 1.0, &mut own)?;
    let why = "nothing is absorbed in a coat";
    props.ignore(context, &["thickness", "sigma_a"], why);
    let (base, textures) = match *model(context, props, within)? {
        MaterialKind::Textured { model, textures } => (*model, textures),
        other => (other, Varying::new()),
    };
    let title = props.object.title();
    let MaterialKind::Diffuse { reflectance: diffuse_reflectance } = base else {
        let text = format!("{title} is left out: only a diffuse base can have a coat here");
        context.note(NoteKind::Differs, text, props.place());
        return Ok(match textures.is_empty() {
            true => base,
            false => MaterialKind::Textured { model: Box::new(base), textures },
        });
    };
    let name = if rough { "roughplastic" } else { "plastic" };
    let text = format!("{title} over a diffuse base is read as \"{name}\"");
    context.note(NoteKind::Differs, text, props.place());
    let nonlinear = true;
    let coated = match rough {
        true if int_ior != ext_ior => MaterialKind::RoughPlastic {
            distribution,
            alpha,
            sample_visible: true,
            int_ior,
            ext_ior,
            diffuse_reflectance,
            specular_reflectance,
            nonlinear,
        },
        _ => MaterialKind::Plastic {
            int_ior,
            ext_ior,
            diffuse_reflectance,
            specular_reflectance,
            nonlinear,
        },
    };
    own.extend(textures);
    Ok(match own.is_empty() {
        true => coated,
        false => MaterialKind::Textured { model: Box::new(coated), textures: own },
    })
}
