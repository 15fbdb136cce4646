//! What one bootstrap sample offers.

use glam::Vec2;
use pathspace_core::Scene;

/// A state that a chain could start at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// W.
    pub weight: f64,
    /// Where it stands among the others. The upper half names its group, which has chains of its
    /// own; within a group starts are drawn by strata in the order of the keys, so that candidates
    /// with like keys share chains out evenly. No key changes any expectation.
    pub key: u64,
    /// What the target makes it again by.
    pub index: u32,
}

impl Candidate {
    /// The upper half of the key.
    pub(super) fn group(&self) -> u64 {
        self.key >> 32
    }
}

/// The candidates of one bootstrap sample, a few for each group.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Candidates(Vec<Candidate>);

impl Candidates {
    /// Forgets all of them.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Takes a candidate in, if its weight is not 0.
    pub fn add(&mut self, candidate: Candidate) {
        if candidate.weight != 0.0 {
            self.0.push(candidate);
        }
    }

    /// Takes a candidate in and leaves one in its group, picked in proportion to W by the uniform
    /// number `u`, with the sum of the weights: as good for b̂, and as good a start as both.
    pub fn merge(&mut self, candidate: Candidate, u: f32) {
        let group = candidate.group();
        match self.0.iter_mut().find(|c| c.group() == group) {
            Some(one) if candidate.weight != 0.0 => {
                let weight = one.weight + candidate.weight;
                let picked =
                    if f64::from(u) * weight < candidate.weight { candidate } else { *one };
                *one = Candidate { weight, ..picked };
            }
            Some(_) => (),
            None => self.add(candidate),
        }
    }

    /// ΣW.
    pub fn total(&self) -> f64 {
        self.0.iter().map(|c| c.weight).sum()
    }

    /// One of all in proportion to W, by the uniform number `u`.
    pub fn pick(&self, u: f32) -> Option<Candidate> {
        let mut rest = f64::from(u) * self.total();
        let passes = |c: &&Candidate| {
            rest -= c.weight;
            rest < 0.0
        };
        self.0.iter().find(passes).or(self.0.last()).copied()
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &Candidate> {
        self.0.iter()
    }
}

/// The key of a state of a part (a path length, say) by its film position: part first, then the
/// cell of a Z-order curve over the film.
pub fn film_key(scene: &Scene, part: u16, film: Vec2) -> u64 {
    let crop = scene.film().crop;
    let at = |v: f32, origin: u32, size: u32| {
        ((v - origin as f32) / size as f32 * 65_536.0).clamp(0.0, 65_535.0) as u64
    };
    let (h, v) = (at(film.x, crop.x, crop.width), at(film.y, crop.y, crop.height));
    let spread = |n: u64| (0..16).fold(0, |sum, bit| sum | (n >> bit & 1) << (2 * bit));
    u64::from(part) << 32 | spread(h) | spread(v) << 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(weight: f64, group: u64, index: u32) -> Candidate {
        Candidate { weight, key: group << 32, index }
    }

    #[test]
    fn merging_picks_in_proportion_to_the_weights() {
        let n = 40_000;
        let mut counts = [0_u32; 3];
        for i in 0..n {
            // A lattice of pairs of numbers.
            let (u, v) = ((i % 200) as f32 / 200.0, (i / 200) as f32 / 200.0);
            let mut found = Candidates::default();
            found.merge(candidate(1.0, 4, 0), 0.0);
            found.merge(candidate(2.0, 4, 1), u);
            found.merge(candidate(5.0, 4, 2), v);
            let [one] = found.0[..] else { panic!("{found:?}") };
            assert_eq!(one.weight, 8.0);
            counts[one.index as usize] += 1;
        }
        for (count, w) in counts.into_iter().zip([1.0, 2.0, 5.0]) {
            let share = f64::from(count) / f64::from(n);
            assert!((share - w / 8.0).abs() < 0.01, "{counts:?}");
        }
    }

    #[test]
    fn groups_stay_apart_and_nothing_weighs_nothing() {
        let mut found = Candidates::default();
        found.add(candidate(0.0, 1, 0));
        found.merge(candidate(0.0, 1, 1), 0.5);
        found.merge(candidate(1.0, 1, 2), 0.5);
        found.merge(candidate(3.0, 2, 3), 0.0);
        assert_eq!(found.iter().map(|c| c.index).collect::<Vec<_>>(), [2, 3]);
        assert_eq!(found.total(), 4.0);
        assert_eq!(found.pick(0.2).map(|c| c.index), Some(2));
        assert_eq!(found.pick(0.3).map(|c| c.index), Some(3));
        assert_eq!(Candidates::default().pick(0.3), None);
    }
}
