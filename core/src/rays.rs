//! Counts the rays that each thread traces.

use std::cell::Cell;

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
