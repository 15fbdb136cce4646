//! Meshes in PLY: whatever the bytes, the answer is a mesh or one error, and a mesh can be built or
//! is refused.

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use pathspace_core::Scene;
use pathspace_scenes::source::Memory;
use pathspace_scenes::{LoadOptions, load_with};

const SCENE: &[u8] =
    br#"<scene version="3.0.0"><shape type="ply"><string name="filename" value="m.ply"/></shape>
<emitter type="constant"/></scene>"#;

fuzz_target!(|bytes: &[u8]| {
    let source = Memory::new().with("scene.xml", SCENE).with("m.ply", bytes.to_vec());
    if let Ok(loaded) = load_with(&source, Path::new("scene.xml"), &LoadOptions::default()) {
        let _ = Scene::new(&loaded.description);
    }
});
