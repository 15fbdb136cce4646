//! Bidirectional path tracing (Lafortune and Willems 1993; Veach and Guibas 1994; Veach 1997, chapter 10).
//!
//! One light subpath and one sensor subpath per sample, every technique (s, t) that their vertices allow, weighted so that Σ w = 1 on the
//! techniques that can make the path.
//!
//! | step | file |
//! | --- | --- |
//! | one walk and its densities | `subpath` |
//! | both subpaths of a sample, and the techniques that need one of them | `walks` |
//! | the techniques | `connect` |
//! | connections to a cache of light vertices | `cache` |
//! | one technique alone | `single` |
//! | every technique of two subpaths, each by numbers of its own: starts of chains | `every` |
//! | numbers by which a technique makes a given path | `inverse` |
//! | densities and weights of all techniques of a given path | `shares` |
//! | the same by the code that renders, for tests | `replay` |
//! | debug builds check weights against the oracle | `verify` |
//! | weights, O(1) per connection | `weight` |
//! | which techniques take part | `techniques` |

mod cache;
mod connect;
mod every;
mod inverse;
mod replay;
mod shares;
mod single;
mod subpath;
mod techniques;
mod verify;
mod walks;
mod weight;

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::film::{Families, Sink};
use pathspace_core::integrator::{
    Integrator, IntegratorError, MonteCarlo, PathEstimator, Run, State,
};
use pathspace_core::mis::Heuristic;
use pathspace_core::path::WalkRules;
use pathspace_core::random::{PrimarySample, Stream};

use self::cache::CachedRun;
pub use self::every::TechniqueNumbers;
pub use self::inverse::Numbers;
pub use self::techniques::TechniqueSet;
use self::walks::{Walks, always};
use crate::spec::{Defaults, Options, Spec, SpecError};

/// Name in the registry.
pub const NAME: &str = "bdpt";

/// How the vertices of the two subpaths are connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Connect {
    /// Every pair.
    Full,
    /// For every sensor vertex light vertices from a cache of all light subpaths of the step (Davidovič et al. 2014), as many as a
    /// light subpath has on average.
    Cache,
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
    /// From options: `s`, `t` (ranges), `heuristic` (`beta`, `alpha`), `connect` = full | one | cache, `roulette`, `max_depth`.
    ///
    /// # Errors
    /// Where an option is unknown or its value out of range.
    pub fn from_spec(spec: &Spec, defaults: &Defaults) -> Result<Self, SpecError> {
        let mut options = spec.options();
        let bdpt = Bdpt::from_options(&mut options, defaults, true)?;
        options.finish()?;
        Ok(Bdpt { spec: spec.to_string(), ..bdpt })
    }

    /// The same for an integrator that has options beside those; a cache of light vertices is no function of one sample.
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

    /// For chains whose path length is given: every option but `connect` and `roulette`, which is off.
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

    /// The rules of its walks, for the oracle: roulette plays from the first surface vertex or never.
    pub fn rules(&self) -> WalkRules {
        let rr_depth = if self.roulette { 1 } else { u32::MAX };
        WalkRules { max_length: self.max_length, rr_depth }
    }

    fn walks(&self, scene: &Scene) -> Walks {
        Walks::new(self, scene)
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
        let mut connector = walks.connector(scene, sink, sensor.film);
        u.stream(Stream::Light);
        let light = walks.light_subpath(&mut connector, u, always);
        u.stream(Stream::Lens);
        walks.onto_film(&mut connector, &light, u);
        walks.hit_emitters(&mut connector, &mut sensor);
        // s ≥ 1, t ≥ 2.
        u.stream(Stream::Connection);
        for t in 2..=sensor.vertices.len() {
            let (pick, on_emitter) = (u.next(), u.next2());
            let choice = if self.connect == Connect::One { u.next() } else { 0.0 };
            let sensor = &sensor.vertices[..t];
            if !sensor[t - 1].connectible || t > walks.max {
                continue;
            }
            connector.next_event(sensor, pick, on_emitter);
            let last = light.vertices.len().min((walks.max + 1).saturating_sub(t));
            match self.connect {
                Connect::One => {
                    connector.inner_one(&light.vertices[..last], sensor, light.emitter, choice);
                }
                _ => connector.inner_all(&light.vertices[..last], sensor, light.emitter),
            }
        }
    }
}
