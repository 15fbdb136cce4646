//! Scattering models.

use std::sync::Arc;

use pathspace_core::Rgb;
use pathspace_core::description::{MaterialKind, MicrofacetKind, Parameter};
use pathspace_core::texture::Texture;

use super::props::{Props, rounded};
use super::{Context, ior, metals, support, texture};
use crate::error::{Result, SceneFileError};
use crate::note::NoteKind;
use crate::spectrum::Meaning;

/// Reads the bsdf with this index.
pub(super) fn read(context: &mut Context<'_>, index: usize) -> Result<MaterialKind> {
    nested(context, index, &mut Vec::new())
}

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
        "diffuse" => MaterialKind::Diffuse {
            reflectance: factor(context, &mut props, "reflectance", 0.5, &mut textures)?,
        },
        "dielectric" => MaterialKind::Dielectric {
            int_ior: index_of_refraction(&mut props, "int_ior", "bk7")?,
            ext_ior: index_of_refraction(&mut props, "ext_ior", "air")?,
            specular_reflectance: factor(
                context,
                &mut props,
                "specular_reflectance",
                1.0,
                &mut textures,
            )?,
            specular_transmittance: factor(
                context,
                &mut props,
                "specular_transmittance",
                1.0,
                &mut textures,
            )?,
        },
        "conductor" => {
            let (eta, k) = metal(context, &mut props)?;
            let specular_reflectance =
                factor(context, &mut props, "specular_reflectance", 1.0, &mut textures)?;
            MaterialKind::Conductor { eta, k, specular_reflectance }
        }
        "plastic" => {
            let int_ior = index_of_refraction(&mut props, "int_ior", "polypropylene")?;
            let ext_ior = index_of_refraction(&mut props, "ext_ior", "air")?;
            let mut colour =
                |name, default| factor(context, &mut props, name, default, &mut textures);
            let diffuse_reflectance = colour("diffuse_reflectance", 0.5)?;
            let specular_reflectance = colour("specular_reflectance", 1.0)?;
            let nonlinear = props.boolean("nonlinear")?.unwrap_or(false);
            MaterialKind::Plastic {
                int_ior,
                ext_ior,
                diffuse_reflectance,
                specular_reflectance,
                nonlinear,
            }
        }
        "roughconductor" => rough_conductor(context, &mut props, &mut textures)?,
        "twosided" => {
            let children = props.nested("bsdf")?;
            let mut models = Vec::new();
            for (child, place) in &children {
                let model = nested(context, *child, within)?;
                if transmits(&model) {
                    let reason = format!(
                        "{} lets light through and cannot be twosided",
                        graph.objects[*child].title()
                    );
                    return Err(SceneFileError::Scene { place: (*place).clone(), reason });
                }
                models.push(model);
            }
            two_sided(&props, models)?
        }
        "null" => MaterialKind::Null,
        _ => return Err(support::unknown(object)),
    };
    within.pop();
    props.finish(context)?;
    Ok(match textures.is_empty() {
        true => kind,
        false => MaterialKind::Textured { model: Box::new(kind), textures },
    })
}

fn transmits(model: &MaterialKind) -> bool {
    match model {
        MaterialKind::Textured { model, .. } => transmits(model),
        other => matches!(other, MaterialKind::Dielectric { .. } | MaterialKind::Null),
    }
}

/// Parameters that textures stand for.
type Varying = Vec<(Parameter, Arc<Texture>)>;

/// A factor on scattering, 0 to 1: a colour, or a texture, whose mean is returned.
fn factor(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    name: &str,
    default: f32,
    textures: &mut Varying,
) -> Result<Rgb> {
    let Some(index) = props.texture(name)? else {
        return props.reflectance(context, name, default);
    };
    let texture = texture::read(context, index, 0)?;
    let mean = texture.mean().map(|v| v.clamp(0.0, 1.0));
    let parameter = match name {
        "specular_reflectance" => Parameter::SpecularReflectance,
        "specular_transmittance" => Parameter::SpecularTransmittance,
        _ => Parameter::Reflectance,
    };
    textures.push((parameter, texture));
    Ok(mean)
}

/// A twosided model within a twosided one stands for the side that it is seen from.
fn two_sided(props: &Props<'_>, models: Vec<MaterialKind>) -> Result<MaterialKind> {
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

/// A refractive index as a number or by name.
fn index_of_refraction(props: &mut Props<'_>, name: &str, default: &str) -> Result<f32> {
    let is_number = props.has(name) && props.string(name).is_err();
    let value = if is_number {
        props.positive(name)?.unwrap_or(1.0)
    } else {
        let text = props.string(name)?.unwrap_or(default);
        match ior::by_name(text) {
            Some(value) => value,
            None => {
                let names = ior::names();
                return Err(props.refuse(name, &format!("a number or one of {names}")));
            }
        }
    };
    Ok(value as f32)
}

/// Complex refractive index relative to the outside: a named material, or eta and k, which are 0
/// and 1 where missing (a perfect mirror). Files of 0.x mean copper where they give nothing.
fn metal(context: &mut Context<'_>, props: &mut Props<'_>) -> Result<(Rgb, Rgb)> {
    let old = props.object.old;
    let given = props.has("eta") || props.has("k");
    let name = props.string("material")?;
    if name.is_some() && given && !old {
        return Err(props.error("has \"material\" and \"eta\" or \"k\": give one or the other"));
    }
    let name = match name {
        None if old && !given => Some("Cu"),
        other => other,
    };
    let (eta, k) = match name {
        Some(name) => {
            let Some(both) = metals::by_name(name) else {
                let names = metals::names();
                return Err(
                    props.refuse("material", &format!("one of {names} (or give eta and k)"))
                );
            };
            both
        }
        None => (Rgb::BLACK, Rgb::WHITE),
    };
    let any = [f64::NEG_INFINITY, f64::INFINITY];
    let given_eta = props.colour(context, "eta", Meaning::Factor, any)?;
    let given_k = props.colour(context, "k", Meaning::Factor, any)?;
    if given_eta.iter().chain(&given_k).flatten().any(|v| *v < 0.0) {
        let text = "negative components of \"eta\" and \"k\" count as positive: \
                    Fresnel's equations have their squares only";
        context.note(NoteKind::Mended, text, props.place());
    }
    let eta = given_eta.map_or(eta, |v| rounded(v.map(f64::abs)));
    let mut k = given_k.map_or(k, |v| rounded(v.map(f64::abs)));
    // 0 + 0i reflects everything, and so does 0 + 1i, without a division of 0 by 0.
    for (channel, eta) in [&mut k.r, &mut k.g, &mut k.b].into_iter().zip(eta.to_array()) {
        if eta == 0.0 && *channel == 0.0 {
            *channel = 1.0;
        }
    }
    // Mitsuba 0.5 gives the outside apart; Mitsuba 3 knows only the ratio.
    if old && props.has("ext_eta") {
        let outside = index_of_refraction(props, "ext_eta", "air")?;
        return Ok((eta / outside, k / outside));
    }
    Ok((eta, k))
}

/// Smallest roughness: Mitsuba takes it for every smaller one.
const MIN_ALPHA: f64 = 1e-4;

/// Largest roughness: beyond it the squares of the distribution leave the range of single precision.
const MAX_ALPHA: f64 = 1e4;

fn rough_conductor(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    textures: &mut Varying,
) -> Result<MaterialKind> {
    let distribution = distribution(context, props)?;
    let [alpha_u, alpha_v] = roughness(context, props)?;
    let sample_visible = props.boolean("sample_visible")?.unwrap_or(true);
    let (eta, k) = metal(context, props)?;
    Ok(MaterialKind::RoughConductor {
        distribution,
        alpha_u,
        alpha_v,
        sample_visible,
        eta,
        k,
        specular_reflectance: factor(context, props, "specular_reflectance", 1.0, textures)?,
    })
}

fn distribution(context: &mut Context<'_>, props: &mut Props<'_>) -> Result<MicrofacetKind> {
    match props.string("distribution")?.map(str::to_ascii_lowercase).as_deref() {
        None | Some("beckmann") => Ok(MicrofacetKind::Beckmann),
        Some("ggx") => Ok(MicrofacetKind::Ggx),
        // Mitsuba 0.x has both, with exponents that it makes of alpha so that they look like Beckmann's.
        Some(name @ ("phong" | "as")) if props.object.old => {
            let text = format!("distribution \"{name}\" is read as \"beckmann\"");
            context.note(NoteKind::Differs, text, props.place());
            Ok(MicrofacetKind::Beckmann)
        }
        Some(_) => Err(props.refuse("distribution", "one of beckmann, ggx")),
    }
}

/// `alpha`, or `alpha_u` and `alpha_v`; 0.1 by default.
fn roughness(context: &mut Context<'_>, props: &mut Props<'_>) -> Result<[f32; 2]> {
    let mut read = |name: &str| -> Result<Option<f64>> {
        match props.float(name)? {
            Some(v) if v < 0.0 => Err(props.refuse(name, "a number ≥ 0")),
            Some(v) if v > MAX_ALPHA => {
                Err(props.refuse(name, &format!("a number up to {MAX_ALPHA}")))
            }
            Some(v) if v < MIN_ALPHA => {
                let text = format!("property \"{name}\" below {MIN_ALPHA} counts as {MIN_ALPHA}");
                context.note(NoteKind::Mended, text, props.place());
                Ok(Some(MIN_ALPHA))
            }
            other => Ok(other),
        }
    };
    let (alpha, u, v) = (read("alpha")?, read("alpha_u")?, read("alpha_v")?);
    let (u, v) = match (alpha, u, v) {
        (None, None, None) => (0.1, 0.1),
        (Some(both), None, None) => (both, both),
        (None, Some(u), Some(v)) => (u, v),
        (None, ..) => return Err(props.error("has only one of \"alpha_u\" and \"alpha_v\"")),
        (Some(_), ..) => {
            return Err(props.error("has \"alpha\" and \"alpha_u\" or \"alpha_v\""));
        }
    };
    Ok([u as f32, v as f32])
}
