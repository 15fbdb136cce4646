//! Means of the film as finite elements see it, at three mesh sizes.

use pathspace_core::color::luminance;
use pathspace_core::description::SceneDescription;
use pathspace_core::film::Families;
use pathspace_core::path::WalkRules;
use pathspace_core::{Scene, SceneError};
use pathspace_integrators::radiosity::{Settings, Solution, SolveError};
use rayon::prelude::*;

use super::Extrapolated;
use crate::exact::{ExactLength, ExactScene};

/// Camera rays a pixel and direction, on a regular grid: the mean over a pixel is no Monte Carlo here.
const GRID: u32 = 8;

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
    /// Means over a lens are not implemented.
    #[error("the sensor has a lens; finite elements are read by a pinhole")]
    Lens,
}

/// Mean luminance over the film of paths of 1, 2, …, `lengths` edges, for elements of edges h, h/2 and h/4 (fractions of the
/// radius of the scene's bounding sphere): `[level][length − 1]`.
///
/// # Errors
/// [`FeError`].
pub fn levels(
    scene: &Scene,
    lengths: u32,
    h: f64,
    settings: &Settings,
) -> Result<[Vec<f64>; 3], FeError> {
    let mut out: [Vec<f64>; 3] = Default::default();
    for (level, out) in out.iter_mut().enumerate() {
        let h = h / f64::from(1_u32 << level);
        let solution = Solution::new(scene, &Settings { h: Some(h), ..*settings }, Some(lengths))?;
        *out = means(scene, &solution, lengths)?;
    }
    Ok(out)
}

/// Mean luminance over the film of each length.
fn means(scene: &Scene, solution: &Solution, lengths: u32) -> Result<Vec<f64>, FeError> {
    let sensor = scene.sensor();
    if !sensor.is_pinhole() {
        return Err(FeError::Lens);
    }
    let crop = scene.film().crop;
    let n = solution.system.len();
    // How much of the film each element fills.
    let rows: Vec<Vec<u32>> = (0..crop.height)
        .into_par_iter()
        .map(|y| {
            let mut counts = vec![0_u32; n];
            for x in 0..crop.width {
                for k in 0..GRID * GRID {
                    let place = |i: u32| (i as f32 + 0.5) / GRID as f32;
                    let on_film = [place(k % GRID), place(k / GRID)];
                    let pixel = Some([crop.x + x, crop.y + y]);
                    let ray = sensor.sample(pixel, on_film, [0.0; 2]).ray;
                    let element =
                        scene.intersect(&ray).and_then(|p| solution.system.mesh.find(&p, -ray.d));
                    if let Some(element) = element {
                        counts[element] += 1;
                    }
                }
            }
            counts
        })
        .collect();
    let all = f64::from(crop.width) * f64::from(crop.height) * f64::from(GRID * GRID);
    let share: Vec<f64> =
        (0..n).map(|i| rows.iter().map(|r| f64::from(r[i])).sum::<f64>() / all).collect();
    let mean = |k: usize| {
        let terms = solution.bounces.iter().filter_map(|terms| terms.get(k));
        terms
            .map(|b| {
                let seen = share.iter().zip(b).map(|(w, b)| w * luminance(b));
                seen.sum::<f64>() / std::f64::consts::PI
            })
            .sum()
    };
    Ok((0..lengths as usize).map(mean).collect())
}

/// Three levels as a scene with known answers for 1, 2, … edges, each with its uncertainty.
pub fn scene_of(
    name: &'static str,
    description: SceneDescription,
    [coarse, middle, fine]: &[Vec<f64>; 3],
) -> ExactScene {
    let seen = Families::S0 | Families::S1 | Families::INNER | Families::T1;
    let expected: Vec<ExactLength> = (0..fine.len())
        .map(|k| {
            let e = Extrapolated::new([coarse[k], middle[k], fine[k]]);
            let families = if k == 0 { Families::S0 | Families::T1 } else { seen };
            ExactLength {
                uncertainty: e.uncertainty,
                ..ExactLength::new(k as u32 + 1, e.value, families)
            }
        })
        .collect();
    let rules = WalkRules { max_length: Some(fine.len() as u32), rr_depth: u32::MAX };
    ExactScene { name, description, rules, expected }
}
