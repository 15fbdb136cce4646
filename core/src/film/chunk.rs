//! The buffer between a work item and the film.

use super::layer::Layers;
use super::sink::{Contribution, Sink};
use crate::random::Address;

/// A contribution that was NaN or infinite, with what makes it again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NonFinite {
    /// Seed, step and item whose random numbers led to it.
    pub address: Address,
    /// The contribution itself.
    pub contribution: Contribution,
}

/// Contributions of a fixed range of work items as short records in order. Chunks are filled in
/// parallel and applied to the film in the order of their index, so that the film does not depend
/// on the number of threads.
#[derive(Clone, Debug)]
pub struct Chunk {
    address: Address,
    coalesce: bool,
    /// Records of earlier work items: what follows is not added to them, so that chunks may be cut
    /// anywhere.
    before: usize,
    records: Vec<Contribution>,
    nonfinite: Vec<NonFinite>,
    nonfinite_count: u64,
}

impl Chunk {
    /// An empty chunk for a film that keeps `layers`.
    pub fn new(layers: Layers) -> Self {
        Chunk {
            address: Address { seed: 0, step: 0, item: 0 },
            coalesce: layers.is_none(),
            before: 0,
            records: Vec::new(),
            nonfinite: Vec::new(),
            nonfinite_count: 0,
        }
    }

    /// Says which work item the next contributions belong to.
    #[inline]
    pub fn begin(&mut self, address: Address) {
        self.address = address;
        self.before = self.records.len();
    }

    /// The records in order.
    pub fn records(&self) -> &[Contribution] {
        &self.records
    }

    /// Kept non-finite contributions.
    pub fn nonfinite(&self) -> &[NonFinite] {
        &self.nonfinite
    }

    /// Number of non-finite contributions.
    pub fn nonfinite_count(&self) -> u64 {
        self.nonfinite_count
    }
}

impl Sink for Chunk {
    #[inline]
    fn add(&mut self, c: Contribution) {
        if c.value.is_black() {
            return;
        }
        let finite = c.value.is_finite() && c.film.is_finite();
        if !finite {
            self.nonfinite_count += 1;
            if self.nonfinite.len() < super::MAX_NONFINITE_EXAMPLES {
                self.nonfinite.push(NonFinite { address: self.address, contribution: c });
            }
            return;
        }
        // Without layers only position and value matter: the path lengths of one camera sample
        // share a record.
        if self.coalesce
            && self.records.len() > self.before
            && let Some(last) = self.records.last_mut()
            && last.film == c.film
        {
            let sum = last.value + c.value;
            // Two numbers that fit may have a sum that does not; the film adds in f64.
            if sum.is_finite() {
                last.value = sum;
                return;
            }
        }
        self.records.push(c);
    }
}
