//! The measurement contribution f(x̄).

use super::{Path, Vertex};
use crate::scene::Scene;

/// f(x̄) = L_e(x₀→x₁) G T(x₀,x₁) Π f̄(x_i) G T(x_i,x_{i+1}) · W_e(x_{k−1}→x_k) per channel (Veach
/// 1997, eq. 8.7; T is 1 without media), visibility not included ([`Scene::visible`] tells it);
/// relative to the delta functions of specular vertices. 0 where the path does not reach the crop
/// window.
pub fn contribution(scene: &Scene, path: &Path) -> [f64; 3] {
    let v = &path.vertices;
    let k = path.length();
    let Vertex::Sensor { p, .. } = v[k] else { return [0.0; 3] };
    let edges: Vec<_> = v.windows(2).map(|w| w[0].edge_to(&w[1])).collect();
    // Towards the emitter side, as the sensor sees it.
    let into = -edges[k - 1].direction();
    if scene.sensor().film_position(p, into).is_none() {
        return [0.0; 3];
    }
    let emitted = scene.emitted_from(&v[0], edges[0].direction());
    let mut f = emitted.to_array().map(|c| c as f64 * scene.sensor().importance(into));
    for (edge, ends) in edges.iter().zip(v.windows(2)) {
        let through = scene.transmittance(&ends[0], &ends[1]).to_array();
        for (c, t) in f.iter_mut().zip(through) {
            *c *= edge.geometry_term() * f64::from(t);
        }
    }
    for i in 1..k {
        if !v[i].scatters() {
            return [0.0; 3];
        }
        let (to_light, to_sensor) = (-edges[i - 1].direction(), edges[i].direction());
        let value = scene.value_at(&v[i], to_light, to_sensor, path.events[i]);
        for (c, x) in f.iter_mut().zip(value.to_array()) {
            *c *= x as f64;
        }
    }
    f
}
