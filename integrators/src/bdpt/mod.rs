//! Bidirectional path tracing (Lafortune and Willems 1993; Veach and Guibas 1994; Veach 1997,
//! chapter 10).
//!
//! One light subpath and one sensor subpath per sample, every technique (s, t) that their vertices
//! allow, weighted so that Σ w = 1 on the techniques that can make the path.
//!
//! Subpaths grow, are connected and are weighed in [`pathspace_core::walk`]. Here:
//!
//! | step | file |
//! | --- | --- |
//! | one sample: all techniques of two subpaths | `mod` |
//! | connections to a cache of light vertices | `cache` |
//! | one technique alone | `single` |
//! | every technique of two subpaths, each by numbers of its own: starts of chains | `every` |
//! | numbers by which a technique makes a given path | `inverse` |
//! | densities and weights of all techniques of a given path | `shares` |
//! | the same by the code that renders, for tests | `replay` |

mod cache;
mod every;
mod inverse;
mod replay;
mod shares;
mod single;

use std::sync::Arc;

use glam::Vec2;
use pathspace_core::Scene;
use pathspace_core::film::{Families, Sink};
use pathspace_core::integrator::{
    Integrator, IntegratorError, MonteCarlo, PathEstimator, Run, State,
};
use pathspace_core::measure::Mass;
use pathspace_core::mis::Heuristic;
use pathspace_core::path::WalkRules;
use pathspace_core::random::{PrimarySample, Stream};
use pathspace_core::walk::{
    Connection, LightSubpath, SensorSubpath, TechniqueSet, WalkVertex, Walks, always,
    next_event_numbers,
};

use self::cache::CachedRun;
pub use self::every::TechniqueNumbers;
pub use self::inverse::Numbers;
use crate::spec::{Defaults, Options, Spec, SpecError};

/// Name in the registry.
pub const NAME: &str = "bdpt";

/// How the vertices of the two subpaths are connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Connect {
    /// Every pair.
    Full,
    /// For every sensor vertex light vertices from a cache of all light subpaths of the step
    /// (Davidovič et al. 2014), as many as a light subpath has on average.
    Cache,
    /// For every sensor vertex one light vertex, picked in proportion to the unoccluded
    /// contribution: one shadow ray instead of s, unbiased because the picked value is divided by
    /// its probability (resampled importance sampling with one draw).
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
    /// From options: `s`, `t` (ranges), `heuristic` (`beta`, `alpha`), `connect` = full | one |
    /// cache, `roulette`, `max_depth`.
    ///
    /// # Errors
    /// Where an option is unknown or its value out of range.
    pub fn from_spec(spec: &Spec, defaults: &Defaults) -> Result<Self, SpecError> {
        let mut options = spec.options();
        let bdpt = Bdpt::from_options(&mut options, defaults, true)?;
        options.finish()?;
        Ok(Bdpt { spec: spec.to_string(), ..bdpt })
    }

    /// The same for an integrator that has options beside those; a cache of light vertices is no
    /// function of one sample.
    pub(crate) fn from_options(
        options: &mut Options<'_>,
        defaults: &Defaults,
        cache: bool,
    ) -> Result<Self, SpecError> {
        let max_length = options.max_length(defaults)?;
        let connect = [("full", Connect::Full), ("one", Connect::One), ("cache", Connect::Cache)];
        Ok(Bdpt {
            techniques: options.techniques()?,
            heuristic: options.heuristic(Heuristic::Power { beta: 2.0 })?,
            connect: options.choice("connect", if cache { &connect } else { &connect[..2] })?,
            roulette: options.roulette(max_length)?,
            max_length,
            spec: NAME.to_owned(),
        })
    }

    /// All techniques with default options, to start chains of paths.
    pub(crate) fn for_starts(max_length: Option<u32>) -> Self {
        Bdpt {
            techniques: TechniqueSet::ALL,
            heuristic: Heuristic::Power { beta: 2.0 },
            connect: Connect::Full,
            roulette: true,
            max_length,
            spec: NAME.to_owned(),
        }
    }

    /// For chains whose path length is given: every option but `connect` and `roulette`, which is
    /// off.
    pub(crate) fn for_chains(
        options: &mut Options<'_>,
        defaults: &Defaults,
    ) -> Result<Self, SpecError> {
        Ok(Bdpt {
            techniques: options.techniques()?,
            heuristic: options.heuristic(Heuristic::Power { beta: 2.0 })?,
            connect: Connect::Full,
            roulette: false,
            max_length: options.max_length(defaults)?,
            spec: NAME.to_owned(),
        })
    }

    /// The rules of its walks, for the oracle: roulette plays from the first surface vertex or
    /// never.
    pub fn rules(&self) -> WalkRules {
        let rr_depth = if self.roulette { 1 } else { u32::MAX };
        WalkRules { max_length: self.max_length, rr_depth }
    }

    fn walks(&self, scene: &Scene) -> Walks {
        Walks::new(scene, &self.rules(), self.heuristic, self.techniques)
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

    fn sees_media(&self) -> bool {
        true
    }

    fn resume(
        &self,
        scene: Arc<Scene>,
        seed: u64,
        state: &State,
    ) -> Result<Box<dyn Run>, IntegratorError> {
        let bdpt = Arc::new(self.clone());
        Ok(match self.connect {
            Connect::Cache => Box::new(CachedRun::new(bdpt, scene, seed, state.step)),
            _ => Box::new(MonteCarlo::new(bdpt, scene, seed, state.step)),
        })
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
        let walks = self.walks(scene);
        u.stream(Stream::Sensor);
        let mut sensor = walks.sensor_subpath(scene, pixel, u, always);
        let mut sample = Sample { scene, walks: &walks, sink, film: sensor.film };
        u.stream(Stream::Light);
        let light = sample.light_subpath(u, always);
        u.stream(Stream::Lens);
        sample.onto_film(&light, u);
        sample.hit_emitters(&mut sensor);
        // s ≥ 1, t ≥ 2.
        u.stream(Stream::Connection);
        for t in 2..=sensor.vertices.len() {
            let numbers = next_event_numbers(u);
            let choice = if self.connect == Connect::One { u.next() } else { 0.0 };
            let sensor = &sensor.vertices[..t];
            if !sensor[t - 1].connectible || t > walks.max {
                continue;
            }
            sample.next_event(sensor, numbers);
            let last = light.vertices.len().min((walks.max + 1).saturating_sub(t));
            let light = &light.vertices[..last];
            match self.connect {
                Connect::One => sample.inner_one(light, sensor, choice),
                _ => sample.inner_all(light, sensor),
            }
        }
    }
}

/// The techniques of one pair of subpaths, and where their contributions go.
struct Sample<'a, S> {
    scene: &'a Scene,
    walks: &'a Walks,
    sink: &'a mut S,
    film: Vec2,
}

impl<S: Sink> Sample<'_, S> {
    /// A light subpath, with technique t = 0 on the way.
    fn light_subpath<U: PrimarySample>(
        &mut self,
        u: &mut U,
        goes_on: impl FnMut(Mass) -> bool,
    ) -> LightSubpath {
        let walks = self.walks;
        walks.light_subpath(self.scene, u, |light| self.connect(light, &[]), goes_on)
    }

    /// One technique: w f/p where nothing stands between both ends. Visibility comes before the
    /// weight, which costs more.
    fn connect(&mut self, light: &[WalkVertex], sensor: &[WalkVertex]) {
        if let Some(connection) = self.walks.connect(self.scene, light, sensor) {
            self.finish(&connection);
        }
    }

    fn finish(&mut self, connection: &Connection<'_>) {
        if connection.is_visible(self.scene) {
            let weight = connection.weight(self.scene, self.walks);
            connection.emit(self.scene, self.sink, self.film, weight, 1.0);
        }
    }

    /// Technique s = 0 for every t.
    fn hit_emitters(&mut self, sensor: &mut SensorSubpath) {
        for t in 2..=sensor.vertices.len() {
            if sensor.vertices[t - 1].vertex.emitter().is_some() {
                self.connect(&[], &sensor.vertices[..t]);
            }
        }
        let (walks, scene) = (self.walks, self.scene);
        walks.on_background(scene, sensor, |sensor| self.connect(&[], sensor));
    }

    /// Technique t = 1 for every s.
    fn onto_film<U: PrimarySample>(&mut self, light: &LightSubpath, u: &mut U) {
        for s in 1..=light.vertices.len().min(self.walks.max) {
            let on_lens = self.walks.lens(u);
            if light.vertices[s - 1].connectible {
                self.onto_lens(&light.vertices[..s], on_lens);
            }
        }
    }

    /// Technique (s, 1) with a point of the lens.
    fn onto_lens(&mut self, light: &[WalkVertex], on_lens: [f32; 2]) {
        let (vertex, pdf) = self.scene.sensor().sample_vertex(on_lens);
        self.connect(light, &[WalkVertex::on_lens(vertex, pdf)]);
    }

    /// Technique s = 1: x₀ is sampled for the last vertex of `sensor`.
    fn next_event(&mut self, sensor: &[WalkVertex], (pick, on_emitter): (f32, [f32; 2])) {
        let takes_part = self.walks.light.weights.techniques.contains(1, sensor.len());
        let Some(p) = sensor.last().and_then(|z| z.vertex.position()) else { return };
        if takes_part && let Some(direct) = self.scene.sample_direct(p, pick, on_emitter) {
            self.connect(&[WalkVertex::next_event(self.scene, &direct)], sensor);
        }
    }

    /// Techniques (s, t) for every s ≥ 2 and one t ≥ 2.
    fn inner_all(&mut self, light: &[WalkVertex], sensor: &[WalkVertex]) {
        for s in 2..=light.len() {
            self.connect(&light[..s], sensor);
        }
    }

    /// The same sum estimated by one of its terms, picked in proportion to its unoccluded
    /// contribution.
    fn inner_one(&mut self, light: &[WalkVertex], sensor: &[WalkVertex], choice: f32) {
        let candidates: Vec<_> = (2..=light.len())
            .filter_map(|s| self.walks.connect(self.scene, &light[..s], sensor))
            .map(|connection| (connection, connection.weight(self.scene, self.walks)))
            .collect();
        let share = |(c, w): &(Connection<'_>, f64)| f64::from((c.value * *w as f32).max_channel());
        let total: f64 = candidates.iter().map(share).sum();
        let mut x = choice as f64 * total;
        for candidate in &candidates {
            if x < share(candidate) {
                let (connection, weight) = candidate;
                if connection.is_visible(self.scene) {
                    let factor = (total / share(candidate)) as f32;
                    connection.emit(self.scene, self.sink, self.film, *weight, factor);
                }
                return;
            }
            x -= share(candidate);
        }
    }
}
