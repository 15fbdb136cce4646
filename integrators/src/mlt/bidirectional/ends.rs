//! The two ends that a deletion leaves, and the ways in which new vertices can join them.

use glam::Vec3;
use pathspace_core::Scene;

use super::super::mutator::Kept;
use super::super::path::MltPath;

/// What is known of the kept parts before anything new is sampled.
pub(super) struct Ends {
    /// The kept parts.
    pub kept: Kept,
    /// A connection may end at the last kept vertex of the emitter side.
    light: bool,
    /// A connection may end at the last kept vertex of the sensor side.
    sensor: bool,
    /// Some emitter can be hit.
    non_delta_emitters: bool,
    pinhole: bool,
}

impl Ends {
    /// The ends of `x` where `kept` stays. Of two paths that share their kept parts it is the same.
    pub(super) fn new(scene: &Scene, x: &MltPath, kept: Kept, non_delta_emitters: bool) -> Self {
        let n = x.length() + 1;
        let Kept { light, sensor } = kept;
        // By what the surface can do: the event there is chosen anew.
        let connectible = |i: usize, before: Vec3| {
            x.vertices()[i].surface().is_some_and(|point| scene.is_connectible(point, before))
        };
        Ends {
            kept,
            light: light <= 1 || connectible(light - 1, -x.edge(light - 2).direction()),
            sensor: sensor <= 1 || connectible(n - sensor, x.edge(n - sensor).direction()),
            non_delta_emitters,
            // The last vertex is the sensor's in every path.
            pinhole: x.is_specular(n - 1),
        }
    }

    /// Whether `added` vertices can come from techniques with s emitter-side vertices, as far as
    /// the ends tell.
    fn can_split(&self, added: usize, s: usize) -> bool {
        let Kept { light, sensor } = self.kept;
        let Some(t) = (light + sensor + added).checked_sub(s) else { return false };
        if s < light || t < sensor {
            return false;
        }
        // Only a new vertex can end on the lens.
        let light_end = match s {
            0 => self.non_delta_emitters,
            _ if s == light => self.light && t > 0,
            _ => true,
        };
        let sensor_end = match t {
            0 => !self.pinhole,
            _ if t == sensor => self.sensor,
            _ => true,
        };
        light_end && sensor_end
    }

    /// The values of s by which `added` vertices may be made: s − `light` of them from the emitter
    /// side, the rest from the sensor.
    pub(super) fn splits(&self, added: usize) -> impl Iterator<Item = usize> + '_ {
        (self.kept.light..=self.kept.light + added).filter(move |&s| self.can_split(added, s))
    }
}
