//! Families of sampling techniques.

use std::fmt;
use std::ops::BitOr;

/// A set of families of sampling techniques (s emitter-side, t sensor-side vertices).
///
/// A path carries the set of families that can make it at all, an integrator the set it uses; two
/// integrators agree on the paths that both can make. A pinhole cannot see a caustic directly seen
/// in a mirror by t = 1, a path tracer cannot see the caustic of a point light: comparisons leave
/// such paths out by name.
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
    /// A light and a sensor subpath that end near each other are merged (photon mapping; Georgiev
    /// et al. 2012).
    pub const MERGE: Families = Families(32);
    /// Every technique.
    pub const ALL: Families = Families(63);
    /// No technique but a mark: the path starts on an emitter at infinity. No integrator has it and
    /// a path always has others beside it, so that it never says who can make a path; it keeps
    /// light of the surroundings apart from that of lamps, of which one may be rare where the other
    /// is common.
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
