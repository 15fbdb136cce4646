//! MIS weights of connections, two ways: running sums that cost O(1) per connection, and the chain
//! of ratios.
//!
//! Let v₀ … v_{n−1} be the vertices of one subpath as it takes part in a path, p(v_j) the density
//! of v_j from its own side and p′(v_j) from the other side. Moving the connection one edge towards
//! this subpath's start multiplies the density of the technique by ρ_j = p′(v_j)/p(v_j) (Veach
//! 1997, eq. 10.9), so that the other techniques on this side sum to
//!
//! S = ρ_{n−1}^β (χ_{n−1} d_{n−1} + ρ_{n−2}^β K_{n−2}), K_j = χ_j d_j + ρ_{j−1}^β K_{j−1}, K₀ = χ₀
//! ,
//!
//! with χ_j = 1 where the technique with j vertices on this side can make the path, and w = d/(d +
//! S_light + S_sensor) for the power heuristic with exponent β. K_{n−2} is known when the walk
//! arrives at v_{n−1}; only ρ_{n−1} and ρ_{n−2} wait for the connection. This is the recursion of
//! van Antwerpen 2011 ("Recursive MIS computation for streaming BDPT on the GPU") and Georgiev 2012
//! ("Implementing vertex connection and merging", §5), for any β.
//!
//! d_j = 1 but for next-event estimation (s = 1, t ≥ 2), whose x₀ is sampled for x₁: d₁ =
//! (p_direct(x₀|x₁)/p_emission(x₀))^β.
//!
//! **Merges** (Georgiev et al. 2012; Georgiev 2012, eq. 20). A merge at v_j needs v_j on a light
//! and a sensor subpath; beside a connection it counts as if the walk on one side went one vertex
//! further and the density of that step were multiplied by η, so that K_j has one term more:
//!
//! K_j = χ_j d_j + [v_{j−1} merges] (η p′(v_{j−1}))^β + ρ_{j−1}^β K_{j−1} .
//!
//! η = 0 where merges take no part ([`Weights::with_merges`]).
//!
//! Specular vertices take part with their relative densities (see [`crate::path`]), and χ = 0 on
//! both sides of them: never a sentinel value of a pdf.

use super::subpath::{Subpath, WalkVertex};
use super::techniques::TechniqueSet;
use crate::bsdf::TransportMode;
use crate::measure::{Area, Density};
use crate::mis::Heuristic;
use crate::path::Vertex;
use crate::scene::Scene;

/// What a vertex carries for the weights.
#[derive(Clone, Copy, Debug, Default)]
pub struct WeightState {
    /// K_{j−1} at vertex v_j.
    pub running: f64,
    /// p′(v_{j−2})/p(v_{j−2}) at vertex v_j, for the chain.
    pub ratio_before: f64,
    /// d₁ without its power at x₁ of a light subpath, else 1.
    pub direct: f64,
}

/// How weights are computed.
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    /// How techniques share a path.
    pub heuristic: Heuristic,
    /// Techniques that take part.
    pub techniques: TechniqueSet,
    /// Exponent where the running sums are exact.
    beta: Option<f64>,
    pinhole: bool,
    delta_emitter: bool,
    /// η, 0 where merges take no part.
    eta: f64,
    /// Connections (s, t ≥ 1) take part.
    connections: bool,
}

/// One side of a path whose weight is asked for.
#[derive(Clone, Copy)]
pub struct Side<'a> {
    /// The vertices of the subpath that take part; may be none (s = 0 or t = 0).
    pub vertices: &'a [WalkVertex],
    /// p′ of the last vertex.
    pub last: Density<Area>,
    /// p′ of the one before.
    pub before: Density<Area>,
    /// Whether the last vertex can end a connection, as the end of the path it is here.
    pub connectible: bool,
    /// Whether subpaths can merge there: an inner vertex, whose event is not specular because a
    /// connection ends at it.
    pub merges: bool,
    /// d of the technique that ends one vertex earlier on this side.
    pub direct: f64,
}

impl<'a> Side<'a> {
    /// The side without vertices.
    pub fn empty() -> Self {
        Side {
            vertices: &[],
            last: Density::ZERO,
            before: Density::ZERO,
            connectible: false,
            merges: false,
            direct: 1.0,
        }
    }
}

impl Weights {
    /// For walks in a scene with a pinhole or not; `delta_emitter`: x₀ can not be hit.
    pub fn new(
        heuristic: Heuristic,
        techniques: TechniqueSet,
        pinhole: bool,
        delta_emitter: bool,
    ) -> Self {
        let beta = match heuristic {
            _ if !techniques.is_all() => None,
            Heuristic::Balance => Some(1.0),
            Heuristic::Power { beta } => Some(beta),
            _ => None,
        };
        Weights { heuristic, techniques, beta, pinhole, delta_emitter, eta: 0.0, connections: true }
    }

    /// Weights of vertex connection and merging: s = 0, connections if `connections`, and merges of
    /// worth `eta` = N π r², N light subpaths and radius r. Nothing hits the lens. `power` is β.
    pub fn with_merges(power: f64, connections: bool, eta: f64) -> Self {
        let heuristic = Heuristic::Power { beta: power };
        let techniques = TechniqueSet::WITHOUT_LENS;
        let beta = Some(power);
        let (pinhole, delta_emitter) = (true, false);
        Weights { heuristic, techniques, beta, pinhole, delta_emitter, eta, connections }
    }

    /// True where connections or hits (s, t) take part.
    #[inline]
    pub fn takes_part(&self, s: usize, t: usize) -> bool {
        self.techniques.contains(s, t) && (self.connections || s == 0)
    }

    /// These weights for paths that start on a given emitter.
    pub fn for_emitter(self, delta_emitter: bool) -> Self {
        Weights { delta_emitter, ..self }
    }

    /// χ₀: whether the other walk can hit the start of a subpath.
    fn start_can_be_hit(&self, mode: TransportMode) -> bool {
        match mode {
            TransportMode::Importance => !self.delta_emitter,
            TransportMode::Radiance => !self.pinhole,
        }
    }

    #[inline]
    fn power(&self, r: f64) -> f64 {
        match self.beta {
            Some(1.0) | None => r,
            Some(2.0) => r * r,
            Some(beta) => r.powf(beta),
        }
    }

    /// State of the next vertex; `backward` is p′ of the vertex before the last one, now that its
    /// successor's successor is known.
    pub(super) fn extend(
        &self,
        scene: &Scene,
        mode: TransportMode,
        subpath: &Subpath,
        vertex: &Vertex,
        backward: Density<Area>,
    ) -> WeightState {
        let n = subpath.len();
        let mut state = WeightState { running: 0.0, ratio_before: 0.0, direct: 1.0 };
        if n == 1 {
            state.running = f64::from(self.start_can_be_hit(mode));
            if mode == TransportMode::Importance {
                state.direct = direct_ratio(scene, &subpath[0], vertex);
            }
            return state;
        }
        let (last, before) = (&subpath[n - 1], &subpath[n - 2]);
        state.ratio_before = backward / before.pdf;
        let can = before.ends() && last.ends();
        let (direct, running) = (last.weight.direct, last.weight.running);
        state.running = self.run_on(can, direct, state.ratio_before, running);
        if self.eta > 0.0 {
            state.running += self.merge(before, backward);
        }
        state
    }

    /// χ_j d_j + ρ_{j−1}^β K_{j−1}.
    #[inline]
    fn run_on(&self, can: bool, direct: f64, ratio: f64, running: f64) -> f64 {
        let here = if can && self.connections { self.power(direct) } else { 0.0 };
        here + self.power(ratio) * running
    }

    /// (η p′)^β of the merge at `v`; 0 where nothing merges there.
    #[inline]
    fn merge(&self, v: &WalkVertex, opposite: Density<Area>) -> f64 {
        if v.merges() { self.power(self.eta * opposite.value()) } else { 0.0 }
    }

    /// w_{s,t} of a path made of two sides; `own` is d of the technique itself.
    pub fn weight(&self, light: Side, sensor: Side, own: f64) -> f64 {
        if self.beta.is_none() {
            return self.weight_by_chain(light, sensor, own);
        }
        let own = self.power(own);
        own / (own
            + self.side(light, TransportMode::Importance)
            + self.side(sensor, TransportMode::Radiance))
    }

    /// S of one side.
    fn side(&self, side: Side, mode: TransportMode) -> f64 {
        match side.vertices {
            [] => 0.0,
            [only] => self.power(side.last / only.pdf) * f64::from(self.start_can_be_hit(mode)),
            [.., before, last] => {
                let sum = self.power(side.last / last.pdf) * self.k(&side, before, last);
                let merge = self.eta > 0.0 && side.merges;
                if merge { sum + self.power(self.eta * side.last.value()) } else { sum }
            }
        }
    }

    /// K of a side at its last vertex.
    #[inline]
    fn k(&self, side: &Side, before: &WalkVertex, last: &WalkVertex) -> f64 {
        let can = before.ends() && side.connectible;
        let ratio = side.before / before.pdf;
        let k = self.run_on(can, side.direct, ratio, last.weight.running);
        if self.eta > 0.0 { k + self.merge(before, side.before) } else { k }
    }

    /// w of a merge of the last vertices of both sides (Georgiev 2012, eqs. 37–39): η^β / (η^β +
    /// K_light/p_light^β + K_sensor/p_sensor^β). `last` of a side is not asked for. `None` where a
    /// side has no vertex before the merged one.
    pub fn merge_weight(&self, light: Side, sensor: Side) -> Option<f64> {
        let own = self.power(self.eta);
        let mut sum = own;
        for side in [light, sensor] {
            let [.., before, last] = side.vertices else { return None };
            sum += self.k(&side, before, last) / self.power(last.pdf.value());
        }
        Some(own / sum)
    }

    /// The same weight from all ratios of densities, for any heuristic and any set of techniques;
    /// O(k).
    pub fn weight_by_chain(&self, light: Side, sensor: Side, own: f64) -> f64 {
        let (s, t) = (light.vertices.len(), sensor.vertices.len());
        let mut densities = Vec::with_capacity(s + t + 1);
        densities.push(own);
        for (side, mode) in [(light, TransportMode::Importance), (sensor, TransportMode::Radiance)]
        {
            let n = side.vertices.len();
            let mut ratio = 1.0;
            for j in (0..n).rev() {
                // Technique with j vertices on this side.
                let v = &side.vertices[j];
                ratio *= if j + 1 == n {
                    side.last / v.pdf
                } else if j + 2 == n {
                    side.before / v.pdf
                } else {
                    side.vertices[j + 2].weight.ratio_before
                };
                let (s, t) = match mode {
                    TransportMode::Importance => (j, s + t - j),
                    TransportMode::Radiance => (s + t - j, j),
                };
                let can = match j {
                    0 => self.start_can_be_hit(mode),
                    _ if j + 1 == n => side.vertices[j - 1].ends() && side.connectible,
                    _ => side.vertices[j - 1].ends() && v.ends(),
                };
                let direct = if j + 1 == n { side.direct } else { v.weight.direct };
                if can && self.techniques.contains(s, t) {
                    densities.push(ratio * direct);
                }
            }
        }
        self.heuristic.weight(0, &densities)
    }
}

/// p_direct(x₀|x₁)/p_emission(x₀).
fn direct_ratio(scene: &Scene, x0: &WalkVertex, x1: &Vertex) -> f64 {
    match x1.position() {
        Some(p) => scene.pdf_direct(p, &x0.vertex) / x0.pdf,
        None => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Address, PrimarySample, RandomStream};
    use glam::Vec3;

    /// A subpath of random densities and delta vertices; only what weights look at is set.
    fn random_subpath(
        weights: &Weights,
        mode: TransportMode,
        n: usize,
        u: &mut RandomStream,
    ) -> Subpath {
        let mut subpath = Subpath::new();
        for j in 0..n {
            let ln = |u: &mut RandomStream| 20.0 * (u.next() as f64 - 0.5);
            let pdf = Density::new(ln(u).exp());
            let mut v = WalkVertex::first(Vertex::Sensor { p: Vec3::ZERO, n: Vec3::Z }, pdf);
            v.connectible = j == 0 || u.next() < 0.7;
            if j == 1 {
                v.weight.running = f64::from(weights.start_can_be_hit(mode));
                v.weight.direct = if mode == TransportMode::Importance { ln(u).exp() } else { 1.0 };
            } else if j >= 2 {
                let (last, before) = (&subpath[j - 1], &subpath[j - 2]);
                v.weight.ratio_before = ln(u).exp() / before.pdf.value();
                let can = before.ends() && last.ends();
                let (direct, running) = (last.weight.direct, last.weight.running);
                v.weight.running = weights.run_on(can, direct, v.weight.ratio_before, running);
            }
            subpath.push(v);
        }
        subpath
    }

    fn side<'a>(subpath: &'a Subpath, direct: f64, u: &mut RandomStream) -> Side<'a> {
        let mut density = || Density::new((20.0 * (u.next() as f64 - 0.5)).exp());
        let (last, before) = (density(), density());
        Side { vertices: subpath, last, before, connectible: true, merges: false, direct }
    }

    #[test]
    fn running_sums_equal_the_chain_of_ratios_to_ten_digits() {
        for (i, beta) in [1.0, 2.0, 3.5].into_iter().enumerate() {
            let heuristic =
                if beta == 1.0 { Heuristic::Balance } else { Heuristic::Power { beta } };
            for item in 0..20_000 {
                let mut u = RandomStream::new(Address { seed: i as u64, step: 0, item });
                let (pinhole, delta) = (u.next() < 0.5, u.next() < 0.5);
                let weights = Weights::new(heuristic, TechniqueSet::ALL, pinhole, delta);
                let n = |u: &mut RandomStream| (u.next() * 7.0) as usize;
                let (s, t) = (n(&mut u), n(&mut u));
                let light = random_subpath(&weights, TransportMode::Importance, s, &mut u);
                let sensor = random_subpath(&weights, TransportMode::Radiance, t, &mut u);
                let direct = if s == 2 { light[1].weight.direct } else { 1.0 };
                let light = side(&light, direct, &mut u);
                let sensor = side(&sensor, 1.0, &mut u);
                let own = if s == 1 { 3.0 } else { 1.0 };
                let fast = weights.weight(light, sensor, own);
                let slow = weights.weight_by_chain(light, sensor, own);
                assert!((fast - slow).abs() <= 1e-10 * slow, "β {beta} ({s},{t}): {fast} {slow}");
            }
        }
    }
}
