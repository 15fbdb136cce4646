//! How many contributions each technique made: what says whether paths that never came were rare or
//! lost.

use std::collections::BTreeMap;

use pathspace_core::film::{Families, Film, LayerKey};

/// Contributions by path length and family of techniques, over all replicates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Made {
    samples: u64,
    lit: BTreeMap<(u32, Families), u64>,
}

impl Made {
    /// Adds a film with the layer of techniques. A pixel that a technique has lit counts as one
    /// contribution, which is the fewest that it can have made there.
    pub fn add(&mut self, film: &Film) {
        self.samples += film.samples();
        for (key, plane) in film.planes() {
            if let LayerKey::Technique { s, t } = *key {
                let length = (u32::from(s) + u32::from(t)).saturating_sub(1);
                let lit = plane.sums().iter().filter(|p| **p != [0.0; 3]).count() as u64;
                *self.lit.entry((length, Families::of_technique(s, t))).or_default() += lit;
            }
        }
    }

    /// Contributions of `length` edges that techniques of `families` would have made in as many
    /// samples as `other` took, at least.
    pub fn expected(&self, length: u32, families: Families, other: &Made) -> f64 {
        if self.samples == 0 {
            return 0.0;
        }
        let of = |(key, n): (&(u32, Families), &u64)| {
            if key.0 == length && key.1.intersects(families) { *n } else { 0 }
        };
        let made: u64 = self.lit.iter().map(of).sum();
        made as f64 * other.samples as f64 / self.samples as f64
    }
}
