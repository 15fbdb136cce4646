//! The state of a chain: a whole path with everything that mutations ask of it.

use glam::Vec2;
use pathspace_core::Scene;
use pathspace_core::bsdf::{Event, TransportMode};
use pathspace_core::color::luminance;
use pathspace_core::film::Families;
use pathspace_core::measure::Edge;
use pathspace_core::path::{Origin, Path, Vertex, WalkClass};

/// A path x̄ = x₀…x_k with f(x̄) ≠ 0 and what is known of it: edges, specular vertices, film
/// position.
///
/// A state of a chain has f*(x̄) > 0; a proposal may have one that is no finite number, so that it
/// can be reported. Visibility is not part of f here, as in [`pathspace_core::path::contribution`];
/// whoever makes a path has looked.
#[derive(Clone, Debug, PartialEq)]
pub struct MltPath {
    path: Path,
    edges: Vec<Edge>,
    specular: Vec<bool>,
    film: Vec2,
    value: [f64; 3],
    target: f64,
}

impl MltPath {
    /// The state of this path; `None` where f(x̄) = 0.
    pub fn new(scene: &Scene, path: Path) -> Option<MltPath> {
        let vertices = &path.vertices;
        let k = vertices.len().checked_sub(1).filter(|&k| k >= 1)?;
        let Vertex::Sensor { p: on_lens, .. } = vertices[k] else { return None };
        vertices[0].emitter()?;
        let mut edges = Vec::with_capacity(k);
        edges.extend(vertices.windows(2).map(|w| w[0].edge_to(&w[1])));
        let into = -edges[k - 1].direction();
        let sensor = scene.sensor();
        let film = sensor.film_position(on_lens, into)?;
        let emitted = scene.emitted_from(&vertices[0], edges[0].direction());
        if emitted.is_black() {
            return None;
        }
        let mut value = emitted.to_array().map(|c| f64::from(c) * sensor.importance(into));
        let mut specular = Vec::with_capacity(k + 1);
        specular.push(vertices[0].emitter().is_none_or(|e| scene.emitters().get(e).is_delta()));
        for i in 1..k {
            let point = vertices[i].surface()?;
            let (to_light, to_sensor) = (-edges[i - 1].direction(), edges[i].direction());
            specular.push(path.is_specular(i));
            let scattered = scene.scatter_value(point, to_light, to_sensor, path.events[i]);
            if scattered.is_black() {
                return None;
            }
            for (v, f) in value.iter_mut().zip(scattered.to_array()) {
                *v *= f64::from(f);
            }
        }
        specular.push(sensor.is_pinhole());
        let geometry: f64 = edges.iter().map(Edge::geometry_term).product();
        let value = value.map(|v| v * geometry);
        let target = luminance(&value);
        // Not a number is not nothing.
        (target != 0.0).then_some(MltPath { path, edges, specular, film, value, target })
    }

    /// The path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// x₀ … x_k.
    pub fn vertices(&self) -> &[Vertex] {
        &self.path.vertices
    }

    /// Number of edges k.
    pub fn length(&self) -> usize {
        self.edges.len()
    }

    /// The edge x_i → x_{i+1}.
    pub fn edge(&self, i: usize) -> &Edge {
        &self.edges[i]
    }

    /// f(x̄) per channel, relative to the delta functions of specular vertices.
    pub fn value(&self) -> [f64; 3] {
        self.value
    }

    /// f*(x̄), the luminance of f(x̄): what the chain samples in proportion to.
    pub fn target(&self) -> f64 {
        self.target
    }

    /// Where the path lands on the film, in pixels.
    pub fn film(&self) -> Vec2 {
        self.film
    }

    /// True where x_i scatters, emits or receives by a delta function: a specular event, a point or
    /// directional light, a pinhole.
    pub fn is_specular(&self, i: usize) -> bool {
        self.specular[i]
    }

    /// What happens at x_i.
    pub fn event(&self, i: usize) -> Event {
        self.path.events[i]
    }

    /// Whether technique (s, k + 1 − s) can make the path: [`pathspace_core::path::samplable`] from
    /// the cached flags.
    pub fn samplable(&self, s: usize) -> bool {
        let k = self.length();
        if s > k + 1 || (self.specular[0] && k == 1) {
            return false;
        }
        match s {
            0 => !self.specular[0],
            s if s == k + 1 => !self.specular[k],
            s => (s == 1 || !self.specular[s - 1]) && (s == k || !self.specular[s]),
        }
    }

    /// Every family of techniques that can make the path.
    pub fn families(&self) -> Families {
        let k = self.length();
        let mut class = WalkClass::default();
        for i in 1..k {
            class.push(!self.specular[i]);
        }
        let far = matches!(self.path.vertices[0], Vertex::InfiniteEmitter { .. });
        let origin = Origin { delta: self.specular[0], far };
        class.families(TransportMode::Importance, origin, self.specular[k])
    }
}
