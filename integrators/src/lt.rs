//! Light tracing (Arvo 1986; Dutré et al. 1993): technique t = 1 for every s.
//!
//! The light subpath x₀, x₁, … is sampled vertex by vertex and every vertex with a non-specular
//! component is connected to a point of the lens. What is seen directly in or through a smooth
//! mirror or glass has no such technique: those parts of the image stay black, and comparisons
//! leave them out ([`Families`]).

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::bsdf::TransportMode;
use pathspace_core::color::Rgb;
use pathspace_core::film::{Contribution, Families, Sink};
use pathspace_core::integrator::{
    Integrator, IntegratorError, MonteCarlo, PathEstimator, Run, State,
};
use pathspace_core::path::{Vertex, WalkClass, WalkRules};
use pathspace_core::random::{PrimarySample, Stream};
use pathspace_core::walk::{OpenEdge, emission_numbers, scatter};

use crate::spec::{Defaults, Spec, SpecError};
use crate::trace::Trace;

/// Name in the registry.
pub const NAME: &str = "lt";

/// Light tracing.
#[derive(Clone, Debug)]
pub struct LightTracer {
    /// Length cap and roulette.
    pub rules: WalkRules,
    spec: String,
}

impl LightTracer {
    /// From options: `max_depth`, `rr_depth`.
    ///
    /// # Errors
    /// Where an option is unknown or its value out of range.
    pub fn from_spec(spec: &Spec, defaults: &Defaults) -> Result<Self, SpecError> {
        let mut options = spec.options();
        let tracer = LightTracer { rules: options.walk_rules(defaults)?, spec: spec.to_string() };
        options.finish()?;
        Ok(tracer)
    }
}

impl Integrator for LightTracer {
    fn name(&self) -> &str {
        NAME
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn families(&self, _: &Scene) -> Families {
        Families::T1
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

impl PathEstimator for LightTracer {
    fn estimate<U: PrimarySample, S: Sink>(
        &self,
        scene: &Scene,
        _: Option<[u32; 2]>,
        u: &mut U,
        sink: &mut S,
    ) {
        u.stream(Stream::Light);
        let (pick, position, direction) = emission_numbers(u);
        let Some(emission) = scene.sample_emission(pick, position, direction) else { return };
        let mut trace = Trace::default();
        trace.push::<S>(|| emission.vertex, || emission.pdf.value());
        let origin = scene.emitters().get(emission.emitter).into();
        let mut film = ToFilm { scene, sink, emitter: emission.emitter };
        if !self.rules.allows(1) {
            return;
        }
        let (mut class, mode) = (WalkClass::default(), TransportMode::Importance);
        let families = |class: WalkClass| class.families(mode, origin, scene.sensor().is_pinhole());
        // x₀ itself, seen directly; a delta emitter has no image.
        if !origin.delta {
            let lens = lens_numbers(scene, u);
            let alpha = emission.radiance * (1.0 / emission.pdf.value()) as f32;
            film.connect(&trace, &emission.vertex, (1, lens), families(class), |d| {
                // Emission of a surface is one-sided.
                let emitted = scene.emitted_from(&emission.vertex, d);
                if emitted.is_black() { Rgb::BLACK } else { alpha }
            });
        }
        // G/p(x₁|x₀) = |cos θ₀|/p_σ, or 1/p_⊥ for a beam.
        let throughput = emission.throughput();
        let mut edge = OpenEdge::new(emission.ray, throughput, emission.next);
        let mut before = emission.vertex;
        for index in 1.. {
            if edge.throughput.is_black() || !self.rules.allows(index + 1) {
                return;
            }
            let Some(vertex) = edge.travel(scene, &before, u) else { return };
            let from = -edge.ray.d;
            trace.push::<S>(|| vertex, || edge.pdf_of_end(scene, &before.end(), &vertex).value());
            let lens = lens_numbers(scene, u);
            if scene.connects_at(&vertex, from) {
                let mut class = class;
                class.push(true);
                film.connect(&trace, &vertex, (index + 1, lens), families(class), |d| {
                    scene.scatter_at(&vertex, from, d) * edge.throughput
                });
            }
            let plays = index >= self.rules.rr_depth as usize;
            let Some((next, event)) =
                scatter(scene, &vertex, from, edge.throughput, mode, plays, u)
                    .map(|(next, sample)| (next, sample.event))
            else {
                return;
            };
            trace.scatter::<S>(event);
            class.push(!event.is_specular());
            before = vertex;
            edge = next;
        }
    }
}

/// Numbers for a point of the lens, none for a pinhole.
#[inline]
fn lens_numbers<U: PrimarySample>(scene: &Scene, u: &mut U) -> [f32; 2] {
    if scene.sensor().is_pinhole() {
        return [0.0; 2];
    }
    u.stream(Stream::Lens);
    let on_lens = u.next2();
    u.stream(Stream::Light);
    on_lens
}

/// Connections of one light subpath to the lens.
struct ToFilm<'a, S> {
    scene: &'a Scene,
    sink: &'a mut S,
    emitter: u32,
}

impl<S: Sink> ToFilm<'_, S> {
    /// Technique (s, 1): connects `vertex` to the point of the lens by its numbers. `scattered`
    /// gives throughput times what the vertex sends in unit direction d.
    #[inline]
    fn connect(
        &mut self,
        trace: &Trace,
        vertex: &Vertex,
        (s, lens): (usize, [f32; 2]),
        families: Families,
        scattered: impl FnOnce(glam::Vec3) -> Rgb,
    ) {
        let scene = self.scene;
        let sensor = scene.sensor();
        let (on_lens, pdf) = sensor.sample_vertex(lens);
        let Vertex::Sensor { p, .. } = on_lens else { return };
        let edge = vertex.edge_to(&on_lens);
        let into_scene = -edge.direction();
        let Some(film) = sensor.film_position(p, into_scene) else { return };
        let factor = edge.geometry_term() * sensor.importance(into_scene) / pdf.value();
        let mut value = scattered(edge.direction()) * factor as f32;
        if scene.has_media() && !value.is_black() {
            value *= scene.transmittance(vertex, &on_lens);
        }
        if value.is_black() || !scene.visible(vertex, &on_lens) {
            return;
        }
        let (s, t, emitter) = (s as u16, 1, self.emitter);
        let contribution =
            Contribution { s, t, emitter, families, ..Contribution::new(film, value) };
        trace.emit(self.sink, contribution, false, || (on_lens, pdf.value()));
    }
}
