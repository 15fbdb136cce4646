//! Ctrl-C: the first one ends the rendering after the step under way, the second one the program.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::say;

static COUNT: AtomicUsize = AtomicUsize::new(0);

/// Catches SIGINT and SIGTERM from here on.
pub(super) fn install() {
    let handler = || {
        if COUNT.fetch_add(1, Ordering::SeqCst) > 0 {
            // 128 + SIGINT, as a shell would say.
            std::process::exit(130);
        }
        say("stopping after this step and keeping what is rendered; again to quit at once");
    };
    // It fails where a handler is there already: from an earlier call, or of the program around us, which has its reasons.
    let _ = ctrlc::set_handler(handler);
}

/// True after the first Ctrl-C.
pub(super) fn requested() -> bool {
    COUNT.load(Ordering::SeqCst) > 0
}
