//! Vertex merging: x_i of the path is the last vertex of a sensor subpath, and a light subpath ended within the radius of it.
//!
//! With Φ the flux α_y of a light subpath that arrives at y (area density p_light(y) in it), the estimate is
//!
//! (1/η) α_y f̄(ω_y, ω_z) α_z, η = N π r² (Georgiev et al. 2012, eqs. 6–8; Hachisuka, Pantaleoni and Jensen 2012, eq. 10),
//!
//! summed over the photons y within r. It takes x_i for y, and with it the flux around x_i for that at x_i: a bias of O(r²) on flat surfaces, of
//! O(r) at edges and shadows, gone with r.

use pathspace::core::bsdf::TransportMode;
use pathspace::core::film::Sink;
use pathspace::core::path::{TwoWayScatter, Vertex};

use crate::connect::{Connector, Made};
use crate::photons::PhotonGrid;
use crate::subpath::{LightSubpath, SubpathVertex};

impl<S: Sink> Connector<'_, S> {
    /// Merges the last vertex of `sensor` with every photon near it.
    pub(crate) fn merge(
        &mut self,
        sensor: &[SubpathVertex],
        photons: &PhotonGrid,
        light: &[LightSubpath],
    ) {
        let Some(p) = sensor.last().filter(|z| z.merges).and_then(|z| z.vertex.position()) else {
            return;
        };
        photons.within(p, |photon| {
            let subpath = &light[photon.path as usize];
            let vertices = &subpath.vertices[..=photon.vertex as usize];
            self.merge_one(vertices, sensor, subpath.emitter);
        });
    }

    /// Merges the last vertices of two subpaths.
    pub(crate) fn merge_one(
        &mut self,
        light: &[SubpathVertex],
        sensor: &[SubpathVertex],
        emitter: u32,
    ) {
        let ([before @ .., y], Some(z)) = (light, sensor.last()) else { return };
        let Vertex::Surface(point) = &z.vertex else { return };
        // The merged vertex is on both sides: k = s + t − 1 edges with s not counting it.
        if before.len() + sensor.len() > self.walks.max_length + 1 {
            return;
        }
        let mode = TransportMode::Radiance;
        let Some(scatter) = self.walks.scene.connect_scatter(point, z.from, y.from, mode) else {
            return;
        };
        let Some(weight) = self.merge_weight(light, sensor, &scatter) else { return };
        let eta = self.walks.weights.eta;
        self.emit(&Made {
            film: self.film,
            value: y.throughput * scatter.value * z.throughput * (1.0 / eta) as f32,
            weight,
            light: before,
            sensor,
            emitter,
            ln_extra: (eta * y.pdf.value()).ln(),
        });
    }

    /// w of the merge of the last vertices; `scatter` is that of the sensor's vertex, which came from its side and looks along the photon's.
    pub(crate) fn merge_weight(
        &self,
        light: &[SubpathVertex],
        sensor: &[SubpathVertex],
        scatter: &TwoWayScatter,
    ) -> Option<f64> {
        let ([.., y_before, y], [.., z_before, z]) = (light, sensor) else { return None };
        let weights = &self.walks.weights;
        // p′ of the vertices beside x_i: the sensor walk goes on along the photon's edge, the light walk along the sensor's.
        let to_light = y.vertex.edge_to(&y_before.vertex);
        let y_opposite = to_light.to_area(scatter.forward * scatter.survival_forward);
        let to_sensor = z.vertex.edge_to(&z_before.vertex);
        let z_opposite = to_sensor.to_area(scatter.backward * scatter.survival_backward);
        let k_light = weights.arrive(y_before, y, true, y.direct, y_opposite);
        let k_sensor = weights.arrive(z_before, z, true, 1.0, z_opposite);
        Some(weights.merging((k_light, y.pdf), (k_sensor, z.pdf)))
    }
}
