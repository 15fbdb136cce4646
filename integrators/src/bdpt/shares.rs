//! Densities and weights of all techniques of a given path, in O(k) and without a ray.

use pathspace_core::Scene;
use pathspace_core::bsdf::TransportMode;
use pathspace_core::measure::Edge;
use pathspace_core::path::{Path, Technique, Vertex, samplable};

use super::Bdpt;

/// ln 0.
const NEVER: f64 = f64::NEG_INFINITY;

impl Bdpt {
    /// w_{s,t}(x̄) for s = 0 … k + 1; 0 for techniques that can not make the path or do not take
    /// part.
    pub fn weights(&self, scene: &Scene, path: &Path) -> Vec<f64> {
        let ln = self.ln_densities(scene, path);
        let max = ln.iter().flatten().copied().fold(NEVER, f64::max);
        let relative: Vec<f64> = ln.iter().map(|l| l.map_or(0.0, |l| (l - max).exp())).collect();
        (0..relative.len()).map(|s| self.heuristic.weight(s, &relative)).collect()
    }

    /// ln p_{s,t}(x̄) for s = 0 … k + 1, as [`pathspace_core::path::ln_density`] gives it for one
    /// technique; `None` too where the technique does not take part.
    ///
    /// The density of each vertex from either side does not depend on the technique, so that
    /// p_{s,t} = ∏_{j<s} p_l(x_j) ∏_{j≥s} p_c(x_j) are products of the same factors (Veach 1997,
    /// §10.2.1); only x₀ of next-event estimation has one of its own.
    pub fn ln_densities(&self, scene: &Scene, path: &Path) -> Vec<Option<f64>> {
        let (k, v) = (path.length(), &path.vertices);
        let edges: Vec<Edge> = v.windows(2).map(|w| w[0].edge_to(&w[1])).collect();
        let (light, sensor) =
            (self.ln_from_light(scene, path, &edges), self.ln_from_sensor(scene, path, &edges));
        let rules = self.rules();
        // Sums over j ≥ s, from the end: no differences, a factor may be 0.
        let mut right = vec![0.0; k + 2];
        for j in (0..=k).rev() {
            right[j] = right[j + 1] + sensor[j];
        }
        let mut on_the_left = 0.0;
        (0..=k + 1)
            .map(|s| {
                if s >= 1 {
                    on_the_left += light[s - 1];
                }
                let technique = Technique::new(s, k + 1 - s);
                let left = match (s, v[1].position()) {
                    (1, Some(p)) if technique.t >= 2 => scene.pdf_direct(p, &v[0]).value().ln(),
                    _ => on_the_left,
                };
                let ln = left + right[s];
                let can = ln.is_finite()
                    && self.techniques.contains(s, technique.t)
                    && samplable(scene, path, technique, &rules);
                can.then_some(ln)
            })
            .collect()
    }

    /// ln p_l(x_j) for j = 0 … k.
    fn ln_from_light(&self, scene: &Scene, path: &Path, edges: &[Edge]) -> Vec<f64> {
        let (k, v) = (edges.len(), &path.vertices);
        let mut ln = vec![NEVER; k + 1];
        ln[0] = scene.pdf_emission_vertex(&v[0]).value().ln();
        ln[1] = scene.pdf_emission_next(&v[0], &edges[0]).value().ln() + ln_flight(scene, v, 0, 1);
        for i in 1..k {
            let (from, to) = (-edges[i - 1].direction(), edges[i].direction());
            let event = scene.event_at(&v[i], from, to, TransportMode::Importance, path.events[i]);
            let Some((pdf, q)) = event else { break };
            let pdf = if self.roulette { pdf * q } else { pdf };
            ln[i + 1] = edges[i].to_area(pdf).value().ln() + ln_flight(scene, v, i, i + 1);
        }
        ln
    }

    /// ln p_c(x_j) for j = 0 … k.
    fn ln_from_sensor(&self, scene: &Scene, path: &Path, edges: &[Edge]) -> Vec<f64> {
        let (k, v) = (edges.len(), &path.vertices);
        let mut ln = vec![NEVER; k + 1];
        let sensor = scene.sensor();
        ln[k] = sensor.pdf_vertex().value().ln();
        let d = -edges[k - 1].direction();
        if v[k].position().and_then(|p| sensor.film_position(p, d)).is_some() {
            let area = edges[k - 1].reversed().to_area(sensor.pdf_direction(d)).value();
            ln[k - 1] = area.ln() + ln_flight(scene, v, k - 1, k - 1);
        }
        for i in (1..k).rev() {
            let (from, to) = (edges[i].direction(), -edges[i - 1].direction());
            let event = scene.event_at(&v[i], from, to, TransportMode::Radiance, path.events[i]);
            let Some((pdf, q)) = event else { break };
            let pdf = if self.roulette { pdf * q } else { pdf };
            let area = edges[i - 1].reversed().to_area(pdf).value();
            ln[i - 1] = area.ln() + ln_flight(scene, v, i - 1, i - 1);
        }
        ln
    }
}

/// ln of the density of the free flight along edge `edge` that ends at x_`end`; 0 without media.
fn ln_flight(scene: &Scene, v: &[Vertex], edge: usize, end: usize) -> f64 {
    if !scene.has_media() {
        return 0.0;
    }
    let through = scene.transmittance(&v[edge], &v[edge + 1]);
    scene.flight_density(&v[end], through).ln()
}
