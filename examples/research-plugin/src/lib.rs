//! Vertex connection and merging (Georgiev, Křivánek, Davidovič and Slusallek 2012, "Light
//! transport simulation with vertex connection and merging"; as "unified path space", Hachisuka,
//! Pantaleoni and Jensen 2012), as a plug-in that sees nothing of pathspace but its public items.
//!
//! Bidirectional path tracing connects the ends of a light and a sensor subpath; photon mapping
//! merges them where they come near each other. Both are techniques for the same paths, and
//! multiple importance sampling weights them together: connections are good at diffuse light,
//! merges at caustics seen in mirrors and glass, for which no connection exists.
//!
//! Subpaths, connections and weights are those of [`pathspace::core::walk`]; its recursion of
//! weights has the term of a merge. Here:
//!
//! | step | file |
//! | --- | --- |
//! | merges | `merge` |
//! | light vertices by place | `photons` |
//! | a step: light subpaths, photons, sensor subpaths | `run` |
//!
//! A merged path has x_i on both of its subpaths. Its contribution counts x_i on the sensor's side,
//! where it lies: (s, t) = (i, k − i + 1), so that s + t − 1 is its length and it shares a layer
//! with the connection of x_{i−1} and x_i.

mod merge;
mod photons;
mod run;
#[cfg(test)]
mod tests;

use std::f64::consts::PI;
use std::sync::Arc;

use pathspace::core::Scene;
use pathspace::core::film::Families;
use pathspace::core::integrator::{Integrator, IntegratorError, Run, State};
use pathspace::core::path::WalkRules;
use pathspace::core::walk::{Walks, Weights};
use pathspace::integrators::{Defaults, Spec, SpecError};

use crate::run::VcmRun;

/// Name in the registry.
pub const NAME: &str = "vcm";

/// Vertex connection and merging.
#[derive(Clone, Debug)]
pub struct Vcm {
    /// Radius of the first step, where the bounding sphere of the scene has radius 1.
    pub first_radius: f64,
    /// α: how fast the radius shrinks.
    pub alpha: f64,
    /// Merges take part.
    pub merge: bool,
    /// Connections (s, t ≥ 1) take part.
    pub connect: bool,
    /// Longest path in edges; `None` is unlimited.
    pub max_length: Option<u32>,
    /// β of the heuristic.
    power: f64,
    spec: String,
}

impl Vcm {
    /// From options: `radius`, `alpha`, `merge`, `connect`, `heuristic` = balance | power,
    /// `max_depth`.
    ///
    /// # Errors
    /// Where an option is unknown or its value out of range.
    pub fn from_spec(spec: &Spec, defaults: &Defaults) -> Result<Self, SpecError> {
        let mut options = spec.options();
        let vcm = Vcm {
            first_radius: options.number("radius", 0.003, 1e-6..=1.0)?,
            alpha: options.number("alpha", 0.75, 0.0..=1.0)?,
            merge: options.boolean("merge", true)?,
            connect: options.boolean("connect", true)?,
            power: options.choice("heuristic", &[("balance", 1.0), ("power", 2.0)])?,
            max_length: options.max_length(defaults)?,
            spec: spec.to_string(),
        };
        options.finish()?;
        Ok(vcm)
    }

    /// r_i = r_1 i^((α−1)/2) of step i − 1 (Georgiev et al. 2012, eq. 18; Knaus and Zwicker 2011),
    /// not below what positions in `f32` resolve.
    fn radius(&self, step: u64) -> f64 {
        let i = step as f64 + 1.0;
        (self.first_radius * i.powf(0.5 * (self.alpha - 1.0))).max(1e-7)
    }

    /// η = N π r² of a step with `n` light subpaths (Georgiev 2012, eq. 20); 0 where merges take no
    /// part.
    fn eta(&self, n: u64, radius: f64) -> f64 {
        if self.merge { n as f64 * PI * radius * radius } else { 0.0 }
    }

    /// Walks of a step. Roulette plays at every surface and depends on the event alone, so that
    /// both walks know each other's.
    fn walks(&self, scene: &Scene, eta: f64) -> Walks {
        let rules = WalkRules { max_length: self.max_length, rr_depth: 1 };
        Walks::weighed(scene, &rules, Weights::with_merges(self.power, self.connect, eta))
    }
}

impl Integrator for Vcm {
    fn name(&self) -> &str {
        NAME
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn families(&self, _: &Scene) -> Families {
        Families::S0
            | (Families::S1 | Families::INNER | Families::T1).when(self.connect)
            | Families::MERGE.when(self.merge)
    }

    fn resume(
        &self,
        scene: Arc<Scene>,
        seed: u64,
        state: &State,
    ) -> Result<Box<dyn Run>, IntegratorError> {
        Ok(Box::new(VcmRun::new(self.clone(), scene, seed, state.step)))
    }
}
