//! Which techniques (s, t) take part.

use std::fmt;
use std::ops::RangeInclusive;

/// A set of techniques: s and t each in a range, `s=0..3,t=1..` in a spec.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TechniqueSet {
    s: (u16, u16),
    t: (u16, u16),
}

/// Larger than any subpath.
const MANY: u16 = u16::MAX / 4;

impl TechniqueSet {
    /// Every technique.
    pub const ALL: TechniqueSet = TechniqueSet { s: (0, MANY), t: (0, MANY) };

    /// The techniques with s and t in the ranges.
    pub fn new(s: RangeInclusive<u16>, t: RangeInclusive<u16>) -> Self {
        TechniqueSet { s: (*s.start(), *s.end()), t: (*t.start(), *t.end()) }
    }

    /// Every technique that does not hit the lens.
    pub const WITHOUT_LENS: TechniqueSet = TechniqueSet { s: (0, MANY), t: (1, MANY) };

    /// True where (s, t) takes part.
    #[inline]
    pub fn contains(&self, s: usize, t: usize) -> bool {
        let within = |v: usize, (lo, hi): (u16, u16)| v >= lo as usize && v <= hi as usize;
        within(s, self.s) && within(t, self.t)
    }

    /// Largest s that takes part.
    pub fn max_s(&self) -> usize {
        self.s.1 as usize
    }

    /// Largest t that takes part.
    pub fn max_t(&self) -> usize {
        self.t.1 as usize
    }

    /// True for [`TechniqueSet::ALL`].
    #[inline]
    pub fn is_all(&self) -> bool {
        *self == TechniqueSet::ALL
    }

    /// Reads a range `2`, `0..3` (both ends count), `1..`, `..4`.
    pub fn parse_range(text: &str) -> Option<RangeInclusive<u16>> {
        let number = |t: &str, default: u16| {
            if t.is_empty() { Some(default) } else { t.parse().ok().filter(|&n| n < MANY) }
        };
        let range = match text.split_once("..") {
            None => number(text, MANY).filter(|_| !text.is_empty()).map(|n| n..=n),
            Some((lo, hi)) => Some(number(lo, 0)?..=number(hi, MANY)?),
        };
        range.filter(|r| r.start() <= r.end())
    }
}

impl fmt::Display for TechniqueSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let range = |(lo, hi): (u16, u16)| {
            if hi == MANY { format!("{lo}..") } else { format!("{lo}..{hi}") }
        };
        write!(f, "s={},t={}", range(self.s), range(self.t))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_read_as_written() {
        assert_eq!(TechniqueSet::parse_range("2"), Some(2..=2));
        assert_eq!(TechniqueSet::parse_range("0..3"), Some(0..=3));
        assert_eq!(TechniqueSet::parse_range("1.."), Some(1..=MANY));
        assert_eq!(TechniqueSet::parse_range("..4"), Some(0..=4));
        for bad in ["", "a", "3..1", "-1", "1..x", "99999"] {
            assert_eq!(TechniqueSet::parse_range(bad), None, "{bad}");
        }
    }

    #[test]
    fn membership_follows_both_ranges() {
        let set = TechniqueSet::new(0..=3, 2..=MANY);
        assert!(set.contains(3, 2) && set.contains(0, 900));
        assert!(!set.contains(4, 2) && !set.contains(0, 1));
    }
}
