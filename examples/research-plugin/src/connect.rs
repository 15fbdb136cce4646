//! Vertex connection: the techniques of bidirectional path tracing, with merges in the denominator of their weights.
//!
//! | function | technique | estimate | weight |
//! | --- | --- | --- | --- |
//! | [`Connector::hit_emitter`] | s = 0 | α_z L_e | eqs. 42, 43 |
//! | [`Connector::next_event`] | s = 1 | α_z f̄ G V L_e / p_direct | eqs. 44, 45 |
//! | [`Connector::onto_film`] | t = 1 | α_y f̄ G V W_e / p_lens | eqs. 46, 47 |
//! | [`Connector::inner`] | s, t ≥ 2 | α_y f̄ G V f̄ α_z | eqs. 40, 41 |
//!
//! Equations are those of the technical report (Georgiev 2012); see `weight`.

use pathspace::core::bsdf::TransportMode;
use pathspace::core::color::Rgb;
use pathspace::core::emitter::DirectSample;
use pathspace::core::film::{Contribution, Families, Sink};
use pathspace::core::glam::Vec2;
use pathspace::core::measure::{Area, Density};
use pathspace::core::path::{Path, PathRecord, Technique, TwoWayScatter, Vertex, WalkClass};

use crate::subpath::{LightSubpath, SubpathVertex, Walks};

/// Makes contributions of one sample and hands them to the sink.
pub(crate) struct Connector<'a, S> {
    pub walks: Walks<'a>,
    pub sink: &'a mut S,
    /// Where the sensor subpath starts.
    pub film: Vec2,
}

/// A path as the technique made it: its two sides in walk order, and what the technique says of it.
pub(crate) struct Made<'a> {
    pub film: Vec2,
    /// f/p.
    pub value: Rgb,
    pub weight: f64,
    pub light: &'a [SubpathVertex],
    pub sensor: &'a [SubpathVertex],
    pub emitter: u32,
    /// ln of what p is beside the product of the vertices' densities: of x₀ for next-event estimation, of a merge.
    pub ln_extra: f64,
}

impl<S: Sink> Connector<'_, S> {
    /// Technique s = 0: the last vertex of `sensor` lies on an emitter.
    pub(crate) fn hit_emitter(&mut self, sensor: &[SubpathVertex]) {
        let [.., x1, x0] = sensor else { return };
        let Some(emitter) = x0.vertex.emitter() else { return };
        let scene = self.walks.scene;
        let radiance = scene.emitted_from(&x0.vertex, x0.from);
        if radiance.is_black() {
            return;
        }
        let weight = self.hit_weight(sensor, x1, x0);
        self.emit(&Made {
            film: self.film,
            value: x0.throughput * radiance,
            weight,
            light: &[],
            sensor,
            emitter,
            ln_extra: 0.0,
        });
    }

    /// w of s = 0: only the sensor side has other techniques.
    pub(crate) fn hit_weight(
        &self,
        sensor: &[SubpathVertex],
        x1: &SubpathVertex,
        x0: &SubpathVertex,
    ) -> f64 {
        let (scene, weights) = (self.walks.scene, &self.walks.weights);
        let emission = scene.pdf_emission_vertex(&x0.vertex);
        // x₀ of (1, 1) is sampled by emission, of (1, t) for x₁.
        let direct = match x1.vertex.position() {
            Some(p) if sensor.len() > 2 => scene.pdf_direct(p, &x0.vertex) / emission,
            _ => 1.0,
        };
        let next = scene.pdf_emission_next(&x0.vertex, &x0.vertex.edge_to(&x1.vertex));
        let k = weights.arrive(x1, x0, true, direct, next);
        weights.connection(1.0, 0.0, weights.power(emission / x0.pdf) * k)
    }

    /// Technique s = 1: x₀ is sampled for the last vertex of `sensor`.
    pub(crate) fn next_event(&mut self, sensor: &[SubpathVertex], pick: f32, u: [f32; 2]) {
        let Some(p) = sensor.last().and_then(|z| z.vertex.position()) else { return };
        if let Some(direct) = self.walks.scene.sample_direct(p, pick, u) {
            self.connect_direct(sensor, &direct);
        }
    }

    /// Connects x₀ of next-event estimation to the last vertex of `sensor`.
    pub(crate) fn connect_direct(&mut self, sensor: &[SubpathVertex], direct: &DirectSample) {
        let (scene, weights) = (self.walks.scene, self.walks.weights);
        let [.., before, z] = sensor else { return };
        let Vertex::Surface(point) = &z.vertex else { return };
        let edge = z.vertex.edge_to(&direct.vertex);
        let mode = TransportMode::Radiance;
        let Some(scatter) = scene.connect_scatter(point, z.from, edge.direction(), mode) else {
            return;
        };
        let factor = edge.geometry_term() / direct.pdf.value();
        let value = z.throughput * scatter.value * direct.radiance * factor as f32;
        if value.is_black() || !scene.visible(&z.vertex, &direct.vertex) {
            return;
        }
        let (forward, backward) = two_ways(&scatter, &edge, z, before);
        let emission = scene.pdf_emission_vertex(&direct.vertex);
        let next = scene.pdf_emission_next(&direct.vertex, &direct.vertex.edge_to(&z.vertex));
        let k = weights.arrive(before, z, true, 1.0, backward);
        let own = direct.pdf / emission;
        let light = weights.power(forward / emission) * self.walks.start(direct.emitter);
        let x0 = SubpathVertex::first(direct.vertex, emission, Rgb::WHITE);
        self.emit(&Made {
            film: self.film,
            value,
            weight: weights.connection(own, light, weights.side(z, next, k)),
            light: std::slice::from_ref(&x0),
            sensor,
            emitter: direct.emitter,
            ln_extra: own.ln(),
        });
    }

    /// Technique t = 1: the last vertex of `light` is connected to a point of the lens.
    pub(crate) fn onto_film(&mut self, light: &[SubpathVertex], emitter: u32, lens: [f32; 2]) {
        let (scene, weights) = (self.walks.scene, self.walks.weights);
        let sensor = scene.sensor();
        let Some(y) = light.last() else { return };
        // A delta emitter has no image of its own.
        if light.len() == 1 && scene.emitters().get(emitter).is_delta() {
            return;
        }
        let (on_lens, lens_pdf) = sensor.sample_vertex(lens);
        let Vertex::Sensor { p, .. } = on_lens else { return };
        let edge = y.vertex.edge_to(&on_lens);
        let into_scene = -edge.direction();
        let Some(film) = sensor.film_position(p, into_scene) else { return };
        let seen = on_lens.edge_to(&y.vertex).to_area(sensor.pdf_direction(into_scene));
        let (scattered, side) = match (&y.vertex, light) {
            (Vertex::Surface(point), [.., before, _]) => {
                let mode = TransportMode::Importance;
                let Some(scatter) = scene.connect_scatter(point, y.from, edge.direction(), mode)
                else {
                    return;
                };
                let (_, backward) = two_ways(&scatter, &edge, y, before);
                let k = weights.arrive(before, y, true, y.direct, backward);
                (scatter.value, weights.side(y, seen, k))
            }
            (x0, _) => {
                if scene.emitted_from(x0, edge.direction()).is_black() {
                    return;
                }
                (Rgb::WHITE, weights.power(seen / y.pdf) * self.walks.start(emitter))
            }
        };
        let factor = edge.geometry_term() * sensor.importance(into_scene) / lens_pdf.value();
        let value = y.throughput * scattered * factor as f32;
        if value.is_black() || !scene.visible(&y.vertex, &on_lens) {
            return;
        }
        let lens = SubpathVertex::first(on_lens, lens_pdf, Rgb::WHITE);
        self.emit(&Made {
            film,
            value,
            weight: weights.connection(1.0, side, 0.0),
            light,
            sensor: std::slice::from_ref(&lens),
            emitter,
            ln_extra: 0.0,
        });
    }

    /// Technique s, t ≥ 2: connects the last vertices of both subpaths.
    pub(crate) fn inner(
        &mut self,
        light: &[SubpathVertex],
        sensor: &[SubpathVertex],
        emitter: u32,
    ) {
        let (scene, weights) = (self.walks.scene, self.walks.weights);
        let ([.., y_before, y], [.., z_before, z]) = (light, sensor) else { return };
        let (Vertex::Surface(py), Vertex::Surface(pz)) = (&y.vertex, &z.vertex) else { return };
        let edge = y.vertex.edge_to(&z.vertex);
        let back = z.vertex.edge_to(&y.vertex);
        let d = edge.direction();
        let Some(at_z) = scene.connect_scatter(pz, z.from, -d, TransportMode::Radiance) else {
            return;
        };
        let Some(at_y) = scene.connect_scatter(py, y.from, d, TransportMode::Importance) else {
            return;
        };
        let g = edge.geometry_term() as f32;
        let value = y.throughput * at_y.value * at_z.value * z.throughput * g;
        if value.is_black() || !scene.visible(&y.vertex, &z.vertex) {
            return;
        }
        let (y_on, y_back) = two_ways(&at_y, &edge, y, y_before);
        let (z_on, z_back) = two_ways(&at_z, &back, z, z_before);
        let k_light = weights.arrive(y_before, y, true, y.direct, y_back);
        let k_sensor = weights.arrive(z_before, z, true, 1.0, z_back);
        let sides = (weights.side(y, z_on, k_light), weights.side(z, y_on, k_sensor));
        self.emit(&Made {
            film: self.film,
            value,
            weight: weights.connection(1.0, sides.0, sides.1),
            light,
            sensor,
            emitter,
            ln_extra: 0.0,
        });
    }

    /// Everything that a sensor subpath makes with one light subpath and x₀ sampled by `u`, which gives three numbers for each vertex.
    pub(crate) fn connect(
        &mut self,
        light: &LightSubpath,
        sensor: &[SubpathVertex],
        (pick, on_emitter): (f32, [f32; 2]),
    ) {
        let (t, max) = (sensor.len(), self.walks.max_length);
        if t > max || !sensor.last().is_some_and(|z| z.connectible) {
            return;
        }
        self.next_event(sensor, pick, on_emitter);
        for s in 2..=light.vertices.len().min(max + 1 - t) {
            if light.vertices[s - 1].connectible {
                self.inner(&light.vertices[..s], sensor, light.emitter);
            }
        }
    }

    /// Hands a path over; whole where the sink records.
    pub(crate) fn emit(&mut self, made: &Made<'_>) {
        let technique = Technique::new(made.light.len(), made.sensor.len());
        let value = made.value * made.weight as f32;
        self.sink.add(Contribution {
            film: made.film,
            value,
            weight: made.weight as f32,
            s: technique.s as u16,
            t: technique.t as u16,
            emitter: made.emitter,
            families: self.families(made),
        });
        if S::RECORDS_PATHS {
            let vertices = || made.light.iter().chain(made.sensor.iter().rev());
            let ln_pdf = vertices().map(|v| v.pdf.value().ln()).sum::<f64>() + made.ln_extra;
            self.sink.record(PathRecord {
                path: Path { vertices: vertices().map(|v| v.vertex).collect() },
                technique,
                ln_pdf,
                weight: made.weight,
                value,
            });
        }
    }

    fn families(&self, made: &Made<'_>) -> Families {
        let scene = self.walks.scene;
        let class =
            |side: &[SubpathVertex]| side.last().map_or_else(WalkClass::default, |v| v.class);
        let sensor = match made.sensor {
            // x₀ itself does not scatter.
            [.., x1, _] if made.light.is_empty() => x1.class,
            side => class(side),
        };
        WalkClass::join(
            &class(made.light),
            &sensor,
            scene.emitters().get(made.emitter).into(),
            scene.sensor().is_pinhole(),
        )
    }
}

/// Densities at an end of a connection: of the other end from here, and of the vertex before from the other side. Roulette included.
pub(crate) fn two_ways(
    scatter: &TwoWayScatter,
    edge: &pathspace::core::measure::Edge,
    last: &SubpathVertex,
    before: &SubpathVertex,
) -> (Density<Area>, Density<Area>) {
    let forward = edge.to_area(scatter.forward * scatter.survival_forward);
    let back = last.vertex.edge_to(&before.vertex);
    (forward, back.to_area(scatter.backward * scatter.survival_backward))
}
