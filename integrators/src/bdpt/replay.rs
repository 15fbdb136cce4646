//! The production code's weights for a given path, one for each technique: what tests hold against the oracle.

use pathspace_core::Scene;
use pathspace_core::bsdf::TransportMode;
use pathspace_core::color::Rgb;
use pathspace_core::emitter::{DirectSample, NextDensity};
use pathspace_core::film::RecordingSink;
use pathspace_core::math::Ray;
use pathspace_core::measure::Density;
use pathspace_core::path::{Path, Technique, Vertex};

use super::Bdpt;
use super::connect::first_vertex;
use super::subpath::{OpenEdge, Subpath, WalkConfig};

impl Bdpt {
    /// w_{s,t}(x̄) of every technique that can make the path, by the code that renders: the subpaths are laid along the given
    /// vertices instead of being sampled, and every connection computes its weight as ever. Techniques that cannot make the path, or
    /// whose connection is blocked, are left out.
    pub fn weights_of(&self, scene: &Scene, path: &Path) -> Vec<(Technique, f64)> {
        let (k, v) = (path.length(), &path.vertices);
        let Some(emitter) = v[0].emitter() else { return Vec::new() };
        let mut sink = RecordingSink::default();
        let walks = self.walks(scene);
        let mut connector = walks.connector(scene, &mut sink, glam::Vec2::ZERO);
        connector.begin_light(emitter);
        let backwards: Vec<Vertex> = v.iter().rev().copied().collect();
        let light = lay(scene, &connector.light, v, scene.pdf_emission_vertex(&v[0]));
        let sensor = lay(scene, &connector.sensor, &backwards, scene.sensor().pdf_vertex());
        // A pinhole has one point; on a lens the technique would sample another one than the path's.
        let pinhole = scene.sensor().is_pinhole();
        let delta = scene.emitters().get(emitter).is_delta();
        let mut weights = Vec::new();
        for s in 0..=k + 1 {
            let t = k + 1 - s;
            if light.len() < s || sensor.len() < t {
                continue;
            }
            let (light, sensor) = (&light[..s], &sensor[..t]);
            let connectible =
                [light, sensor].iter().all(|side| side.last().is_some_and(|v| v.connectible));
            let before = connector.sink.records.len();
            match (s, t) {
                // Walks never end on a point that has no area.
                (0, _) if !delta => connector.hit_emitter(sensor),
                (_, 0) if !pinhole => {
                    if let [.., _, lens] = light {
                        connector.hit_lens(light, emitter, -lens.from);
                    }
                }
                (_, 1) if connectible && pinhole => connector.onto_film(light, emitter, [0.0; 2]),
                (1, _) if connectible => {
                    let Some(p) = v[1].position() else { continue };
                    let d = v[0].edge_to(&v[1]).direction();
                    let direct = DirectSample {
                        vertex: v[0],
                        emitter,
                        radiance: scene.emitted_from(&v[0], d),
                        pdf: scene.pdf_direct(p, &v[0]),
                    };
                    connector.connect_direct(sensor, &direct);
                }
                _ if connectible && s >= 2 && t >= 2 => {
                    if let Some(candidate) = connector.inner(light, sensor) {
                        connector.finish_inner(&candidate, light, sensor, emitter, 1.0);
                    }
                }
                _ => {}
            }
            let records = &connector.sink.records;
            if records.len() > before {
                weights.push((Technique::new(s, t), records[before].weight));
            }
        }
        weights
    }
}

/// The subpath along given vertices in walk order, with the densities that the walk would have given them.
fn lay(
    scene: &Scene,
    config: &WalkConfig,
    vertices: &[Vertex],
    first: Density<pathspace_core::measure::Area>,
) -> Subpath {
    let mut subpath = vec![first_vertex(vertices[0], first)];
    for i in 1..vertices.len() {
        let d = vertices[i - 1].edge_to(&vertices[i]).direction();
        let next = match (i, config.mode) {
            (1, TransportMode::Radiance) => NextDensity::Direction(scene.sensor().pdf_direction(d)),
            (1, TransportMode::Importance) => match scene.next_of(&vertices[0], d) {
                Some(next) => next,
                None => break,
            },
            _ => {
                let Vertex::Surface(point) = &vertices[i - 1] else { break };
                let from = subpath[i - 1].from;
                let Some((pdf, q)) = scene.scatter_event(point, from, d, config.mode) else {
                    break;
                };
                NextDensity::Direction(if config.roulette { pdf * q } else { pdf })
            }
        };
        let connectible = match &vertices[i] {
            Vertex::Surface(point) => !scene.is_delta_at(point, -d),
            _ => true,
        };
        let edge = OpenEdge { ray: Ray::new(glam::Vec3::ZERO, d), throughput: Rgb::WHITE, next };
        if !config.push(scene, &mut subpath, vertices[i], &edge, connectible) {
            break;
        }
    }
    subpath
}
