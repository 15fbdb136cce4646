//! Small odd files, each with what Mitsuba 3.9.1 does with it.

use std::path::PathBuf;

use pathspace_scenes::load;

/// Files that load. Mitsuba 3 loads all but `amp`, `ext_eta_material`, `face_sphere_old`,
/// `spectrum3` and `spectrum_rgb`, where it does not know a property.
const FINE: [&str; 32] = [
    "alpha0",
    "comment",
    "cyl_stretch",
    "doctype",
    "dupattr",
    "e_old",
    "fov180",
    "junk",
    "latin1",
    "leadws",
    "lookat_up_missing",
    "lt",
    "medium_unused",
    "neg_eta",
    "neg_eta_rough",
    "null_mask",
    "scene_bool",
    "spectrum_d65",
    "spectrum_uniform",
    "sphere_stretch",
    "string_int",
    "text",
    "top_area",
    "top_unused_texture",
    "utf16",
    "version4",
    "amp",
    "ext_eta_material",
    "face_sphere_old",
    "spectrum3",
    "spectrum_rgb",
    "top_texture",
];

/// Files that both refuse.
const BROKEN: [(&str, &str); 9] = [
    ("bsdf_null_ref", "no object has the id \"nope\""),
    ("hide", "<scene> has more than one <integrator>"),
    ("prop_twice", "property \"radius\" of shape \"sphere\" is given twice"),
    ("refl_gt1", "\"1.2, 1, 1\" is not a colour with components from 0 to 1"),
    ("resource", "<path>: \"meshes\" is not a folder"),
    ("rot0", "<rotate> axis: \"0, 0, 0\" is not a direction"),
    ("rotaxis", "unknown attribute \"axis\" in <rotate>"),
    ("shape_case", "shape type \"Sphere\" is not understood"),
    ("two_env", "more than one environment emitter"),
];

fn case(name: &str) -> Option<PathBuf> {
    let root = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/cases/reader"));
    let path = root.join(format!("{name}.xml"));
    if !path.is_file() {
        eprintln!("skipped: {} is not here", path.display());
        return None;
    }
    Some(path)
}

#[test]
fn odd_files_load() {
    let mut wrong = Vec::new();
    for path in FINE.iter().filter_map(|name| case(name)) {
        if let Err(e) = load(&path, &[]) {
            wrong.push(e.to_string());
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn broken_files_are_refused_with_the_reason() {
    for (name, reason) in BROKEN {
        let Some(path) = case(name) else { return };
        match load(&path, &[]) {
            Ok(_) => panic!("{name} loads"),
            Err(e) => assert!(e.to_string().contains(reason), "{e}"),
        }
    }
}
