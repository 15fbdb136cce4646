//! Parameters, includes, search paths, ids and aliases.

use pathspace_core::Rgb;
use pathspace_core::description::MaterialKind;
use pathspace_scenes::source::Memory;
use pathspace_scenes::{LoadedScene, load_from, load_str};
use std::path::Path;

fn with(text: &str, files: Memory, params: &[(&str, &str)]) -> LoadedScene {
    let params: Vec<_> = params.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    load_str(text, "main.xml", &files, &params).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn parameters_fill_any_attribute() {
    let text = "<scene version=\"3.0.0\"><default name=\"n\" value=\"8\"/><default name=\"kind\" value=\"path\"/>\
                <integrator type=\"$kind\"><integer name=\"max_depth\" value=\"$n\"/></integrator></scene>";
    assert_eq!(with(text, Memory::new(), &[]).defaults.max_depth, Some(8));
    let given = with(text, Memory::new(), &[("n", "3"), ("kind", "ptracer")]);
    assert_eq!(given.defaults.max_depth, Some(3));
    assert_eq!(given.defaults.integrator.as_deref(), Some("lt"));
}

#[test]
fn includes_give_their_children_and_see_the_parameters() {
    let files = Memory::new().with(
        "sub/part.xml",
        b"<scene version=\"3.0.0\"><shape type=\"obj\"><string name=\"filename\" value=\"m.obj\"/>\
          <ref id=\"$look\"/></shape></scene>"
            .as_slice(),
    );
    let files = files.with("sub/m.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".as_slice());
    let text = "<scene version=\"3.0.0\"><bsdf type=\"null\" id=\"ghost\"/>\
                <path value=\"sub\"/><include filename=\"sub/part.xml\"/></scene>";
    let scene = with(text, files, &[("look", "ghost")]).description;
    assert_eq!(scene.shapes.len(), 1);
    assert_eq!(scene.materials[scene.shapes[0].material].kind, MaterialKind::Null);
}

#[test]
fn files_of_included_files_are_found_beside_them() {
    let files = Memory::new()
        .with(
            "lib/a.xml",
            b"<scene version=\"3.0.0\"><include filename=\"b.xml\"/></scene>".as_slice(),
        )
        .with("lib/b.xml", b"<scene version=\"3.0.0\"><shape type=\"cube\"/></scene>".as_slice())
        .with(
            "main.xml",
            b"<scene version=\"3.0.0\"><include filename=\"lib/a.xml\"/></scene>".as_slice(),
        );
    let scene = load_from(&files, Path::new("main.xml"), &[]).unwrap();
    assert_eq!(scene.description.shapes.len(), 1);
}

#[test]
fn an_included_object_becomes_a_child() {
    let files = Memory::new().with("red.xml", b"<bsdf version=\"3.0.0\" type=\"diffuse\"><rgb name=\"reflectance\" value=\"1 0 0\"/></bsdf>".as_slice());
    let text = "<scene version=\"3.0.0\"><shape type=\"cube\"><include filename=\"red.xml\"/></shape></scene>";
    let scene = with(text, files, &[]).description;
    let red = MaterialKind::Diffuse { reflectance: Rgb::new(1.0, 0.0, 0.0) };
    assert_eq!(scene.materials[scene.shapes[0].material].kind, red);
}

#[test]
fn an_alias_is_another_name_for_an_object() {
    let text = "<scene version=\"3.0.0\"><bsdf type=\"null\" id=\"a\"/><alias id=\"a\" as=\"b\"/>\
                <shape type=\"cube\"><ref id=\"b\"/></shape><shape type=\"cube\"><ref id=\"a\" name=\"bsdf\"/></shape></scene>";
    let scene = with(text, Memory::new(), &[]).description;
    assert_eq!(scene.materials.len(), 1);
    assert_eq!((scene.shapes[0].material, scene.shapes[1].material), (0, 0));
}

#[test]
fn references_may_come_before_what_they_refer_to() {
    let text = "<scene version=\"3.0.0\"><shape type=\"cube\"><ref id=\"later\"/></shape>\
                <bsdf type=\"null\" id=\"later\"/></scene>";
    let scene = with(text, Memory::new(), &[]).description;
    assert_eq!(scene.materials[scene.shapes[0].material].kind, MaterialKind::Null);
}

#[test]
fn the_hash_is_that_of_the_content_not_of_the_text() {
    let hash = |text: &str, params: &[(&str, &str)]| with(text, Memory::new(), params).hash;
    let plain = hash("<scene version=\"3.0.0\"><shape type=\"cube\"/></scene>", &[]);
    let spaced = "<scene version=\"3.0.0\">\n<!-- a cube -->\n  <shape type=\"$k\"/></scene>";
    assert_eq!(plain, hash(spaced, &[("k", "cube")]));
    assert_ne!(plain, hash(spaced, &[("k", "disk")]));
    assert_eq!(plain.len(), 64);
}

#[test]
fn the_hash_covers_meshes() {
    let hash = |last: &str| {
        let obj = format!("v 0 0 0\nv 1 0 0\nv 0 {last} 0\nf 1 2 3\n");
        let text = "<scene version=\"3.0.0\"><shape type=\"obj\"><string name=\"filename\" value=\"m.obj\"/></shape></scene>";
        with(text, Memory::new().with("m.obj", obj.into_bytes()), &[]).hash
    };
    assert_ne!(hash("1"), hash("2"));
}
