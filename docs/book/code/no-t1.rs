//! Bidirectional path tracing without t = 1. Weights come from the densities of whole paths.

use std::sync::Arc;

use pathspace::core::bsdf::TransportMode;
use pathspace::core::film::{Contribution, Families, Sink};
use pathspace::core::glam::{Vec2, Vec3};
use pathspace::core::integrator::{
    Integrator, IntegratorError, MonteCarlo, PathEstimator, Run, State,
};
use pathspace::core::math::Ray;
use pathspace::core::mis::Heuristic;
use pathspace::core::path::{Path, Technique, Vertex, WalkRules, families, ln_density};
use pathspace::core::random::PrimarySample;
use pathspace::core::{Rgb, Scene};
use pathspace::integrators::{Defaults, Spec, SpecError};

/// Name on the command line.
pub const NAME: &str = "no-t1";

/// The integrator with its options.
#[derive(Clone, Debug)]
pub struct MyIntegrator {
    heuristic: Heuristic,
    rules: WalkRules,
    spec: String,
}

impl MyIntegrator {
    /// Reads the options.
    pub fn from_spec(spec: &Spec, defaults: &Defaults) -> Result<Self, SpecError> {
        let mut options = spec.options();
        let integrator = MyIntegrator {
            heuristic: options.heuristic(Heuristic::Balance)?,
            rules: WalkRules { rr_depth: 1, max_length: options.max_length(defaults)? },
            spec: spec.to_string(),
        };
        options.finish()?;
        Ok(integrator)
    }
}

impl Integrator for MyIntegrator {
    fn name(&self) -> &str {
        NAME
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn families(&self, _: &Scene) -> Families {
        Families::S0 | Families::S1 | Families::INNER
    }

    fn resume(
        &self,
        scene: Arc<Scene>,
        seed: u64,
        state: &State,
    ) -> Result<Box<dyn Run>, IntegratorError> {
        Ok(Box::new(MonteCarlo::new(Arc::new(self.clone()), scene, seed, state.step)))
    }
}

/// A vertex of a subpath: f/p up to its scattering, and the direction back.
#[derive(Clone, Copy)]
struct Step {
    vertex: Vertex,
    throughput: Rgb,
    from: Vec3,
}

/// Walks on from `ray`; gives the last ray where it left the scene.
fn walk<U: PrimarySample>(
    scene: &Scene,
    mode: TransportMode,
    most: usize,
    mut ray: Ray,
    mut throughput: Rgb,
    steps: &mut Vec<Step>,
    u: &mut U,
) -> Option<(Ray, Rgb)> {
    while steps.len() < most && !throughput.is_black() {
        let Some(point) = scene.intersect(&ray) else { return Some((ray, throughput)) };
        steps.push(Step { vertex: Vertex::Surface(point), throughput, from: -ray.d });
        let (lobe, direction) = (u.next(), u.next2());
        let next = scene.sample_scatter(&point, -ray.d, mode, lobe, direction)?;
        if u.next() as f64 >= next.survival.value() {
            return None;
        }
        throughput *= next.weight * (1.0 / next.survival.value()) as f32;
        ray = point.spawn(next.direction);
    }
    None
}

impl MyIntegrator {
    /// Weighs a path among (s, t), t ≥ 2, and emits it.
    fn emit<S: Sink>(
        &self,
        scene: &Scene,
        film: Vec2,
        value: Rgb,
        light: &[Step],
        sensor: &[Step],
        sink: &mut S,
    ) {
        if value.is_black() {
            return;
        }
        let vertices = light.iter().chain(sensor.iter().rev()).map(|v| v.vertex).collect();
        let path = Path { vertices };
        let Some(emitter) = path.vertices[0].emitter() else { return };
        let k = path.length();
        let ln: Vec<_> = (0..k.max(1))
            .map(|s| ln_density(scene, &path, Technique::new(s, k + 1 - s), &self.rules))
            .collect();
        let weight = self.heuristic.weight_ln(light.len(), &ln);
        sink.add(Contribution {
            film,
            value: value * weight as f32,
            weight: weight as f32,
            s: light.len() as u16,
            t: sensor.len() as u16,
            emitter,
            families: families(scene, &path, &self.rules),
        });
    }
}

impl PathEstimator for MyIntegrator {
    fn estimate<U: PrimarySample, S: Sink>(
        &self,
        scene: &Scene,
        pixel: Option<[u32; 2]>,
        u: &mut U,
        sink: &mut S,
    ) {
        let max = self.rules.max_length.map_or(usize::MAX / 4, |k| k as usize);
        let camera = scene.sensor();
        let on_film = u.next2();
        let lens = if camera.is_pinhole() { [0.0; 2] } else { u.next2() };
        let sample = camera.sample(pixel, on_film, lens);
        let mut z = vec![Step { vertex: sample.vertex, throughput: Rgb::WHITE, from: Vec3::ZERO }];
        let radiance = TransportMode::Radiance;
        let left = walk(scene, radiance, max + 1, sample.ray, Rgb::WHITE, &mut z, u);
        if let (Some((ray, throughput)), Some(emitter)) = (left, scene.emitters().background()) {
            let vertex = Vertex::InfiniteEmitter { emitter, to: ray.d };
            z.push(Step { vertex, throughput, from: -ray.d });
        }
        let mut y = Vec::new();
        if let Some(e) = scene.sample_emission(u.next(), u.next2(), u.next2()) {
            let throughput = e.radiance * (1.0 / e.pdf.value()) as f32;
            y.push(Step { vertex: e.vertex, throughput, from: Vec3::ZERO });
            let importance = TransportMode::Importance;
            walk(scene, importance, max.saturating_sub(1), e.ray, e.throughput(), &mut y, u);
        }
        for t in 2..=z.len() {
            let (sensor, end) = (&z[..t], &z[t - 1]);
            // s = 0
            let emitted = scene.emitted_from(&end.vertex, end.from);
            self.emit(scene, sample.film, end.throughput * emitted, &[], sensor, sink);
            let Vertex::Surface(point) = &end.vertex else { continue };
            if t > max || scene.is_delta_at(point, end.from) {
                continue;
            }
            // s = 1
            if let Some(direct) = scene.sample_direct(point.p, u.next(), u.next2()) {
                let edge = end.vertex.edge_to(&direct.vertex);
                let f = scene.evaluate_scatter(point, end.from, edge.direction(), radiance);
                if let Some(f) = f.filter(|_| scene.visible(&end.vertex, &direct.vertex)) {
                    let g = (edge.geometry_term() / direct.pdf.value()) as f32;
                    let value = end.throughput * f.value * direct.radiance * g;
                    let x0 = Step { vertex: direct.vertex, ..*end };
                    self.emit(scene, sample.film, value, &[x0], sensor, sink);
                }
            }
            // s ≥ 2
            for s in 2..=y.len().min(max + 1 - t) {
                let start = &y[s - 1];
                let Vertex::Surface(at) = &start.vertex else { continue };
                let edge = start.vertex.edge_to(&end.vertex);
                let f = scene.scatter(at, start.from, edge.direction())
                    * scene.scatter(point, -edge.direction(), end.from);
                let value = start.throughput * f * end.throughput * edge.geometry_term() as f32;
                if !value.is_black() && scene.visible(&start.vertex, &end.vertex) {
                    self.emit(scene, sample.film, value, &y[..s], sensor, sink);
                }
            }
        }
    }
}
