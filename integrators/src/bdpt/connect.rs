//! The techniques: each makes contributions of one (s, t) from a light and a sensor subpath.
//!
//! | function | technique | estimate |
//! | --- | --- | --- |
//! | [`Connector::hit_emitter`] | s = 0 | α_z L_e |
//! | [`Connector::next_event`] | s = 1 | α_z f̄ G V L_e / p_direct |
//! | [`Connector::onto_film`] | t = 1 | α_y f̄ G V W_e / p_lens |
//! | [`Connector::hit_lens`] | t = 0 | α_y W_e |
//! | [`Connector::inner`] | s, t ≥ 2 | α_y f̄ G V f̄ α_z |

use glam::{Vec2, Vec3};
use pathspace_core::Scene;
use pathspace_core::bsdf::TransportMode;
use pathspace_core::color::Rgb;
use pathspace_core::emitter::DirectSample;
use pathspace_core::film::{Contribution, Sink};
use pathspace_core::measure::{Density, Mass, SolidAngle};
use pathspace_core::path::{Origin, Path, PathRecord, Technique, TwoWayScatter, Vertex, WalkClass};

use super::subpath::{SubpathVertex, WalkConfig};
use super::verify::verify;
use super::weight::{Side, WeightState};

/// One pair of subpaths and the sink.
pub(super) struct Connector<'a, S> {
    pub scene: &'a Scene,
    pub sink: &'a mut S,
    pub film: Vec2,
    pub light: WalkConfig,
    pub sensor: WalkConfig,
}

/// A connection whose visibility is not known yet.
pub(super) struct Candidate {
    /// w f/p without V.
    pub value: Rgb,
    pub weight: f64,
    pub s: usize,
    pub t: usize,
}

impl<S: Sink> Connector<'_, S> {
    /// Says which emitter the light subpaths that follow start on.
    pub(super) fn begin_light(&mut self, emitter: u32) {
        let delta = self.scene.emitters().get(emitter).is_delta();
        self.light.weights = self.light.weights.for_emitter(delta);
    }

    /// Technique s = 0: the last vertex of `sensor` lies on an emitter.
    pub(super) fn hit_emitter(&mut self, sensor: &[SubpathVertex]) {
        let scene = self.scene;
        let [.., x1, x0] = sensor else { return };
        let k = sensor.len() - 1;
        let Some(emitter) = x0.vertex.emitter() else { return };
        let radiance = scene.emitted_from(&x0.vertex, x0.from);
        let origin = Origin::from(scene.emitters().get(emitter));
        let weights = self.sensor.weights.for_emitter(origin.delta);
        if radiance.is_black() || !weights.techniques.contains(0, k + 1) {
            return;
        }
        let emission = scene.pdf_emission_vertex(&x0.vertex);
        let direct = match x1.vertex.position() {
            Some(p) if k >= 2 => scene.pdf_direct(p, &x0.vertex) / emission,
            _ => 1.0,
        };
        let side = Side {
            vertices: sensor,
            last: emission,
            before: scene.pdf_emission_next(&x0.vertex, &x0.vertex.edge_to(&x1.vertex)),
            connectible: true,
            direct,
        };
        let weight = weights.weight(Side::empty(), side, 1.0);
        let class =
            WalkClass::join(&WalkClass::default(), &x1.class, origin, scene.sensor().is_pinhole());
        let value = x0.throughput * radiance * weight as f32;
        let contribution = Contribution {
            film: self.film,
            value,
            weight: weight as f32,
            s: 0,
            t: (k + 1) as u16,
            emitter,
            families: class,
        };
        self.emit(contribution, &[], sensor, weight, 0.0);
    }

    /// Technique s = 1: x₀ is sampled for the last vertex of `sensor`.
    pub(super) fn next_event(&mut self, sensor: &[SubpathVertex], pick: f32, u: [f32; 2]) {
        let scene = self.scene;
        let Some(p) = sensor.last().and_then(|z| z.vertex.position()) else { return };
        if self.sensor.weights.techniques.contains(1, sensor.len())
            && let Some(direct) = scene.sample_direct(p, pick, u)
        {
            self.connect_direct(sensor, &direct);
        }
    }

    /// Connects x₀ of next-event estimation to the last vertex of `sensor`.
    pub(super) fn connect_direct(&mut self, sensor: &[SubpathVertex], direct: &DirectSample) {
        let scene = self.scene;
        let [.., before, z] = sensor else { return };
        let Vertex::Surface(point) = &z.vertex else { return };
        let k = sensor.len();
        let edge = z.vertex.edge_to(&direct.vertex);
        let mode = TransportMode::Radiance;
        let Some(scatter) = scene.connect_scatter(point, z.from, edge.direction(), mode) else {
            return;
        };
        let value = z.throughput
            * scatter.value
            * direct.radiance
            * (edge.geometry_term() / direct.pdf.value()) as f32;
        if value.is_black() || !scene.visible(&z.vertex, &direct.vertex) {
            return;
        }
        let origin = Origin::from(scene.emitters().get(direct.emitter));
        let x0 = first_vertex(direct.vertex, scene.pdf_emission_vertex(&direct.vertex));
        let (forward, backward) = self.two_ways(&scatter, &self.sensor);
        let light = Side {
            vertices: std::slice::from_ref(&x0),
            last: edge.to_area(forward),
            before: Density::ZERO,
            connectible: true,
            direct: 1.0,
        };
        let sensor_side = Side {
            vertices: sensor,
            last: scene.pdf_emission_next(&direct.vertex, &direct.vertex.edge_to(&z.vertex)),
            before: z.vertex.edge_to(&before.vertex).to_area(backward),
            connectible: true,
            direct: 1.0,
        };
        let own = direct.pdf / x0.pdf;
        let weight = self.sensor.weights.for_emitter(origin.delta).weight(light, sensor_side, own);
        let contribution = Contribution {
            film: self.film,
            value: value * weight as f32,
            weight: weight as f32,
            s: 1,
            t: k as u16,
            emitter: direct.emitter,
            families: WalkClass::join(
                &WalkClass::default(),
                &z.class,
                origin,
                scene.sensor().is_pinhole(),
            ),
        };
        self.emit(contribution, std::slice::from_ref(&x0), sensor, weight, own.ln());
    }

    /// Technique t = 1: the last vertex of `light` is connected to a point of the lens.
    pub(super) fn onto_film(&mut self, light: &[SubpathVertex], emitter: u32, lens: [f32; 2]) {
        let scene = self.scene;
        let sensor = scene.sensor();
        let Some(y) = light.last() else { return };
        let k = light.len();
        let weights = &self.light.weights;
        let origin = Origin::from(scene.emitters().get(emitter));
        if !weights.techniques.contains(k, 1) || (k == 1 && origin.delta) {
            return;
        }
        let (on_lens, lens_pdf) = sensor.sample_vertex(lens);
        let Vertex::Sensor { p, .. } = on_lens else { return };
        let edge = y.vertex.edge_to(&on_lens);
        let into_scene = -edge.direction();
        let Some(film) = sensor.film_position(p, into_scene) else { return };
        let (scattered, forward, backward) = match (&y.vertex, k) {
            (Vertex::Surface(point), 2..) => {
                let mode = TransportMode::Importance;
                let Some(scatter) = scene.connect_scatter(point, y.from, edge.direction(), mode)
                else {
                    return;
                };
                let (forward, backward) = self.two_ways(&scatter, &self.light);
                (scatter.value, edge.to_area(forward), backward)
            }
            (x0, _) => {
                if scene.emitted_from(x0, edge.direction()).is_black() {
                    return;
                }
                (Rgb::WHITE, scene.pdf_emission_next(x0, &edge), Density::ZERO)
            }
        };
        let factor = edge.geometry_term() * sensor.importance(into_scene) / lens_pdf.value();
        let value = y.throughput * scattered * factor as f32;
        if value.is_black() || !scene.visible(&y.vertex, &on_lens) {
            return;
        }
        let lens_vertex = first_vertex(on_lens, lens_pdf);
        let light_side = Side {
            vertices: light,
            last: on_lens.edge_to(&y.vertex).to_area(sensor.pdf_direction(into_scene)),
            before: match light {
                [.., before, _] => y.vertex.edge_to(&before.vertex).to_area(backward),
                _ => Density::ZERO,
            },
            connectible: true,
            direct: y.weight.direct,
        };
        let sensor_side = Side {
            vertices: std::slice::from_ref(&lens_vertex),
            last: forward,
            before: Density::ZERO,
            connectible: true,
            direct: 1.0,
        };
        let weight = weights.weight(light_side, sensor_side, 1.0);
        let contribution = Contribution {
            film,
            value: value * weight as f32,
            weight: weight as f32,
            s: k as u16,
            t: 1,
            emitter,
            families: WalkClass::join(&y.class, &WalkClass::default(), origin, sensor.is_pinhole()),
        };
        self.emit(contribution, light, std::slice::from_ref(&lens_vertex), weight, 0.0);
    }

    /// Technique t = 0: the last vertex of `light` lies on the lens, reached along unit direction `d`.
    pub(super) fn hit_lens(&mut self, light: &[SubpathVertex], emitter: u32, d: Vec3) {
        let scene = self.scene;
        let sensor = scene.sensor();
        let [.., before, lens] = light else { return };
        let k = light.len() - 1;
        let origin = Origin::from(scene.emitters().get(emitter));
        let weights = &self.light.weights;
        if !weights.techniques.contains(k + 1, 0) || (k == 1 && origin.delta) {
            return;
        }
        let Some(p) = lens.vertex.position() else { return };
        let Some(film) = sensor.film_position(p, -d) else { return };
        let edge = lens.vertex.edge_to(&before.vertex);
        let side = Side {
            vertices: light,
            last: sensor.pdf_vertex(),
            before: edge.to_area(sensor.pdf_direction(-d)),
            connectible: true,
            // A path of one edge has no next-event estimation.
            direct: 1.0,
        };
        let weight = weights.weight(side, Side::empty(), 1.0);
        let value = lens.throughput * (sensor.importance(-d) * weight) as f32;
        let contribution = Contribution {
            film,
            value,
            weight: weight as f32,
            s: (k + 1) as u16,
            t: 0,
            emitter,
            families: WalkClass::join(&before.class, &WalkClass::default(), origin, false),
        };
        self.emit(contribution, light, &[], weight, 0.0);
    }

    /// Technique s, t ≥ 2 up to its visibility: the last vertices of both subpaths. Everything that is 0 anyway is
    /// found before a ray is asked for.
    pub(super) fn inner(
        &self,
        light: &[SubpathVertex],
        sensor: &[SubpathVertex],
    ) -> Option<Candidate> {
        let ([.., y_before, y], [.., z_before, z]) = (light, sensor) else { return None };
        let (s, t) = (light.len(), sensor.len());
        if !y.connectible || !self.sensor.weights.techniques.contains(s, t) {
            return None;
        }
        let (Vertex::Surface(py), Vertex::Surface(pz)) = (&y.vertex, &z.vertex) else {
            return None;
        };
        let edge = y.vertex.edge_to(&z.vertex);
        let d = edge.direction();
        let scene = self.scene;
        let at_z = scene.connect_scatter(pz, z.from, -d, TransportMode::Radiance)?;
        let at_y = scene.connect_scatter(py, y.from, d, TransportMode::Importance)?;
        let g = edge.geometry_term();
        let value = y.throughput * at_y.value * at_z.value * z.throughput * g as f32;
        if value.is_black() {
            return None;
        }
        let (y_on, y_back) = self.two_ways(&at_y, &self.light);
        let (z_on, z_back) = self.two_ways(&at_z, &self.sensor);
        let light_side = Side {
            vertices: light,
            last: z.vertex.edge_to(&y.vertex).to_area(z_on),
            before: y.vertex.edge_to(&y_before.vertex).to_area(y_back),
            connectible: true,
            direct: y.weight.direct,
        };
        let sensor_side = Side {
            vertices: sensor,
            last: edge.to_area(y_on),
            before: z.vertex.edge_to(&z_before.vertex).to_area(z_back),
            connectible: true,
            direct: 1.0,
        };
        let weight = self.light.weights.weight(light_side, sensor_side, 1.0);
        Some(Candidate { value: value * weight as f32, weight, s, t })
    }

    /// Traces the connection of a candidate and emits it with `scale` (the inverse probability that it was picked).
    pub(super) fn finish_inner(
        &mut self,
        candidate: &Candidate,
        light: &[SubpathVertex],
        sensor: &[SubpathVertex],
        emitter: u32,
        scale: f32,
    ) {
        let (y, z) = (&light[candidate.s - 1], &sensor[candidate.t - 1]);
        let scene = self.scene;
        if !scene.visible(&y.vertex, &z.vertex) {
            return;
        }
        let origin = Origin::from(scene.emitters().get(emitter));
        let contribution = Contribution {
            film: self.film,
            value: candidate.value * scale,
            weight: candidate.weight as f32,
            s: candidate.s as u16,
            t: candidate.t as u16,
            emitter,
            families: WalkClass::join(&y.class, &z.class, origin, scene.sensor().is_pinhole()),
        };
        let (light, sensor) = (&light[..candidate.s], &sensor[..candidate.t]);
        self.emit(contribution, light, sensor, candidate.weight, 0.0);
    }

    /// Techniques (s, t) for every s ≥ 2 and one t ≥ 2, a shadow ray for each that could contribute.
    pub(super) fn inner_all(
        &mut self,
        light: &[SubpathVertex],
        sensor: &[SubpathVertex],
        emitter: u32,
    ) {
        for s in 2..=light.len() {
            if let Some(candidate) = self.inner(&light[..s], sensor) {
                self.finish_inner(&candidate, light, sensor, emitter, 1.0);
            }
        }
    }

    /// The same sum estimated by one of its terms, picked in proportion to its unoccluded contribution.
    pub(super) fn inner_one(
        &mut self,
        light: &[SubpathVertex],
        sensor: &[SubpathVertex],
        emitter: u32,
        choice: f32,
    ) {
        let candidates: Vec<_> =
            (2..=light.len()).filter_map(|s| self.inner(&light[..s], sensor)).collect();
        let share = |c: &Candidate| c.value.max_channel() as f64;
        let total: f64 = candidates.iter().map(share).sum();
        let mut x = choice as f64 * total;
        for candidate in &candidates {
            if x < share(candidate) {
                let scale = (total / share(candidate)) as f32;
                self.finish_inner(candidate, light, sensor, emitter, scale);
                return;
            }
            x -= share(candidate);
        }
    }

    /// Forward and backward density with this walk's roulette.
    fn two_ways(
        &self,
        scatter: &TwoWayScatter,
        walk: &WalkConfig,
    ) -> (Density<SolidAngle>, Density<SolidAngle>) {
        let q = |q: Mass| if walk.roulette { q } else { Mass::ONE };
        (
            scatter.forward * q(scatter.survival_forward),
            scatter.backward * q(scatter.survival_backward),
        )
    }

    /// Hands a contribution over; with its path where the sink records. `ln_extra` corrects the density of x₀ for next-event estimation.
    fn emit(
        &mut self,
        contribution: Contribution,
        light: &[SubpathVertex],
        sensor: &[SubpathVertex],
        weight: f64,
        ln_extra: f64,
    ) {
        if cfg!(debug_assertions) {
            verify(self.scene, &self.light, light, sensor, weight);
        }
        self.sink.add(contribution);
        if S::RECORDS_PATHS {
            let vertices = light.iter().chain(sensor.iter().rev());
            let ln_pdf = vertices.clone().map(|v| v.pdf.value().ln()).sum::<f64>() + ln_extra;
            self.sink.record(PathRecord {
                path: Path { vertices: vertices.map(|v| v.vertex).collect() },
                technique: Technique::new(contribution.s as usize, contribution.t as usize),
                ln_pdf,
                weight,
                value: contribution.value,
            });
        }
    }
}

/// The first vertex of a subpath, or the only one of a re-sampled end.
pub(super) fn first_vertex(
    vertex: Vertex,
    pdf: Density<pathspace_core::measure::Area>,
) -> SubpathVertex {
    SubpathVertex {
        vertex,
        throughput: Rgb::WHITE,
        from: Vec3::ZERO,
        connectible: true,
        pdf,
        class: WalkClass::default(),
        weight: WeightState { running: 0.0, ratio_before: 0.0, direct: 1.0 },
    }
}
