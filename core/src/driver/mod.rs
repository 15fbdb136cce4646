//! Runs work items on all threads of the current rayon pool and exposes the film in the order of
//! the items.

mod commit;
mod turns;

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::film::{Chunk, Film};
use crate::random::{Address, RandomStream};
pub use crate::rays::rays_on_this_thread;
use commit::Commit;
pub use turns::Turns;

/// Most work items in a chunk: its contributions, a few dozen bytes each, are kept in memory until
/// their turn.
const LARGEST: u64 = 512;

/// Chunks for each thread, where there are items enough: at the end of the work a thread waits for
/// half a chunk of another one on average.
const CHUNKS: u64 = 64;

/// Work items in a chunk: large enough to hide the hand-over, small enough that all threads have
/// work up to the end. Films do not depend on it: contributions are added in the order of the
/// items.
fn chunk_size(items: u64) -> u64 {
    (items / (CHUNKS * rayon::current_num_threads() as u64)).clamp(1, LARGEST)
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

/// One step: runs `f(item, stream, chunk)` for every item in `0..items` and applies what it emits
/// in item order, so that the film is the same to the bit for any number of threads. An item is one
/// sample.
pub fn run_items<F>(film: &mut Film, seed: u64, step: u64, items: u64, f: F) -> Work
where
    F: Fn(u64, &mut RandomStream, &mut Chunk) + Sync,
{
    run_steps(film, seed, step..step + 1, items, f)
}

/// Several steps of so many items each, the same to the bit as one after the other. Items of a step
/// begin before the last ones of the step before it are done, so that threads wait for each other
/// at the end alone.
pub fn run_steps<F>(film: &mut Film, seed: u64, steps: Range<u64>, items: u64, f: F) -> Work
where
    F: Fn(u64, &mut RandomStream, &mut Chunk) + Sync,
{
    let all = items * (steps.end - steps.start);
    let size = chunk_size(all);
    run_chunks(film, all.div_ceil(size), |index, chunk| {
        let range = index * size..((index + 1) * size).min(all);
        for i in range.clone() {
            let address = Address { seed, step: steps.start + i / items, item: i % items };
            chunk.begin(address);
            f(address.item, &mut RandomStream::new(address), chunk);
        }
        range.end - range.start
    })
}

/// Work that comes in chunks of unequal numbers of samples (Markov chains): runs `f(index, chunk)`
/// for every index in `0..chunks`, applies the chunks in the order of their index and counts the
/// samples that `f` returns.
///
/// Indices are handed out in order. The film is applied to in bands of rows by whichever thread
/// finds one free. Memory is bounded: a thread that is eight chunks a thread ahead of the first one
/// that is not done applies what others have made, and waits.
pub fn run_chunks<F>(film: &mut Film, chunks: u64, f: F) -> Work
where
    F: Fn(u64, &mut Chunk) -> u64 + Sync,
{
    let layers = film.layers();
    let threads = (rayon::current_num_threads() as u64).min(chunks).max(1) as usize;
    let next = AtomicU64::new(0);
    let rays = AtomicU64::new(0);
    let samples = AtomicU64::new(0);
    let failed = AtomicBool::new(false);
    let commit = Commit::new(film, threads, &failed);
    let work = || {
        let _guard = Failing(&failed);
        let before = rays_on_this_thread();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= chunks || failed.load(Ordering::Relaxed) {
                break;
            }
            commit.wait_for_room(index);
            let mut chunk = Chunk::new(layers);
            samples.fetch_add(f(index, &mut chunk), Ordering::Relaxed);
            commit.push(index, chunk);
        }
        rays.fetch_add(rays_on_this_thread() - before, Ordering::Relaxed);
    };
    rayon::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(|_| work());
        }
        work();
    });
    let left = commit.finish();
    left.to(film);
    let samples = samples.into_inner();
    film.add_samples(samples);
    Work { samples, rays: rays.into_inner() }
}

/// Says that a thread panicked, so that those that wait for its work end too.
struct Failing<'a>(&'a AtomicBool);

impl Drop for Failing<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.store(true, Ordering::Relaxed);
        }
    }
}
