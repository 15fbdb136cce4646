//! `results.json`: what can be read can be shown.

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use pathspace_benches::report::page;
use pathspace_benches::results::Results;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(results) = serde_json::from_slice::<Results>(bytes) {
        // The folder has no images: they are named as missing.
        let _ = page(&results, Path::new("/nowhere"), 1 << 20);
    }
});
