//! T(x̄→ȳ) of the vertices that were added, summed over all splits that could have made them (Veach
//! 1997, §11.4.2.3).

use pathspace_core::Scene;
use pathspace_core::bsdf::TransportMode;
use pathspace_core::path::Vertex;

use super::super::path::MltPath;
use super::ends::Ends;

/// ln of the mean over the possible splits of p(new vertices | kept ones); `None` where no split
/// makes them.
pub(super) fn ln_added(scene: &Scene, y: &MltPath, ends: &Ends) -> Option<f64> {
    let kept = ends.kept;
    let added = kept.replaced(y)?;
    let (first, end) = (kept.light, kept.light + added);
    // Suffix sums of the sensor's densities, then the emitter's on the way.
    let mut sensor = Vec::with_capacity(added + 1);
    let mut ln_sensor = Some(0.0);
    sensor.push(ln_sensor);
    for i in (first..end).rev() {
        ln_sensor = ln_sensor.zip(from_sensor(scene, y, i)).map(|(ln, next)| ln + next);
        sensor.push(ln_sensor);
    }
    let mut terms = Vec::with_capacity(added + 1);
    let mut splits = 0;
    let mut ln_light = Some(0.0);
    for s in first..=end {
        if s > first {
            let next = from_light(scene, y, s - 1);
            ln_light = ln_light.zip(next).map(|(ln, next)| ln + next);
        }
        if !ends.splits(added).any(|split| split == s) {
            continue;
        }
        splits += 1;
        if !y.samplable(s) {
            continue;
        }
        // x₀ alone is sampled for the vertex that it is connected to.
        let light =
            if s == 1 && first == 0 && y.length() >= 2 { direct(scene, y) } else { ln_light };
        terms.extend(light.zip(sensor[end - s]).map(|(l, r)| l + r));
    }
    let max = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !max.is_finite() {
        return None;
    }
    let sum: f64 = terms.iter().map(|t| (t - max).exp()).sum();
    Some(max + (sum / f64::from(splits)).ln())
}

/// ln of a density that must be positive.
fn ln(density: f64) -> Option<f64> {
    (density > 0.0).then(|| density.ln())
}

/// ln p(x₀) where it is sampled for x₁.
fn direct(scene: &Scene, y: &MltPath) -> Option<f64> {
    let p = y.vertices()[1].position()?;
    ln(scene.pdf_direct(p, &y.vertices()[0]).value())
}

/// ln of the area density of x_i as the next vertex of the light subpath x₀ … x_{i−1}.
fn from_light(scene: &Scene, y: &MltPath, i: usize) -> Option<f64> {
    let v = y.vertices();
    let pdf = match i {
        0 => scene.pdf_emission_vertex(&v[0]),
        1 => scene.pdf_emission_next(&v[0], y.edge(0)),
        _ => {
            let (before, edge) = (y.edge(i - 2), y.edge(i - 1));
            let (from, to) = (-before.direction(), edge.direction());
            let mode = TransportMode::Importance;
            let event = scene.scatter_event(v[i - 1].surface()?, from, to, mode, y.event(i - 1));
            edge.to_area(event?.0)
        }
    };
    ln(pdf.value())
}

/// ln of the area density of x_i as the next vertex of the sensor subpath x_k … x_{i+1}.
fn from_sensor(scene: &Scene, y: &MltPath, i: usize) -> Option<f64> {
    let v = y.vertices();
    let k = y.length();
    if i == k {
        return ln(scene.sensor().pdf_vertex().value());
    }
    let edge = y.edge(i).reversed();
    let pdf = if i + 1 == k {
        scene.sensor().pdf_direction(edge.direction())
    } else {
        let Vertex::Surface(point) = &v[i + 1] else { return None };
        let from = y.edge(i + 1).direction();
        let (to, mode) = (edge.direction(), TransportMode::Radiance);
        scene.scatter_event(point, from, to, mode, y.event(i + 1))?.0
    };
    ln(edge.to_area(pdf).value())
}
