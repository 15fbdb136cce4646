//! Path tracing with next-event estimation (Kajiya 1986; weights of Veach and Guibas 1995).
//!
//! The sensor subpath x_k, x_{k−1}, … is sampled vertex by vertex. At every vertex two techniques
//! estimate the emitted light: (s=0) the subpath itself hits an emitter, (s=1) x₀ is sampled on an
//! emitter and connected. Their weights compare the area densities of x₀, Russian roulette
//! included:
//!
//! w₀ = h(p_bsdf q, p_direct), w₁ = h(p_direct, p_bsdf q).

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::bsdf::TransportMode;
use pathspace_core::color::Rgb;
use pathspace_core::film::{Contribution, Families, Sink};
use pathspace_core::integrator::{
    Integrator, IntegratorError, MonteCarlo, PathEstimator, Run, State,
};
use pathspace_core::measure::Mass;
use pathspace_core::mis::Heuristic;
use pathspace_core::path::{WalkClass, WalkRules};
use pathspace_core::random::{PrimarySample, Stream};
use pathspace_core::scene::NextDensity;
use pathspace_core::walk::{OpenEdge, next_event_numbers, scatter};

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

    fn sees_media(&self) -> bool {
        true
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
        let (sensor, emitters, mode) = (scene.sensor(), scene.emitters(), TransportMode::Radiance);
        let on_film = u.next2();
        let on_lens = if sensor.is_pinhole() { [0.0; 2] } else { u.next2() };
        let sample = sensor.sample(pixel, on_film, on_lens);
        let first = NextDensity::Direction(sensor.pdf_direction(sample.ray.d));
        let mut edge = OpenEdge::new(sample.ray, Rgb::WHITE, first);
        let mut trace = Trace::default();
        trace.push::<S>(|| sample.vertex, || sensor.pdf_vertex().value());
        // The events so far; where the edge starts, as next-event estimation sees it; whether that
        // could have made the same path.
        let mut class = WalkClass::default();
        let mut before = sample.vertex;
        let mut two_techniques = false;
        let contribution = |value: Rgb, weight: f64, s, length, emitter, class: &WalkClass| {
            let origin = emitters.get(emitter).into();
            Contribution {
                weight: weight as f32,
                s,
                t: (length + 1) as u16,
                emitter,
                families: class.families(mode, origin, sensor.is_pinhole()),
                ..Contribution::new(sample.film, value * weight as f32)
            }
        };
        for length in 1.. {
            // s = 0: the edge ends on an emitter, or leaves the scene for the environment.
            let end = edge.travel(scene, &before, u);
            let (x0, radiance) = match &end {
                Some(vertex) => (end, scene.emitted_from(vertex, -edge.ray.d)),
                None => scene.background(edge.ray.d),
            };
            if let Some(x0) = x0.filter(|_| !radiance.is_black())
                && let Some(emitter) = x0.emitter()
            {
                let hit_pdf = edge.pdf_of_end(scene, &before.end(), &x0).value();
                let weight = match before.position() {
                    Some(p) if two_techniques => {
                        self.heuristic.weight2(hit_pdf, scene.pdf_direct(p, &x0).value())
                    }
                    _ => 1.0,
                };
                let value = radiance * edge.throughput;
                let c = contribution(value, weight, 0, length, emitter, &class);
                trace.emit(sink, c, true, || (x0, hit_pdf));
            }
            let Some(vertex) = end else { return };
            if !self.rules.allows(length + 1) {
                return;
            }
            let from = -edge.ray.d;
            trace.push::<S>(|| vertex, || edge.pdf_of_end(scene, &before.end(), &vertex).value());
            let plays = length >= self.rules.rr_depth as usize;
            // s = 1: x₀ is sampled on an emitter and connected. Numbers are drawn whether or not
            // they are used, so that each keeps its meaning.
            if self.nee {
                u.stream(Stream::Connection);
                let (pick, on_emitter) = next_event_numbers(u);
                u.stream(Stream::Sensor);
                if scene.connects_at(&vertex, from)
                    && let Some(p) = vertex.position()
                    && let Some(direct) = scene.sample_direct(p, pick, on_emitter)
                {
                    let to_x0 = vertex.edge_to(&direct.vertex);
                    if let Some(f) = scene.evaluate_at(&vertex, from, to_x0.direction(), mode) {
                        let through = scene.transmittance(&vertex, &direct.vertex);
                        let mut value = edge.throughput
                            * f.value
                            * direct.radiance
                            * (to_x0.geometry_term() / direct.pdf.value()) as f32;
                        if scene.has_media() {
                            value *= through;
                        }
                        if !value.is_black() && scene.visible(&vertex, &direct.vertex) {
                            let q = if plays { f.survival } else { Mass::ONE };
                            let weight = if emitters.get(direct.emitter).is_delta() {
                                1.0
                            } else {
                                let mut hit_pdf = to_x0.to_area(f.pdf * q).value();
                                if scene.has_media() {
                                    hit_pdf *= scene.flight_density(&direct.vertex, through);
                                }
                                self.heuristic.weight2(direct.pdf.value(), hit_pdf)
                            };
                            let mut class = class;
                            class.push(true);
                            let c = contribution(value, weight, 1, length, direct.emitter, &class);
                            trace.emit(sink, c, true, || (direct.vertex, direct.pdf.value()));
                        }
                    }
                }
            }
            // The next edge. Roulette is part of its density: the weights know it.
            let Some((next, event)) =
                scatter(scene, &vertex, from, edge.throughput, mode, plays, u)
                    .map(|(next, sample)| (next, sample.event))
            else {
                return;
            };
            if next.throughput.is_black() {
                return;
            }
            trace.scatter::<S>(event);
            class.push(!event.is_specular());
            two_techniques = self.nee && !event.is_specular();
            before = vertex;
            edge = next;
        }
    }
}
