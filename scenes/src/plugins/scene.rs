//! The scene element: its children become the description.

use std::collections::HashMap;

use pathspace_core::description::{
    EmitterDescription, MaterialDescription, MaterialKind, SceneDescription,
};

use super::integrator::{self, RenderDefaults};
use super::props::Props;
use super::shape::Material;
use super::{Context, bsdf, emitter, sensor, shape};
use crate::error::Result;

/// Reads everything that the scene refers to.
pub(crate) fn read_scene(context: &mut Context<'_>) -> Result<(SceneDescription, RenderDefaults)> {
    let graph = context.graph;
    let mut props = Props::new(graph, &graph.objects[0]);
    let defaults = match props.nested_one("integrator")? {
        Some(index) => integrator::read(context, index)?,
        None => RenderDefaults::default(),
    };
    let sensors = props.nested("sensor")?;
    if let Some((_, place)) = sensors.get(1) {
        let text = format!("{} sensors: the first one is used", sensors.len());
        context.warn(&text, place);
    }
    let sensor = match sensors.first() {
        Some((index, _)) => sensor::read(context, *index)?,
        None => {
            context.warn("no sensor: Mitsuba's default is used", props.place());
            sensor::default_sensor()
        }
    };
    let mut scene = SceneDescription {
        sensor: sensor.sensor,
        film: sensor.film,
        ..SceneDescription::default()
    };
    read_emitters(context, &mut props, &mut scene)?;
    let mut materials = Materials::default();
    // Materials that no shape uses are read as well, so that mistakes in them show.
    for (index, _) in props.nested("bsdf")? {
        materials.object(context, &mut scene, index)?;
    }
    for (index, _) in props.nested("shape")? {
        let mut shape = shape::read(context, index)?;
        shape.description.material = match shape.material {
            Material::Object(bsdf) => materials.object(context, &mut scene, bsdf)?,
            Material::Default(kind) => materials.unnamed(&mut scene, kind),
        };
        scene.shapes.push(shape.description);
    }
    props.finish()?;
    Ok((scene, RenderDefaults { spp: sensor.spp, ..defaults }))
}

fn read_emitters(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    scene: &mut SceneDescription,
) -> Result<()> {
    for (index, place) in props.nested("emitter")? {
        let emitter = emitter::read_free(context, index)?;
        let constant = |e: &EmitterDescription| matches!(e, EmitterDescription::Constant { .. });
        if constant(&emitter) && scene.emitters.iter().any(constant) {
            return Err(crate::error::SceneFileError::Scene {
                place: place.clone(),
                reason: "more than one environment emitter".into(),
            });
        }
        scene.emitters.push(emitter);
    }
    Ok(())
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
        let name = match &object.id {
            Some(id) => id.clone(),
            None => format!("{} (line {})", object.plugin, object.place.line),
        };
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
