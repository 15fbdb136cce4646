//! Vertex connection and merging (Georgiev, Křivánek, Davidovič and Slusallek 2012, "Light transport simulation with vertex connection and
//! merging"; as "unified path space", Hachisuka, Pantaleoni and Jensen 2012), as a plug-in that sees nothing of pathspace but its public items.
//!
//! Bidirectional path tracing connects the ends of a light and a sensor subpath; photon mapping merges them where they come near each
//! other. Both are techniques for the same paths, and multiple importance sampling weights them together: connections are good at
//! diffuse light, merges at caustics seen in mirrors and glass, for which no connection exists.
//!
//! | step | file |
//! | --- | --- |
//! | walks and their densities | `subpath` |
//! | connections | `connect` |
//! | merges | `merge` |
//! | light vertices by place | `photons` |
//! | weights of both | `weight` |
//! | a step: light subpaths, photons, sensor subpaths | `run` |
//!
//! A merged path has x_i on both of its subpaths. Its contribution counts x_i on the sensor's side, where it lies: (s, t) = (i, k − i + 1), so
//! that s + t − 1 is its length and it shares a layer with the connection of x_{i−1} and x_i.

mod connect;
mod merge;
mod photons;
mod run;
mod subpath;
#[cfg(test)]
mod tests;
mod weight;

use std::f64::consts::PI;
use std::sync::Arc;

use pathspace::core::Scene;
use pathspace::core::film::Families;
use pathspace::core::integrator::{Integrator, IntegratorError, Run, State};
use pathspace::integrators::{Defaults, Spec, SpecError};

use crate::run::VcmRun;
use crate::subpath::Walks;
use crate::weight::{Exponent, Weights};

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
    exponent: Exponent,
    spec: String,
}

impl Vcm {
    /// From options: `radius`, `alpha`, `merge`, `connect`, `heuristic` = balance | power, `max_depth`.
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
            exponent: options.choice(
                "heuristic",
                &[("balance", Exponent::Balance), ("power", Exponent::Power)],
            )?,
            max_length: options.max_length(defaults)?,
            spec: spec.to_string(),
        };
        options.finish()?;
        Ok(vcm)
    }

    /// r_i = r_1 i^((α−1)/2) of step i − 1 (Georgiev et al. 2012, eq. 18; Knaus and Zwicker 2011), not below what positions in `f32` resolve.
    fn radius(&self, step: u64) -> f64 {
        let i = step as f64 + 1.0;
        (self.first_radius * i.powf(0.5 * (self.alpha - 1.0))).max(1e-7)
    }

    /// Walks of a step with `n` light subpaths.
    fn walks<'a>(&self, scene: &'a Scene, n: u64, radius: f64) -> Walks<'a> {
        let eta = if self.merge { n as f64 * PI * radius * radius } else { 0.0 };
        Walks {
            scene,
            weights: Weights { exponent: self.exponent, connect: self.connect, eta },
            max_length: self.max_length.map_or(usize::MAX / 4, |k| k as usize),
        }
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
