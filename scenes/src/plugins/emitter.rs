//! Emitters: on a surface and on their own.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use pathspace_core::Rgb;
use pathspace_core::description::{
    EmitterDescription, FilmDescription, ProjectorDescription, SpotDescription,
};
use pathspace_core::texture::Texture;

use super::props::Props;
use super::{Context, sensor, sky, support, texture};
use crate::error::{Result, SceneFileError};
use crate::note::NoteKind;

/// Radiance of the area emitter with this index, nested in a shape.
pub(super) fn read_area(context: &mut Context<'_>, index: usize) -> Result<Rgb> {
    let object = &context.graph.objects[index];
    if object.plugin != "area" {
        let reason = format!("{} cannot stand in a shape, only \"area\"", object.title());
        return Err(SceneFileError::Scene { place: object.place.clone(), reason });
    }
    let mut props = Props::new(context.graph, object);
    let radiance = props.light(context, "radiance")?;
    props.ignore(context, &["sampling_weight"], "emitters are chosen by power");
    skip_medium(context, &mut props)?;
    props.finish(context)?;
    Ok(radiance)
}

/// The boundaries of media tell what is around an emitter.
fn skip_medium(context: &mut Context<'_>, props: &mut Props<'_>) -> Result<()> {
    for (_, place) in props.nested("medium")? {
        let text = "the medium of an emitter is ignored: boundaries tell what is around it";
        context.note(NoteKind::Ignored, text, place);
    }
    Ok(())
}

/// An emitter that is no surface: one, or two for sun and sky.
pub(super) fn read_free(
    context: &mut Context<'_>,
    index: usize,
) -> Result<Vec<EmitterDescription>> {
    let object = &context.graph.objects[index];
    let mut props = Props::new(context.graph, object);
    let emitter = match object.plugin.as_str() {
        "sunsky" | "sky" | "sun" => {
            let emitters = sky::read(context, &mut props)?;
            props.ignore(context, &["sampling_weight"], "emitters are chosen by power");
            skip_medium(context, &mut props)?;
            props.finish(context)?;
            return Ok(emitters);
        }
        "point" => {
            let position = props.vector("position")?;
            let to_world = props.transform("to_world")?;
            if position.is_some() && to_world.is_some() {
                return Err(props.error("has \"position\" and \"to_world\": give one of them"));
            }
            let moved = to_world.map(|t| t.translation);
            EmitterDescription::Point {
                position: position.or(moved).unwrap_or(DVec3::ZERO),
                intensity: props.light(context, "intensity")?,
            }
        }
        "spot" => spot(context, &mut props)?,
        "projector" => projector(context, &mut props)?,
        "directional" => {
            let direction = props.vector("direction")?;
            let to_world = props.transform("to_world")?;
            if direction.is_some() && to_world.is_some() {
                return Err(props.error("has \"direction\" and \"to_world\": give one of them"));
            }
            let turned = to_world.map(|t| t.transform_vector3(DVec3::Z));
            let direction = direction.or(turned).unwrap_or(DVec3::Z);
            let Some(direction) = direction.try_normalize() else {
                return Err(props.refuse("direction", "a direction other than 0, 0, 0"));
            };
            EmitterDescription::Directional {
                direction,
                irradiance: props.light(context, "irradiance")?,
            }
        }
        "constant" => EmitterDescription::Constant { radiance: props.light(context, "radiance")? },
        "envmap" => environment(context, &mut props)?,
        _ => return Err(support::unknown(object)),
    };
    props.ignore(context, &["sampling_weight"], "emitters are chosen by power");
    skip_medium(context, &mut props)?;
    props.finish(context)?;
    Ok(vec![emitter])
}

/// A point light in a cone.
fn spot(context: &mut Context<'_>, props: &mut Props<'_>) -> Result<EmitterDescription> {
    let to_world = match props.transform("to_world")? {
        Some(t) => sensor::rigid(props, t)?,
        None => DAffine3::IDENTITY,
    };
    let intensity = props.light(context, "intensity")?;
    let cutoff_degrees = props.positive("cutoff_angle")?.unwrap_or(20.0);
    if cutoff_degrees >= 90.0 {
        return Err(props.refuse("cutoff_angle", "an angle between 0 and 90 degrees"));
    }
    let beam_degrees = props.float("beam_width")?.unwrap_or(0.75 * cutoff_degrees);
    let texture = match props.texture("texture")? {
        Some(index) => Some(texture::read(context, index, 0)?),
        None => None,
    };
    let shape = SpotDescription { intensity, cutoff_degrees, beam_degrees, texture };
    Ok(EmitterDescription::Spot { to_world, shape })
}

/// An image thrown from a point.
fn projector(context: &mut Context<'_>, props: &mut Props<'_>) -> Result<EmitterDescription> {
    let to_world = match props.transform("to_world")? {
        Some(t) => sensor::rigid(props, t)?,
        None => DAffine3::IDENTITY,
    };
    let irradiance = match props.texture("irradiance")? {
        Some(index) => texture::read(context, index, 0)?,
        None => Arc::new(Texture::Constant(props.light(context, "irradiance")?)),
    };
    let (width, height) = match &*irradiance {
        Texture::Bitmap(image) => (image.bitmap.width(), image.bitmap.height()),
        _ => (1, 1),
    };
    let fov_x_degrees = sensor::read_fov(props, &FilmDescription::new(width, height))?;
    let scale = props.float("scale")?.unwrap_or(1.0);
    if scale < 0.0 {
        return Err(props.refuse("scale", "a number ≥ 0"));
    }
    let aspect = f64::from(width) / f64::from(height);
    let shape = ProjectorDescription { irradiance, aspect, fov_x_degrees, scale: scale as f32 };
    Ok(EmitterDescription::Projector { to_world, shape })
}

/// Radiance from an image over all directions.
fn environment(context: &mut Context<'_>, props: &mut Props<'_>) -> Result<EmitterDescription> {
    let Some(name) = props.string("filename")? else {
        return Err(props.error("needs the property \"filename\""));
    };
    let mut bitmap = context.bitmap(name, false, props.place())?;
    if bitmap.min() < 0.0 {
        let (cut, count) = bitmap.without_negatives();
        let text = format!("image \"{name}\": {count} negative values of radiance count as 0");
        context.note(NoteKind::Mended, text, props.place());
        bitmap = Arc::new(cut);
    }
    let scale = props.float("scale")?.unwrap_or(1.0);
    if scale < 0.0 {
        return Err(props.refuse("scale", "a number ≥ 0"));
    }
    let to_world = match props.transform("to_world")? {
        Some(t) => rotation(props, t.matrix3)?,
        None => DMat3::IDENTITY,
    };
    props.ignore(context, &["mis_compensation"], "all radiance is sampled");
    let old = ["cache", "gamma"];
    props.ignore(context, &old, "the image is read as it is");
    Ok(EmitterDescription::Environment { bitmap, to_world, scale: scale as f32 })
}

/// The turn of a transform that may scale alike along all axes and mirror.
pub(super) fn rotation(props: &Props<'_>, m: DMat3) -> Result<DMat3> {
    let size = m.determinant().abs().cbrt();
    let m = m * (1.0 / size);
    let off = (m.transpose() * m - DMat3::IDENTITY).to_cols_array();
    if !off.iter().all(|v| v.abs() < 1e-3) {
        let reason = "an environment can be turned and mirrored, not stretched or sheared";
        return Err(props.complain("to_world", reason));
    }
    let z = m.z_axis.normalize();
    let y = (m.y_axis - z * m.y_axis.dot(z)).normalize();
    Ok(DMat3::from_cols(y.cross(z) * m.determinant().signum(), y, z))
}
