//! Radiosity: the deterministic answer of finite elements (Goral, Torrance, Greenberg & Battaile
//! 1984).
//!
//! Between diffuse surfaces the rendering equation is B = E + ρKB for one number a point and
//! channel. It is discretised with constant elements (Galerkin): B_i = E_i + ρ_i Σ_j F_ij B_j, A_i
//! F_ij = ∬ G V/π. Neumann's series of it is solved bounce by bounce, so that path lengths come
//! apart as in every other integrator: what is seen of B⁽ᵏ⁾/π is the contribution of paths of k + 1
//! edges.
//!
//! | step | where |
//! | --- | --- |
//! | cells of all surfaces, a side each | [`elements`](Mesh) |
//! | how they are cut | `grid` |
//! | which parts light can reach | `open` |
//! | form factors | [`factors`] |
//! | form factors once more, by rays, to hold them to | [`traced_row`] |
//! | B⁽ᵏ⁾ | [`System`] |
//! | camera rays that read it | [`RadiosityIntegrator`] |
//!
//! The only randomness left is where in a pixel a camera ray begins. What remains of finite
//! elements is a systematic error that falls with their edges; `pathspace-validation` extrapolates
//! it.

mod elements;
pub mod factors;
mod grid;
mod open;
pub mod sequence;
mod solve;
mod traced;

pub use elements::{Element, Mesh};
pub use solve::{Radiosity, System};
pub use traced::traced_row;

use std::f64::consts::FRAC_1_PI;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use pathspace_core::Scene;
use pathspace_core::bsdf::TransportMode;
use pathspace_core::color::Rgb;
use pathspace_core::film::{Contribution, Families, Sink};
use pathspace_core::integrator::{
    Integrator, IntegratorError, MonteCarlo, PathEstimator, Run, State,
};
use pathspace_core::path::{Origin, WalkClass};
use pathspace_core::random::PrimarySample;

use crate::spec::{Defaults, Spec, SpecError};

/// Every emitter of a scene that is not refused.
const LAMP: Origin = Origin { delta: false, far: false };

/// Name in the registry.
pub const NAME: &str = "radiosity";

/// How a scene is discretised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Edge of elements as a fraction of the radius of the scene's bounding sphere; `None`: from
    /// `elements`.
    pub h: Option<f64>,
    /// About how many elements, both sides of surfaces counted together.
    pub elements: u32,
    /// How often the edges of that mesh are halved: every cell into four, so that meshes of 0, 1,
    /// 2, … halvings are nested.
    pub halvings: u32,
    /// Samples along the edge of an element for form factors.
    pub samples: u32,
    /// Largest matrix in MiB.
    pub memory: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Settings { h: None, elements: 1500, halvings: 0, samples: 3, memory: 1024 }
    }
}

impl Settings {
    /// Elements whose matrix of `f64` fits the memory.
    fn most_elements(&self) -> u64 {
        ((f64::from(self.memory) * f64::from(1 << 20) / 8.0).sqrt()) as u64
    }

    /// Edge of an element in the normalised scene before it is halved.
    pub fn edge(&self, scene: &Scene) -> f64 {
        self.h.unwrap_or_else(|| {
            let area: f64 = scene.charts().iter().map(|chart| chart.area()).sum();
            (area / f64::from(self.elements.max(1))).sqrt()
        })
    }
}

/// Why a scene has no solution here.
#[derive(Debug, thiserror::Error, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum SolveError {
    /// The scene has something that is not diffuse.
    #[error("{0}")]
    Refused(String),
    /// The matrix does not fit.
    #[error(
        "{elements} elements are more than the {most} whose matrix fits; use a larger h, fewer elements, or more memory"
    )]
    TooLarge {
        /// Elements there would be.
        elements: u64,
        /// Elements that fit.
        most: u64,
    },
    /// The series does not converge.
    #[error("light is still there after {bounces} bounces; set max_depth")]
    Endless {
        /// Terms of the series.
        bounces: usize,
    },
}

/// A solved scene.
pub struct Solution {
    /// Elements and matrix.
    pub system: System,
    /// B⁽ᵏ⁾ of each emitter: `bounces[emitter][k]`.
    pub bounces: Vec<Vec<Radiosity>>,
}

impl Solution {
    /// Discretises and solves.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn new(
        scene: &Scene,
        settings: &Settings,
        max_length: Option<u32>,
    ) -> Result<Solution, SolveError> {
        let system = System::new(scene, settings)?;
        // A path of k edges has k − 1 bounces.
        let most = max_length.map(|k| k.saturating_sub(1));
        let emitters = 0..scene.emitters().list().len() as u32;
        let bounces = emitters.map(|e| system.bounces(e, most)).collect::<Result<Vec<_>, _>>()?;
        Ok(Solution { system, bounces })
    }

    /// Radiance B⁽ᵏ⁾/π of an element.
    fn radiance(&self, emitter: usize, k: usize, element: usize) -> Rgb {
        let [r, g, b] = self.bounces[emitter][k][element].map(|v| (v * FRAC_1_PI) as f32);
        Rgb::new(r, g, b)
    }
}

/// A solution and the scene it is of.
type Cached = Option<(Weak<Scene>, Arc<Solution>)>;

/// Radiosity as an integrator: camera rays read the solution.
#[derive(Clone, Debug)]
pub struct RadiosityIntegrator {
    /// Discretisation.
    pub settings: Settings,
    /// Longest path in edges.
    pub max_length: Option<u32>,
    spec: String,
    /// Replicates of one scene share one solution.
    cache: Arc<Mutex<CacheCell>>,
}

#[derive(Default)]
struct CacheCell(Cached);

impl std::fmt::Debug for CacheCell {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(if self.0.is_some() { "solved" } else { "unsolved" })
    }
}

impl RadiosityIntegrator {
    /// From options: `elements`, `h`, `samples`, `memory`, `max_depth`.
    ///
    /// # Errors
    /// Where an option is unknown or its value out of range.
    pub fn from_spec(spec: &Spec, defaults: &Defaults) -> Result<Self, SpecError> {
        let mut options = spec.options();
        let default = Settings::default();
        let whole = |v: u64| u32::try_from(v).unwrap_or(u32::MAX);
        let h = options.number("h", 0.0, 0.0..=2.0)?;
        let settings = Settings {
            h: (h > 0.0).then_some(h),
            elements: whole(options.integer("elements", default.elements.into(), 1..=1_000_000)?),
            halvings: 0,
            samples: whole(options.integer("samples", default.samples.into(), 1..=16)?),
            memory: whole(options.integer("memory", default.memory.into(), 1..=1 << 20)?),
        };
        options.used_if("elements", settings.h.is_none(), "h left out")?;
        let max_length = options.max_length(defaults)?;
        options.finish()?;
        let cache = Arc::default();
        Ok(RadiosityIntegrator { settings, max_length, spec: spec.to_string(), cache })
    }

    /// The solution of a scene, computed once.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn solution(&self, scene: &Arc<Scene>) -> Result<Arc<Solution>, SolveError> {
        let mut cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((of, solution)) = &cache.0
            && of.upgrade().is_some_and(|of| Arc::ptr_eq(&of, scene))
        {
            return Ok(solution.clone());
        }
        let solution = Arc::new(Solution::new(scene, &self.settings, self.max_length)?);
        cache.0 = Some((Arc::downgrade(scene), solution.clone()));
        Ok(solution)
    }
}

impl Integrator for RadiosityIntegrator {
    fn name(&self) -> &str {
        NAME
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    /// Of the scenes it does not refuse it sees everything.
    fn families(&self, _: &Scene) -> Families {
        Families::ALL
    }

    fn resume(
        &self,
        scene: Arc<Scene>,
        seed: u64,
        state: &State,
    ) -> Result<Box<dyn Run>, IntegratorError> {
        let solution = self.solution(&scene).map_err(|error| IntegratorError::Refused {
            integrator: NAME.to_owned(),
            reason: error.to_string(),
        })?;
        let reader = Reader { solution, max_length: self.max_length };
        Ok(Box::new(MonteCarlo::new(Arc::new(reader), scene, seed, state.step)))
    }
}

/// Camera rays onto a solution.
struct Reader {
    solution: Arc<Solution>,
    max_length: Option<u32>,
}

impl PathEstimator for Reader {
    fn estimate<U: PrimarySample, S: Sink>(
        &self,
        scene: &Scene,
        pixel: Option<[u32; 2]>,
        u: &mut U,
        sink: &mut S,
    ) {
        if self.max_length == Some(0) {
            return;
        }
        let sensor = scene.sensor();
        let pinhole = sensor.is_pinhole();
        let on_film = u.next2();
        let on_lens = if pinhole { [0.0; 2] } else { u.next2() };
        let sample = sensor.sample(pixel, on_film, on_lens);
        let Some(point) = scene.intersect(&sample.ray) else { return };
        let Some(element) = self.solution.system.mesh.find(&point, -sample.ray.d) else { return };
        for (emitter, terms) in self.solution.bounces.iter().enumerate() {
            let mut class = WalkClass::default();
            for k in 0..terms.len() {
                let families = class.families(TransportMode::Radiance, LAMP, pinhole);
                class.push(true);
                let value = self.solution.radiance(emitter, k, element);
                if value.is_black() {
                    continue;
                }
                sink.add(Contribution {
                    film: sample.film,
                    value,
                    weight: 1.0,
                    s: 0,
                    t: u16::try_from(k + 2).unwrap_or(u16::MAX),
                    emitter: emitter as u32,
                    families,
                });
            }
        }
    }
}
