//! What an integrator emits, and what receives it.

use std::fmt;
use std::ops::BitOr;

use glam::Vec2;

use crate::color::Rgb;
use crate::path::PathRecord;

/// A set of families of sampling techniques (s emitter-side, t sensor-side vertices).
///
/// A path carries the set of families that can make it at all, an integrator the set it uses; two
/// integrators agree on the paths that both can make. A pinhole cannot see a caustic directly seen in a mirror by t = 1,
/// a path tracer cannot see the caustic of a point light: comparisons leave such paths out by name.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Families(u8);

impl Families {
    /// No technique.
    pub const NONE: Families = Families(0);
    /// s = 0: the sensor subpath hits the emitter.
    pub const S0: Families = Families(1);
    /// s = 1: next-event estimation.
    pub const S1: Families = Families(2);
    /// s ≥ 2 and t ≥ 2: connection of two subpaths.
    pub const INNER: Families = Families(4);
    /// t = 1: light tracing onto the film.
    pub const T1: Families = Families(8);
    /// t = 0: the light subpath hits the lens.
    pub const T0: Families = Families(16);
    /// A light and a sensor subpath that end near each other are merged (photon mapping; Georgiev et al. 2012).
    pub const MERGE: Families = Families(32);
    /// Every technique.
    pub const ALL: Families = Families(63);
    /// No technique but a mark: the path starts on an emitter at infinity. No integrator has it and a path always has others beside it, so that it never
    /// says who can make a path; it keeps light of the surroundings apart from that of lamps, of which one may be rare where the other is common.
    pub const FAR: Families = Families(64);

    /// The family of technique (s, t).
    #[inline]
    pub fn of_technique(s: u16, t: u16) -> Families {
        match (s, t) {
            (0, _) => Families::S0,
            (_, 0) => Families::T0,
            (_, 1) => Families::T1,
            (1, _) => Families::S1,
            _ => Families::INNER,
        }
    }

    /// The families that both sets have.
    pub fn common(self, other: Families) -> Families {
        Families(self.0 & other.0)
    }

    /// True where the sets share a family.
    #[inline]
    pub fn intersects(self, other: Families) -> bool {
        self.0 & other.0 != 0
    }

    /// The bits, for keys and files.
    pub fn bits(self) -> u8 {
        self.0
    }

    /// Families from [`Families::bits`]; unknown bits are dropped.
    pub fn from_bits(bits: u8) -> Self {
        Families(bits & (Families::ALL.0 | Families::FAR.0))
    }

    /// The union, for constants.
    pub const fn or(self, other: Families) -> Self {
        Families(self.0 | other.0)
    }

    /// `self` where `condition` holds, else nothing.
    #[inline]
    pub fn when(self, condition: bool) -> Self {
        if condition { self } else { Families::NONE }
    }
}

impl BitOr for Families {
    type Output = Families;
    #[inline]
    fn bitor(self, other: Families) -> Families {
        Families(self.0 | other.0)
    }
}

impl fmt::Debug for Families {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = ["s0", "s1", "inner", "t1", "t0", "merge", "far"];
        let on: Vec<_> =
            (0..names.len()).filter(|i| self.0 >> i & 1 == 1).map(|i| names[i]).collect();
        write!(f, "{{{}}}", on.join(","))
    }
}

/// One estimate of the measurement of one path: f(x̄)/p(x̄) times its MIS weight.
///
/// Values are scaled so that the film's pixel is their sum over samples divided by the number of samples per
/// pixel, whatever technique made them: the sensor's importance integrates to 1 over the crop window.
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
    /// A contribution that says no more than where and how much: weight 1, technique (0, 2), the first emitter, no family of techniques. The other fields
    /// are there to be set: `Contribution { s: 1, t: 3, ..Contribution::new(film, value) }`. A comparison of methods needs
    /// s, t and `families`.
    pub fn new(film: Vec2, value: Rgb) -> Self {
        Contribution { film, value, weight: 1.0, s: 0, t: 2, emitter: 0, families: Families::NONE }
    }

    /// Path length k = s + t − 1 in edges; term k − 1 of the Neumann series.
    #[inline]
    pub fn length(&self) -> u16 {
        self.s + self.t - 1
    }
}

/// Receives contributions. Films, statistics and tests implement it; integrators are generic over it.
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
