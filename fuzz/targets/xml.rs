//! Scene files: whatever the text, the answer is a scene or one error, and a scene can be built or
//! is refused.

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use pathspace_core::Scene;
use pathspace_scenes::source::Memory;
use pathspace_scenes::{LoadOptions, load_with};

fuzz_target!(|bytes: &[u8]| {
    let mesh = &b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"[..];
    let source = Memory::new().with("scene.xml", bytes.to_vec()).with("m.obj", mesh);
    let options = LoadOptions::default();
    if let Ok(loaded) = load_with(&source, Path::new("scene.xml"), &options) {
        // A film of many pixels is allowed and takes long.
        if loaded.description.film.problem().is_none() {
            let _ = Scene::new(&loaded.description);
        }
    }
});
