//! Broken files, each with the one line that a user sees.

mod materials;
mod meshes;
mod spectra;
mod structure;
mod values;

use pathspace_scenes::load_str;
use pathspace_scenes::source::Memory;

/// A mesh that is fine.
const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn error_of(body: &str, files: &[(&str, &[u8])]) -> String {
    let mut source = Memory::new().with("ok.obj", OBJ.as_bytes());
    for (name, bytes) in files {
        source.insert(name, bytes.to_vec());
    }
    match load_str(body, "bad.xml", &source, &[]) {
        Ok(_) => "no error".into(),
        Err(e) => e.to_string(),
    }
}

/// Scene file, further files, and the line that a user sees.
pub(crate) type Case<'a> = (String, Vec<(&'a str, &'a [u8])>, &'a str);

/// Compares each case and reports all that differ, so that a table can be mended at once.
pub(crate) fn check(cases: &[Case<'_>]) {
    let mut wrong = Vec::new();
    for (body, files, expected) in cases {
        let found = error_of(body, files);
        assert!(!found.contains('\n'), "more than one line: {found}");
        if found != *expected {
            wrong.push(format!("{body}\n  expected {expected}\n  found    {found}"));
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// A scene whose third line is the body.
pub(crate) fn scene(body: &str) -> String {
    format!("<?xml version=\"1.0\"?>\n<scene version=\"3.0.0\">\n{body}\n</scene>\n")
}

pub(crate) fn shape(body: &str) -> String {
    scene(&format!("<shape type=\"sphere\">\n{body}\n</shape>"))
}

pub(crate) fn bsdf(body: &str) -> String {
    scene(&format!("<shape type=\"cube\"><bsdf type=\"{body}</bsdf></shape>"))
}

pub(crate) fn sensor(body: &str) -> String {
    scene(&format!("<sensor type=\"perspective\">{body}</sensor>"))
}

pub(crate) fn film(body: &str) -> String {
    sensor(&format!("<film type=\"hdrfilm\">{body}</film>"))
}

#[test]
fn parameters_that_nobody_uses_are_errors() {
    let text = scene("<default name=\"depth\" value=\"3\"/>\n<shape type=\"$kind\"/>");
    let given = [("kind".to_string(), "cube".to_string()), ("spp".to_string(), "4".to_string())];
    let error = load_str(&text, "bad.xml", &Memory::new(), &given).unwrap_err();
    assert_eq!(
        error.to_string(),
        "bad.xml: parameter \"spp=4\" is not used by the scene; known: depth, kind"
    );
}
