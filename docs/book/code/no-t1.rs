//! Bidirectional path tracing without t = 1: the subpaths, connections and weights of `core::walk`,
//! with techniques of its own.

use std::sync::Arc;

use pathspace::core::Scene;
use pathspace::core::film::{Families, Sink};
use pathspace::core::integrator::{
    Integrator, IntegratorError, MonteCarlo, PathEstimator, Run, State,
};
use pathspace::core::mis::Heuristic;
use pathspace::core::path::WalkRules;
use pathspace::core::random::PrimarySample;
use pathspace::core::walk::{TechniqueSet, WalkVertex, Walks, always, next_event_numbers};
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

impl PathEstimator for MyIntegrator {
    fn estimate<U: PrimarySample, S: Sink>(
        &self,
        scene: &Scene,
        pixel: Option<[u32; 2]>,
        u: &mut U,
        sink: &mut S,
    ) {
        // Every s, and t ≥ 2. Roulette plays at every surface, so that both walks know each
        // other's.
        let techniques = TechniqueSet::new(0..=1000, 2..=1000);
        let walks = Walks::new(scene, &self.rules, self.heuristic, techniques);
        let mut sensor = walks.sensor_subpath(scene, pixel, u, always);
        let light = walks.light_subpath(scene, u, |_| (), always).vertices;
        let film = sensor.film;
        // One technique (s, t): f/p of the path, its weight among all others that make it, and
        // whether both ends see each other.
        let mut connect = |light: &[WalkVertex], sensor: &[WalkVertex]| {
            if let Some(path) = walks.connect(scene, light, sensor)
                && path.is_visible(scene)
            {
                path.emit(scene, sink, film, path.weight(scene, &walks), 1.0);
            }
        };
        for t in 2..=sensor.vertices.len() {
            let (sensor, z) = (&sensor.vertices[..t], &sensor.vertices[t - 1]);
            // s = 0: the subpath ends on an emitter.
            if z.vertex.emitter().is_some() {
                connect(&[], sensor);
            }
            let (pick, on_emitter) = next_event_numbers(u);
            if !z.connectible || t > walks.max {
                continue;
            }
            // s = 1: x₀ is sampled for the last vertex.
            let p = z.vertex.position();
            if let Some(direct) = p.and_then(|p| scene.sample_direct(p, pick, on_emitter)) {
                connect(&[WalkVertex::next_event(scene, &direct)], sensor);
            }
            // s ≥ 2: the two subpaths are joined.
            for s in 2..=light.len().min(walks.max + 1 - t) {
                connect(&light[..s], sensor);
            }
        }
        walks.on_background(scene, &mut sensor, |sensor| connect(&[], sensor));
    }
}
