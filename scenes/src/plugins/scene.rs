//! The scene element: its children become the description.

use std::collections::HashMap;

use pathspace_core::description::{
    BoundaryDescription, EmitterDescription, MaterialDescription, MaterialKind, SceneDescription,
};

use super::integrator::{self, RenderDefaults};
use super::props::Props;
use super::shape::Material;
use super::{Context, bsdf, emitter, group, medium, sensor, support};
use crate::error::{Place, Result, SceneFileError};
use crate::note::NoteKind;
use crate::xml::value::Value;
use crate::xml::{Graph, Property};

/// Reads everything that the scene refers to, seen by the sensor of this number.
pub(crate) fn read_scene(
    context: &mut Context<'_>,
    sensor: usize,
) -> Result<(SceneDescription, RenderDefaults)> {
    let graph = context.graph;
    let mut props = Props::new(graph, &graph.objects[0]);
    let sensors = props.nested("sensor")?;
    let makes_an_image = |index: usize| sensor::makes_an_image(&graph.objects[index].plugin);
    let seen_by = match sensors.get(sensor) {
        // A meter has no image: where the file has a camera as well, it is the one that is meant.
        Some((index, place)) if sensor == 0 && !makes_an_image(*index) => {
            let camera = sensors.iter().find(|(i, _)| makes_an_image(*i)).map(|(i, _)| *i);
            if camera.is_some() {
                let text = format!("{} makes no image", graph.objects[*index].title());
                context.note(NoteKind::Ignored, text, place);
            }
            Some(camera.unwrap_or(*index))
        }
        Some((index, _)) => Some(*index),
        None if sensor == 0 => None,
        None => {
            let n = sensors.len();
            return Err(props.error(format!("has {n} sensors: there is no sensor {sensor}")));
        }
    };
    let used = support::reachable(graph, &roots(&mut props, seen_by)?)?;
    support::check(graph, &used)?;
    let defaults = match props.nested_one("integrator")? {
        Some(index) => integrator::read(context, index)?,
        None => RenderDefaults::default(),
    };
    if let Some((_, place)) = sensors.get(1) {
        let text = format!("{} sensors: number {sensor} is used, counted from 0", sensors.len());
        context.note(NoteKind::Mended, text, place);
    }
    let sensor = match seen_by {
        Some(index) => sensor::read(context, index)?,
        None => {
            context.note(NoteKind::Mended, "no sensor: Mitsuba's default is used", props.place());
            sensor::default_sensor()
        }
    };
    let mut scene = SceneDescription {
        sensor: sensor.sensor,
        film: sensor.film,
        ..SceneDescription::default()
    };
    read_emitters(context, &mut props, &mut scene)?;
    let mut media = Media::default();
    scene.media.sensor = match sensor.medium {
        Some(medium) => Some(media.object(context, &mut scene, medium)?),
        None => None,
    };
    let mut materials = Materials::default();
    for (index, place) in props.nested("bsdf")? {
        // Materials that no shape uses are read as well, so that mistakes in them show.
        if used.contains(&index) || support::is_understood(graph, index) {
            materials.object(context, &mut scene, index)?;
        } else {
            let text =
                format!("{} is not understood, and nothing uses it", graph.objects[index].title());
            context.note(NoteKind::Ignored, text, place);
        }
    }
    for (index, _) in props.nested("shape")? {
        let mut all = Vec::new();
        group::read(context, index, &mut all)?;
        for mut shape in all {
            if let Some(sides) = shape.media {
                let mut of = |side: Option<usize>| {
                    side.map(|medium| media.object(context, &mut scene, medium)).transpose()
                };
                let [interior, exterior] = [of(sides[0])?, of(sides[1])?];
                let boundary =
                    BoundaryDescription { shape: scene.shapes.len(), interior, exterior };
                scene.media.boundaries.push(boundary);
            }
            shape.description.material = match shape.material {
                Material::Object(bsdf) => materials.object(context, &mut scene, bsdf)?,
                Material::Default(kind) => materials.unnamed(&mut scene, kind),
            };
            scene.shapes.push(shape.description);
        }
    }
    // Objects that stand here for others to refer to.
    for class in ["texture", "sampler", "film", "rfilter", "medium", "volume", "phase"] {
        for (index, place) in props.nested(class)? {
            if !is_referred_to(graph, index) {
                let text =
                    format!("{} is ignored: nothing refers to it", graph.objects[index].title());
                context.note(NoteKind::Ignored, text, place);
            }
        }
    }
    let technical =
        ["embree_use_robust_intersections", "allow_thread_dumping", "thread_reordering"];
    props.ignore(context, &technical, "it concerns Mitsuba's ray tracing only");
    props.finish(context)?;
    Ok((scene, RenderDefaults { spp: sensor.spp, ..defaults }))
}

/// Objects of the scene that make the image.
fn roots(props: &mut Props<'_>, sensor: Option<usize>) -> Result<Vec<usize>> {
    let mut roots: Vec<usize> = sensor.into_iter().collect();
    roots.extend(free_emitters(props)?.iter().map(|(index, _)| *index));
    roots.extend(props.nested("shape")?.iter().map(|(index, _)| *index));
    Ok(roots)
}

/// Emitters of the scene itself: an area emitter stands there for shapes to refer to.
fn free_emitters<'a>(props: &mut Props<'a>) -> Result<Vec<(usize, &'a Place)>> {
    let graph = props.graph();
    let mut all = props.nested("emitter")?;
    all.retain(|(index, _)| graph.objects[*index].plugin != "area");
    Ok(all)
}

fn is_referred_to(graph: &Graph, index: usize) -> bool {
    let refers = |p: &Property| match &p.value {
        Value::Reference(id) => graph.ids.get(id) == Some(&index),
        _ => false,
    };
    graph.objects.iter().any(|o| o.properties.iter().any(refers))
}

fn read_emitters(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    scene: &mut SceneDescription,
) -> Result<()> {
    for (index, place) in free_emitters(props)? {
        let emitters = emitter::read_free(context, index)?;
        let constant = |e: &EmitterDescription| {
            matches!(
                e,
                EmitterDescription::Constant { .. } | EmitterDescription::Environment { .. }
            )
        };
        if emitters.iter().any(constant) && scene.emitters.iter().any(constant) {
            return Err(SceneFileError::Scene {
                place: place.clone(),
                reason: "more than one environment emitter".into(),
            });
        }
        scene.emitters.extend(emitters);
    }
    Ok(())
}

/// Where each medium of the file is in the description.
#[derive(Default)]
struct Media(HashMap<usize, usize>);

impl Media {
    fn object(
        &mut self,
        context: &mut Context<'_>,
        scene: &mut SceneDescription,
        index: usize,
    ) -> Result<usize> {
        if let Some(known) = self.0.get(&index) {
            return Ok(*known);
        }
        scene.media.media.push(medium::read(context, index)?);
        self.0.insert(index, scene.media.media.len() - 1);
        Ok(scene.media.media.len() - 1)
    }
}

/// Where each bsdf of the file is in the description.
#[derive(Default)]
struct Materials {
    by_object: HashMap<usize, usize>,
    defaults: Vec<usize>,
}

impl Materials {
    fn object(
        &mut self,
        context: &mut Context<'_>,
        scene: &mut SceneDescription,
        index: usize,
    ) -> Result<usize> {
        if let Some(known) = self.by_object.get(&index) {
            return Ok(*known);
        }
        let object = &context.graph.objects[index];
        let name = object.name();
        let kind = bsdf::read(context, index)?;
        scene.materials.push(MaterialDescription { name, kind });
        self.by_object.insert(index, scene.materials.len() - 1);
        Ok(scene.materials.len() - 1)
    }

    /// One material for all shapes that have the same default.
    fn unnamed(&mut self, scene: &mut SceneDescription, kind: MaterialKind) -> usize {
        if let Some(at) = self.defaults.iter().find(|at| scene.materials[**at].kind == kind) {
            return *at;
        }
        scene.materials.push(MaterialDescription { name: "default".into(), kind });
        self.defaults.push(scene.materials.len() - 1);
        scene.materials.len() - 1
    }
}
