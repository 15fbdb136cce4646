//! Path tracing with next-event estimation (Kajiya 1986; weights of Veach and Guibas 1995).
//!
//! The sensor subpath x_k, x_{k−1}, … is sampled vertex by vertex. At every vertex two techniques estimate
//! the emitted light: (s=0) the subpath itself hits an emitter, (s=1) x₀ is sampled on an emitter and connected. Their
//! weights compare the area densities of x₀, Russian roulette included:
//!
//! w₀ = h(p_bsdf q, p_direct), w₁ = h(p_direct, p_bsdf q).

use std::sync::Arc;

use glam::Vec3;
use pathspace_core::Scene;
use pathspace_core::bsdf::TransportMode;
use pathspace_core::color::Rgb;
use pathspace_core::film::{Contribution, Families, Sink};
use pathspace_core::integrator::{
    Integrator, IntegratorError, MonteCarlo, PathEstimator, Run, State,
};
use pathspace_core::measure::{Density, Edge, End, Mass, SolidAngle};
use pathspace_core::mis::Heuristic;
use pathspace_core::path::{Vertex, WalkClass, WalkRules};
use pathspace_core::random::{PrimarySample, Stream};
use pathspace_core::scene::SurfacePoint;

use crate::spec::{Defaults, Options, Spec, SpecError};
use crate::trace::Trace;

/// Name in the registry.
pub const NAME: &str = "pt";

/// Path tracing.
#[derive(Clone, Debug)]
pub struct PathTracer {
    /// Next-event estimation (s = 1) beside hitting emitters (s = 0).
    pub nee: bool,
    /// How the two share a path.
    pub heuristic: Heuristic,
    /// Length cap and roulette.
    pub rules: WalkRules,
    spec: String,
}

impl PathTracer {
    /// With next-event estimation and default options, to start chains of paths.
    pub(crate) fn for_starts(rules: WalkRules) -> Self {
        let heuristic = Heuristic::Power { beta: 2.0 };
        PathTracer { nee: true, heuristic, rules, spec: NAME.to_owned() }
    }

    /// From options: `nee`, `heuristic` (`beta`, `alpha`), `max_depth`, `rr_depth`.
    ///
    /// # Errors
    /// Where an option is unknown or its value out of range.
    pub fn from_spec(spec: &Spec, defaults: &Defaults) -> Result<Self, SpecError> {
        let mut options = spec.options();
        let tracer = PathTracer::from_options(&mut options, defaults)?;
        options.finish()?;
        Ok(PathTracer { spec: spec.to_string(), ..tracer })
    }

    /// The same for an integrator that has options beside those.
    pub(crate) fn from_options(
        options: &mut Options<'_>,
        defaults: &Defaults,
    ) -> Result<Self, SpecError> {
        Ok(PathTracer {
            nee: options.boolean("nee", true)?,
            heuristic: options.heuristic(Heuristic::Power { beta: 2.0 })?,
            rules: options.walk_rules(defaults)?,
            spec: NAME.to_owned(),
        })
    }
}

impl Integrator for PathTracer {
    fn name(&self) -> &str {
        NAME
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn families(&self, _: &Scene) -> Families {
        Families::S0 | Families::S1.when(self.nee)
    }

    fn resume(
        &self,
        scene: Arc<Scene>,
        seed: u64,
        state: &State,
    ) -> Result<Box<dyn Run>, IntegratorError> {
        Ok(Box::new(MonteCarlo::new(Arc::new(self.clone()), scene, seed, state.step)))
    }
}

/// How the walk came to its current vertex.
struct Arrival {
    /// Position of the vertex before, where x₀ would have been sampled for.
    reference: Vec3,
    /// Density of the direction, roulette included.
    pdf: Density<SolidAngle>,
    /// True where next-event estimation could not have made this path: camera edge or delta vertex.
    only_hit: bool,
}

impl PathEstimator for PathTracer {
    fn estimate<U: PrimarySample, S: Sink>(
        &self,
        scene: &Scene,
        pixel: Option<[u32; 2]>,
        u: &mut U,
        sink: &mut S,
    ) {
        if !self.rules.allows(1) {
            return;
        }
        let sensor = scene.sensor();
        let on_film = u.next2();
        let on_lens = if sensor.is_pinhole() { [0.0; 2] } else { u.next2() };
        let sample = sensor.sample(pixel, on_film, on_lens);
        let mut trace = Trace::default();
        trace.push::<S>(|| sample.vertex, || sensor.pdf_vertex().value());
        let mut walk = Walk {
            tracer: self,
            scene,
            sink,
            film: sample.film,
            class: WalkClass::default(),
            throughput: Rgb::WHITE,
            trace,
        };
        let mut ray = sample.ray;
        let mut arrival =
            Arrival { reference: ray.o, pdf: sensor.pdf_direction(ray.d), only_hit: true };
        for length in 1.. {
            let hit = scene.intersect(&ray);
            walk.hit_emitter(hit.as_ref(), ray.d, length, &arrival);
            let Some(point) = hit else { return };
            if !self.rules.allows(length + 1) {
                return;
            }
            let delta = scene.is_delta_at(&point, -ray.d);
            walk.advance(&point, delta, &arrival);
            // Numbers are drawn whether or not they are used, so that each dimension keeps its meaning.
            if self.nee {
                u.stream(Stream::Connection);
                let (pick, on_emitter) = (u.next(), u.next2());
                u.stream(Stream::Sensor);
                if !delta {
                    walk.next_event(&point, -ray.d, length, pick, on_emitter);
                }
            }
            let (lobe, direction) = (u.next(), u.next2());
            let mode = TransportMode::Radiance;
            let Some(next) = scene.sample_scatter(&point, -ray.d, mode, lobe, direction) else {
                return;
            };
            let q = self.survival(length, next.survival);
            if length >= self.rules.rr_depth as usize && u.next() as f64 >= q.value() {
                return;
            }
            walk.throughput *= next.weight * (1.0 / q.value()) as f32;
            if walk.throughput.is_black() {
                return;
            }
            arrival =
                Arrival { reference: point.p, pdf: next.pdf * q, only_hit: delta || !self.nee };
            ray = point.spawn(next.direction);
        }
    }
}

impl PathTracer {
    /// Probability to go on at vertex `index` of the sensor subpath.
    #[inline]
    fn survival(&self, index: usize, survival: Mass) -> Mass {
        if index >= self.rules.rr_depth as usize { survival } else { Mass::ONE }
    }
}

/// The sensor subpath so far.
struct Walk<'a, S> {
    tracer: &'a PathTracer,
    scene: &'a Scene,
    sink: &'a mut S,
    film: glam::Vec2,
    class: WalkClass,
    throughput: Rgb,
    trace: Trace,
}

impl<S: Sink> Walk<'_, S> {
    /// Technique s = 0: the last edge ends on an emitter.
    #[inline]
    fn hit_emitter(
        &mut self,
        hit: Option<&SurfacePoint>,
        d: Vec3,
        length: usize,
        arrival: &Arrival,
    ) {
        let scene = self.scene;
        let (radiance, emitter) = match hit {
            Some(point) => (scene.emitted(point, -d), point.emitter()),
            None => (scene.emitters().background_radiance(d), scene.emitters().background()),
        };
        let Some(emitter) = emitter.filter(|_| !radiance.is_black()) else { return };
        let vertex = match hit {
            Some(point) => Vertex::Surface(*point),
            None => Vertex::InfiniteEmitter { emitter, to: d },
        };
        let to_vertex = Edge::new(&End::Point { p: arrival.reference }, &vertex.end());
        let hit_pdf = to_vertex.to_area(arrival.pdf);
        let weight = if arrival.only_hit {
            1.0
        } else {
            let direct = scene.pdf_direct(arrival.reference, &vertex);
            self.tracer.heuristic.weight2(hit_pdf.value(), direct.value())
        };
        let contribution =
            self.contribution(radiance * self.throughput, weight, (0, length + 1), emitter);
        self.trace.emit(self.sink, contribution, true, || {
            // Roulette is in the trace already.
            (Some(vertex), to_vertex.to_area(arrival.pdf).value())
        });
    }

    /// Adds the surface vertex that the walk arrived at.
    #[inline]
    fn advance(&mut self, point: &SurfacePoint, delta: bool, arrival: &Arrival) {
        self.class.push(!delta);
        let edge = || Edge::new(&End::Point { p: arrival.reference }, &point.end());
        self.trace.push::<S>(|| Vertex::Surface(*point), || edge().to_area(arrival.pdf).value());
    }

    /// Technique s = 1: x₀ is sampled on an emitter and connected to the current vertex.
    #[inline]
    fn next_event(
        &mut self,
        point: &SurfacePoint,
        to_sensor: Vec3,
        length: usize,
        pick: f32,
        u: [f32; 2],
    ) {
        let scene = self.scene;
        let Some(direct) = scene.sample_direct(point.p, pick, u) else { return };
        let edge = Edge::new(&point.end(), &direct.vertex.end());
        let mode = TransportMode::Radiance;
        let Some(scatter) = scene.evaluate_scatter(point, to_sensor, edge.direction(), mode) else {
            return;
        };
        let value = self.throughput
            * scatter.value
            * direct.radiance
            * (edge.geometry_term() / direct.pdf.value()) as f32;
        if value.is_black() || !scene.visible(&Vertex::Surface(*point), &direct.vertex) {
            return;
        }
        let weight = if scene.emitters().get(direct.emitter).is_delta() {
            1.0
        } else {
            let hit = edge.to_area(scatter.pdf * self.tracer.survival(length, scatter.survival));
            self.tracer.heuristic.weight2(direct.pdf.value(), hit.value())
        };
        let contribution = self.contribution(value, weight, (1, length + 1), direct.emitter);
        let pdf = direct.pdf.value();
        self.trace.emit(self.sink, contribution, true, || (Some(direct.vertex), pdf));
    }

    #[inline]
    fn contribution(
        &self,
        value: Rgb,
        weight: f64,
        (s, t): (usize, usize),
        emitter: u32,
    ) -> Contribution {
        let origin = self.scene.emitters().get(emitter).into();
        let pinhole = self.scene.sensor().is_pinhole();
        Contribution {
            film: self.film,
            value: value * weight as f32,
            weight: weight as f32,
            s: s as u16,
            t: t as u16,
            emitter,
            families: self.class.families(TransportMode::Radiance, origin, pinhole),
        }
    }
}
