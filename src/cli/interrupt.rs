//! Signals that ask the program to end.
//!
//! Before there is anything to keep, the first one ends the program. Afterwards the first one ends
//! the rendering after the step under way, and the second one the program. The exit status is 128
//! and the number of the signal, as a shell says it: 130 for Ctrl-C, 143 for SIGTERM.

use std::fmt;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};

use pathspace_benches::clear_leftovers;

use super::say;

/// The first signal that came; 0 before.
static SIGNAL: AtomicI32 = AtomicI32::new(0);
/// True where the first signal has to wait for the step under way.
static KEEPS: AtomicBool = AtomicBool::new(false);

/// An error that is no fault: the command was asked to end before it had a result.
#[derive(Debug)]
pub(super) struct Interrupted(pub(super) String);

impl fmt::Display for Interrupted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Interrupted {}

/// Catches SIGINT (Ctrl-C), SIGTERM (batch systems) and SIGHUP from here on.
pub(super) fn install() {
    static ONCE: Once = Once::new();
    ONCE.call_once(catch);
}

/// From here on there is something to keep.
pub(super) fn keep() {
    KEEPS.store(true, Ordering::SeqCst);
}

/// True after the first signal.
pub(super) fn requested() -> bool {
    SIGNAL.load(Ordering::SeqCst) != 0
}

/// Exit status of a command that was interrupted.
pub(super) fn status() -> u8 {
    u8::try_from(code()).unwrap_or(1)
}

fn code() -> i32 {
    128 + SIGNAL.load(Ordering::SeqCst)
}

/// What is done at each signal, on a thread of its own.
fn received(signal: i32) {
    let first = SIGNAL.compare_exchange(0, signal, Ordering::SeqCst, Ordering::SeqCst).is_ok();
    if first && KEEPS.load(Ordering::SeqCst) {
        say("stopping after this step and keeping what is rendered; again to quit at once");
        return;
    }
    if first {
        say("interrupted before there was anything to keep");
    }
    clear_leftovers();
    std::process::exit(code());
}

// Where signals cannot be caught, they end the program as they always do.
#[cfg(unix)]
fn catch() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let ignored = ignored();
    // `nohup` and shells that start a job in the background ask for signals to be ignored.
    let caught = [SIGHUP, SIGINT, SIGTERM].into_iter().filter(|s| ignored >> (s - 1) & 1 == 0);
    if let Ok(mut signals) = signal_hook::iterator::Signals::new(caught) {
        std::thread::spawn(move || signals.forever().for_each(received));
    }
}

/// Signals that were ignored when the program started, signal n as bit n − 1; none where the system
/// does not tell.
#[cfg(unix)]
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}

#[cfg(not(unix))]
fn catch() {
    /// SIGINT.
    const CTRL_C: i32 = 2;
    let _ = ctrlc::set_handler(|| received(CTRL_C));
}
