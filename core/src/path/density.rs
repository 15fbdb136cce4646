//! Densities p_{s,t}(x̄) of the techniques, and which technique can make a path at all.

use super::Families;
use super::{Path, Vertex};
use crate::bsdf::TransportMode;
use crate::measure::{Density, Edge, SolidAngle};
use crate::scene::Scene;

/// A sampling technique: s emitter-side and t sensor-side vertices (Veach's convention).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Technique {
    /// Emitter-side vertices.
    pub s: usize,
    /// Sensor-side vertices.
    pub t: usize,
}

impl Technique {
    /// The technique (s, t).
    pub fn new(s: usize, t: usize) -> Self {
        Technique { s, t }
    }

    /// The family it belongs to.
    pub fn family(self) -> Families {
        Families::of_technique(self.s as u16, self.t as u16)
    }
}

/// The rules by which walks end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WalkRules {
    /// Longest path in edges; `None` is unlimited. 1 is directly seen emission only (Mitsuba's
    /// max_depth).
    pub max_length: Option<u32>,
    /// Russian roulette plays at vertex i of a subpath (its first vertex is 0) for i ≥ `rr_depth`.
    pub rr_depth: u32,
}

impl Default for WalkRules {
    fn default() -> Self {
        WalkRules { max_length: None, rr_depth: 5 }
    }
}

impl WalkRules {
    /// True where paths of this length count.
    #[inline]
    pub fn allows(&self, length: usize) -> bool {
        self.max_length.is_none_or(|max| length <= max as usize)
    }
}

/// Whether technique (s, t) can make the path: hits need an emitter or lens of positive measure,
/// connections need ends whose events are not specular. The one predicate; a density is never asked
/// to say "impossible".
pub fn samplable(scene: &Scene, path: &Path, technique: Technique, rules: &WalkRules) -> bool {
    let Technique { s, t } = technique;
    let v = &path.vertices;
    let k = path.length();
    if s + t != k + 1 || k == 0 || !rules.allows(k) {
        return false;
    }
    let delta_emitter = v[0].emitter().is_none_or(|e| scene.emitters().get(e).is_delta());
    // A delta emitter has no image of its own: it is never seen directly.
    if delta_emitter && k == 1 {
        return false;
    }
    if s == 0 {
        return !delta_emitter;
    }
    if t == 0 {
        return !scene.sensor().is_pinhole();
    }
    let connectible = |i: usize| !path.is_specular(i);
    (s == 1 || connectible(s - 1)) && (t == 1 || connectible(s))
}

/// Every family of techniques that can make the path.
pub fn families(scene: &Scene, path: &Path, rules: &WalkRules) -> Families {
    let k = path.length();
    let v = &path.vertices;
    // Subpaths merge at any vertex with a non-specular event.
    let spreads = |i: usize| !path.is_specular(i);
    let merge = Families::MERGE.when(rules.allows(k) && (1..k).any(spreads));
    let techniques = (0..=k + 1).map(|s| Technique::new(s, k + 1 - s));
    let all = techniques.fold(merge, |all, technique| {
        all | technique.family().when(samplable(scene, path, technique, rules))
    });
    let far = matches!(v.first(), Some(Vertex::InfiniteEmitter { .. }));
    all | Families::FAR.when(far && all != Families::NONE)
}

/// ln p_{s,t}(x̄), roulette and choice of emitter included (Veach 1997, §10.2); `None` where the
/// technique can not make the path ([`samplable`]) or has density 0 there.
///
/// x₀ of s = 1, t ≥ 2 is sampled for x₁ (next-event estimation), of every other technique by the
/// light subpath.
pub fn ln_density(
    scene: &Scene,
    path: &Path,
    technique: Technique,
    rules: &WalkRules,
) -> Option<f64> {
    if !samplable(scene, path, technique, rules) {
        return None;
    }
    let Technique { s, t } = technique;
    let v = &path.vertices;
    let k = path.length();
    let edges: Vec<Edge> = v.windows(2).map(|w| w[0].edge_to(&w[1])).collect();
    // Density of the free flight along edge i that ends at x_j.
    let flight = |i: usize, j: usize| {
        let through = scene.transmittance(&v[i], &v[i + 1]);
        if scene.has_media() { scene.flight_density(&v[j], through) } else { 1.0 }
    };
    let mut ln = 0.0;
    let mut multiply = |p: f64| ln += p.ln();

    // Light subpath x₀ … x_{s−1}.
    if s == 1 && t >= 2 {
        multiply(scene.pdf_direct(v[1].position()?, &v[0]).value());
    } else if s >= 1 {
        multiply(scene.pdf_emission_vertex(&v[0]).value());
    }
    if s >= 2 {
        multiply(scene.pdf_emission_next(&v[0], &edges[0]).value() * flight(0, 1));
    }
    for i in 1..s.saturating_sub(1) {
        let (from, to) = (-edges[i - 1].direction(), edges[i].direction());
        let (pdf, q) =
            scene.event_at(&v[i], from, to, TransportMode::Importance, path.events[i])?;
        multiply(edges[i].to_area(pdf).value() * flight(i, i + 1));
        if i >= rules.rr_depth as usize {
            multiply(q.value());
        }
    }

    // Sensor subpath x_k … x_s.
    if t >= 1 {
        multiply(scene.sensor().pdf_vertex().value());
    }
    if t >= 2 {
        let d = -edges[k - 1].direction();
        let Vertex::Sensor { p, .. } = v[k] else { return None };
        scene.sensor().film_position(p, d)?;
        multiply(to_previous(v, k - 1, scene.sensor().pdf_direction(d)) * flight(k - 1, k - 1));
    }
    // Vertex j of the sensor subpath is x_{k−j}.
    for j in 1..t.saturating_sub(1) {
        let i = k - j;
        let (from, to) = (edges[i].direction(), -edges[i - 1].direction());
        let (pdf, q) = scene.event_at(&v[i], from, to, TransportMode::Radiance, path.events[i])?;
        multiply(to_previous(v, i - 1, pdf) * flight(i - 1, i - 1));
        if j >= rules.rr_depth as usize {
            multiply(q.value());
        }
    }
    ln.is_finite().then_some(ln)
}

/// Area density at x_i of a direction sampled at x_{i+1}.
fn to_previous(v: &[Vertex], i: usize, pdf: Density<SolidAngle>) -> f64 {
    v[i + 1].edge_to(&v[i]).to_area(pdf).value()
}
