//! MIS weights of connections, two ways: running sums that cost O(1) per connection, and the chain of ratios.
//!
//! Let v₀ … v_{n−1} be the vertices of one subpath as it takes part in a path, p(v_j) the density of v_j from its own side and
//! p′(v_j) from the other side. Moving the connection one edge towards this subpath's start multiplies the
//! density of the technique by ρ_j = p′(v_j)/p(v_j) (Veach 1997, eq. 10.9), so that the other techniques on this side sum to
//!
//! S = ρ_{n−1}^β (χ_{n−1} d_{n−1} + ρ_{n−2}^β K_{n−2}), K_j = χ_j d_j + ρ_{j−1}^β K_{j−1}, K₀ = χ₀ ,
//!
//! with χ_j = 1 where the technique with j vertices on this side can make the path, and w = d/(d + S_light + S_sensor) for the power
//! heuristic with exponent β. K_{n−2} is known when the walk arrives at v_{n−1}; only ρ_{n−1} and ρ_{n−2} wait for
//! the connection. This is the recursion of van Antwerpen 2011 ("Recursive MIS computation for streaming BDPT on the GPU") and Georgiev 2012
//! ("Implementing vertex connection and merging", §5), for any β.
//!
//! d_j = 1 but for next-event estimation (s = 1, t ≥ 2), whose x₀ is sampled for x₁: d₁ = (p_direct(x₀|x₁)/p_emission(x₀))^β.
//!
//! Delta vertices take part with their relative densities (see `pathspace_core::path`), and χ = 0 on both sides of them: never a sentinel value of a pdf.

use pathspace_core::Scene;
use pathspace_core::bsdf::TransportMode;
use pathspace_core::measure::{Area, Density};
use pathspace_core::mis::Heuristic;
use pathspace_core::path::Vertex;

use super::subpath::{Subpath, SubpathVertex};
use super::techniques::TechniqueSet;

/// What a vertex carries for the weights.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WeightState {
    /// K_{j−1} at vertex v_j.
    pub running: f64,
    /// p′(v_{j−2})/p(v_{j−2}) at vertex v_j, for the chain.
    pub ratio_before: f64,
    /// d₁ without its power at x₁ of a light subpath, else 1.
    pub direct: f64,
}

/// How weights are computed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights {
    pub heuristic: Heuristic,
    pub techniques: TechniqueSet,
    /// Exponent where the running sums are exact.
    beta: Option<f64>,
    pinhole: bool,
    delta_emitter: bool,
}

/// One side of a path whose weight is asked for.
#[derive(Clone, Copy)]
pub(super) struct Side<'a> {
    /// The vertices of the subpath that take part; may be none (s = 0 or t = 0).
    pub vertices: &'a [SubpathVertex],
    /// p′ of the last vertex.
    pub last: Density<Area>,
    /// p′ of the one before.
    pub before: Density<Area>,
    /// Whether the last vertex can end a connection, as the end of the path it is here.
    pub connectible: bool,
    /// d of the technique that ends one vertex earlier on this side.
    pub direct: f64,
}

impl<'a> Side<'a> {
    /// The side without vertices.
    pub(super) fn empty() -> Self {
        Side {
            vertices: &[],
            last: Density::ZERO,
            before: Density::ZERO,
            connectible: false,
            direct: 1.0,
        }
    }
}

impl Weights {
    pub(super) fn new(
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
        Weights { heuristic, techniques, beta, pinhole, delta_emitter }
    }

    /// These weights for paths that start on a given emitter.
    pub(super) fn for_emitter(self, delta_emitter: bool) -> Self {
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

    /// State of the next vertex; `backward` is p′ of the vertex before the last one, now that its successor's successor is known.
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
        let can = before.connectible && last.connectible;
        state.running =
            self.run_on(can, last.weight.direct, state.ratio_before, last.weight.running);
        state
    }

    /// K_j = χ_j d_j + ρ_{j−1}^β K_{j−1}.
    #[inline]
    fn run_on(&self, can: bool, direct: f64, ratio: f64, running: f64) -> f64 {
        let here = if can { self.power(direct) } else { 0.0 };
        here + self.power(ratio) * running
    }

    /// w_{s,t} of a path made of two sides; `own` is d of the technique itself.
    pub(super) fn weight(&self, light: Side, sensor: Side, own: f64) -> f64 {
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
                let can = before.connectible && side.connectible;
                let one_less = if can { self.power(side.direct) } else { 0.0 };
                let two_less = self.power(side.before / before.pdf) * last.weight.running;
                self.power(side.last / last.pdf) * (one_less + two_less)
            }
        }
    }

    /// The same weight from all ratios of densities, for any heuristic and any set of techniques; O(k).
    pub(super) fn weight_by_chain(&self, light: Side, sensor: Side, own: f64) -> f64 {
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
                    _ if j + 1 == n => side.vertices[j - 1].connectible && side.connectible,
                    _ => side.vertices[j - 1].connectible && v.connectible,
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
pub(super) fn direct_ratio(scene: &Scene, x0: &SubpathVertex, x1: &Vertex) -> f64 {
    match x1.position() {
        Some(p) => scene.pdf_direct(p, &x0.vertex) / x0.pdf,
        None => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use pathspace_core::random::{Address, PrimarySample, RandomStream};

    use super::super::connect::first_vertex;
    use super::*;

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
            let mut v = first_vertex(Vertex::Sensor { p: Vec3::ZERO, n: Vec3::Z }, pdf);
            v.connectible = j == 0 || u.next() < 0.7;
            if j == 1 {
                v.weight.running = f64::from(weights.start_can_be_hit(mode));
                v.weight.direct = if mode == TransportMode::Importance { ln(u).exp() } else { 1.0 };
            } else if j >= 2 {
                let (last, before) = (&subpath[j - 1], &subpath[j - 2]);
                v.weight.ratio_before = ln(u).exp() / before.pdf.value();
                let can = before.connectible && last.connectible;
                let (direct, running) = (last.weight.direct, last.weight.running);
                v.weight.running = weights.run_on(can, direct, v.weight.ratio_before, running);
            }
            subpath.push(v);
        }
        subpath
    }

    fn side<'a>(subpath: &'a Subpath, direct: f64, u: &mut RandomStream) -> Side<'a> {
        let mut density = || Density::new((20.0 * (u.next() as f64 - 0.5)).exp());
        Side { vertices: subpath, last: density(), before: density(), connectible: true, direct }
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
