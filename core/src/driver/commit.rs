//! Chunks that are applied to the film in the order of their index while others are still being
//! filled.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::film::{Band, Chunk, Film, Fresh, NonFinite, Raster, Sorted};

/// Chunks for each thread that may be done before the first one that is not. A thread that is
/// further ahead helps to apply, then waits.
const AHEAD: u64 = 8;

/// Bands of the film for each thread: with more bands than threads one that finds a band taken goes
/// on with another.
const BANDS: usize = 2;

/// A chunk that waits, with its index.
type Slot = Mutex<Option<(u64, Arc<Sorted>)>>;

/// The film while a step is under way.
///
/// Chunk i waits in slot i mod n until every band has taken it. The band that is furthest behind
/// says how far the others may go, so that no more than n chunks wait at any time: [`AHEAD`] for
/// each thread.
pub(super) struct Commit<'a> {
    raster: &'a Raster,
    band_rows: usize,
    slots: Vec<Slot>,
    bands: Vec<Mutex<Band<'a>>>,
    /// By band, the index of the chunk that it takes next.
    next: Vec<AtomicU64>,
    nonfinite: Mutex<BTreeMap<u64, (u64, Vec<NonFinite>)>>,
    failed: &'a AtomicBool,
}

/// What is to be handed back to the film.
pub(super) struct Left {
    fresh: Vec<Fresh>,
    nonfinite: BTreeMap<u64, (u64, Vec<NonFinite>)>,
}

impl<'a> Commit<'a> {
    pub(super) fn new(film: &'a mut Film, threads: usize, failed: &'a AtomicBool) -> Self {
        let count = if threads > 1 { BANDS * threads } else { 1 };
        let band_rows = film.height().div_ceil(count).max(1);
        let (raster, bands) = film.bands(band_rows);
        let slots = AHEAD * threads as u64;
        Commit {
            raster,
            band_rows,
            slots: (0..slots).map(|_| Mutex::new(None)).collect(),
            next: bands.iter().map(|_| AtomicU64::new(0)).collect(),
            bands: bands.into_iter().map(Mutex::new).collect(),
            nonfinite: Mutex::new(BTreeMap::new()),
            failed,
        }
    }

    /// Waits until there is a slot for chunk `index`. Whoever has the chunk that all wait for never
    /// waits here, so that there is always one at work.
    pub(super) fn wait_for_room(&self, index: u64) {
        let full = || index >= self.floor() + self.slots.len() as u64;
        while full() && !self.failed.load(Ordering::Relaxed) {
            self.drain(index as usize);
            if full() {
                std::thread::yield_now();
            }
        }
    }

    /// Hands over a chunk and applies what can be applied.
    pub(super) fn push(&self, index: u64, chunk: Chunk) {
        let sorted = self.raster.sort(chunk, self.bands.len(), self.band_rows);
        let (count, examples) = sorted.nonfinite();
        if count > 0 {
            let mut list = lock(&self.nonfinite);
            list.insert(index, (count, examples.to_vec()));
        }
        *lock(&self.slots[self.slot(index)]) = Some((index, Arc::new(sorted)));
        self.drain(index as usize);
    }

    /// Applies what is ready to every band that nobody else is at; `begin` says with which band to
    /// begin.
    fn drain(&self, begin: usize) {
        let count = self.bands.len();
        for k in 0..count {
            let band = (begin + k) % count;
            let next = &self.next[band];
            // Whoever holds the band takes what is ready; the others go on.
            while let Ok(mut own) = self.bands[band].try_lock() {
                let mut index = next.load(Ordering::Acquire);
                while let Some(sorted) = self.ready(index) {
                    own.apply(self.raster, &sorted, band);
                    index += 1;
                    next.store(index, Ordering::Release);
                }
                drop(own);
                // A chunk may have come in between the last look and the release of the band.
                if self.ready(index).is_none() {
                    break;
                }
            }
        }
    }

    fn ready(&self, index: u64) -> Option<Arc<Sorted>> {
        let slot = lock(&self.slots[self.slot(index)]);
        slot.as_ref().filter(|(i, _)| *i == index).map(|(_, sorted)| Arc::clone(sorted))
    }

    fn slot(&self, index: u64) -> usize {
        (index % self.slots.len() as u64) as usize
    }

    /// Chunks that every band has taken.
    fn floor(&self) -> u64 {
        self.next.iter().map(|n| n.load(Ordering::Acquire)).min().unwrap_or(u64::MAX / 2)
    }

    /// Ends the work on the film.
    pub(super) fn finish(self) -> Left {
        let own = |band: Mutex<Band<'a>>| band.into_inner().unwrap_or_else(PoisonError::into_inner);
        Left {
            fresh: self.bands.into_iter().map(|band| own(band).into_fresh()).collect(),
            nonfinite: self.nonfinite.into_inner().unwrap_or_else(PoisonError::into_inner),
        }
    }
}

impl Left {
    /// Hands everything back.
    pub(super) fn to(self, film: &mut Film) {
        film.rejoin(self.fresh);
        for (count, examples) in self.nonfinite.into_values() {
            film.add_nonfinite(count, &examples);
        }
    }
}

/// Locks although another thread panicked: that panic is passed on by the scope anyway.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
