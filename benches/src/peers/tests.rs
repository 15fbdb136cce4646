use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use super::*;

/// A shell script as adapter, with an image of 2×1 pixels beside it that it copies.
fn adapter(folder: &Path, script: &str) -> String {
    let image = folder.join("answer.exr");
    exr::prelude::write_rgb_file(&image, 2, 1, |x, _| (x as f32, 0.5_f32, 2.0_f32)).unwrap();
    let path = folder.join("adapter.sh");
    let script = script.replace("IMAGE", image.to_str().unwrap());
    fs::write(&path, format!("#!/bin/sh\n{script}\n")).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    path.to_str().unwrap().to_owned()
}

fn place(width: u32) -> Place {
    let file = PathBuf::from("scene.xml");
    Place { file, define: BTreeMap::new(), width, height: 1, max_depth: None }
}

const REQUEST: Request =
    Request { seed: u64::MAX, replicate: 3, budget: Budget::Samples(4), threads: 1 };

/// Answers every line; takes the place of the image from the request.
const WELL: &str = r#"
while read -r line; do
    echo "loading ..."
    case "$line" in
    *'"ask":"describe"'*) echo '{"version": "fake 1", "techniques": ["s0", "t1"]}' ;;
    *)
        out=$(echo "$line" | sed 's/.*"output":"\([^"]*\)".*/\1/')
        cp IMAGE "$out"
        echo '{"seconds": 0.5, "startup_seconds": 2, "spp": 4}'
        ;;
    esac
done"#;

fn open(folder: &Path, script: &str, width: u32) -> Result<Peer, PeerError> {
    let command = adapter(folder, script);
    Peer::open("external", &[("command", &command)], place(width))
}

#[test]
fn an_adapter_is_asked_and_its_image_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut peer = open(folder.path(), WELL, 2).unwrap();
    assert_eq!((peer.version(), peer.families()), ("fake 1", Families::S0 | Families::T1));
    let rendered = peer.render(&REQUEST).unwrap();
    assert_eq!(rendered.image, [0.0, 0.5, 2.0, 1.0, 0.5, 2.0]);
    assert_eq!((rendered.answer.seconds, rendered.answer.startup_seconds), (0.5, 2.0));
    assert_eq!(rendered.answer.cpu_seconds, None);
}

#[test]
fn an_adapter_that_ends_after_an_answer_is_started_again() {
    let folder = tempfile::tempdir().unwrap();
    let once = WELL.replace("while read -r line; do", "read -r line").replace("\ndone", "");
    let mut peer = open(folder.path(), &once, 2).unwrap();
    assert!(peer.render(&REQUEST).is_ok() && peer.render(&REQUEST).is_ok());
}

#[test]
fn seeds_fit_into_31_bits() {
    let folder = tempfile::tempdir().unwrap();
    let script = WELL.replace("cp IMAGE", r#"echo "$line" > "$(dirname "$0")/line"; cp IMAGE"#);
    open(folder.path(), &script, 2).unwrap().render(&REQUEST).unwrap();
    let line = fs::read_to_string(folder.path().join("line")).unwrap();
    let value: serde_json::Value = serde_json::from_str(&line).unwrap();
    assert_eq!((&value["seed"], &value["spp"]), (&0x7fff_ffff_u32.into(), &4.into()));
    assert_eq!((&value["replicate"], &value["seconds"]), (&3.into(), &serde_json::Value::Null));
}

#[test]
fn what_an_adapter_can_not_do_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let say = |answer: &str| {
        let script = format!("read -r line; echo '{answer}'");
        open(folder.path(), &script, 2).err().map(|e| e.to_string()).unwrap_or_default()
    };
    assert!(say(r#"{"absent": "pip install it"}"#).ends_with("is not there: pip install it"));
    assert!(say(r#"{"error": "no volumes"}"#).ends_with("does not render this scene: no volumes"));
    assert!(say("{").contains("not one of the protocol"));
    assert!(say("hello").contains("ended without an answer"));
    let missing = Peer::open("external", &[("command", "no-such-adapter")], place(2));
    assert!(matches!(missing, Err(PeerError::Absent { .. })));
}

#[test]
fn last_words_of_a_broken_adapter_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let error = open(folder.path(), "echo 'out of cheese' >&2; exit 1", 2).err().unwrap();
    assert!(error.to_string().ends_with("out of cheese"), "{error}");
}

#[test]
fn images_of_another_size_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let error = open(folder.path(), WELL, 3).unwrap().render(&REQUEST).unwrap_err();
    assert!(error.to_string().contains("2×1 pixels, not 3×1"), "{error}");
}
