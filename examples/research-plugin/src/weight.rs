//! MIS weights over connections and merges, O(1) for each.
//!
//! A merge at x_i needs x_i twice: on a light subpath and, within the radius r, on a sensor subpath. With N light subpaths it is worth
//! N samples of density p(x₀…x_i) p(x_i…x_k) πr² (Georgiev et al. 2012, eq. 7), so that beside a connection it counts as if the walk on one side went
//! one vertex further and the density of that step were multiplied by
//!
//! η = N π r² (Georgiev 2012, "Implementing vertex connection and merging", eq. 20).
//!
//! Let v₀ … v_{n−1} be one side of a path, p(v_j) the density of v_j from its own walk and p′(v_j) that from the walk of the other side. In units of
//! the connection that has j vertices on this side, all techniques with j or fewer sum to
//!
//! K_j = χ_j d_j^β + [v_{j−1} merges] (η p′(v_{j−1}))^β + (p′(v_{j−1})/p(v_{j−1}))^β K_{j−1}
//!
//! (eqs. 34–36 with a power β; K is Georgiev's dVCM, dVC and dVM in one number, because the vertex keeps its own p). χ_j = 1 where connection j
//! can make the path, and d_1 = p_direct(x₀|x₁)/p_emission(x₀) for next-event estimation, else 1. The weights are
//!
//! | technique | weight | eq. |
//! | --- | --- | --- |
//! | connection | d^β / (d^β + S_light + S_sensor), S = (η p′)^β + (p′/p)^β K at the last vertex | 37, 40–47 |
//! | merge at x_i | η^β / (η^β + K_light/p_light(x_i)^β + K_sensor/p_sensor(x_i)^β) | 37–39 |
//!
//! A delta emitter starts with K₀ = 0 (eqs. 48–50), as does the sensor, whose lens this method does not hit.

use pathspace::core::measure::{Area, Density};

use crate::subpath::SubpathVertex;

/// Exponent β of the heuristic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exponent {
    /// Balance heuristic, β = 1.
    Balance,
    /// Power heuristic, β = 2.
    Power,
}

/// How the techniques share a path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weights {
    /// β.
    pub exponent: Exponent,
    /// True where s, t ≥ 1 connections take part.
    pub connect: bool,
    /// η, 0 where merges take no part.
    pub eta: f64,
}

impl Weights {
    /// x^β.
    #[inline]
    pub(crate) fn power(&self, x: f64) -> f64 {
        match self.exponent {
            Exponent::Balance => x,
            Exponent::Power => x * x,
        }
    }

    /// (η p′)^β of the merge at `v`; 0 where nothing merges there.
    #[inline]
    fn merge(&self, v: &SubpathVertex, opposite: Density<Area>) -> f64 {
        if v.merges { self.power(self.eta * opposite.value()) } else { 0.0 }
    }

    /// K_j at v_j = `last` from K_{j−1}, which `last` keeps; `before` is v_{j−1} and `opposite` p′(v_{j−1}). `connectible` says whether
    /// v_j can end a connection, `direct` is d_j.
    #[inline]
    pub(crate) fn arrive(
        &self,
        before: &SubpathVertex,
        last: &SubpathVertex,
        connectible: bool,
        direct: f64,
        opposite: Density<Area>,
    ) -> f64 {
        let can = self.connect && before.connectible && connectible;
        let connection = if can { self.power(direct) } else { 0.0 };
        connection + self.merge(before, opposite) + self.power(opposite / before.pdf) * last.running
    }

    /// S of the side that ends at `last`, which the other side makes with density `opposite`; `k` is K there.
    #[inline]
    pub(crate) fn side(&self, last: &SubpathVertex, opposite: Density<Area>, k: f64) -> f64 {
        self.merge(last, opposite) + self.power(opposite / last.pdf) * k
    }

    /// w of a connection (eq. 37); `own` is d of the technique itself.
    #[inline]
    pub(crate) fn connection(&self, own: f64, light: f64, sensor: f64) -> f64 {
        let own = self.power(own);
        own / (own + light + sensor)
    }

    /// w of a merge (eqs. 37–39); `light` and `sensor` are K and the density of the merged vertex on either side.
    #[inline]
    pub(crate) fn merging(&self, light: (f64, Density<Area>), sensor: (f64, Density<Area>)) -> f64 {
        let own = self.power(self.eta);
        let share = |(k, p): (f64, Density<Area>)| k / self.power(p.value());
        own / (own + share(light) + share(sensor))
    }
}
