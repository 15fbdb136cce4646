//! One technique alone, with the weight that it has among all.

use pathspace_core::Scene;
use pathspace_core::film::{Contribution, Sink};
use pathspace_core::path::{PathRecord, Technique};
use pathspace_core::random::{PrimarySample, Stream};
use pathspace_core::walk::{always, next_event_numbers};

use super::{Bdpt, Sample};

impl Bdpt {
    /// Makes one estimate of w_{s,t} f by technique (s, t) alone, for the whole crop window: walks
    /// of exactly as many vertices, one connection. At most one contribution.
    ///
    /// Numbers of the sensor subpath come from [`Stream::Sensor`], of the light subpath from
    /// [`Stream::Light`], of a point on the lens for t = 1 from [`Stream::Lens`], of a point on an
    /// emitter for s = 1 from [`Stream::Connection`].
    pub fn estimate_technique<U: PrimarySample, S: Sink>(
        &self,
        scene: &Scene,
        technique: Technique,
        u: &mut U,
        sink: &mut S,
    ) {
        let Technique { s, t } = technique;
        if s + t < 2 || !self.techniques.contains(s, t) {
            return;
        }
        let mut walks = self.walks(scene);
        walks.restrict(s, t);
        let mut sink = Only { sink, technique, last: false };
        let mut sample = Sample { scene, walks: &walks, sink: &mut sink, film: glam::Vec2::ZERO };
        if t <= 1 {
            u.stream(Stream::Light);
            let light = sample.light_subpath(u, always);
            // t = 0 was made on the way.
            if t == 1 && light.vertices.len() == s && light.vertices[s - 1].connectible {
                u.stream(Stream::Lens);
                let on_lens = walks.lens(u);
                sample.onto_lens(&light.vertices, on_lens);
            }
            return;
        }
        u.stream(Stream::Sensor);
        let mut sensor = walks.sensor_subpath(scene, None, u, always);
        sample.film = sensor.film;
        if s == 0 {
            if sensor.vertices.len() == t {
                sample.connect(&[], &sensor.vertices);
            } else if sensor.vertices.len() + 1 == t {
                walks.on_background(scene, &mut sensor, |sensor| sample.connect(&[], sensor));
            }
            return;
        }
        let arrived = sensor.vertices.len() == t && sensor.vertices[t - 1].connectible;
        if !arrived {
            return;
        }
        if s == 1 {
            u.stream(Stream::Connection);
            let numbers = next_event_numbers(u);
            sample.next_event(&sensor.vertices, numbers);
            return;
        }
        u.stream(Stream::Light);
        let light = sample.light_subpath(u, always);
        if light.vertices.len() == s {
            sample.connect(&light.vertices, &sensor.vertices);
        }
    }
}

/// Lets one technique through: a light subpath may meet the lens before its last vertex.
struct Only<'a, S> {
    sink: &'a mut S,
    technique: Technique,
    last: bool,
}

impl<S: Sink> Sink for Only<'_, S> {
    const RECORDS_PATHS: bool = S::RECORDS_PATHS;

    fn add(&mut self, c: Contribution) {
        self.last = Technique::new(c.s as usize, c.t as usize) == self.technique;
        if self.last {
            self.sink.add(c);
        }
    }

    fn record(&mut self, record: PathRecord) {
        if self.last {
            self.sink.record(record);
        }
    }
}
