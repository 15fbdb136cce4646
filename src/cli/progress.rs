//! A progress bar with the time that is left, on terminals; nothing in pipes.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Fractions are shown in thousandths.
const PARTS: f64 = 1000.0;

pub(super) struct Progress(ProgressBar);

impl Progress {
    /// A bar on stderr; invisible where that is no terminal.
    pub(super) fn new() -> Self {
        let bar = ProgressBar::with_draw_target(
            Some(PARTS as u64),
            ProgressDrawTarget::stderr_with_hz(8),
        );
        let template = "{wide_bar} {percent:>3} %  {eta} left  {msg}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(250));
        Progress(bar)
    }

    /// Shows the fraction done in [0, 1], and a word on what is going on.
    pub(super) fn set(&self, done: f64, what: impl FnOnce() -> String) {
        self.0.set_position((done * PARTS) as u64);
        if !self.0.is_hidden() {
            self.0.set_message(what());
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
