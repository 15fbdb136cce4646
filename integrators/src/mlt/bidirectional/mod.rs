//! The bidirectional mutation (Veach 1997, §11.4.2): a part of the path is deleted, and the two
//! ends are joined anew as in bidirectional path tracing, by vertices from either side. It alone
//! makes the chain ergodic: the whole path may be replaced.
//!
//! T(x̄→ȳ) = p_d(x̄, kept) · p_a(added | deleted, kept) · mean over the splits (s, t) of Π p(new
//! vertices | kept ones).

mod density;
mod ends;
mod extend;
mod lengths;

use pathspace_core::Scene;
use pathspace_core::random::{PrimarySample, RandomStream};

use self::ends::Ends;
use self::lengths::{Addition, Deletion};
use super::mutator::{Candidate, Kept, Mutator};
use super::path::MltPath;

/// The bidirectional mutation.
#[derive(Clone, Debug)]
pub struct Bidirectional {
    max_length: usize,
    non_delta_emitters: bool,
}

impl Bidirectional {
    /// The mutation for paths of at most `max_length` edges of this scene.
    pub fn new(scene: &Scene, max_length: Option<u32>) -> Self {
        Bidirectional {
            max_length: max_length.map_or(usize::MAX, |k| k as usize),
            non_delta_emitters: scene.emitters().list().iter().any(|e| !e.is_delta()),
        }
    }
}

impl Mutator for Bidirectional {
    fn name(&self) -> &'static str {
        "bidir"
    }

    fn applies(&self, _: &MltPath) -> bool {
        true
    }

    fn propose(&self, scene: &Scene, x: &MltPath, u: &mut RandomStream) -> Option<Candidate> {
        let kept = Deletion::new(x).sample(x, u.next())?;
        let ends = Ends::new(scene, x, kept, self.non_delta_emitters);
        let deleted = kept.replaced(x)?;
        let added = Addition::new(&ends, deleted, self.max_length).sample(u.next())?;
        let count = ends.splits(added).count();
        let pick = ((u.next() * count as f32) as usize).min(count.checked_sub(1)?);
        let s = ends.splits(added).nth(pick)?;
        let path = extend::join(scene, x, kept, s, added, u)?;
        Some(Candidate { path, kept })
    }

    fn ln_transition(&self, scene: &Scene, x: &MltPath, y: &MltPath, kept: Kept) -> Option<f64> {
        let (deleted, added) = (kept.replaced(x)?, kept.replaced(y)?);
        let deletion = Deletion::new(x).mass(x, kept);
        let ends = Ends::new(scene, x, kept, self.non_delta_emitters);
        let addition = Addition::new(&ends, deleted, self.max_length).mass(added);
        let mass = deletion * addition;
        if !(mass > 0.0) {
            return None;
        }
        Some(mass.ln() + density::ln_added(scene, y, &ends)?)
    }
}
