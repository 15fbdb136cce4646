//! Time spent: wall clock and processor time of the whole process.

use std::time::Instant;

/// Time spent on something.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spent {
    /// Wall clock, s.
    pub seconds: f64,
    /// Processor time of all threads of the process, s; NaN where the system does not tell.
    pub cpu_seconds: f64,
}

impl std::ops::AddAssign for Spent {
    fn add_assign(&mut self, other: Spent) {
        self.seconds += other.seconds;
        self.cpu_seconds += other.cpu_seconds;
    }
}

impl std::ops::Sub for Spent {
    type Output = Spent;
    fn sub(self, other: Spent) -> Spent {
        Spent {
            seconds: self.seconds - other.seconds,
            cpu_seconds: self.cpu_seconds - other.cpu_seconds,
        }
    }
}

/// Measures time since it was started.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    wall: Instant,
    cpu: f64,
}

impl Stopwatch {
    /// Starts now.
    pub fn start() -> Self {
        Stopwatch { wall: Instant::now(), cpu: process_seconds() }
    }

    /// Time since the start.
    pub fn spent(&self) -> Spent {
        Spent { seconds: self.seconds(), cpu_seconds: process_seconds() - self.cpu }
    }

    /// Wall-clock seconds since the start.
    pub fn seconds(&self) -> f64 {
        self.wall.elapsed().as_secs_f64()
    }
}

/// Processor time of this process so far.
#[cfg(unix)]
fn process_seconds() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is a valid place for the one timespec that the call writes.
    let status = unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut time) };
    if status == 0 { time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9 } else { f64::NAN }
}

#[cfg(not(unix))]
fn process_seconds() -> f64 {
    f64::NAN
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn sleeping_costs_wall_clock_and_no_processor() {
        let watch = Stopwatch::start();
        std::thread::sleep(std::time::Duration::from_millis(60));
        assert!(watch.seconds() >= 0.06);
        // Other tests of this process may be at work: only the sign can be held here.
        assert!(watch.spent().cpu_seconds >= 0.0);
    }

    #[test]
    fn work_costs_processor_time() {
        let watch = Stopwatch::start();
        let mut x = 1.0_f64;
        while watch.seconds() < 0.2 {
            x = std::hint::black_box(x.sqrt() + 1.0);
        }
        assert!(watch.spent().cpu_seconds > 0.01, "{x}");
    }
}
