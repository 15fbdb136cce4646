//! Every technique of one pair of subpaths, such that each can be made again alone.
//!
//! A chain on the primary sample space of one technique (s, t) starts at numbers that
//! [`Bdpt::estimate_technique`] turns into a path. Two subpaths give such numbers for all
//! techniques at once. Densities know no roulette there, because s and t are given; walks that
//! nothing ends are cut short by roulette all the same, as a matter of sampling: technique (s, t)
//! of a pair exists with probability P = Π q over the scattering events of both walks, so that E Σ
//! C/P is the sum of the integrals of all techniques.

use pathspace_core::Scene;
use pathspace_core::film::{Contribution, Sink};
use pathspace_core::measure::Mass;
use pathspace_core::path::Technique;
use pathspace_core::random::{Address, PrimarySample, RandomStream, Stream};
use pathspace_core::walk::next_event_numbers;

use super::{Bdpt, Sample};

/// The numbers of one technique among those of one pair of subpaths.
///
/// Subpaths are shared by all techniques; points on the lens (t = 1) belong to s and points on
/// emitters (s = 1) to t.
#[derive(Clone, Debug)]
pub struct TechniqueNumbers {
    streams: [RandomStream; Stream::COUNT],
    at: Stream,
    /// First number of [`Stream::Connection`], until it is read.
    selector: Option<f32>,
}

impl TechniqueNumbers {
    /// Of a technique of pair `seed`; `selector` is read before what the technique itself reads
    /// from [`Stream::Connection`].
    pub fn new(seed: u64, technique: Technique, selector: f32) -> Self {
        let Technique { s, t } = technique;
        TechniqueNumbers {
            streams: [
                numbers(seed, Stream::Sensor, 0),
                numbers(seed, Stream::Light, 0),
                numbers(seed, Stream::Lens, s),
                numbers(seed, Stream::Connection, t),
            ],
            at: Stream::Sensor,
            selector: Some(selector),
        }
    }
}

impl PrimarySample for TechniqueNumbers {
    fn next(&mut self) -> f32 {
        if self.at == Stream::Connection
            && let Some(selector) = self.selector.take()
        {
            return selector;
        }
        self.streams[self.at as usize].next()
    }

    fn stream(&mut self, stream: Stream) {
        self.at = stream;
    }
}

fn numbers(seed: u64, stream: Stream, index: usize) -> RandomStream {
    RandomStream::new(Address { seed, step: stream as u64, item: index as u64 })
}

/// A roulette that remembers how likely its walk was to come so far.
struct Thinning {
    u: RandomStream,
    /// Π q of the first i events.
    survival: Vec<f64>,
}

impl Thinning {
    fn new(seed: u64, index: u64) -> Self {
        let u = RandomStream::new(Address { seed, step: Stream::COUNT as u64, item: index });
        Thinning { u, survival: vec![1.0] }
    }

    fn goes_on(&mut self, q: Mass) -> bool {
        let before = self.survival.last().copied().unwrap_or(1.0);
        self.survival.push(before * q.value());
        f64::from(self.u.next()) < q.value()
    }

    /// P of a walk with this many vertices: the first does not scatter, the last need not.
    fn of(&self, vertices: usize) -> f64 {
        self.survival.get(vertices.saturating_sub(2)).copied().unwrap_or(1.0)
    }
}

impl Bdpt {
    /// Makes every technique of pair `seed` and tells its contribution C = w_{s,t} f/p, by
    /// densities without roulette, and P. The contribution is the one that
    /// [`Bdpt::estimate_technique`] makes of [`TechniqueNumbers::new`], which is called without
    /// roulette too.
    pub fn estimate_every(
        &self,
        scene: &Scene,
        seed: u64,
        mut tell: impl FnMut(Contribution, f64),
    ) {
        debug_assert!(!self.roulette, "densities of given lengths");
        let mut found = Found(Vec::new());
        let (mut on_light, mut on_sensor) = (Thinning::new(seed, 0), Thinning::new(seed, 1));
        let walks = self.walks(scene);
        let mut u = numbers(seed, Stream::Sensor, 0);
        let mut sensor = walks.sensor_subpath(scene, None, &mut u, |q| on_sensor.goes_on(q));
        let sink = &mut found;
        let mut sample = Sample { scene, walks: &walks, sink, film: sensor.film };
        let mut u = numbers(seed, Stream::Light, 0);
        let light = sample.light_subpath(&mut u, |q| on_light.goes_on(q));
        for s in 1..=light.vertices.len().min(walks.max) {
            if light.vertices[s - 1].connectible {
                let on_lens = walks.lens(&mut numbers(seed, Stream::Lens, s));
                sample.onto_lens(&light.vertices[..s], on_lens);
            }
        }
        sample.hit_emitters(&mut sensor);
        for t in 2..=sensor.vertices.len().min(walks.max) {
            let sensor = &sensor.vertices[..t];
            if !sensor[t - 1].connectible {
                continue;
            }
            let mut u = numbers(seed, Stream::Connection, t);
            sample.next_event(sensor, next_event_numbers(&mut u));
            let last = light.vertices.len().min(walks.max + 1 - t);
            sample.inner_all(&light.vertices[..last], sensor);
        }
        for c in found.0 {
            tell(c, on_light.of(c.s.into()) * on_sensor.of(c.t.into()));
        }
    }
}

struct Found(Vec<Contribution>);

impl Sink for Found {
    fn add(&mut self, c: Contribution) {
        self.0.push(c);
    }
}
