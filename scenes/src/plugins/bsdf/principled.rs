//! The principled models.

use pathspace_core::description::{MaterialKind, Parameter, PrincipledKind, PrincipledThinKind};

use super::super::Context;
use super::super::props::Props;
use super::parameter::{Varying, factor, number};
use crate::error::Result;

const UNIT: [f64; 2] = [0.0, 1.0];

/// `principled`.
pub(super) fn solid(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    textures: &mut Varying,
) -> Result<MaterialKind> {
    let base_color = factor(context, props, "base_color", 0.5, textures)?;
    let mut unit = |props: &mut Props<'_>, name: &str, default, parameter| {
        number(context, props, name, (default, UNIT), parameter, textures)
    };
    let mut kind = PrincipledKind {
        base_color,
        roughness: unit(props, "roughness", 0.5, Parameter::Roughness)?,
        anisotropic: unit(props, "anisotropic", 0.0, Parameter::Anisotropic)?,
        metallic: unit(props, "metallic", 0.0, Parameter::Metallic)?,
        spec_trans: unit(props, "spec_trans", 0.0, Parameter::SpecTrans)?,
        spec_tint: unit(props, "spec_tint", 0.0, Parameter::SpecTint)?,
        sheen: unit(props, "sheen", 0.0, Parameter::Sheen)?,
        sheen_tint: unit(props, "sheen_tint", 0.0, Parameter::SheenTint)?,
        flatness: unit(props, "flatness", 0.0, Parameter::Flatness)?,
        clearcoat: unit(props, "clearcoat", 0.0, Parameter::Clearcoat)?,
        clearcoat_gloss: unit(props, "clearcoat_gloss", 0.0, Parameter::ClearcoatGloss)?,
        ..PrincipledKind::default()
    };
    let transmits =
        kind.spec_trans > 0.0 || textures.iter().any(|(p, _)| *p == Parameter::SpecTrans);
    let (eta, specular) = (props.positive("eta")?, props.float("specular")?);
    kind.eta = match (eta, specular) {
        (Some(_), Some(_)) => return Err(props.error("has \"eta\" and \"specular\"")),
        // A boundary that bends nothing has no half vectors.
        (Some(1.0), None) if transmits => 1.001,
        (Some(eta), None) => eta as f32,
        (None, specular) => {
            let specular = specular.unwrap_or(0.5);
            if !(0.0..=1.0).contains(&specular) {
                return Err(props.refuse("specular", "a number from 0 to 1"));
            }
            let specular = if specular == 0.0 && transmits { 1e-3 } else { specular };
            (2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0) as f32
        }
    };
    kind.rates = rates(
        props,
        [
            "main_specular_sampling_rate",
            "clearcoat_sampling_rate",
            "diffuse_reflectance_sampling_rate",
        ],
    )?;
    Ok(MaterialKind::Principled(Box::new(kind)))
}

/// `principledthin`.
pub(super) fn thin(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    textures: &mut Varying,
) -> Result<MaterialKind> {
    let base_color = factor(context, props, "base_color", 0.5, textures)?;
    let mut value = |props: &mut Props<'_>, name: &str, default, range, parameter| {
        number(context, props, name, (default, range), parameter, textures)
    };
    let mut kind = PrincipledThinKind {
        base_color,
        roughness: value(props, "roughness", 0.5, UNIT, Parameter::Roughness)?,
        anisotropic: value(props, "anisotropic", 0.0, UNIT, Parameter::Anisotropic)?,
        spec_trans: value(props, "spec_trans", 0.0, UNIT, Parameter::SpecTrans)?,
        eta: value(props, "eta", 1.5, [1e-4, 1e4], Parameter::Eta)?,
        spec_tint: value(props, "spec_tint", 0.0, UNIT, Parameter::SpecTint)?,
        sheen: value(props, "sheen", 0.0, UNIT, Parameter::Sheen)?,
        sheen_tint: value(props, "sheen_tint", 0.0, UNIT, Parameter::SheenTint)?,
        flatness: value(props, "flatness", 0.0, UNIT, Parameter::Flatness)?,
        diff_trans: value(props, "diff_trans", 0.0, [0.0, 2.0], Parameter::DiffTrans)?,
        ..PrincipledThinKind::default()
    };
    kind.rates = rates(
        props,
        [
            "specular_reflectance_sampling_rate",
            "specular_transmittance_sampling_rate",
            "diffuse_transmittance_sampling_rate",
            "diffuse_reflectance_sampling_rate",
        ],
    )?;
    Ok(MaterialKind::PrincipledThin(Box::new(kind)))
}

/// Rates at which lobes are sampled: they make no difference to the image.
fn rates<const N: usize>(props: &mut Props<'_>, names: [&str; N]) -> Result<[f32; N]> {
    let mut rates = [1.0; N];
    for (rate, name) in rates.iter_mut().zip(names) {
        if let Some(v) = props.positive(name)? {
            *rate = v.min(1e6) as f32;
        }
    }
    Ok(rates)
}
