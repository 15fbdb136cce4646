//! Images that are read: references, which are EXR files.

#![no_main]

mod common;

use libfuzzer_sys::fuzz_target;
use pathspace_benches::reference::ReferenceImage;

fuzz_target!(|bytes: &[u8]| {
    let path = common::file("r.exr", &[bytes]);
    let _ = ReferenceImage::read(&path, 12);
});
