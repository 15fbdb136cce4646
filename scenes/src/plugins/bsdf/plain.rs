//! Models without parts.

use pathspace_core::description::{MaterialKind, Parameter, PrincipledThinKind, WardVariant};

use super::super::props::Props;
use super::super::{Context, support};
use super::parameter::{
    Varying, distribution, factor, index_of_refraction, metal, number, one_roughness, roughness,
};
use crate::error::Result;
use crate::note::NoteKind;

/// Reads the model that the object's type names.
pub(super) fn read(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    textures: &mut Varying,
) -> Result<MaterialKind> {
    Ok(match props.object.plugin.as_str() {
        "diffuse" => MaterialKind::Diffuse {
            reflectance: factor(context, props, "reflectance", 0.5, textures)?,
        },
        "dielectric" => {
            let [int_ior, ext_ior] = indices(props, "bk7")?;
            MaterialKind::Dielectric {
                int_ior,
                ext_ior,
                specular_reflectance: factor(context, props, SPECULAR, 1.0, textures)?,
                specular_transmittance: factor(context, props, TRANSMITTED, 1.0, textures)?,
            }
        }
        "thindielectric" => {
            let [int_ior, ext_ior] = indices(props, "bk7")?;
            MaterialKind::ThinDielectric {
                int_ior,
                ext_ior,
                specular_reflectance: factor(context, props, SPECULAR, 1.0, textures)?,
                specular_transmittance: factor(context, props, TRANSMITTED, 1.0, textures)?,
            }
        }
        "roughdielectric" => {
            let distribution = distribution(context, props)?;
            let [alpha_u, alpha_v] = roughness(context, props, 0.1, textures)?;
            let sample_visible = props.boolean("sample_visible")?.unwrap_or(true);
            let [int_ior, ext_ior] = apart(props, "bk7")?;
            MaterialKind::RoughDielectric {
                distribution,
                alpha_u,
                alpha_v,
                sample_visible,
                int_ior,
                ext_ior,
                specular_reflectance: factor(context, props, SPECULAR, 1.0, textures)?,
                specular_transmittance: factor(context, props, TRANSMITTED, 1.0, textures)?,
            }
        }
        "conductor" => {
            let (eta, k) = metal(context, props)?;
            let specular_reflectance = factor(context, props, SPECULAR, 1.0, textures)?;
            MaterialKind::Conductor { eta, k, specular_reflectance }
        }
        "roughconductor" => {
            let distribution = distribution(context, props)?;
            let [alpha_u, alpha_v] = roughness(context, props, 0.1, textures)?;
            let sample_visible = props.boolean("sample_visible")?.unwrap_or(true);
            let (eta, k) = metal(context, props)?;
            MaterialKind::RoughConductor {
                distribution,
                alpha_u,
                alpha_v,
                sample_visible,
                eta,
                k,
                specular_reflectance: factor(context, props, SPECULAR, 1.0, textures)?,
            }
        }
        "plastic" => {
            let [int_ior, ext_ior] = indices(props, "polypropylene")?;
            MaterialKind::Plastic {
                int_ior,
                ext_ior,
                diffuse_reflectance: factor(context, props, DIFFUSE, 0.5, textures)?,
                specular_reflectance: factor(context, props, SPECULAR, 1.0, textures)?,
                nonlinear: props.boolean("nonlinear")?.unwrap_or(false),
            }
        }
        "roughplastic" => {
            let distribution = distribution(context, props)?;
            let alpha = one_roughness(context, props, 0.1)?;
            let sample_visible = props.boolean("sample_visible")?.unwrap_or(true);
            let [int_ior, ext_ior] = apart(props, "polypropylene")?;
            MaterialKind::RoughPlastic {
                distribution,
                alpha,
                sample_visible,
                int_ior,
                ext_ior,
                diffuse_reflectance: factor(context, props, DIFFUSE, 0.5, textures)?,
                specular_reflectance: factor(context, props, SPECULAR, 1.0, textures)?,
                nonlinear: props.boolean("nonlinear")?.unwrap_or(false),
            }
        }
        "roughdiffuse" => {
            let range = (0.2, [0.0, 1e4]);
            MaterialKind::RoughDiffuse {
                reflectance: factor(context, props, reflectance_name(props), 0.5, textures)?,
                alpha: number(context, props, "alpha", range, Parameter::Alpha, textures)?,
                fast: props.boolean("use_fast_approx")?.unwrap_or(false),
            }
        }
        "phong" => {
            let range = (30.0, [0.0, 1e7]);
            let parameter = Parameter::Exponent;
            MaterialKind::Phong {
                exponent: number(context, props, "exponent", range, parameter, textures)?,
                diffuse_reflectance: factor(context, props, DIFFUSE, 0.5, textures)?,
                specular_reflectance: factor(context, props, SPECULAR, 0.2, textures)?,
            }
        }
        "ward" => {
            let variant = match props.string("variant")? {
                None | Some("balanced") => WardVariant::Balanced,
                Some("ward") => WardVariant::Ward,
                Some("ward-duer") => WardVariant::Duer,
                Some(_) => {
                    return Err(props.refuse("variant", "one of balanced, ward, ward-duer"));
                }
            };
            let [alpha_u, alpha_v] = roughness(context, props, 0.1, textures)?;
            MaterialKind::Ward {
                variant,
                alpha_u,
                alpha_v,
                diffuse_reflectance: factor(context, props, DIFFUSE, 0.5, textures)?,
                specular_reflectance: factor(context, props, SPECULAR, 0.2, textures)?,
            }
        }
        "null" => MaterialKind::Null,
        _ => return Err(support::unknown(props.object)),
    })
}

const DIFFUSE: &str = "diffuse_reflectance";
const SPECULAR: &str = "specular_reflectance";
const TRANSMITTED: &str = "specular_transmittance";

/// Mitsuba 0.4 called it `diffuse_reflectance`.
fn reflectance_name(props: &Props<'_>) -> &'static str {
    if props.has(DIFFUSE) { DIFFUSE } else { "reflectance" }
}

/// Refractive indices inside and outside.
fn indices(props: &mut Props<'_>, inside: &str) -> Result<[f32; 2]> {
    Ok([
        index_of_refraction(props, "int_ior", inside)?,
        index_of_refraction(props, "ext_ior", "air")?,
    ])
}

/// The same where a rough boundary needs them to differ: as near as makes no difference to the
/// image otherwise.
fn apart(props: &mut Props<'_>, inside: &str) -> Result<[f32; 2]> {
    let [int_ior, ext_ior] = indices(props, inside)?;
    if int_ior == ext_ior {
        return Err(props.error("needs different \"int_ior\" and \"ext_ior\""));
    }
    Ok([int_ior, ext_ior])
}

/// Lambert's transmission, of Mitsuba 0.x: the thin principled model with nothing else.
pub(super) fn diffuse_transmitter(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    textures: &mut Varying,
) -> Result<MaterialKind> {
    let base_color = factor(context, props, "transmittance", 0.5, textures)?;
    let text = "bsdf \"difftrans\" is read as \"principledthin\" with diff_trans = 2";
    context.note(NoteKind::Mended, text, props.place());
    let kind = PrincipledThinKind { base_color, diff_trans: 2.0, ..PrincipledThinKind::default() };
    Ok(MaterialKind::PrincipledThin(Box::new(kind)))
}
