//! Work on shared things whose order is given: Markov chains, whose next step needs the one before.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use super::Failing;

/// Things that are worked on in turns. Each has a count of the turns that are done, and the next
/// one waits for its number.
///
/// Whoever is handed turn n of a thing must have been handed it after somebody else was handed turn
/// n − 1, as the indices of [`run_chunks`](super::run_chunks) are: then somebody is always at work,
/// and nobody waits for ever.
#[derive(Debug)]
pub struct Turns {
    done: Vec<AtomicU64>,
    failed: AtomicBool,
}

impl Turns {
    /// Turns of `count` things, none of them done.
    pub fn new(count: usize) -> Self {
        let done = (0..count).map(|_| AtomicU64::new(0)).collect();
        Turns { done, failed: AtomicBool::new(false) }
    }

    /// Does `work` on thing number `index`, behind `thing`, as its turn number `turn`. `None` where
    /// an earlier turn panicked.
    pub fn take<T, R>(
        &self,
        index: usize,
        turn: u64,
        thing: &Mutex<T>,
        work: impl FnOnce(&mut T) -> R,
    ) -> Option<R> {
        while self.done[index].load(Ordering::Acquire) != turn {
            if self.failed.load(Ordering::Relaxed) {
                return None;
            }
            std::thread::yield_now();
        }
        let _guard = Failing(&self.failed);
        let result = work(&mut thing.lock().unwrap_or_else(PoisonError::into_inner));
        self.done[index].store(turn + 1, Ordering::Release);
        Some(result)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::FilmDescription;
    use crate::driver::run_chunks;
    use crate::film::{Film, Layers};

    #[test]
    fn turns_are_taken_in_order_by_any_number_of_threads() {
        for threads in [1, 4] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let lists: Vec<Mutex<Vec<u64>>> = (0..3).map(|_| Mutex::default()).collect();
            let turns = Turns::new(3);
            let mut film = Film::new(&FilmDescription::new(2, 2), Layers::NONE);
            pool.install(|| {
                run_chunks(&mut film, 3000, |index, _| {
                    let (thing, turn) = ((index % 3) as usize, index / 3);
                    turns.take(thing, turn, &lists[thing], |list| list.push(turn));
                    1
                })
            });
            assert_eq!(film.samples(), 3000);
            for list in lists {
                assert!(list.into_inner().unwrap().iter().copied().eq(0..1000));
            }
        }
    }
}
