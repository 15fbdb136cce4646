//! Layers beside the image: per length, per technique, per emitter, per family set.

use super::sink::Contribution;
use crate::path::Families;

/// Names one layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum LayerKey {
    /// Paths of length k: term k − 1 of the Neumann series K^{k−1} L_e.
    Length(u16),
    /// Contributions of technique (s, t) with their MIS weight.
    Technique {
        /// Emitter-side vertices.
        s: u16,
        /// Sensor-side vertices.
        t: u16,
    },
    /// Contributions of technique (s, t) without their MIS weight, as if it were the only one.
    Unweighted {
        /// Emitter-side vertices.
        s: u16,
        /// Sensor-side vertices.
        t: u16,
    },
    /// Light group: paths from one emitter.
    Emitter(u32),
    /// Paths of one length that the same families of techniques can make; what comparisons use.
    Class {
        /// Path length in edges.
        length: u16,
        /// Families that can make the path.
        families: Families,
    },
    /// Paths of one class from one emitter that one family of techniques made: tells what was
    /// rarely sampled from what was not.
    Source {
        /// Path length in edges.
        length: u16,
        /// Families that can make the path.
        families: Families,
        /// The emitter; all from `MOST_SOURCES` on share a layer.
        emitter: u16,
        /// The family that made it.
        made_by: Families,
    },
}

/// Emitters with a [`LayerKey::Source`] of their own; a film has a plane for each.
pub const MOST_SOURCES: u16 = 63;

impl LayerKey {
    /// True for layers that undo the MIS weight.
    pub fn is_unweighted(self) -> bool {
        matches!(self, LayerKey::Unweighted { .. })
    }

    /// Name of the layer in files: `length.03`, `technique.s02.t01`, …
    pub fn name(self) -> String {
        match self {
            LayerKey::Length(k) => format!("length.{k:02}"),
            LayerKey::Technique { s, t } => format!("technique.s{s:02}.t{t:02}"),
            LayerKey::Unweighted { s, t } => format!("unweighted.s{s:02}.t{t:02}"),
            LayerKey::Emitter(i) => format!("emitter.{i:03}"),
            LayerKey::Class { length, families } => {
                format!("class.{length:02}.{:02}", families.bits())
            }
            LayerKey::Source { length, families, emitter, made_by } => {
                let (families, made_by) = (families.bits(), made_by.bits());
                format!("source.{length:02}.{families:02}.{emitter:02}.{made_by:02}")
            }
        }
    }

    /// The key of a [`LayerKey::name`]; `None` for other texts.
    pub fn from_name(name: &str) -> Option<LayerKey> {
        let parts: Vec<&str> = name.split('.').collect();
        let technique = |s: &str, t: &str| {
            Some((s.strip_prefix('s')?.parse().ok()?, t.strip_prefix('t')?.parse().ok()?))
        };
        let key = match parts.as_slice() {
            ["length", k] => LayerKey::Length(k.parse().ok()?),
            ["technique", s, t] => {
                let (s, t) = technique(s, t)?;
                LayerKey::Technique { s, t }
            }
            ["unweighted", s, t] => {
                let (s, t) = technique(s, t)?;
                LayerKey::Unweighted { s, t }
            }
            ["emitter", i] => LayerKey::Emitter(i.parse().ok()?),
            ["class", k, bits] => LayerKey::Class {
                length: k.parse().ok()?,
                families: Families::from_bits(bits.parse().ok()?),
            },
            ["source", k, bits, emitter, by] => LayerKey::Source {
                length: k.parse().ok()?,
                families: Families::from_bits(bits.parse().ok()?),
                emitter: emitter.parse().ok()?,
                made_by: Families::from_bits(by.parse().ok()?),
            },
            _ => return None,
        };
        // One text for each key: neither `length.3` nor bits that no family has.
        (key.name() == name).then_some(key)
    }

    /// True where a film with `layers` keeps this one.
    pub fn is_of(self, layers: Layers) -> bool {
        match self {
            LayerKey::Length(_) => layers.length,
            LayerKey::Technique { .. } => layers.technique,
            LayerKey::Unweighted { .. } => layers.unweighted,
            LayerKey::Emitter(_) => layers.emitter,
            LayerKey::Class { .. } => layers.class,
            LayerKey::Source { .. } => layers.class && layers.emitter,
        }
    }
}

/// Which layers a film keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layers {
    /// [`LayerKey::Length`].
    pub length: bool,
    /// [`LayerKey::Technique`].
    pub technique: bool,
    /// [`LayerKey::Unweighted`].
    pub unweighted: bool,
    /// [`LayerKey::Emitter`].
    pub emitter: bool,
    /// [`LayerKey::Class`]; with [`Layers::emitter`] also [`LayerKey::Source`].
    pub class: bool,
}

impl Layers {
    /// The image alone.
    pub const NONE: Layers =
        Layers { length: false, technique: false, unweighted: false, emitter: false, class: false };

    /// True where only the image is kept.
    pub fn is_none(self) -> bool {
        self == Layers::NONE
    }

    /// Keys of the layers that a contribution belongs to.
    pub fn keys(self, c: &Contribution) -> impl Iterator<Item = LayerKey> {
        let (s, t, length) = (c.s, c.t, c.length());
        [
            self.length.then_some(LayerKey::Length(length)),
            self.technique.then_some(LayerKey::Technique { s, t }),
            (self.unweighted && c.weight > 0.0).then_some(LayerKey::Unweighted { s, t }),
            self.emitter.then_some(LayerKey::Emitter(c.emitter)),
            self.class.then_some(LayerKey::Class { length, families: c.families }),
            (self.class && self.emitter).then(|| LayerKey::Source {
                length,
                families: c.families,
                emitter: c.emitter.min(u32::from(MOST_SOURCES)) as u16,
                made_by: Families::of_technique(s, t),
            }),
        ]
        .into_iter()
        .flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_back_to_their_keys() {
        let keys = [
            LayerKey::Length(3),
            LayerKey::Length(u16::MAX),
            LayerKey::Technique { s: 0, t: 117 },
            LayerKey::Unweighted { s: 12, t: 1 },
            LayerKey::Emitter(70_000),
            LayerKey::Class { length: 2, families: Families::ALL },
            LayerKey::Class { length: 2, families: Families::S0 | Families::FAR },
            LayerKey::Source {
                length: 2,
                families: Families::ALL,
                emitter: MOST_SOURCES,
                made_by: Families::T1,
            },
        ];
        for key in keys {
            assert_eq!(LayerKey::from_name(&key.name()), Some(key));
        }
        for text in ["", "length", "length.3", "length.x", "technique.t01.s02", "class.02.128"] {
            assert_eq!(LayerKey::from_name(text), None, "{text}");
        }
    }
}
