//! What an integrator emits, and what receives it.

use glam::Vec2;

use crate::color::Rgb;
use crate::path::{Families, PathRecord};

/// One estimate of the measurement of one path: f(x̄)/p(x̄) times its MIS weight.
///
/// Values are scaled so that the film's pixel is their sum over samples divided by the number of
/// samples per pixel, whatever technique made them: the sensor's importance integrates to 1 over
/// the crop window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contribution {
    /// Position on the film in pixels of the whole film, x to the right, y down.
    pub film: Vec2,
    /// w_{s,t}(x̄) f(x̄) / p_{s,t}(x̄).
    pub value: Rgb,
    /// The MIS weight in `value`.
    pub weight: f32,
    /// Emitter-side vertices of the technique.
    pub s: u16,
    /// Sensor-side vertices of the technique.
    pub t: u16,
    /// Index of the emitter the path starts on.
    pub emitter: u32,
    /// Every family of techniques that could make this path.
    pub families: Families,
}

impl Contribution {
    /// A contribution that says no more than where and how much: weight 1, technique (0, 2), the
    /// first emitter, no family of techniques. The other fields are there to be set: `Contribution
    /// { s: 1, t: 3, ..Contribution::new(film, value) }`. A comparison of methods needs s, t and
    /// `families`.
    pub fn new(film: Vec2, value: Rgb) -> Self {
        Contribution { film, value, weight: 1.0, s: 0, t: 2, emitter: 0, families: Families::NONE }
    }

    /// Path length k = s + t − 1 in edges; term k − 1 of the Neumann series.
    #[inline]
    pub fn length(&self) -> u16 {
        self.s + self.t - 1
    }
}

/// Receives contributions. Films, statistics and tests implement it; integrators are generic over
/// it.
///
/// ```
/// use pathspace_core::film::{Contribution, Sink};
///
/// /// Light by path length.
/// #[derive(Default)]
/// struct Lengths(Vec<f64>);
///
/// impl Sink for Lengths {
///     fn add(&mut self, c: Contribution) {
///         let k = c.length() as usize;
///         self.0.resize(self.0.len().max(k + 1), 0.0);
///         self.0[k] += f64::from(c.value.max_channel());
///     }
/// }
/// ```
pub trait Sink {
    /// True where [`Sink::record`] wants whole paths: integrators keep them only then.
    const RECORDS_PATHS: bool = false;

    /// Takes one contribution. A non-finite value is the sink's business, never the integrator's.
    fn add(&mut self, contribution: Contribution);

    /// Takes the path behind the contribution just added, with the density and weight that the
    /// integrator itself computed.
    fn record(&mut self, _record: PathRecord) {}
}

/// Keeps every contribution and every path: for tests and replays.
#[derive(Clone, Debug, Default)]
pub struct RecordingSink {
    /// Contributions in order.
    pub contributions: Vec<Contribution>,
    /// Paths in order, one for each contribution.
    pub records: Vec<PathRecord>,
}

impl Sink for RecordingSink {
    const RECORDS_PATHS: bool = true;

    fn add(&mut self, contribution: Contribution) {
        self.contributions.push(contribution);
    }

    fn record(&mut self, record: PathRecord) {
        self.records.push(record);
    }
}
