//! The manifold perturbation (Jakob and Marschner 2012, "Manifold Exploration"): suffixes (D|L) S⁺
//! D S* E.
//!
//! The film position moves and the walk goes to the first non-specular vertex x_b, as in the lens
//! perturbation. From there the specular vertices x_{b−1} … x_{c+1} are found again that lead to
//! x_c, which stays: a Newton walk on the manifold of paths that obey the laws of reflection and
//! refraction. So light from the smallest of sources stays in a chain through glass and mirrors.
//!
//! | step | file |
//! | --- | --- |
//! | the constraints and their Jacobian | `constraint` |
//! | the walk | `newton` |
//! | linear equations | `linear` |
//!
//! The walk makes the specular vertices out of x_b and x_c without any choice. The delta function
//! of a vertex is δ²(C_i), C_i the projection of the generalised half vector n_c ω_c + n_l ω_l on
//! the shading plane, the same as for every other density (n² dσ⊥ is the area of that projection).
//! So the density of the specular vertices is |det ∂(C_{b−1} … C_{c+1})/∂(x_{b−1} … x_{c+1})|,
//! relative to those delta functions.

mod constraint;
mod linear;
mod newton;

use pathspace_core::Scene;
use pathspace_core::bsdf::{Component, Event};
use pathspace_core::path::{Path, Vertex};
use pathspace_core::random::RandomStream;
use pathspace_core::scene::SurfacePoint;

use self::constraint::ln_chain_density;
use super::mutator::{Candidate, Kept, Mutator};
use super::path::MltPath;
use super::perturb::{Plan, SensorSide, Sizes, same_kind};

/// Longest chain of specular vertices that is walked.
const MAX_CHAIN: usize = 8;

/// Chains found on the way there and on the way back are one where their vertices differ by less
/// than this part of the distance of their ends: solutions have the accuracy of `f32` positions.
const SAME: f64 = 2e-3;

/// The manifold perturbation.
#[derive(Clone, Debug)]
pub struct Manifold(SensorSide);

/// Where the chain of specular vertices lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Chain {
    /// x_b is non-specular and is moved.
    b: usize,
    /// x_c stays.
    c: usize,
}

impl Chain {
    fn of(x: &MltPath) -> Option<Chain> {
        let mut b = x.length() - 1;
        while b > 0 && x.is_specular(b) {
            b -= 1;
        }
        if b < 2 || !x.is_specular(b - 1) {
            return None;
        }
        let mut c = b - 1;
        while c > 0 && x.is_specular(c) {
            c -= 1;
        }
        (b - c - 1 <= MAX_CHAIN).then_some(Chain { b, c })
    }

    fn kept(self) -> Kept {
        Kept { light: self.c + 1, sensor: 1 }
    }

    fn plan(self) -> Plan {
        Plan { kept: self.b, turns: 0 }
    }

    /// The specular vertices, from the side of x_b.
    fn points(self, x: &MltPath) -> Option<Vec<SurfacePoint>> {
        (self.c + 1..self.b).rev().map(|i| x.vertices()[i].surface().copied()).collect()
    }

    /// Their components.
    fn components(self, x: &MltPath) -> Option<Vec<Component>> {
        let component = |i: usize| match x.event(i) {
            Event::Specular(component) => Some(component),
            Event::NonSpecular => None,
        };
        (self.c + 1..self.b).rev().map(component).collect()
    }
}

impl Manifold {
    /// The perturbation for this scene's film.
    pub fn new(scene: &Scene, sizes: &Sizes) -> Self {
        Manifold(SensorSide::new(scene, sizes))
    }

    /// The specular vertices that the walk from those of `x` finds where x_b is at `b`.
    fn find(
        scene: &Scene,
        x: &MltPath,
        chain: Chain,
        b: &SurfacePoint,
    ) -> Option<Vec<SurfacePoint>> {
        let components = chain.components(x)?;
        newton::walk(scene, b, chain.points(x)?, &components, &x.vertices()[chain.c])
    }

    /// Whether the walk from `x` to the x_b of `y` ends at `y`.
    fn leads_to(scene: &Scene, x: &MltPath, chain: Chain, y: &MltPath) -> bool {
        let Some(b) = y.vertices()[chain.b].surface() else { return false };
        let (Some(found), Some(wanted)) = (Manifold::find(scene, x, chain, b), chain.points(y))
        else {
            return false;
        };
        let distance = |p: &SurfacePoint, q: &SurfacePoint| p.p.as_dvec3().distance(q.p.as_dvec3());
        let extent = distance(b, &wanted[wanted.len() - 1]).max(distance(b, &wanted[0]));
        found.iter().zip(&wanted).all(|(p, q)| distance(p, q) < SAME * extent)
    }

    fn ln_density(&self, scene: &Scene, x: &MltPath, y: &MltPath, chain: Chain) -> Option<f64> {
        let b = y.vertices()[chain.b].surface()?;
        let (points, components) = (chain.points(y)?, chain.components(y)?);
        let c = &y.vertices()[chain.c];
        let delta = ln_chain_density(scene, b, &points, &components, c)?;
        Some(self.0.ln_walk(scene, x, y, chain.plan())? + delta)
    }
}

impl Mutator for Manifold {
    fn name(&self) -> &'static str {
        "manifold"
    }

    fn applies(&self, x: &MltPath) -> bool {
        Chain::of(x).is_some()
    }

    fn propose(&self, scene: &Scene, x: &MltPath, u: &mut RandomStream) -> Option<Candidate> {
        let chain = Chain::of(x)?;
        let mut vertices = self.0.walk(scene, x, chain.plan(), u)?;
        let b = *vertices[chain.b].surface()?;
        let found = Manifold::find(scene, x, chain, &b)?;
        for (slot, point) in vertices[chain.c + 1..chain.b].iter_mut().rev().zip(found) {
            *slot = Vertex::Surface(point);
        }
        let path = MltPath::new(scene, Path::new(vertices, x.path().events.clone()))?;
        let v = path.vertices();
        // The other edges were traced.
        let visible = same_kind(x, &path, chain.c + 1, x.length() - 1)
            && scene.visible(&v[chain.c + 1], &v[chain.c]);
        visible.then(|| Candidate { path, kept: chain.kept() })
    }

    fn ln_transition(&self, scene: &Scene, x: &MltPath, y: &MltPath, kept: Kept) -> Option<f64> {
        let chain = Chain::of(x)?;
        let possible = kept == chain.kept()
            && same_kind(x, y, chain.c + 1, x.length() - 1)
            && Manifold::leads_to(scene, x, chain, y);
        if !possible {
            return None;
        }
        self.ln_density(scene, x, y, chain)
    }

    /// The walk to `y` has just been made; only the way back has to be walked.
    fn ln_transition_ratio(&self, scene: &Scene, x: &MltPath, y: &Candidate) -> Option<f64> {
        let chain = Chain::of(x)?;
        let back = self.ln_transition(scene, &y.path, x, y.kept)?;
        Some(back - self.ln_density(scene, x, &y.path, chain)?)
    }
}
