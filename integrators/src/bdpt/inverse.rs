//! From a path to the numbers by which a technique makes it: the inverse of
//! [`Bdpt::estimate_technique`].

use glam::Vec2;
use pathspace_core::Scene;
use pathspace_core::bsdf::Event;
use pathspace_core::path::{Path, Technique, Vertex};
use pathspace_core::random::{PrimarySample, Stream, nearest_coordinate};
use pathspace_core::walk::Layout;

use super::Bdpt;

/// Numbers of every stream, in the order in which a technique reads them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Numbers {
    streams: [Vec<f32>; Stream::COUNT],
}

impl Numbers {
    /// The numbers of a stream.
    pub fn stream(&self, stream: Stream) -> &[f32] {
        &self.streams[stream as usize]
    }

    /// Adds numbers to a stream, each rounded to the nearest coordinate.
    pub fn push(&mut self, stream: Stream, numbers: &[f32]) {
        let rounded = numbers.iter().map(|&u| nearest_coordinate(u.into()));
        self.streams[stream as usize].extend(rounded);
    }

    fn len(&self, stream: Stream) -> usize {
        self.streams[stream as usize].len()
    }
}

impl Bdpt {
    /// Appends to `numbers` those by which technique (s, t) makes the path; the first ones of the
    /// streams Sensor and Light may be there already ([`Layout::shared`]). `film` is where the path
    /// lands. `None` where a sampler has no inverse at the path.
    ///
    /// Numbers on which the path does not depend are drawn from `free`; where a choice has an
    /// interval of numbers, uniformly in it. So if x̄ has density p_{s,t}, the numbers are uniform:
    /// a probabilistic inverse of the technique (Bitterli et al. 2017, §4). Numbers that the
    /// technique does not read at all are left out.
    ///
    /// Whether the technique goes the whole way (visibility, delta lobes) is seen by doing so.
    pub fn invert_technique<U: PrimarySample>(
        &self,
        scene: &Scene,
        path: &Path,
        film: Vec2,
        technique: Technique,
        numbers: &mut Numbers,
        free: &mut U,
    ) -> Option<()> {
        let (Technique { s, t }, v) = (technique, &path.vertices);
        let k = path.length();
        if s + t != k + 1 {
            return None;
        }
        let layout = Layout::new(scene, technique);
        if numbers.len(Stream::Sensor) < layout.sensor {
            if numbers.len(Stream::Sensor) == 0 {
                numbers.push(Stream::Sensor, &scene.sensor().invert_film(film));
                if !scene.sensor().is_pinhole() {
                    numbers.push(Stream::Sensor, &on_lens(scene, &v[k])?);
                }
            }
            for j in 1..t {
                let i = k - j;
                let arrived = Layout::walk(layout.sensor_start, layout.flight, j + 1);
                if numbers.len(Stream::Sensor) < arrived {
                    numbers.push(Stream::Sensor, &scene.invert_flight(&v[i + 1], &v[i], free)?);
                }
                if j + 1 < t && numbers.len(Stream::Sensor) < arrived + 3 {
                    let u = event(scene, [&v[i + 1], &v[i], &v[i - 1]], path.events[i], free)?;
                    numbers.push(Stream::Sensor, &u);
                }
            }
        }
        if numbers.len(Stream::Light) < layout.light {
            if numbers.len(Stream::Light) == 0 {
                numbers.push(Stream::Light, &scene.invert_emission_vertex(&v[0], free)?);
            }
            if s >= 2 && numbers.len(Stream::Light) < Layout::LIGHT_START {
                numbers.push(Stream::Light, &scene.invert_emission_next(&v[0], &v[1])?);
            }
            for j in 1..s {
                let arrived = Layout::walk(Layout::LIGHT_START, layout.flight, j + 1);
                if numbers.len(Stream::Light) < arrived {
                    numbers.push(Stream::Light, &scene.invert_flight(&v[j - 1], &v[j], free)?);
                }
                if j + 1 < s && numbers.len(Stream::Light) < arrived + 3 {
                    let u = event(scene, [&v[j - 1], &v[j], &v[j + 1]], path.events[j], free)?;
                    numbers.push(Stream::Light, &u);
                }
            }
        }
        if t == 1 && !scene.sensor().is_pinhole() {
            numbers.push(Stream::Lens, &on_lens(scene, &v[k])?);
        }
        if s == 1 && t >= 2 {
            let u = scene.invert_direct(v[1].position()?, &v[0], free)?;
            numbers.push(Stream::Connection, &u);
        }
        Some(())
    }
}

fn event<U: PrimarySample>(
    scene: &Scene,
    [before, at, after]: [&Vertex; 3],
    event: Event,
    free: &mut U,
) -> Option<[f32; 3]> {
    let from = at.edge_to(before).direction();
    match at {
        Vertex::Surface(point) => scene.invert_scatter(point, from, point.aim(after), event, free),
        Vertex::Medium(point) => {
            let phase = scene.medium(point.medium)?.phase();
            Some(phase.invert(from, at.edge_to(after).direction(), free.next()))
        }
        _ => None,
    }
}

fn on_lens(scene: &Scene, lens: &Vertex) -> Option<[f32; 2]> {
    scene.sensor().invert_vertex(lens.position()?)
}
