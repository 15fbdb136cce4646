//! Checks on a discretised scene: the direct solution, reciprocity, row sums.

use faer::Mat;
use faer::prelude::Solve;
use pathspace_integrators::radiosity::{Radiosity, System};

/// Solves (1 − ρF) B = E by elimination with partial pivots. What Neumann's series and Gauss and
/// Seidel's iteration must come to.
///
/// # Errors
/// Where B comes out not finite: the matrix is singular.
pub fn solve_directly(system: &System, e: &Radiosity) -> Result<Radiosity, NotSolved> {
    let n = system.len();
    let mut out = vec![[0.0; 3]; n];
    for c in 0..3 {
        let matrix = Mat::from_fn(n, n, |i, j| {
            let rho = f64::from(system.mesh.elements[i].reflectance[c]);
            f64::from(u8::from(i == j)) - rho * system.form_factor(i, j)
        });
        let right = Mat::from_fn(n, 1, |i, _| e[i][c]);
        let b = matrix.partial_piv_lu().solve(&right);
        for (i, out) in out.iter_mut().enumerate() {
            out[c] = b[(i, 0)];
        }
    }
    if out.iter().flatten().all(|b| b.is_finite()) { Ok(out) } else { Err(NotSolved) }
}

/// The matrix is singular.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the matrix 1 − ρF is singular")]
pub struct NotSolved;

/// How far form factors are from what they must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Defects {
    /// Largest |A_i F_ij − A_j F_ji| over the largest A_i F_ij.
    pub reciprocity: f64,
    /// Smallest Σ_j F_ij.
    pub least_row: f64,
    /// Largest Σ_j F_ij: at most 1, and 1 in a closed room.
    pub largest_row: f64,
    /// Root mean square of Σ_j F_ij − 1, by area: small in a closed room.
    pub row: f64,
}

/// Reciprocity and row sums of a discretised scene.
pub fn defects(system: &System) -> Defects {
    let n = system.len();
    let area = |i: usize| system.mesh.elements[i].open_area();
    let (mut largest, mut difference) = (0.0_f64, 0.0_f64);
    for i in 0..n {
        for j in 0..n {
            let (a, b) = (area(i) * system.form_factor(i, j), area(j) * system.form_factor(j, i));
            largest = largest.max(a);
            difference = difference.max((a - b).abs());
        }
    }
    let rows: Vec<f64> = (0..n).map(|i| (0..n).map(|j| system.form_factor(i, j)).sum()).collect();
    let total: f64 = (0..n).map(area).sum();
    let square: f64 = rows.iter().enumerate().map(|(i, r)| area(i) * (r - 1.0).powi(2)).sum();
    Defects {
        reciprocity: difference / largest,
        least_row: rows.iter().copied().fold(f64::INFINITY, f64::min),
        largest_row: rows.iter().copied().fold(0.0, f64::max),
        row: (square / total).sqrt(),
    }
}
