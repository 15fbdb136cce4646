//! A report in words, for assertions and logs.

use std::fmt;

use super::config::Config;
use super::report::{Failure, Report};

impl Report {
    /// A report of `tests` tests without results yet.
    pub(crate) fn new(suite: &str, config: &Config, tests: usize) -> Self {
        Report {
            suite: suite.to_owned(),
            config: *config,
            tests,
            scenes: Vec::new(),
            checks: Vec::new(),
            seconds: 0.0,
            complete: true,
            version: env!("CARGO_PKG_VERSION"),
            done: 0,
        }
    }
}

impl fmt::Display for Report {
    /// One line a pair and a check, then what is wrong.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for scene in &self.scenes {
            for pair in &scene.pairs {
                let last = &pair.last;
                writeln!(
                    f,
                    "{}: {} and {} {}, p = {:.1e}, detectable bias {:.2} %",
                    scene.scene,
                    last.a,
                    last.b,
                    pair.outcome,
                    last.p,
                    100.0 * last.mdb
                )?;
            }
        }
        for check in &self.checks {
            writeln!(f, "{} {} {}: {:?}", check.kind, check.scene, check.subject, check.outcome)?;
        }
        for (scene, who, why) in self.skips() {
            writeln!(f, "{scene}: {who} left out: {why}")?;
        }
        for failure in self.failures() {
            writeln!(f, "{failure}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "WRONG on {}: {} (seed {})", self.scene, self.message, self.seed)
    }
}
