//! What the reader understands, as one table: readers, messages and the table in `scenes/README.md`
//! all come from it.

use std::collections::HashSet;

use crate::error::{Known, Place, Result, SceneFileError};
use crate::xml::{Graph, Object};

/// How well a plug-in is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Support {
    /// As in Mitsuba.
    Full,
    /// Read as something near it.
    As(&'static str),
    /// Not read, for this reason.
    Refused(&'static str),
}

use Support::{As, Full, Refused};

/// Class of the element, type, support.
pub(crate) const TABLE: &[(&str, &str, Support)] = &[
    ("shape", "cube", Full),
    ("shape", "cylinder", Full),
    ("shape", "disk", Full),
    ("shape", "instance", As("copies")),
    ("shape", "merge", As("its shapes")),
    ("shape", "obj", Full),
    ("shape", "ply", Full),
    ("shape", "rectangle", Full),
    ("shape", "serialized", Full),
    ("shape", "shapegroup", Full),
    ("shape", "sphere", Full),
    ("shape", "bsplinecurve", Refused("there are no curves")),
    ("shape", "linearcurve", Refused("there are no curves")),
    ("shape", "hair", Refused("there are no curves")),
    ("shape", "sdfgrid", Refused("there are no distance fields")),
    ("shape", "ellipsoids", Refused("there are no volumetric primitives")),
    ("shape", "ellipsoidsmesh", Refused("there are no volumetric primitives")),
    ("bsdf", "blendbsdf", Full),
    ("bsdf", "bumpmap", Full),
    ("bsdf", "conductor", Full),
    ("bsdf", "dielectric", Full),
    ("bsdf", "diffuse", Full),
    ("bsdf", "mask", Full),
    ("bsdf", "mixturebsdf", Full),
    ("bsdf", "normalmap", Full),
    ("bsdf", "null", Full),
    ("bsdf", "phong", Full),
    ("bsdf", "plastic", Full),
    ("bsdf", "principled", Full),
    ("bsdf", "principledthin", Full),
    ("bsdf", "roughconductor", Full),
    ("bsdf", "roughdielectric", Full),
    ("bsdf", "roughdiffuse", Full),
    ("bsdf", "roughplastic", Full),
    ("bsdf", "thindielectric", Full),
    ("bsdf", "twosided", Full),
    ("bsdf", "ward", Full),
    ("bsdf", "coating", As("plastic over a diffuse base")),
    ("bsdf", "difftrans", As("principledthin")),
    ("bsdf", "roughcoating", As("roughplastic over a diffuse base")),
    ("bsdf", "hair", Refused("there is no model of hair")),
    ("bsdf", "measured", Refused("there are no measured materials")),
    ("bsdf", "measured_polarized", Refused("light is not polarised here")),
    ("bsdf", "circular", Refused("light is not polarised here")),
    ("bsdf", "polarizer", Refused("light is not polarised here")),
    ("bsdf", "pplastic", Refused("light is not polarised here")),
    ("bsdf", "retarder", Refused("light is not polarised here")),
    ("emitter", "area", Full),
    ("emitter", "constant", Full),
    ("emitter", "directional", Full),
    ("emitter", "envmap", Full),
    ("emitter", "point", Full),
    ("emitter", "projector", Full),
    ("emitter", "spot", Full),
    ("emitter", "sky", As("sunsky without a sun")),
    ("emitter", "sun", As("the direction of a sun")),
    ("emitter", "sunsky", As("an environment map and a direction")),
    ("emitter", "timed_sunsky", Refused("the sun does not move")),
    ("emitter", "collimated", Refused("a ray without width meets nothing twice")),
    ("emitter", "directionalarea", Refused("surfaces emit in all directions")),
    ("emitter", "volumelight", Refused("volumes do not emit")),
    ("medium", "homogeneous", Full),
    ("medium", "heterogeneous", Refused("there are no grids")),
    ("phase", "blendphase", Full),
    ("phase", "hg", Full),
    ("phase", "isotropic", Full),
    ("phase", "rayleigh", Full),
    ("phase", "sggx", Refused("there are no microflakes")),
    ("phase", "tabphase", Refused("there are no tables of phase functions")),
    ("volume", "constvolume", Full),
    ("volume", "gridvolume", Refused("there are no grids")),
    ("texture", "bitmap", Full),
    ("texture", "blackbody", Full),
    ("texture", "checkerboard", Full),
    ("texture", "d65", Full),
    ("texture", "irregular", Full),
    ("texture", "mesh_attribute", As("grey 0.5")),
    ("texture", "rawconstant", Full),
    ("texture", "regular", Full),
    ("texture", "rgb", Full),
    ("texture", "scale", Full),
    ("texture", "srgb", Full),
    ("texture", "uniform", Full),
    ("sensor", "perspective", Full),
    ("sensor", "thinlens", Full),
    ("sensor", "orthographic", As("perspective from far away")),
    ("sensor", "distant", As("another sensor of the file")),
    ("sensor", "irradiancemeter", As("another sensor of the file")),
    ("sensor", "radiancemeter", As("another sensor of the file")),
    ("sensor", "batch", Refused("one sensor is rendered at a time")),
    ("film", "hdrfilm", Full),
    ("film", "specfilm", As("hdrfilm")),
    ("rfilter", "box", Full),
    ("rfilter", "gaussian", Full),
    ("rfilter", "tent", Full),
    ("rfilter", "catmullrom", As("gaussian")),
    ("rfilter", "lanczos", As("gaussian")),
    ("rfilter", "mitchell", As("gaussian")),
    ("sampler", "independent", Full),
    ("sampler", "ldsampler", As("independent")),
    ("sampler", "multijitter", As("independent")),
    ("sampler", "orthogonal", As("independent")),
    ("sampler", "stratified", As("independent")),
    ("integrator", "direct", As("pt with depth 2")),
    ("integrator", "path", As("pt")),
    ("integrator", "ptracer", As("lt")),
    ("integrator", "volpath", As("pt")),
    ("integrator", "volpathmis", As("pt")),
];

/// Classes whose plug-ins make the image: an unknown one is an error. Others are read as their
/// nearest relative.
const NEEDED: [&str; 9] =
    ["shape", "bsdf", "emitter", "texture", "medium", "phase", "volume", "subsurface", "sensor"];

/// Entry of the table.
pub(crate) fn of(class: &str, plugin: &str) -> Option<Support> {
    TABLE.iter().find(|(c, p, _)| *c == class && *p == plugin).map(|(.., s)| *s)
}

/// Types of a class that are understood.
pub(crate) fn known(class: &str) -> Known {
    let understood = |s: &Support| !matches!(s, Refused(_));
    Known::new(TABLE.iter().filter(|(c, _, s)| *c == class && understood(s)).map(|(_, p, _)| *p))
}

fn is_missing(object: &Object) -> bool {
    NEEDED.contains(&object.class)
        && matches!(of(object.class, &object.plugin), None | Some(Refused(_)))
}

/// A plug-in that is not understood.
pub(crate) fn unknown(object: &Object) -> SceneFileError {
    let reason = match of(object.class, &object.plugin) {
        Some(Refused(reason)) => Some(reason),
        _ => None,
    };
    SceneFileError::Plugin {
        place: object.place.clone(),
        class: object.class,
        plugin: object.plugin.clone(),
        reason,
        known: known(object.class),
    }
}

/// Objects that make the image: what shapes, emitters and the sensor are, and what they refer to.
pub(crate) fn reachable(graph: &Graph, roots: &[usize]) -> Result<Vec<usize>> {
    let mut seen: HashSet<usize> = HashSet::new();
    let mut order = Vec::new();
    let mut stack: Vec<usize> = roots.iter().rev().copied().collect();
    while let Some(index) = stack.pop() {
        if !seen.insert(index) {
            continue;
        }
        order.push(index);
        for property in graph.objects[index].properties.iter().rev() {
            stack.extend(graph.target(property)?);
        }
    }
    Ok(order)
}

/// Refuses a scene with plug-ins that are not understood, all of them in one error.
pub(crate) fn check(graph: &Graph, used: &[usize]) -> Result<()> {
    let mut kinds: Vec<(&Object, usize)> = Vec::new();
    for object in used.iter().map(|i| &graph.objects[*i]).filter(|o| is_missing(o)) {
        match kinds.iter_mut().find(|(o, _)| o.class == object.class && o.plugin == object.plugin) {
            Some((_, count)) => *count += 1,
            None => kinds.push((object, 1)),
        }
    }
    match kinds.as_slice() {
        [] => Ok(()),
        [(object, 1)] => Err(unknown(object)),
        [(first, _), ..] => Err(SceneFileError::Missing {
            place: first.place.clone(),
            missing: kinds.iter().map(|(o, n)| entry(o, *n, &first.place)).collect(),
        }),
    }
}

/// `bsdf "hair" (3 times, first in line 7; there is no model of hair)`.
fn entry(object: &Object, count: usize, main: &Place) -> String {
    let times = if count == 1 { "once".into() } else { format!("{count} times") };
    let place = if object.place.file == main.file {
        format!("line {}", object.place.line)
    } else {
        object.place.to_string()
    };
    let reason = match of(object.class, &object.plugin) {
        Some(Refused(reason)) => format!("; {reason}"),
        _ => String::new(),
    };
    format!("{} ({times}, first in {place}{reason})", object.title())
}

/// True where everything below an object is understood.
pub(crate) fn is_understood(graph: &Graph, index: usize) -> bool {
    let all = reachable(graph, &[index]);
    all.is_ok_and(|all| !all.iter().any(|i| is_missing(&graph.objects[*i])))
}

/// The table of `scenes/README.md`.
#[cfg(test)]
fn markdown() -> String {
    let mut out = String::from("| Class | Types |\n| --- | --- |\n");
    let mut classes: Vec<&str> = TABLE.iter().map(|(c, ..)| *c).collect();
    classes.dedup();
    for class in classes {
        let of_class = || TABLE.iter().filter(|(c, ..)| *c == class);
        let mut cells: Vec<String> = Vec::new();
        cells.extend(of_class().filter(|(.., s)| *s == Full).map(|(_, p, _)| (*p).to_string()));
        cells.extend(of_class().filter_map(|(_, p, s)| match s {
            As(what) => Some(format!("{p} (as {what})")),
            _ => None,
        }));
        let refused: Vec<String> = of_class()
            .filter_map(|(_, p, s)| match s {
                Refused(why) => Some(format!("{p}: {why}")),
                _ => None,
            })
            .collect();
        let refused = match refused.is_empty() {
            true => String::new(),
            false => format!(". Refused: {}", refused.join("; ")),
        };
        out.push_str(&format!("| {class} | {}{refused} |\n", cells.join(", ")));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of the README is what the code says. Where this fails, put `expected` between the
    /// marks.
    #[test]
    fn the_readme_has_the_present_table() {
        let readme = include_str!("../../README.md");
        let (_, rest) = readme.split_once("<!-- support: begin -->\n").unwrap();
        let (table, _) = rest.split_once("<!-- support: end -->").unwrap();
        assert_eq!(table.trim(), markdown().trim(), "expected:\n{}", markdown());
    }
}
