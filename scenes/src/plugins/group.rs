//! Shapes of shapes: `merge`, and `instance` of a `shapegroup`, both laid out as copies.

use glam::DAffine3;
use pathspace_core::description::ShapeGeometry;

use super::Context;
use super::props::Props;
use super::shape::{self, Shape};
use crate::error::{Result, SceneFileError};

/// Groups in groups: deeper ones are a reference that runs in a circle.
const MAX_NESTING: usize = 8;

/// Most triangles after copying: their tree needs some ten gigabytes.
const MAX_TRIANGLES: u64 = 1 << 27;

/// Most surfaces after copying.
const MAX_SHAPES: usize = 1 << 22;

/// Reads the shape with this index and everything that it stands for.
pub(super) fn read(context: &mut Context<'_>, index: usize, out: &mut Vec<Shape>) -> Result<()> {
    expand(context, index, &DAffine3::IDENTITY, 0, out)
}

fn expand(
    context: &mut Context<'_>,
    index: usize,
    outer: &DAffine3,
    depth: usize,
    out: &mut Vec<Shape>,
) -> Result<()> {
    let graph = context.graph;
    let object = &graph.objects[index];
    let mut props = Props::new(graph, object);
    if depth > MAX_NESTING {
        return Err(props.error(format!("groups are nested deeper than {MAX_NESTING}")));
    }
    match object.plugin.as_str() {
        // Seen by its instances only.
        "shapegroup" if depth == 0 => Ok(()),
        "shapegroup" => {
            let children = props.nested("shape")?;
            props.finish(context)?;
            children.iter().try_for_each(|(i, _)| expand(context, *i, outer, depth + 1, out))
        }
        "merge" => {
            let children = props.nested("shape")?;
            props.finish(context)?;
            children.iter().try_for_each(|(i, _)| expand(context, *i, outer, depth + 1, out))
        }
        "instance" => {
            let own = props.transform("to_world")?.unwrap_or(DAffine3::IDENTITY);
            let Some(group) = props.nested_one("shape")? else {
                return Err(props.error("needs a shapegroup"));
            };
            if graph.objects[group].plugin != "shapegroup" {
                let title = graph.objects[group].title();
                return Err(props.error(format!("needs a shapegroup, not {title}")));
            }
            props.finish(context)?;
            expand(context, group, &(*outer * own), depth + 1, out)
        }
        _ => {
            let Some(shape) = shape::read(context, index, outer)? else { return Ok(()) };
            if let ShapeGeometry::Mesh(mesh) = &shape.description.geometry {
                context.triangles += mesh.triangles.len() as u64;
            }
            if context.triangles > MAX_TRIANGLES || out.len() >= MAX_SHAPES {
                let reason = format!(
                    "more than {MAX_TRIANGLES} triangles or {MAX_SHAPES} shapes, instances counted as copies"
                );
                return Err(SceneFileError::Scene { place: object.place.clone(), reason });
            }
            out.push(shape);
            Ok(())
        }
    }
}
