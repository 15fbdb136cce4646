//! Emitters: on a surface and on their own.

use glam::DVec3;
use pathspace_core::Rgb;
use pathspace_core::description::EmitterDescription;

use super::props::Props;
use super::{Context, support};
use crate::error::{Result, SceneFileError};

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
    props.finish(context)?;
    Ok(radiance)
}

/// An emitter that is no surface.
pub(super) fn read_free(context: &mut Context<'_>, index: usize) -> Result<EmitterDescription> {
    let object = &context.graph.objects[index];
    let mut props = Props::new(context.graph, object);
    let emitter = match object.plugin.as_str() {
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
        _ => return Err(support::unknown(object)),
    };
    props.ignore(context, &["sampling_weight"], "emitters are chosen by power");
    props.finish(context)?;
    Ok(emitter)
}
