//! `pathspace inspect`: what is in a scene, and who can see all of it.

use std::collections::BTreeMap;
use std::fmt::{self, Debug, Write as _};
use std::io::Write;
use std::ops::ControlFlow;
use std::sync::Arc;

use anyhow::Result;
use pathspace_benches::{Budget, expose};
use pathspace_core::Scene;
use pathspace_core::description::{FilmDescription, ShapeGeometry};
use pathspace_core::emitter::Emitter;
use pathspace_core::film::Families;
use pathspace_integrators::Registry;
use pathspace_validation::page::share;
use pathspace_validation::pairs::{Observation, Tiles};

use super::Done;
use super::args::InspectArgs;
use super::scene::{Prepared, pool, prepare};
use super::table::{Table, figure};

/// Samples per pixel, and the largest side of the image, by which it is found out who sees how
/// much.
const LOOK: (u64, u32) = (16, 64);
/// Rows of lists at most, unless all are asked for.
const ROWS: usize = 8;

/// Says what is in a scene.
pub(super) fn inspect(
    registry: &Registry,
    args: &InspectArgs,
    verbose: bool,
    out: &mut dyn Write,
) -> Result<Done> {
    let prepared = prepare(&args.scene, verbose)?;
    let scene = &*prepared.scene;
    writeln!(out, "{}  {}", prepared.name, &prepared.hash)?;
    geometry(&prepared, out)?;
    materials(&prepared, out)?;
    emitters(scene, verbose, out)?;
    camera(&prepared, out)?;
    let asks = prepared.spp.map_or(String::new(), |n| format!(", {n} samples per pixel"));
    let depth = prepared.defaults.rules.max_length;
    let depth = depth.map_or("any length".into(), |k| format!("length {k} at most"));
    writeln!(out, "integrator  {} for paths of {depth}{asks}", prepared.integrator)?;
    sight(registry, args, &prepared, out)?;
    Ok(Done::Well)
}

fn geometry(prepared: &Prepared, out: &mut dyn Write) -> Result<()> {
    let mut kinds: BTreeMap<String, usize> = BTreeMap::new();
    let mut bytes = 0;
    for shape in &prepared.description.shapes {
        *kinds.entry(variant(&shape.geometry)).or_default() += 1;
        if let ShapeGeometry::Mesh(mesh) = &shape.geometry {
            bytes += size_of_val(mesh.triangles.as_slice())
                + size_of_val(mesh.normals.as_slice())
                + size_of_val(mesh.uvs.as_slice());
        }
    }
    let scene = &*prepared.scene;
    let (stats, prims) = (scene.accel().stats(), scene.accel().primitives());
    let corners = size_of_val(prims.triangles.as_slice());
    writeln!(out, "shapes      {} ({})", scene.shapes().len(), counts(&kinds))?;
    writeln!(out, "triangles   {}", prims.triangles.len())?;
    writeln!(
        out,
        "tree        {} nodes of eight, {} levels, {} blocks of eight triangles, {} curved surfaces",
        stats.nodes, stats.depth, stats.blocks, stats.analytic
    )?;
    writeln!(out, "memory      {} for surfaces and tree", size(stats.bytes + corners + bytes))?;
    let norm = scene.normalisation();
    writeln!(
        out,
        "bounds      a sphere about ({}) of radius {}",
        norm.center.to_array().map(figure).join(", "),
        figure(1.0 / norm.scale)
    )?;
    Ok(())
}

fn materials(prepared: &Prepared, out: &mut dyn Write) -> Result<()> {
    let mut kinds: BTreeMap<String, usize> = BTreeMap::new();
    for material in &prepared.description.materials {
        *kinds.entry(variant(&material.kind)).or_default() += 1;
    }
    writeln!(out, "BSDFs       {} ({})", prepared.description.materials.len(), counts(&kinds))?;
    Ok(())
}

fn emitters(scene: &Scene, verbose: bool, out: &mut dyn Write) -> Result<()> {
    let list = scene.emitters().list();
    writeln!(out, "emitters    {}", list.len())?;
    let mut order: Vec<usize> = (0..list.len()).collect();
    let mass = |i: usize| scene.emitters().mass(i as u32).value();
    order.sort_by(|a, b| mass(*b).total_cmp(&mass(*a)).then(a.cmp(b)));
    let shown = if verbose { order.len() } else { ROWS.min(order.len()) };
    let mut table = Table::new(&["", "power", "share of the choice"], &[0]);
    for &i in &order[..shown] {
        let name = match &list[i] {
            Emitter::Area { shape, .. } => {
                let shape = scene.shapes().get(*shape as usize);
                format!("area, {}", shape.map_or("", |s| s.name.as_str()))
            }
            other => variant(other).to_lowercase(),
        };
        table.row(vec![name, power(scene, &list[i]), share(mass(i))]);
    }
    table.write("  ", out)?;
    if shown < order.len() {
        writeln!(out, "  and {} more, with --verbose", order.len() - shown)?;
    }
    Ok(())
}

/// Emitted power in watts (mean of the channels), where it is finite and has a formula.
fn power(scene: &Scene, emitter: &Emitter) -> String {
    let scale = scene.normalisation().scale;
    let mean = |c: [f32; 3]| c.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0;
    let watts = match emitter {
        // Φ = π A L_e on one side.
        Emitter::Area { shape, radiance } => {
            let area = scene.shapes().get(*shape as usize).map_or(0.0, |s| s.area());
            std::f64::consts::PI * area / (scale * scale) * mean(radiance.to_array())
        }
        // Φ = 4π I; the intensity is normalised by scale².
        Emitter::Point { intensity, .. } => {
            4.0 * std::f64::consts::PI * mean(intensity.to_array()) / (scale * scale)
        }
        _ => return "—".into(),
    };
    format!("{} W", figure(watts))
}

fn camera(prepared: &Prepared, out: &mut dyn Write) -> Result<()> {
    let sensor = &prepared.description.sensor;
    let (eye, view) = (sensor.to_world.translation, sensor.to_world.matrix3.z_axis);
    let lens = if sensor.aperture_radius > 0.0 {
        format!("thin lens of radius {}", figure(sensor.aperture_radius))
    } else {
        "pinhole".into()
    };
    writeln!(
        out,
        "camera      {lens} at ({}) along ({}), {}° wide",
        eye.to_array().map(figure).join(", "),
        view.normalize_or_zero().to_array().map(figure).join(", "),
        figure(sensor.fov_x_degrees)
    )?;
    let film = prepared.scene.film();
    let (crop, filter) = (film.crop, variant(&film.filter).to_lowercase());
    let window = if (crop.width, crop.height) == (film.width, film.height) {
        String::new()
    } else {
        format!(", of it {}×{} from ({}, {})", crop.width, crop.height, crop.x, crop.y)
    };
    writeln!(out, "film        {}×{}{window}, {filter} filter", film.width, film.height)?;
    Ok(())
}

/// Which share of the image each integrator can make, by a small render with two of them.
fn sight(
    registry: &Registry,
    args: &InspectArgs,
    prepared: &Prepared,
    out: &mut dyn Write,
) -> Result<()> {
    let mut description = prepared.description.clone();
    let film = &description.film;
    let factor = f64::from(film.width.max(film.height)) / f64::from(LOOK.1);
    let fit = |n: u32| ((f64::from(n) / factor.max(1.0)).round() as u32).max(1);
    let small = FilmDescription::new(fit(film.width), fit(film.height));
    description.film = small;
    let scene = Arc::new(Scene::new(&description)?);
    let tiles = Tiles::at_most(1, small.width as usize, small.height as usize);
    let mut light: BTreeMap<Families, f64> = BTreeMap::new();
    let pool = pool(args.scene.threads)?;
    for name in ["bdpt", "pt"] {
        let integrator = prepared.integrator(registry, Some(&name.parse()?))?;
        let go_on = &mut |_: &_| ControlFlow::Continue(());
        let budget = Budget::Samples(LOOK.0);
        let seed = args.scene.seed;
        let exposed = pool
            .install(|| expose(&*integrator, &scene, Observation::LAYERS, seed, budget, go_on))?;
        let mut own: BTreeMap<Families, f64> = BTreeMap::new();
        for (class, mean) in Observation::of(&exposed.film, &tiles).classes {
            *own.entry(class.families).or_default() += mean.mean;
        }
        for (families, mean) in own {
            let most = light.entry(families).or_default();
            *most = most.max(mean);
        }
    }
    let total: f64 = light.values().sum();
    if !(total > 0.0) {
        writeln!(out, "sight       no light was found in {} samples per pixel", LOOK.0)?;
        return Ok(());
    }
    let mut all = Vec::new();
    let mut part = Vec::new();
    for (name, _) in registry.list() {
        let integrator = prepared.integrator(registry, Some(&name.parse()?))?;
        let families = integrator.families(&scene);
        let seen: f64 = light.iter().filter(|(f, _)| f.intersects(families)).map(|(_, v)| v).sum();
        match share(seen / total).as_str() {
            "100 %" => all.push(name.to_owned()),
            text => part.push(format!("{name} {text}")),
        }
    }
    writeln!(out, "sight       the whole image: {}", list(&all))?;
    if !part.is_empty() {
        writeln!(out, "            a part of it: {} (estimated)", list(&part))?;
    }
    Ok(())
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "nobody".into() } else { names.join(", ") }
}

fn counts(kinds: &BTreeMap<String, usize>) -> String {
    let all: Vec<String> = kinds.iter().map(|(k, n)| format!("{n} {}", k.to_lowercase())).collect();
    all.join(", ")
}

fn size(bytes: usize) -> String {
    match bytes as f64 {
        b if b >= 1e6 => format!("{:.1} MB", b / 1e6),
        b => format!("{:.1} kB", b / 1e3),
    }
}

/// Name of an enum's variant, with spaces between its words.
fn variant(value: &impl Debug) -> String {
    let mut name = Name(String::new());
    // It ends with an error after the name, before what a mesh holds is written out.
    let _ = write!(name, "{value:?}");
    let mut words = String::new();
    for c in name.0.chars() {
        if c.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.push(c);
    }
    words
}

/// Takes the letters up to the first other character.
struct Name(String);

impl fmt::Write for Name {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let end = text.find(|c: char| !c.is_alphanumeric());
        self.0.push_str(&text[..end.unwrap_or(text.len())]);
        if end.is_some() { Err(fmt::Error) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_variants_are_words() {
        #[derive(Debug)]
        enum Kind {
            Plain,
            RoughConductor {
                #[expect(dead_code, reason = "read by Debug")]
                alpha: f64,
            },
        }
        assert_eq!(variant(&Kind::Plain), "Plain");
        assert_eq!(variant(&Kind::RoughConductor { alpha: 0.1 }), "Rough Conductor");
    }
}
