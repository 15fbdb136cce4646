//! Parameters of scattering models: colours, numbers, textures in their place, refractive indices,
//! roughness.

use std::sync::Arc;

use pathspace_core::Rgb;
use pathspace_core::description::{MicrofacetKind, Parameter};
use pathspace_core::texture::Texture;

use super::super::props::{Props, rounded};
use super::super::{Context, ior, metals, texture};
use crate::error::Result;
use crate::note::NoteKind;
use crate::spectrum::Meaning;

/// Parameters that textures stand for.
pub(super) type Varying = Vec<(Parameter, Arc<Texture>)>;

/// A factor on scattering, 0 to 1: a colour, or a texture, whose mean is returned.
pub(super) fn factor(
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

/// A number from `min` to `max`, or a texture, whose mean is returned; a colour stands for its
/// luminance.
pub(super) fn number(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    name: &str,
    (default, [min, max]): (f32, [f64; 2]),
    parameter: Parameter,
    textures: &mut Varying,
) -> Result<f32> {
    if let Some(index) = props.texture(name)? {
        let texture = texture::read(context, index, 0)?;
        let mean = Texture::Constant(texture.mean()).eval_scalar(Default::default());
        textures.push((parameter, texture));
        return Ok(mean.clamp(min as f32, max as f32));
    }
    let found = props.colour(context, name, Meaning::Factor, [min, max])?;
    let luminance = |c| Texture::Constant(rounded(c)).eval_scalar(Default::default());
    Ok(found.map_or(default, luminance))
}

/// A refractive index as a number or by name.
pub(super) fn index_of_refraction(props: &mut Props<'_>, name: &str, default: &str) -> Result<f32> {
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
pub(super) fn metal(context: &mut Context<'_>, props: &mut Props<'_>) -> Result<(Rgb, Rgb)> {
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

/// Largest roughness: beyond it the squares of the distribution leave the range of single
/// precision.
const MAX_ALPHA: f64 = 1e4;

pub(super) fn distribution(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
) -> Result<MicrofacetKind> {
    match props.string("distribution")?.map(str::to_ascii_lowercase).as_deref() {
        None | Some("beckmann") => Ok(MicrofacetKind::Beckmann),
        Some("ggx") => Ok(MicrofacetKind::Ggx),
        // Mitsuba 0.x has both, with exponents that it makes of alpha so that they look like
        // Beckmann's.
        Some(name @ ("phong" | "as")) if props.object.old => {
            let text = format!("distribution \"{name}\" is read as \"beckmann\"");
            context.note(NoteKind::Differs, text, props.place());
            Ok(MicrofacetKind::Beckmann)
        }
        Some(_) => Err(props.refuse("distribution", "one of beckmann, ggx")),
    }
}

/// `alpha`, or `alpha_u` and `alpha_v`, `default` where there is none; numbers or textures.
pub(super) fn roughness(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    default: f32,
    textures: &mut Varying,
) -> Result<[f32; 2]> {
    let mut read = |name: &str, parameter| -> Result<Option<f32>> {
        if !props.has(name) {
            props.mark(name);
            return Ok(None);
        }
        if props.texture(name)?.is_some() {
            let range = (default, [MIN_ALPHA, MAX_ALPHA]);
            return number(context, props, name, range, parameter, textures).map(Some);
        }
        match props.float(name)? {
            Some(v) if v < 0.0 => Err(props.refuse(name, "a number ≥ 0")),
            Some(v) if v > MAX_ALPHA => {
                Err(props.refuse(name, &format!("a number up to {MAX_ALPHA}")))
            }
            Some(v) if v < MIN_ALPHA => {
                let text = format!("property \"{name}\" below {MIN_ALPHA} counts as {MIN_ALPHA}");
                context.note(NoteKind::Mended, text, props.place());
                Ok(Some(MIN_ALPHA as f32))
            }
            other => Ok(other.map(|v| v as f32)),
        }
    };
    let (alpha, u, v) = (
        read("alpha", Parameter::Alpha)?,
        read("alpha_u", Parameter::AlphaU)?,
        read("alpha_v", Parameter::AlphaV)?,
    );
    match (alpha, u, v) {
        (None, None, None) => Ok([default; 2]),
        (Some(both), None, None) => Ok([both; 2]),
        (None, Some(u), Some(v)) => Ok([u, v]),
        (None, ..) => Err(props.error("has only one of \"alpha_u\" and \"alpha_v\"")),
        (Some(_), ..) => Err(props.error("has \"alpha\" and \"alpha_u\" or \"alpha_v\"")),
    }
}

/// The same where the model has one roughness that is the same everywhere.
pub(super) fn one_roughness(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    default: f32,
) -> Result<f32> {
    let mut textures = Varying::new();
    let [u, v] = roughness(context, props, default, &mut textures)?;
    if !textures.is_empty() || u != v {
        let title = props.object.title();
        let text = format!("{title}: roughness is the same everywhere: the mean of what is given");
        context.note(NoteKind::Differs, text, props.place());
    }
    Ok(0.5 * (u + v))
}
