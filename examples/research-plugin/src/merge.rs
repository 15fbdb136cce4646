//! Vertex merging: x_i of the path is the last vertex of a sensor subpath, and a light subpath
//! ended within the radius of it.
//!
//! With Φ the flux α_y of a light subpath that arrives at y (area density p_light(y) in it), the
//! estimate is
//!
//! (1/η) α_y f̄(ω_y, ω_z) α_z, η = N π r² (Georgiev et al. 2012, eqs. 6–8; Hachisuka, Pantaleoni
//! and Jensen 2012, eq. 10),
//!
//! summed over the photons y within r. It takes x_i for y, and with it the flux around x_i for that
//! at x_i: a bias of O(r²) on flat surfaces, of O(r) at edges and shadows, gone with r.

use pathspace::core::Scene;
use pathspace::core::bsdf::TransportMode;
use pathspace::core::film::{Contribution, Sink};
use pathspace::core::glam::Vec2;
use pathspace::core::measure::Density;
use pathspace::core::path::{PathRecord, Technique, Vertex, WalkClass};
use pathspace::core::walk::{Side, WalkVertex, Walks, joined};

use crate::photons::PhotonGrid;

/// The merges of one sensor subpath.
pub(crate) struct Merger<'a> {
    pub scene: &'a Scene,
    pub walks: &'a Walks,
    pub eta: f64,
    /// Where the sensor subpath starts.
    pub film: Vec2,
}

impl Merger<'_> {
    /// Merges the last vertex of `sensor` with every photon near it.
    pub(crate) fn merge<S: Sink>(
        &self,
        sensor: &[WalkVertex],
        photons: &PhotonGrid,
        light: &[Vec<WalkVertex>],
        sink: &mut S,
    ) {
        let last = sensor.last().filter(|z| z.connectible && z.from != Default::default());
        let Some(Vertex::Surface(point)) = last.map(|z| z.vertex) else { return };
        photons.within(point.p, |photon| {
            let light = &light[photon.path as usize][..=photon.vertex as usize];
            self.merge_one(light, sensor, sink);
        });
    }

    /// Merges the last vertices of two subpaths.
    pub(crate) fn merge_one<S: Sink>(
        &self,
        light: &[WalkVertex],
        sensor: &[WalkVertex],
        sink: &mut S,
    ) {
        let ([x0, ..], [before @ .., y], [.., z_before, z]) = (light, light, sensor) else {
            return;
        };
        let (Some(y_before), Some(emitter)) = (before.last(), x0.vertex.emitter()) else { return };
        let (scene, walks) = (self.scene, self.walks);
        let Vertex::Surface(point) = &z.vertex else { return };
        // The merged vertex is on both sides: k = s + t − 1 edges with s not counting it.
        if before.len() + sensor.len() > walks.max + 1 {
            return;
        }
        let mode = TransportMode::Radiance;
        let Some(scatter) = scene.connect_scatter(point, z.from, y.from, mode) else { return };
        // p′ of the vertices beside x_i: the sensor walk goes on along the photon's edge, the light
        // walk along the sensor's.
        let to_light = y.vertex.edge_to(&y_before.vertex);
        let to_sensor = z.vertex.edge_to(&z_before.vertex);
        let side = |vertices, before, direct| Side {
            vertices,
            last: Density::ZERO,
            before,
            connectible: true,
            merges: true,
            direct,
        };
        let y_before = to_light.to_area(scatter.forward * scatter.survival_forward);
        let z_before = to_sensor.to_area(scatter.backward * scatter.survival_backward);
        let sides = (side(light, y_before, y.weight.direct), side(sensor, z_before, 1.0));
        let Some(weight) = walks.light.weights.merge_weight(sides.0, sides.1) else { return };
        let value = y.throughput * scatter.value * z.throughput * (1.0 / self.eta) as f32;
        let value = value * weight as f32;
        let technique = Technique::new(before.len(), sensor.len());
        let origin = scene.emitters().get(emitter).into();
        let (light_class, sensor_class) = (y.class, z.class_at_connection());
        sink.add(Contribution {
            weight: weight as f32,
            s: technique.s as u16,
            t: technique.t as u16,
            emitter,
            families: WalkClass::join(
                &light_class,
                &sensor_class,
                origin,
                scene.sensor().is_pinhole(),
            ),
            ..Contribution::new(self.film, value)
        });
        if S::RECORDS_PATHS {
            let mut path = joined(before, sensor);
            // The light subpath went on from its last vertex here.
            path.events[before.len() - 1] = before[before.len() - 1].event;
            let vertices = before.iter().chain(sensor);
            let ln_pdf =
                vertices.map(|v| v.pdf.value().ln()).sum::<f64>() + (self.eta * y.pdf.value()).ln();
            sink.record(PathRecord { path, technique, ln_pdf, weight, value });
        }
    }
}
