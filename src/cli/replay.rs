//! `pathspace replay`: the paths of one sample, vertex by vertex.

use std::fmt::Write as _;
use std::io::Write;
use std::sync::Arc;

use anyhow::{Result, bail};
use glam::DVec3;
use pathspace_core::Scene;
use pathspace_core::bsdf::Event;
use pathspace_core::film::Contribution;
use pathspace_core::path::{PathRecord, Technique, Vertex, WalkRules, contribution, ln_density};
use pathspace_integrators::Registry;

use super::Done;
use super::args::ReplayArgs;
use super::scene::{Prepared, prepare};
use super::table::{Table, figure};

/// Prints what one sample of a render did.
pub(super) fn replay(
    registry: &Registry,
    args: &ReplayArgs,
    verbose: bool,
    out: &mut dyn Write,
) -> Result<Done> {
    let prepared = prepare(&args.scene, verbose)?;
    let integrator = prepared.integrator(registry, args.integrator.as_ref())?;
    let crop = prepared.scene.film().crop;
    let items = u64::from(crop.width) * u64::from(crop.height);
    let item = match args.pixel {
        None => args.item,
        Some([x, y]) => {
            let inside = x.checked_sub(crop.x).zip(y.checked_sub(crop.y));
            let inside = inside.filter(|(x, y)| *x < crop.width && *y < crop.height);
            let Some((x, y)) = inside else { bail!("--pixel {x},{y} is outside of the image") };
            u64::from(y) * u64::from(crop.width) + u64::from(x)
        }
    };
    if item >= items {
        bail!("--item {item}: a step has the items 0 to {}", items - 1);
    }
    let run = integrator.start(Arc::clone(&prepared.scene), args.scene.seed)?;
    let Some(found) = run.replay(args.step, item) else {
        bail!(
            "a step of {} is more than independent samples: pt, lt and bdpt can be replayed",
            integrator.spec()
        );
    };
    let (x, y) = (item % u64::from(crop.width), item / u64::from(crop.width));
    writeln!(
        out,
        "{} by {}: seed {}, step {}, item {item} (pixel {},{}), {} contributions",
        args.scene.scene,
        integrator.spec(),
        args.scene.seed,
        args.step,
        u64::from(crop.x) + x,
        u64::from(crop.y) + y,
        found.contributions.len()
    )?;
    let all = found.contributions.len();
    for (n, (c, record)) in found.contributions.iter().zip(&found.records).enumerate() {
        let head = format!("path {} of {all}", n + 1);
        tell(&prepared, &head, c, record, out)?;
    }
    Ok(Done::Well)
}

fn tell(
    prepared: &Prepared,
    head: &str,
    made: &Contribution,
    record: &PathRecord,
    out: &mut dyn Write,
) -> Result<()> {
    let (scene, path) = (&*prepared.scene, &record.path);
    let Technique { s, t } = record.technique;
    writeln!(
        out,
        "\n{head}: length {}, technique (s,t) = ({s},{t}), at ({:.2}, {:.2}) on the film",
        path.length(),
        made.film.x,
        made.film.y
    )?;
    let mut table = Table::new(
        &["vertex", "on", "position", "normal", "distance", "G to the next", "V"],
        &[0, 1, 2, 3],
    );
    for (i, vertex) in path.vertices.iter().enumerate() {
        let (on, normal) = describe(scene, vertex, path.events[i]);
        let mut row = vec![format!("x{i}"), on, place(scene, vertex), normal];
        if let Some(next) = path.vertices.get(i + 1) {
            let edge = vertex.edge_to(next);
            let far = vertex.position().is_none() || next.position().is_none();
            let distance = edge.distance2().sqrt() / scene.normalisation().scale;
            row.push(if far { "∞".into() } else { figure(distance) });
            row.push(figure(edge.geometry_term()));
            row.push(if scene.visible(vertex, next) { "1" } else { "0" }.into());
        }
        table.row(row);
    }
    table.write("  ", out)?;
    densities(scene, prepared.defaults.rules, record, out)?;
    let f = contribution(scene, path);
    writeln!(
        out,
        "  f(x̄) = {}, p = {}, w = {}: w f/p = {}",
        triple(f),
        exponential(record.ln_pdf),
        figure(record.weight),
        triple(record.value.to_array().map(f64::from))
    )?;
    Ok(())
}

/// Densities of all techniques of the path, as plain functions of the whole path compute them.
fn densities(
    scene: &Scene,
    rules: WalkRules,
    record: &PathRecord,
    out: &mut dyn Write,
) -> Result<()> {
    let k = record.path.length();
    let mut line = String::from("  densities:");
    for s in 0..=k + 1 {
        let technique = Technique::new(s, k + 1 - s);
        let used = if technique == record.technique { "*" } else { "" };
        let p = ln_density(scene, &record.path, technique, &rules);
        let p = p.map_or("—".into(), exponential);
        // Writing to a string does not fail.
        let _ = write!(line, " ({s},{}){used} {p}", technique.t);
    }
    writeln!(out, "{line}")?;
    Ok(())
}

/// What a vertex lies on, and its normal.
fn describe(scene: &Scene, vertex: &Vertex, event: Event) -> (String, String) {
    match vertex {
        Vertex::Surface(point) => {
            let shape = scene.shapes().get(point.shape as usize);
            let name = shape.map_or("", |s| s.name.as_str());
            let light = if point.emitter().is_some() { ", emits" } else { "" };
            let delta = if event.is_specular() { ", specular" } else { "" };
            (format!("{name}{light}{delta}"), vector(point.n_g.as_dvec3()))
        }
        Vertex::Medium(point) => {
            let name = scene.medium(point.medium).map_or("", |m| m.name());
            (format!("in {name}"), String::new())
        }
        Vertex::PointEmitter { emitter, .. } => (format!("emitter {emitter}"), String::new()),
        Vertex::InfiniteEmitter { emitter, .. } => {
            (format!("emitter {emitter}, at infinity"), String::new())
        }
        Vertex::Sensor { n, .. } => ("sensor".into(), vector(n.as_dvec3())),
    }
}

/// Position in world units, or the direction to a vertex at infinity.
fn place(scene: &Scene, vertex: &Vertex) -> String {
    let norm = scene.normalisation();
    match (vertex.position(), vertex) {
        (Some(p), _) => vector(p.as_dvec3() / norm.scale + norm.center),
        (None, Vertex::InfiniteEmitter { to, .. }) => format!("towards {}", vector(to.as_dvec3())),
        (None, _) => String::new(),
    }
}

fn vector(v: DVec3) -> String {
    // −0 says nothing.
    let round = |x: f64| (x * 1e4).round() / 1e4 + 0.0;
    format!("({}, {}, {})", round(v.x), round(v.y), round(v.z))
}

fn triple(v: [f64; 3]) -> String {
    format!("[{}]", v.map(figure).join(", "))
}

/// exp(ln), also where it overflows.
fn exponential(ln: f64) -> String {
    let decade = (ln / std::f64::consts::LN_10).floor();
    let mantissa = (ln - decade * std::f64::consts::LN_10).exp();
    match decade {
        d if !d.is_finite() => figure(ln.exp()),
        d if (-2.0..4.0).contains(&d) => figure(ln.exp()),
        d => format!("{mantissa:.2}e{d}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn densities_of_any_size_are_told() {
        assert_eq!(exponential(2.0_f64.ln()), "2.000");
        assert_eq!(exponential(-1000.0 * std::f64::consts::LN_10 + 0.5), "1.65e-1000");
        assert_eq!(exponential(f64::NEG_INFINITY), "0");
    }
}
