//! Bidirectional path tracing (Lafortune and Willems 1993; Veach and Guibas 1994; Veach 1997, chapter 10).
//!
//! One light subpath and one sensor subpath per sample, every technique (s, t) that their vertices allow, weighted so that Σ w = 1 on the
//! techniques that can make the path.
//!
//! | step | file |
//! | --- | --- |
//! | subpaths and their densities | `subpath` |
//! | the techniques | `connect` |
//! | weights, O(1) per connection | `weight` |
//! | which techniques take part | `techniques` |

mod connect;
mod subpath;
mod techniques;
mod weight;

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::bsdf::TransportMode;
use pathspace_core::color::Rgb;
use pathspace_core::emitter::NextDensity;
use pathspace_core::film::{Families, Sink};
use pathspace_core::integrator::{
    Integrator, IntegratorError, MonteCarlo, PathEstimator, Run, State,
};
use pathspace_core::mis::Heuristic;
use pathspace_core::path::{Vertex, WalkRules};
use pathspace_core::random::PrimarySample;

use self::connect::{Connector, first_vertex};
use self::subpath::{OpenEdge, Subpath, WalkConfig};
pub use self::techniques::TechniqueSet;
use self::weight::Weights;
use crate::spec::{Defaults, Spec, SpecError};

/// Name in the registry.
pub const NAME: &str = "bdpt";

/// Paths longer than this end without roulette only where the scene caps them.
const ROULETTE_FROM: u32 = 24;

/// How the vertices of the two subpaths are connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Connect {
    /// Every pair.
    Full,
    /// For every sensor vertex one light vertex, picked in proportion to the unoccluded contribution: one shadow ray
    /// instead of s, unbiased because the picked value is divided by its probability (resampled importance sampling with one draw).
    One,
}

/// Bidirectional path tracing.
#[derive(Clone, Debug)]
pub struct Bdpt {
    /// Techniques that take part.
    pub techniques: TechniqueSet,
    /// How techniques share a path.
    pub heuristic: Heuristic,
    /// How inner connections are made.
    pub connect: Connect,
    /// Roulette at every surface vertex of both subpaths, or none.
    pub roulette: bool,
    /// Longest path in edges; `None` is unlimited and needs roulette.
    pub max_length: Option<u32>,
    spec: String,
}

impl Bdpt {
    /// From options: `s`, `t` (ranges), `heuristic` (`beta`, `alpha`), `connect` = full | one, `roulette`, `max_depth`.
    ///
    /// # Errors
    /// Where an option is unknown or its value out of range.
    pub fn from_spec(spec: &Spec, defaults: &Defaults) -> Result<Self, SpecError> {
        let mut options = spec.options();
        let max_length = options.walk_rules(defaults)?.max_length;
        let bdpt = Bdpt {
            techniques: options.techniques()?,
            heuristic: options.heuristic(Heuristic::Power { beta: 2.0 })?,
            connect: options
                .choice("connect", &[("full", Connect::Full), ("one", Connect::One)])?,
            roulette: options.boolean("roulette", max_length.is_none_or(|k| k > ROULETTE_FROM))?
                || max_length.is_none(),
            max_length,
            spec: spec.to_string(),
        };
        options.finish()?;
        Ok(bdpt)
    }

    /// The rules of its walks, for the oracle: roulette plays from the first surface vertex or never.
    pub fn rules(&self) -> WalkRules {
        let rr_depth = if self.roulette { 1 } else { u32::MAX };
        WalkRules { max_length: self.max_length, rr_depth }
    }

    fn max_length(&self) -> usize {
        self.max_length.map_or(usize::MAX / 4, |k| k as usize)
    }
}

impl Integrator for Bdpt {
    fn name(&self) -> &str {
        NAME
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn families(&self, scene: &Scene) -> Families {
        let t = &self.techniques;
        let any = |s: std::ops::Range<usize>, r: std::ops::Range<usize>| {
            s.clone().any(|s| r.clone().any(|r| t.contains(s, r)))
        };
        const FAR: usize = 64;
        Families::S0.when(any(0..1, 2..FAR))
            | Families::S1.when(any(1..2, 2..FAR))
            | Families::INNER.when(any(2..FAR, 2..FAR))
            | Families::T1.when(any(1..FAR, 1..2))
            | Families::T0.when(!scene.sensor().is_pinhole() && any(2..FAR, 0..1))
    }

    fn start(&self, scene: Arc<Scene>, seed: u64) -> Result<Box<dyn Run>, IntegratorError> {
        self.resume(scene, seed, &State::default())
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

impl PathEstimator for Bdpt {
    fn estimate<U: PrimarySample, S: Sink>(
        &self,
        scene: &Scene,
        pixel: Option<[u32; 2]>,
        u: &mut U,
        sink: &mut S,
    ) {
        let pinhole = scene.sensor().is_pinhole();
        let max = self.max_length();
        if max == 0 {
            return;
        }
        let weights = Weights::new(self.heuristic, self.techniques, pinhole, false);
        let config = |mode, max_vertices| WalkConfig {
            mode,
            max_vertices,
            roulette: self.roulette,
            weights,
        };
        let lens = |u: &mut U| if pinhole { [0.0; 2] } else { u.next2() };

        // Sensor subpath z₀ = x_k, z₁, …
        let sample = scene.sensor().sample(pixel, u.next2(), lens(u));
        let sensor_walk = config(TransportMode::Radiance, (max + 1).min(self.techniques.max_t()));
        let mut sensor: Subpath = vec![first_vertex(sample.vertex, scene.sensor().pdf_vertex())];
        let first = OpenEdge {
            ray: sample.ray,
            throughput: Rgb::WHITE,
            next: NextDensity::Direction(scene.sensor().pdf_direction(sample.ray.d)),
        };
        let escaped = if sensor_walk.max_vertices >= 2 {
            sensor_walk.walk(scene, &mut sensor, first, u, |_, _, _| ())
        } else {
            None
        };

        // Light subpath y₀ = x₀, y₁, …
        let mut light: Subpath = Vec::new();
        let emission = scene.sample_emission(u.next(), u.next2(), u.next2());
        let emitter = emission.map_or(0, |e| e.emitter);
        let delta = emission.is_some_and(|e| scene.emitters().get(e.emitter).is_delta());
        let light_walk = WalkConfig {
            weights: weights.for_emitter(delta),
            ..config(TransportMode::Importance, max.min(self.techniques.max_s()))
        };
        let mut connector =
            Connector { scene, sink, film: sample.film, light: light_walk, sensor: sensor_walk };
        if let Some(emission) = emission.filter(|_| light_walk.max_vertices >= 1) {
            let mut x0 = first_vertex(emission.vertex, emission.pdf);
            x0.throughput = emission.radiance * (1.0 / emission.pdf.value()) as f32;
            light.push(x0);
            let cos_over_pdf = emission.cos as f64 / (emission.pdf.value() * emission.next.value());
            let first = OpenEdge {
                ray: emission.ray,
                throughput: emission.radiance * cos_over_pdf as f32,
                next: emission.next,
            };
            light_walk.walk(scene, &mut light, first, u, |light, edge, length| {
                if pinhole || light.len() > max {
                    return;
                }
                let Some(p) = scene.sensor().hit_lens(&edge.ray, length) else { return };
                let lens = Vertex::Sensor { p, n: scene.sensor().axis() };
                light_walk.push(scene, light, lens, edge, true);
                connector.hit_lens(light, emitter, edge.ray.d);
                light.pop();
            });
        }

        // t = 1.
        for n in 1..=light.len().min(max) {
            let on_lens = lens(u);
            if light[n - 1].connectible {
                connector.onto_film(&light[..n], emitter, on_lens);
            }
        }
        // s = 0.
        for n in 2..=sensor.len() {
            connector.hit_emitter(&sensor[..n]);
        }
        if let Some(edge) = escaped
            && sensor.len() < sensor_walk.max_vertices
            && let Some(background) = scene.emitters().background()
        {
            let vertex = Vertex::InfiniteEmitter { emitter: background, to: edge.ray.d };
            sensor_walk.push(scene, &mut sensor, vertex, &edge, false);
            connector.hit_emitter(&sensor);
            sensor.pop();
        }
        // s ≥ 1, t ≥ 2.
        for t in 2..=sensor.len() {
            let (pick, on_emitter) = (u.next(), u.next2());
            let choice = if self.connect == Connect::One { u.next() } else { 0.0 };
            if !sensor[t - 1].connectible || t > max {
                continue;
            }
            connector.next_event(&sensor[..t], pick, on_emitter);
            let last = light.len().min((max + 1).saturating_sub(t));
            self.connect_inner(&mut connector, &light[..last], &sensor[..t], emitter, choice);
        }
    }
}

impl Bdpt {
    /// Techniques (s, t) for every s ≥ 2 and one t ≥ 2.
    fn connect_inner<S: Sink>(
        &self,
        connector: &mut Connector<'_, S>,
        light: &[subpath::SubpathVertex],
        sensor: &[subpath::SubpathVertex],
        emitter: u32,
        choice: f32,
    ) {
        let candidates = (2..=light.len())
            .filter(|&s| light[s - 1].connectible)
            .filter_map(|s| connector.inner(&light[..s], sensor));
        match self.connect {
            Connect::Full => {
                for candidate in candidates.collect::<Vec<_>>() {
                    connector.finish_inner(&candidate, light, sensor, emitter, 1.0);
                }
            }
            Connect::One => {
                let candidates: Vec<_> = candidates.collect();
                let total: f64 = candidates.iter().map(|c| c.value.max_channel() as f64).sum();
                let mut x = choice as f64 * total;
                for candidate in &candidates {
                    let share = candidate.value.max_channel() as f64;
                    if x < share {
                        let scale = (total / share) as f32;
                        connector.finish_inner(candidate, light, sensor, emitter, scale);
                        return;
                    }
                    x -= share;
                }
            }
        }
    }
}
