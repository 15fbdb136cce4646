//! `pathspace new-plugin`. That the crate compiles and compares is shown where there is time to
//! build it.

use std::fs;

use crate::support::*;

#[test]
fn a_plug_in_has_all_its_files_and_no_blanks() {
    let folder = Folder::new();
    let dir = folder.file("new/my-method");
    let output = run(&["new-plugin", "my-method", &dir]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for file in ["Cargo.toml", "README.md", "src/lib.rs", "src/main.rs"] {
        let text = fs::read_to_string(format!("{dir}/{file}")).unwrap();
        assert!(!text.is_empty() && !text.contains("{{"), "{file}: {text}");
        assert!(stdout(&output).contains(file), "{file}");
    }
    let manifest = fs::read_to_string(format!("{dir}/Cargo.toml")).unwrap();
    // This test runs in the source tree.
    let tree = fs::canonicalize(env!("CARGO_MANIFEST_DIR")).unwrap();
    assert!(manifest.contains(&format!("path = {tree:?}")), "{manifest}");
    assert!(fs::read_to_string(format!("{dir}/src/main.rs")).unwrap().contains("use my_method::"));
}

#[test]
fn a_plug_in_overwrites_nothing() {
    let folder = Folder::new();
    fs::create_dir(folder.file("full")).unwrap();
    let file = folder.write("full/precious", "work");
    let failed = |name: &str, dir: &str| {
        let output = run(&["new-plugin", name, dir]);
        assert_eq!(output.status.code(), Some(2));
        assert_eq!(stderr(&output).lines().count(), 1);
        stderr(&output)
    };
    assert!(failed("mine", &folder.file("full")).contains("not empty"));
    assert!(failed("mine", &file).contains("not a directory"));
    assert!(failed("pt", &folder.file("a")).contains("already"));
    assert!(failed("no good", &folder.file("a")).contains("no name"));
    assert_eq!(folder.list(), ["full"]);
    assert_eq!(fs::read_to_string(file).unwrap(), "work");
}

#[test]
fn a_plug_in_builds_on_a_tree_of_pathspace_only() {
    let folder = Folder::new();
    let dir = folder.file("a");
    let output = run(&["new-plugin", "mine", &dir, "--pathspace", folder.path().to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("source tree"), "{}", stderr(&output));
    let tree = env!("CARGO_MANIFEST_DIR");
    let output = run(&["new-plugin", "mine", &dir, "--pathspace", tree]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}
