//! Scattering models.

use pathspace_core::Rgb;
use pathspace_core::description::{MaterialKind, MicrofacetKind};

use super::props::{Colour, Props};
use super::{Context, ior, metals, unknown_plugin};
use crate::error::{Result, SceneFileError};

/// Types that are understood.
const KNOWN: [&str; 6] =
    ["diffuse", "dielectric", "conductor", "roughconductor", "twosided", "null"];

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
    let kind = match object.plugin.as_str() {
        "diffuse" => MaterialKind::Diffuse { reflectance: props.reflectance("reflectance", 0.5)? },
        "dielectric" => MaterialKind::Dielectric {
            int_ior: index_of_refraction(&mut props, "int_ior", "bk7")?,
            ext_ior: index_of_refraction(&mut props, "ext_ior", "air")?,
            specular_reflectance: props.reflectance("specular_reflectance", 1.0)?,
            specular_transmittance: props.reflectance("specular_transmittance", 1.0)?,
        },
        "conductor" => {
            let (eta, k) = metal(&mut props)?;
            let specular_reflectance = props.reflectance("specular_reflectance", 1.0)?;
            MaterialKind::Conductor { eta, k, specular_reflectance }
        }
        "roughconductor" => rough_conductor(&mut props)?,
        "twosided" => {
            let children = props.nested("bsdf")?;
            let mut models = Vec::new();
            for (child, place) in &children {
                let model = nested(context, *child, within)?;
                if matches!(model, MaterialKind::Dielectric { .. } | MaterialKind::Null) {
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
        _ => return Err(unknown_plugin(object, &KNOWN)),
    };
    within.pop();
    props.finish()?;
    Ok(kind)
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
/// and 1 where missing (a perfect mirror).
fn metal(props: &mut Props<'_>) -> Result<(Rgb, Rgb)> {
    if let Some(name) = props.string("material")? {
        let known = metals::by_name(name);
        if props.has("eta") || props.has("k") {
            return Err(props.error("has \"material\" and \"eta\" or \"k\": give one or the other"));
        }
        let Some((eta, k)) = known else {
            let names = metals::names();
            return Err(props.refuse("material", &format!("one of {names} (or give eta and k)")));
        };
        return Ok((eta, k));
    }
    let eta = props.colour("eta", f64::INFINITY)?.map_or(Rgb::BLACK, Colour::factor);
    let k = props.colour("k", f64::INFINITY)?.map_or(Rgb::WHITE, Colour::factor);
    // Mitsuba 0.5 gives the outside apart; Mitsuba 3 knows only the ratio.
    if props.object.old && props.has("ext_eta") {
        let outside = index_of_refraction(props, "ext_eta", "air")?;
        return Ok((eta / outside, k / outside));
    }
    Ok((eta, k))
}

fn rough_conductor(props: &mut Props<'_>) -> Result<MaterialKind> {
    let distribution = match props.string("distribution")?.map(str::to_ascii_lowercase).as_deref() {
        None | Some("beckmann") => MicrofacetKind::Beckmann,
        Some("ggx") => MicrofacetKind::Ggx,
        Some(_) => return Err(props.refuse("distribution", "one of beckmann, ggx")),
    };
    let alpha = props.positive("alpha")?;
    let (alpha_u, alpha_v) = match (alpha, props.positive("alpha_u")?, props.positive("alpha_v")?) {
        (None, None, None) => (0.1, 0.1),
        (Some(both), None, None) => (both, both),
        (None, Some(u), Some(v)) => (u, v),
        (None, ..) => return Err(props.error("has only one of \"alpha_u\" and \"alpha_v\"")),
        (Some(_), ..) => {
            return Err(props.error("has \"alpha\" and \"alpha_u\" or \"alpha_v\""));
        }
    };
    let sample_visible = props.boolean("sample_visible")?.unwrap_or(true);
    let (eta, k) = metal(props)?;
    Ok(MaterialKind::RoughConductor {
        distribution,
        alpha_u: alpha_u as f32,
        alpha_v: alpha_v as f32,
        sample_visible,
        eta,
        k,
        specular_reflectance: props.reflectance("specular_reflectance", 1.0)?,
    })
}
