//! Means of the film as finite elements see it, at three mesh sizes.

use std::f64::consts::FRAC_1_PI;

use pathspace_core::color::luminance;
use pathspace_core::description::SceneDescription;
use pathspace_core::film::Families;
use pathspace_core::path::WalkRules;
use pathspace_core::random::{Address, PrimarySample, RandomStream};
use pathspace_core::{Scene, SceneError};
use pathspace_integrators::radiosity::sequence::r2;
use pathspace_integrators::radiosity::{Settings, Solution, SolveError};
use rayon::prelude::*;

use super::Extrapolated;
use crate::exact::{ExactLength, ExactScene};
use crate::stats::{Moments, StatsError};

/// Camera rays of one shift of the sequence that covers the film.
const RAYS: u32 = 1 << 19;
/// Independent shifts, whose spread is the standard error.
const SHIFTS: u32 = 16;
/// Standard errors of the mean over the film that the uncertainty allows for: less than one in a
/// hundred of Student's t with 15 degrees of freedom is larger.
const SIGMAS: f64 = 3.0;
/// Camera rays of a work item, at least.
const ITEM: usize = 1 << 14;

/// Why there is no finite-element answer.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FeError {
    /// The scene is not one.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// It can not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// A mean over the film is not finite.
    #[error(transparent)]
    Statistics(#[from] StatsError),
    /// Means over a lens are not implemented.
    #[error("the sensor has a lens; finite elements are read by a pinhole")]
    Lens,
}

/// Means over the film at three mesh sizes.
#[derive(Clone, Debug, PartialEq)]
pub struct Levels {
    /// Mean luminance of paths of 1, 2, … edges, for elements of edges h, h/2 and h/4:
    /// `means[level][length − 1]`.
    pub means: [Vec<f64>; 3],
    /// Standard error of the mean over the film at h/4, by length: camera rays are samples.
    pub error: Vec<f64>,
    /// By how much the mean at h/2 changes with one more sample along the edge of an element for
    /// form factors, by length.
    pub quadrature: Vec<f64>,
}

impl Levels {
    /// Paths of 1, 2, …, `lengths` edges for elements of edges h, h/2 and h/4 (fractions of the
    /// radius of the scene's bounding sphere).
    ///
    /// # Errors
    /// [`FeError`].
    pub fn new(
        scene: &Scene,
        lengths: u32,
        h: f64,
        settings: &Settings,
    ) -> Result<Levels, FeError> {
        let nested = [0, 1, 2].map(|halvings| Settings { h: Some(h), halvings, ..*settings });
        let control = Settings { samples: settings.samples + 1, ..nested[1] };
        let solutions = nested
            .iter()
            .chain([&control])
            .map(|settings| Ok(Solution::new(scene, settings, Some(lengths))?))
            .collect::<Result<Vec<_>, FeError>>()?;
        let seen = means(scene, &solutions, lengths)?;
        let of = |solution: usize| seen[solution].iter().map(|m| m.mean).collect::<Vec<_>>();
        let means = [0, 1, 2].map(of);
        let quadrature = means[1].iter().zip(of(3)).map(|(a, b)| (a - b).abs()).collect();
        let error = seen[2].iter().map(|m| m.squared_error().sqrt()).collect();
        Ok(Levels { means, error, quadrature })
    }

    /// The limit of paths of `length` edges. Its uncertainty is that of the extrapolation, and
    /// three standard errors of the mean over the film, and what one more sample for form factors
    /// has changed.
    pub fn extrapolated(&self, length: usize) -> Extrapolated {
        let k = length - 1;
        let limit = Extrapolated::new([0, 1, 2].map(|level: usize| self.means[level][k]));
        let uncertainty = limit.uncertainty + SIGMAS * self.error[k] + self.quadrature[k];
        Extrapolated { uncertainty, ..limit }
    }
}

/// Moments over shifts of mean luminances over the film, `[solution][length − 1]`. All solutions
/// are read by the same camera rays.
fn means(
    scene: &Scene,
    solutions: &[Solution],
    lengths: u32,
) -> Result<Vec<Vec<Moments>>, FeError> {
    let sensor = scene.sensor();
    if !sensor.is_pinhole() {
        return Err(FeError::Lens);
    }
    let crop = scene.film().crop;
    let camera = |shift: [f64; 2], k: u32| {
        // One sequence over the whole window: a grid would see a thin lamp as a whole number of its
        // lines.
        let [x, y] = r2(k, shift);
        let (x, y) = (x * f64::from(crop.width), y * f64::from(crop.height));
        let column = (x as u32).min(crop.width - 1);
        let row = (y as u32).min(crop.height - 1);
        let on_film = [(x - f64::from(column)) as f32, (y - f64::from(row)) as f32];
        sensor.sample(Some([crop.x + column, crop.y + row]), on_film, [0.0; 2]).ray
    };
    // How many of the rays of a shift see each element: whole numbers, in any order the same.
    let counts = |shift: [f64; 2]| -> Vec<Vec<u32>> {
        let none = || solutions.iter().map(|s| vec![0; s.system.len()]).collect::<Vec<Vec<u32>>>();
        let see = |mut counts: Vec<Vec<u32>>, k: u32| {
            let ray = camera(shift, k);
            if let Some(point) = scene.intersect(&ray) {
                for (solution, counts) in solutions.iter().zip(&mut counts) {
                    if let Some(element) = solution.system.mesh.find(&point, -ray.d) {
                        counts[element] += 1;
                    }
                }
            }
            counts
        };
        let add = |mut a: Vec<Vec<u32>>, b: Vec<Vec<u32>>| {
            a.iter_mut().flatten().zip(b.iter().flatten()).for_each(|(a, b)| *a += b);
            a
        };
        (0..RAYS).into_par_iter().with_min_len(ITEM).fold(none, see).reduce(none, add)
    };
    let mut means = vec![vec![Vec::new(); lengths as usize]; solutions.len()];
    for shift in 0..SHIFTS {
        let mut u = RandomStream::new(Address { seed: 0, step: 0, item: shift.into() });
        let counts = counts(u.next2().map(f64::from));
        for ((solution, counts), means) in solutions.iter().zip(&counts).zip(&mut means) {
            for (k, means) in means.iter_mut().enumerate() {
                let terms = solution.bounces.iter().filter_map(|terms| terms.get(k));
                let seen = terms.map(|b| -> f64 {
                    counts.iter().zip(b).map(|(n, b)| f64::from(*n) * luminance(b)).sum()
                });
                means.push(seen.sum::<f64>() * FRAC_1_PI / f64::from(RAYS));
            }
        }
    }
    let of_lengths = |means: Vec<Vec<f64>>| means.iter().map(|m| Moments::of(m)).collect();
    Ok(means.into_iter().map(of_lengths).collect::<Result<_, StatsError>>()?)
}

/// Three levels as a scene with known answers for 1, 2, … edges, each with its uncertainty.
pub fn scene_of(name: &'static str, description: SceneDescription, levels: &Levels) -> ExactScene {
    let seen = Families::S0 | Families::S1 | Families::INNER | Families::T1;
    let lengths = levels.error.len();
    let expected: Vec<ExactLength> = (1..=lengths)
        .map(|length| {
            let e = levels.extrapolated(length);
            let families = if length == 1 { Families::S0 | Families::T1 } else { seen };
            ExactLength {
                uncertainty: e.uncertainty,
                ..ExactLength::new(length as u32, e.value, families)
            }
        })
        .collect();
    let rules = WalkRules { max_length: Some(lengths as u32), rr_depth: u32::MAX };
    ExactScene { name, description, rules, expected }
}
