//! B = E + ρKB, bounce by bounce: B⁽⁰⁾ = πL_e, B⁽ᵏ⁺¹⁾_i = ρ_i Σ_j F_ij B⁽ᵏ⁾_j.

use std::f64::consts::PI;

use pathspace_core::Scene;
use pathspace_core::emitter::Emitter;
use rayon::prelude::*;

use super::elements::Mesh;
use super::{Settings, SolveError, factors, open};

/// What is left of the series when it ends, relative to its sum.
const REST: f64 = 1e-7;
/// Bounces after which a series that has not ended is refused.
const MOST_BOUNCES: usize = 2000;

/// Radiosity of every element, three channels.
pub type Radiosity = Vec<[f64; 3]>;

/// Elements and what they exchange.
pub struct System {
    /// The elements, those alone that light can reach.
    pub mesh: Mesh,
    /// A_i F_ij over the open parts, row by row; symmetric.
    pub exchange: Vec<f64>,
}

impl System {
    /// Meshes the surfaces of a scene and integrates the form factors.
    ///
    /// # Errors
    /// Where something is not diffuse, an emitter is no surface, or the matrix would be too large.
    pub fn new(scene: &Scene, settings: &Settings) -> Result<System, SolveError> {
        if let Some(emitter) = scene.emitters().list().iter().find(|e| !is_area(e)) {
            let what = name_of(emitter);
            return Err(SolveError::Refused(format!("{what} is not a surface")));
        }
        let most = settings.most_elements();
        // Sides that no light reaches are dropped, so there may be more cells than elements.
        let mut mesh = Mesh::new(scene, settings, 4 * most)?;
        open::mark(scene, &mut mesh);
        mesh.drop_closed();
        let elements = mesh.elements.len() as u64;
        if elements > most {
            return Err(SolveError::TooLarge { elements, most });
        }
        let exchange = factors::matrix(scene, &mesh);
        Ok(System { mesh, exchange })
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.mesh.elements.len()
    }

    /// True without elements: a dark scene.
    pub fn is_empty(&self) -> bool {
        self.mesh.elements.is_empty()
    }

    /// F_ij.
    pub fn form_factor(&self, i: usize, j: usize) -> f64 {
        self.exchange[i * self.len() + j] / self.mesh.elements[i].open_area()
    }

    /// πL_e of one emitter.
    pub fn emission(&self, emitter: u32) -> Radiosity {
        self.mesh
            .elements
            .iter()
            .map(|e| match e.emission {
                Some((index, radiance)) if index == emitter => {
                    std::array::from_fn(|c| f64::from(radiance[c]) * PI)
                }
                _ => [0.0; 3],
            })
            .collect()
    }

    /// ρKB.
    pub fn reflect(&self, b: &Radiosity) -> Radiosity {
        let n = self.len();
        let row = |(i, row): (usize, &[f64])| {
            let mut sum = [0.0; 3];
            for (s, b) in row.iter().zip(b) {
                for c in 0..3 {
                    sum[c] += s * b[c];
                }
            }
            let element = &self.mesh.elements[i];
            let (rho, area) = (element.reflectance, element.open_area());
            std::array::from_fn(|c| f64::from(rho[c]) * sum[c] / area)
        };
        self.exchange.par_chunks(n.max(1)).enumerate().map(row).collect()
    }

    /// Neumann's series of one emitter: B⁽ᵏ⁾ for k = 0, 1, …, of `max_bounces` reflections at most;
    /// without a limit, until the power that is left is a ten-millionth of the sum.
    ///
    /// # Errors
    /// Where the series does not end in 2000 terms: a closed room that reflects everything.
    pub fn bounces(
        &self,
        emitter: u32,
        max_bounces: Option<u32>,
    ) -> Result<Vec<Radiosity>, SolveError> {
        let power = |b: &Radiosity| -> f64 {
            let areas = self.mesh.elements.iter().map(|e| e.open_area());
            areas.zip(b).map(|(a, b)| a * (b[0] + b[1] + b[2])).sum()
        };
        let mut terms = vec![self.emission(emitter)];
        let mut total = power(&terms[0]);
        let mut last = total;
        while max_bounces.is_none_or(|most| terms.len() <= most as usize) && last > 0.0 {
            let next = self.reflect(&terms[terms.len() - 1]);
            let now = power(&next);
            total += now;
            // A geometric series with the present ratio bounds what is left.
            let ratio = now / last;
            last = now;
            terms.push(next);
            if ratio < 1.0 && now * ratio / (1.0 - ratio) <= REST * total {
                break;
            }
            if terms.len() > MOST_BOUNCES && max_bounces.is_none() {
                return Err(SolveError::Endless { bounces: MOST_BOUNCES });
            }
        }
        Ok(terms)
    }

    /// Solves (1 − ρF) B = E by Gauss and Seidel's iteration until the largest change is
    /// `tolerance` of the largest radiosity. `None` where 10⁴ sweeps do not get there.
    pub fn gauss_seidel(&self, e: &Radiosity, tolerance: f64) -> Option<Radiosity> {
        let n = self.len();
        let mut b = e.clone();
        for _ in 0..10_000 {
            let (mut change, mut largest) = (0.0_f64, 0.0_f64);
            for i in 0..n {
                let element = &self.mesh.elements[i];
                let row = &self.exchange[i * n..(i + 1) * n];
                for c in 0..3 {
                    let received: f64 = row.iter().zip(&b).map(|(s, b)| s * b[c]).sum();
                    let new = e[i][c]
                        + f64::from(element.reflectance[c]) * received / element.open_area();
                    change = change.max((new - b[i][c]).abs());
                    largest = largest.max(new.abs());
                    b[i][c] = new;
                }
            }
            if change <= tolerance * largest {
                return Some(b);
            }
        }
        None
    }
}

/// An emitter in words.
fn name_of(emitter: &Emitter) -> &'static str {
    match emitter {
        Emitter::Area { .. } => "an area light",
        Emitter::Point { .. } => "a point light",
        Emitter::Beam { .. } => "a spot light or projector",
        Emitter::Directional { .. } => "a directional light",
        Emitter::Constant { .. } => "a constant environment",
        Emitter::Environment { .. } => "an environment map",
    }
}

fn is_area(emitter: &Emitter) -> bool {
    matches!(emitter, Emitter::Area { .. })
}
