//! The production code's weights for a given path, one for each technique: what tests hold against
//! the plain functions of a path.

use pathspace_core::Scene;
use pathspace_core::path::{Path, Technique};
use pathspace_core::scene::DirectSample;
use pathspace_core::walk::{Walk, WalkVertex};

use super::Bdpt;

impl Bdpt {
    /// w_{s,t}(x̄) of every technique that can make the path, by the code that renders: the
    /// subpaths are laid along the given vertices instead of being sampled, and every connection
    /// computes its weight as ever. Techniques that cannot make the path, or whose connection is
    /// blocked, are left out.
    pub fn weights_of(&self, scene: &Scene, path: &Path) -> Vec<(Technique, f64)> {
        let (k, v) = (path.length(), &path.vertices);
        let Some(emitter) = v[0].emitter() else { return Vec::new() };
        let walks = self.walks(scene);
        let delta = scene.emitters().get(emitter).is_delta();
        let light = Walk { weights: walks.light.weights.for_emitter(delta), ..walks.light };
        let (light, sensor) = (light.lay(scene, path), walks.sensor.lay(scene, path));
        let pinhole = scene.sensor().is_pinhole();
        let ends = |side: &[WalkVertex]| side.last().is_some_and(WalkVertex::ends);
        let mut weights = Vec::new();
        for s in 0..=k + 1 {
            let t = k + 1 - s;
            if light.len() < s || sensor.len() < t {
                continue;
            }
            let (mut light, mut sensor) = (&light[..s], &sensor[..t]);
            let (x0, x_k);
            let possible = match (s, t) {
                // Walks never end on a point that has no area.
                (0, _) => !delta,
                (_, 0) => !pinhole,
                _ => ends(light) && ends(sensor),
            };
            if !possible {
                continue;
            }
            if s == 1 && t >= 2 {
                let Some(p) = v[1].position() else { continue };
                let radiance = scene.emitted_from(&v[0], v[0].edge_to(&v[1]).direction());
                let pdf = scene.pdf_direct(p, &v[0]);
                let direct = DirectSample { vertex: v[0], emitter, radiance, pdf };
                x0 = [WalkVertex::next_event(scene, &direct)];
                light = &x0;
            }
            if t == 1 {
                x_k = [WalkVertex::on_lens(v[k], scene.sensor().pdf_vertex())];
                sensor = &x_k;
            }
            let connection = walks.connect(scene, light, sensor);
            if let Some(connection) = connection.filter(|c| c.is_visible(scene)) {
                weights.push((Technique::new(s, t), connection.weight(scene, &walks)));
            }
        }
        weights
    }
}
