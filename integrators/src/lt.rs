//! Light tracing (Arvo 1986; Dutré et al. 1993): technique t = 1 for every s.
//!
//! The light subpath x₀, x₁, … is sampled vertex by vertex and every vertex that spreads light is connected to a point of
//! the lens. What is seen directly in or through a smooth mirror or glass has no such technique: those
//! parts of the image stay black, and comparisons leave them out ([`Families`]).

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::bsdf::TransportMode;
use pathspace_core::color::Rgb;
use pathspace_core::emitter::NextDensity;
use pathspace_core::film::{Contribution, Families, Sink};
use pathspace_core::integrator::{
    Integrator, IntegratorError, MonteCarlo, PathEstimator, Run, State,
};
use pathspace_core::measure::{Edge, Mass};
use pathspace_core::path::{Origin, Vertex, WalkClass, WalkRules};
use pathspace_core::random::{PrimarySample, Stream};

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
        let (pick, position, direction) = (u.next(), u.next2(), u.next2());
        let Some(emission) = scene.sample_emission(pick, position, direction) else { return };
        let mut trace = Trace::default();
        trace.push::<S>(|| emission.vertex, || emission.pdf.value());
        let mut walk = Walk {
            scene,
            sink,
            emitter: emission.emitter,
            origin: scene.emitters().get(emission.emitter).into(),
            class: WalkClass::default(),
            trace,
        };
        if !self.rules.allows(1) {
            return;
        }
        if !walk.origin.delta {
            let lens = walk.lens(u);
            let alpha = emission.radiance * (1.0 / emission.pdf.value()) as f32;
            walk.connect(&emission.vertex, 1, lens, |d| {
                // Emission of a surface is one-sided.
                let emitted = scene.emitted_from(&emission.vertex, d);
                if emitted.is_black() { Rgb::BLACK } else { alpha }
            });
        }
        // G/p(x₁|x₀) = |cos θ₀|/p_σ, or 1/p_⊥ for a beam.
        let mut throughput = emission.throughput();
        let mut ray = emission.ray;
        let mut before = emission.vertex;
        let mut next = emission.next;
        for index in 1.. {
            if throughput.is_black() || !self.rules.allows(index + 1) {
                return;
            }
            let Some(point) = scene.intersect(&ray) else { return };
            let vertex = Vertex::Surface(point);
            let delta = scene.is_delta_at(&point, -ray.d);
            walk.class.push(!delta);
            walk.trace.push::<S>(
                || vertex,
                || next.to_area(&Edge::new(&before.end(), &vertex.end())).value(),
            );
            let lens = walk.lens(u);
            if !delta {
                walk.connect(&vertex, index + 1, lens, |d| {
                    scene.scatter(&point, -ray.d, d) * throughput
                });
            }
            let (lobe, direction) = (u.next(), u.next2());
            let mode = TransportMode::Importance;
            let Some(sample) = scene.sample_scatter(&point, -ray.d, mode, lobe, direction) else {
                return;
            };
            let roulette = index >= self.rules.rr_depth as usize;
            let q = if roulette { sample.survival } else { Mass::ONE };
            if roulette && u.next() as f64 >= q.value() {
                return;
            }
            throughput *= sample.weight * (1.0 / q.value()) as f32;
            before = vertex;
            next = NextDensity::Direction(sample.pdf * q);
            ray = point.spawn(sample.direction);
        }
    }
}

/// The light subpath so far.
struct Walk<'a, S> {
    scene: &'a Scene,
    sink: &'a mut S,
    emitter: u32,
    origin: Origin,
    class: WalkClass,
    trace: Trace,
}

impl<S: Sink> Walk<'_, S> {
    /// Numbers for a point of the lens, none for a pinhole.
    #[inline]
    fn lens<U: PrimarySample>(&self, u: &mut U) -> [f32; 2] {
        if self.scene.sensor().is_pinhole() {
            return [0.0; 2];
        }
        u.stream(Stream::Lens);
        let on_lens = u.next2();
        u.stream(Stream::Light);
        on_lens
    }

    /// Technique (s, 1): connects the last vertex to the lens. `scattered` gives throughput times what the vertex sends in
    /// unit direction d.
    #[inline]
    fn connect(
        &mut self,
        vertex: &Vertex,
        s: usize,
        lens: [f32; 2],
        scattered: impl FnOnce(glam::Vec3) -> Rgb,
    ) {
        let scene = self.scene;
        let sensor = scene.sensor();
        let (on_lens, pdf) = sensor.sample_vertex(lens);
        let Vertex::Sensor { p, .. } = on_lens else { return };
        let edge = vertex.edge_to(&on_lens);
        let into_scene = -edge.direction();
        let Some(film) = sensor.film_position(p, into_scene) else { return };
        let importance = sensor.importance(into_scene);
        let factor = edge.geometry_term() * importance / pdf.value();
        let value = scattered(edge.direction()) * factor as f32;
        if value.is_black() || !scene.visible(vertex, &on_lens) {
            return;
        }
        let pinhole = sensor.is_pinhole();
        let mode = TransportMode::Importance;
        let contribution = Contribution {
            film,
            value,
            weight: 1.0,
            s: s as u16,
            t: 1,
            emitter: self.emitter,
            families: self.class.families(mode, self.origin, pinhole),
        };
        self.trace.emit(self.sink, contribution, false, || (Some(on_lens), pdf.value()));
    }
}
