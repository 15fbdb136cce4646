//! `pathspace scenes`.

use crate::support::*;

#[test]
fn the_list_names_every_scene_of_the_library() {
    let output = run(&["scenes"]);
    assert_eq!(output.status.code(), Some(0));
    let text = stdout(&output);
    for scene in pathspace::scenes::library::all() {
        assert!(text.lines().any(|l| l.starts_with(scene.name)), "{}", scene.name);
    }
}

#[test]
fn an_exported_scene_renders_to_the_same_pixels() {
    let folder = Folder::new();
    let dir = folder.file("new/ring");
    assert_eq!(run(&["scenes", "export", "ring-caustic", &dir]).status.code(), Some(0));
    let render = |scene: &str, out: &str| {
        let out = folder.file(out);
        json(&["render", scene, "--spp", "1", "--size", "24x24", "-o", &out, "--json"]);
        Exr::read(&out)
    };
    let (own, file) =
        (render("ring-caustic", "a.exr"), render(&format!("{dir}/scene.xml"), "b.exr"));
    assert_eq!(own.channels, file.channels);
    assert_eq!(own.attribute("pathspace.scene_hash"), file.attribute("pathspace.scene_hash"));
}

#[test]
fn a_reader_that_has_heard_enough_is_no_error() {
    use std::process::Stdio;
    let mut child = command().arg("scenes").stdout(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
}
