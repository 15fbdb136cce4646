//! Textures: images, checkerboards, and textures times a factor.

use std::sync::Arc;

use glam::{Affine2, DAffine3, Mat2, Vec2};
use pathspace_core::Rgb;
use pathspace_core::texture::{Filter, Image, Texture, Wrap};

use super::props::{Props, rounded};
use super::{Context, spectrum, support};
use crate::error::Result;
use crate::note::NoteKind;
use crate::spectrum::Meaning;
use crate::xml::value::Value;

/// Types that vary over a surface; the others are spectra.
pub(super) const VARYING: [&str; 4] = ["bitmap", "checkerboard", "mesh_attribute", "scale"];

/// Textures in textures: deeper ones are a reference that runs in a circle.
const MAX_NESTING: usize = 8;

/// Reads the texture with this index as a factor on scattering.
pub(super) fn read(context: &mut Context<'_>, index: usize, depth: usize) -> Result<Arc<Texture>> {
    let object = &context.graph.objects[index];
    let mut props = Props::new(context.graph, object);
    if depth > MAX_NESTING {
        return Err(props.error(format!("textures are nested deeper than {MAX_NESTING}")));
    }
    let texture = match object.plugin.as_str() {
        "bitmap" => bitmap(context, &mut props)?,
        "checkerboard" => {
            let first = colour(context, &mut props, "color0", 0.4, depth)?;
            let second = colour(context, &mut props, "color1", 0.2, depth)?;
            Texture::Checkerboard { colors: [first, second], to_uv: to_uv(&mut props)? }
        }
        "scale" => {
            let factor = props.triple("scale")?.unwrap_or([1.0; 3]);
            let Some(inner) = props.nested_one("texture")? else {
                return Err(props.error("needs a nested texture"));
            };
            let texture = read(context, inner, depth + 1)?;
            Texture::Scaled { texture, factor: rounded(factor) }
        }
        "mesh_attribute" => {
            props.string("name")?;
            let scale = props.float("scale")?.unwrap_or(1.0) as f32;
            let text = "texture \"mesh_attribute\" is grey 0.5: colours of meshes are not read";
            context.note(NoteKind::Differs, text, props.place());
            Texture::Constant(Rgb::grey(0.5 * scale))
        }
        name if support::of("texture", name) == Some(support::Support::Full) => {
            let colour = spectrum::read(context, index, Meaning::Factor)?;
            return Ok(Arc::new(Texture::Constant(rounded(colour))));
        }
        _ => return Err(support::unknown(object)),
    };
    props.finish(context)?;
    Ok(Arc::new(texture))
}

fn colour(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    name: &str,
    default: f32,
    depth: usize,
) -> Result<Arc<Texture>> {
    if let Some(index) = props.texture(name)? {
        return read(context, index, depth + 1);
    }
    let found = props.colour(context, name, Meaning::Factor, [0.0, f64::INFINITY])?;
    Ok(Arc::new(Texture::Constant(found.map_or(Rgb::grey(default), rounded))))
}

fn bitmap(context: &mut Context<'_>, props: &mut Props<'_>) -> Result<Texture> {
    let Some(name) = props.string("filename")? else {
        return Err(props.error("needs the property \"filename\""));
    };
    let old = props.object.old;
    // Mitsuba 0.x has a gamma instead: 1 is linear, −1 what the file says.
    let linear = old && props.float("gamma")? == Some(1.0);
    let raw = props.boolean("raw")?.unwrap_or(linear);
    let filter = match props.string("filter_type")? {
        None | Some("bilinear") => Filter::Bilinear,
        Some("nearest") => Filter::Nearest,
        Some("ewa" | "trilinear") if old => Filter::Bilinear,
        Some(_) => return Err(props.refuse("filter_type", "one of bilinear, nearest")),
    };
    let wrap = match props.string("wrap_mode")? {
        None | Some("repeat") => Wrap::Repeat,
        Some("mirror") => Wrap::Mirror,
        Some("clamp") => Wrap::Clamp,
        Some(_) => return Err(props.refuse("wrap_mode", "one of clamp, mirror, repeat")),
    };
    props.ignore(context, &["format"], "texels are kept as they stand in the file");
    if old {
        let names = ["max_anisotropy", "cache", "channel"];
        props.ignore(context, &names, "textures are not filtered over pixels");
    }
    let bitmap = context.bitmap(name, raw, props.place())?;
    if bitmap.min() < 0.0 || bitmap.max() > 1.0 {
        let text = format!("image \"{name}\": reflectances outside 0 to 1 are cut");
        context.note(NoteKind::Differs, text, props.place());
    }
    Ok(Texture::Bitmap(Image { bitmap, filter, wrap, to_uv: to_uv(props)? }))
}

/// `to_uv`, or the four numbers of Mitsuba 0.x.
fn to_uv(props: &mut Props<'_>) -> Result<Affine2> {
    let t = props.transform("to_uv")?.unwrap_or(DAffine3::IDENTITY);
    let (x, y) = (t.matrix3.x_axis.truncate(), t.matrix3.y_axis.truncate());
    let mut uv = Affine2::from_mat2_translation(
        Mat2::from_cols(x.as_vec2(), y.as_vec2()),
        t.translation.truncate().as_vec2(),
    );
    if props.object.old {
        let mut number = |name: &str, default: f64| -> Result<f32> {
            Ok(props.float(name)?.unwrap_or(default) as f32)
        };
        let scale = Vec2::new(number("uscale", 1.0)?, number("vscale", 1.0)?);
        let offset = Vec2::new(number("uoffset", 0.0)?, number("voffset", 0.0)?);
        uv = Affine2::from_scale_angle_translation(scale, 0.0, offset) * uv;
    }
    Ok(uv)
}

impl Props<'_> {
    /// The texture of this name, where it varies over the surface.
    pub(super) fn texture(&mut self, name: &str) -> Result<Option<usize>> {
        let graph = self.graph();
        let Some(p) = self.object.properties.iter().find(|p| p.name == name) else {
            return Ok(None);
        };
        if !matches!(p.value, Value::Object(_) | Value::Reference(_)) {
            return Ok(None);
        }
        let varies = |index: &usize| {
            let object = &graph.objects[*index];
            object.class == "texture" && VARYING.contains(&object.plugin.as_str())
        };
        let found = graph.target(p)?.filter(varies);
        if found.is_some() {
            self.mark(name);
        }
        Ok(found)
    }
}
