//! Runs work items on all threads of the current rayon pool and exposes the film in the order of the items.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::film::{Chunk, Film};
use crate::random::{Address, RandomStream};

/// Work items in a chunk: large enough to hide the hand-over, small enough that a small image occupies many threads. Depends on the
/// number of items alone, as the order of sums does.
fn chunk_size(items: u64) -> u64 {
    (items / 256).clamp(32, 1024)
}

/// What a step has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Samples: camera paths, light paths or mutations.
    pub samples: u64,
    /// Rays traced, shadow rays included.
    pub rays: u64,
}

impl std::ops::AddAssign for Work {
    fn add_assign(&mut self, other: Work) {
        self.samples += other.samples;
        self.rays += other.rays;
    }
}

thread_local! {
    static RAYS: Cell<u64> = const { Cell::new(0) };
}

/// Counts one ray on this thread; the scene's queries call it.
#[inline]
pub(crate) fn count_ray() {
    RAYS.with(|r| r.set(r.get() + 1));
}

/// Rays that this thread has traced so far.
pub fn rays_on_this_thread() -> u64 {
    RAYS.with(Cell::get)
}

/// One step: runs `f(item, stream, chunk)` for every item in `0..items` and applies what it emits in item
/// order, so that the film is the same to the bit for any number of threads. An item is one sample.
pub fn run_items<F>(film: &mut Film, seed: u64, step: u64, items: u64, f: F) -> Work
where
    F: Fn(u64, &mut RandomStream, &mut Chunk) + Sync,
{
    let size = chunk_size(items);
    run_chunks(film, items.div_ceil(size), |index, chunk| {
        let items = index * size..((index + 1) * size).min(items);
        for item in items.clone() {
            let address = Address { seed, step, item };
            chunk.begin(address);
            f(item, &mut RandomStream::new(address), chunk);
        }
        items.end - items.start
    })
}

/// One step whose work comes in chunks of unequal numbers of samples (Markov chains): runs `f(index, chunk)` for every index in
/// `0..chunks`, applies the chunks in the order of their index and counts the samples that `f` returns.
///
/// Indices are handed out in order and applied by whichever thread holds the film; a thread never waits for another one's chunk.
pub fn run_chunks<F>(film: &mut Film, chunks: u64, f: F) -> Work
where
    F: Fn(u64, &mut Chunk) -> u64 + Sync,
{
    let layers = film.layers();
    let next = AtomicU64::new(0);
    let rays = AtomicU64::new(0);
    let samples = AtomicU64::new(0);
    let commit = OrderedCommit::new(film);
    let work = || {
        let before = rays_on_this_thread();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= chunks {
                break;
            }
            let mut chunk = Chunk::new(layers);
            samples.fetch_add(f(index, &mut chunk), Ordering::Relaxed);
            commit.push(index, chunk);
        }
        rays.fetch_add(rays_on_this_thread() - before, Ordering::Relaxed);
    };
    rayon::scope(|scope| {
        for _ in 1..rayon::current_num_threads().min(chunks as usize) {
            scope.spawn(|_| work());
        }
        work();
    });
    let samples = samples.into_inner();
    film.add_samples(samples);
    Work { samples, rays: rays.into_inner() }
}

/// Applies chunks in index order while others are still being filled.
struct OrderedCommit<'a> {
    waiting: Mutex<BTreeMap<u64, Chunk>>,
    film: Mutex<(u64, &'a mut Film)>,
}

impl<'a> OrderedCommit<'a> {
    fn new(film: &'a mut Film) -> Self {
        OrderedCommit { waiting: Mutex::new(BTreeMap::new()), film: Mutex::new((0, film)) }
    }

    fn push(&self, index: u64, chunk: Chunk) {
        lock(&self.waiting).insert(index, chunk);
        loop {
            // Whoever holds the film drains what is ready; the others go back to rendering.
            let Ok(mut film) = self.film.try_lock() else { return };
            while let Some(chunk) = lock(&self.waiting).remove(&film.0) {
                film.1.apply(&chunk);
                film.0 += 1;
            }
            let next = film.0;
            drop(film);
            // A chunk may have come in between the last look and the release of the film.
            if !lock(&self.waiting).contains_key(&next) {
                return;
            }
        }
    }
}

/// Locks although another thread panicked: that panic is passed on by the scope anyway.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
