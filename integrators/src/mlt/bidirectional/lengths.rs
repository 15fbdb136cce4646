//! Which part of a path is deleted, and how many vertices take its place (Veach 1997, §11.4.2.1 and
//! §11.4.2.2).

use super::super::mutator::Kept;
use super::super::path::MltPath;
use super::ends::Ends;

/// Lengths change by no more edges than this in one mutation.
const MAX_CHANGE: usize = 12;

/// 2^−n, made of its bits.
fn half_to(n: usize) -> f64 {
    f64::from_bits((1023 - n.min(1000) as u64) << 52)
}

/// Unnormalised probability to delete `edges` edges: ¼, ½, 2^{−k_d} for k_d ≥ 3.
fn deletion_share(edges: usize) -> f64 {
    match edges {
        0 => 0.0,
        1 => 0.25,
        2 => 0.5,
        n => half_to(n),
    }
}

/// Unnormalised probability that `change` edges more or fewer are added than deleted: ½, then
/// ¼·2^{−j} either way.
fn addition_share(change: usize) -> f64 {
    if change == 0 { 0.5 } else { 0.25 * half_to(change) }
}

/// The distribution of deletions on one path. A deletion that no technique could undo has
/// probability 0, so that its proposals, which could only be rejected, are never made.
pub(super) struct Deletion {
    /// Number of samplable techniques with less than s emitter-side vertices.
    samplable_below: Vec<u32>,
    total: f64,
}

impl Deletion {
    pub(super) fn new(x: &MltPath) -> Self {
        let n = x.length() + 1;
        let mut samplable_below = Vec::with_capacity(n + 2);
        let mut count = 0;
        samplable_below.push(0);
        for s in 0..=n {
            count += u32::from(x.samplable(s));
            samplable_below.push(count);
        }
        let mut deletion = Deletion { samplable_below, total: 0.0 };
        deletion.total = deletion.each(n).map(|(_, share)| share).sum();
        deletion
    }

    /// Share of the deletion that keeps `kept` of a path of `n` vertices.
    fn share(&self, n: usize, kept: Kept) -> f64 {
        let (first, last) = (kept.light, n - kept.sensor);
        if self.samplable_below[last + 1] == self.samplable_below[first] {
            return 0.0;
        }
        deletion_share(last - first + 1)
    }

    fn each(&self, n: usize) -> impl Iterator<Item = (Kept, f64)> + '_ {
        (0..=n).flat_map(move |light| {
            (0..=n - light).map(move |sensor| {
                let kept = Kept { light, sensor };
                (kept, self.share(n, kept))
            })
        })
    }

    /// Picks what to keep.
    pub(super) fn sample(&self, x: &MltPath, u: f32) -> Option<Kept> {
        let mut rest = f64::from(u) * self.total;
        let mut last = None;
        for (kept, share) in self.each(x.length() + 1).filter(|(_, share)| *share > 0.0) {
            last = Some(kept);
            if rest < share {
                break;
            }
            rest -= share;
        }
        last
    }

    /// Probability that [`Deletion::sample`] picks `kept`.
    pub(super) fn mass(&self, x: &MltPath, kept: Kept) -> f64 {
        self.share(x.length() + 1, kept) / self.total
    }
}

/// The distribution of the number of added vertices, given what is kept and how many were deleted.
pub(super) struct Addition<'a> {
    ends: &'a Ends,
    deleted: usize,
    max_length: usize,
    total: f64,
}

impl<'a> Addition<'a> {
    pub(super) fn new(ends: &'a Ends, deleted: usize, max_length: usize) -> Self {
        let mut addition = Addition { ends, deleted, max_length, total: 0.0 };
        addition.total = addition.range().map(|n| addition.share(n)).sum();
        addition
    }

    fn range(&self) -> std::ops::RangeInclusive<usize> {
        self.deleted.saturating_sub(MAX_CHANGE)..=self.deleted + MAX_CHANGE
    }

    fn share(&self, added: usize) -> f64 {
        let vertices = self.ends.kept.light + self.ends.kept.sensor + added;
        // Nothing for nothing is no mutation.
        let idle = added == 0 && self.deleted == 0;
        let change = added.abs_diff(self.deleted);
        if idle
            || vertices < 2
            || vertices - 1 > self.max_length
            || change > MAX_CHANGE
            || self.ends.splits(added).next().is_none()
        {
            return 0.0;
        }
        addition_share(change)
    }

    /// Picks the number of added vertices; `None` where there is no way to add any.
    pub(super) fn sample(&self, u: f32) -> Option<usize> {
        let mut rest = f64::from(u) * self.total;
        let mut last = None;
        for n in self.range() {
            let share = self.share(n);
            if share > 0.0 {
                last = Some(n);
                if rest < share {
                    break;
                }
                rest -= share;
            }
        }
        last
    }

    /// Probability that [`Addition::sample`] picks `added`.
    pub(super) fn mass(&self, added: usize) -> f64 {
        if self.total > 0.0 { self.share(added) / self.total } else { 0.0 }
    }
}
