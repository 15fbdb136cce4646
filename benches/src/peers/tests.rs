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

fn go_on() -> ControlFlow<()> {
    ControlFlow::Continue(())
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
        echo '{"seconds": 0.001, "startup_seconds": 2, "spp": 4}'
        ;;
    esac
done"#;

fn open(folder: &Path, script: &str, width: u32) -> Result<Peer, PeerError> {
    let command = adapter(folder, script);
    Peer::open("external", &[("command", &command), ("timeout", "30")], place(width))
}

/// Why the render of an adapter fails that answers a request to render by `line`, in this many
/// seconds at the most.
fn failure(line: &str, timeout: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let copy = r#"cp IMAGE "$out""#;
    let well = "echo '{\"seconds\": 0.001, \"startup_seconds\": 2, \"spp\": 4}'";
    let script = WELL.replace(copy, "").replace(well, line).replace("COPY", copy);
    assert_ne!(script, WELL);
    let command = adapter(folder.path(), &script);
    let options = [("command", command.as_str()), ("timeout", timeout)];
    let mut peer = Peer::open("external", &options, place(2)).unwrap();
    let error = peer.render(&REQUEST, &mut go_on).unwrap_err().to_string();
    assert!(error.starts_with("external:command="), "{error}");
    error
}

#[test]
fn an_adapter_is_asked_and_its_image_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut peer = open(folder.path(), WELL, 2).unwrap();
    assert_eq!((peer.version(), peer.families()), ("fake 1", Families::S0 | Families::T1));
    let rendered = peer.render(&REQUEST, &mut go_on).unwrap();
    assert_eq!(rendered.image, [0.0, 0.5, 2.0, 1.0, 0.5, 2.0]);
    assert_eq!((rendered.answer.seconds, rendered.answer.startup_seconds), (0.001, 2.0));
    assert_eq!(rendered.answer.cpu_seconds, None);
}

#[test]
fn an_adapter_that_ends_after_an_answer_is_started_again() {
    let folder = tempfile::tempdir().unwrap();
    let once = WELL.replace("while read -r line; do", "read -r line").replace("\ndone", "");
    let mut peer = open(folder.path(), &once, 2).unwrap();
    assert!(peer.render(&REQUEST, &mut go_on).is_ok() && peer.render(&REQUEST, &mut go_on).is_ok());
}

#[test]
fn seeds_fit_into_31_bits() {
    let folder = tempfile::tempdir().unwrap();
    let script = WELL.replace("cp IMAGE", r#"echo "$line" > "$(dirname "$0")/line"; cp IMAGE"#);
    open(folder.path(), &script, 2).unwrap().render(&REQUEST, &mut go_on).unwrap();
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
    let error = open(folder.path(), WELL, 3).unwrap().render(&REQUEST, &mut go_on).unwrap_err();
    assert!(error.to_string().contains("2×1 pixels, not 3×1"), "{error}");
}

#[test]
fn one_that_does_not_answer_is_not_waited_for() {
    let error = failure("sleep 60", "0.2");
    assert!(error.ends_with("no answer after 0.2 s; timeout=S waits longer"), "{error}");
    let folder = tempfile::tempdir().unwrap();
    let command = adapter(folder.path(), WELL);
    for bad in ["0", "-1", "nan", "soon"] {
        let options = [("command", command.as_str()), ("timeout", bad)];
        let error = Peer::open("external", &options, place(2)).err().unwrap().to_string();
        assert!(error.contains("expected seconds over 0"), "{error}");
    }
}

#[test]
fn floods_have_an_end() {
    let error = failure("cat /dev/zero", "30");
    assert!(error.ends_with("a megabyte to stdout without a new line"), "{error}");
    let error = failure("yes", "60");
    assert!(error.ends_with("64 megabytes to stdout without an answer"), "{error}");
    // What it says on stderr goes nowhere, and only its end is remembered.
    let error = failure("yes oh | head -c 30000000 >&2; echo 'no cheese' >&2; exit 3", "30");
    assert!(error.ends_with("ended without an answer: no cheese"), "{error}");
}

#[test]
fn what_it_has_started_ends_with_it_and_its_folder_goes() {
    let folder = tempfile::tempdir().unwrap();
    let pid = folder.path().join("pid");
    let place = folder.path().join("place");
    let start =
        format!("sleep 600 & echo $! > {}; echo $out > {}; wait", pid.display(), place.display());
    let script = WELL.replace(r#"cp IMAGE "$out""#, &start);
    let command = adapter(folder.path(), &script);
    let options = [("command", command.as_str()), ("timeout", "0.5")];
    let mut peer = Peer::open("external", &options, super::tests::place(2)).unwrap();
    let error = peer.render(&REQUEST, &mut go_on).unwrap_err().to_string();
    assert!(error.contains("no answer"), "{error}");
    let orphan: i32 = fs::read_to_string(&pid).unwrap().trim().parse().unwrap();
    // One that has been killed may wait for its parent to notice, but it does not run.
    let runs = || {
        let state = fs::read_to_string(format!("/proc/{orphan}/stat")).unwrap_or_default();
        !state.is_empty() && !state.contains(") Z ")
    };
    let begun = Instant::now();
    while runs() && begun.elapsed() < Duration::from_secs(30) {
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(!runs());
    let image = PathBuf::from(fs::read_to_string(&place).unwrap().trim());
    assert!(image.parent().unwrap().is_dir());
    drop(peer);
    assert!(!image.parent().unwrap().exists());
}

#[test]
fn a_render_can_be_stopped() {
    let folder = tempfile::tempdir().unwrap();
    let mut peer = open(folder.path(), &WELL.replace("cp IMAGE", "sleep 60; cp IMAGE"), 2).unwrap();
    let begun = Instant::now();
    let mut looks = 0;
    let mut watch = || {
        looks += 1;
        if looks < 3 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    };
    let error = peer.render(&REQUEST, &mut watch).unwrap_err();
    assert!(error.to_string().ends_with("it was stopped"), "{error}");
    assert!(looks == 3 && begun.elapsed() < Duration::from_secs(30));
}

#[test]
fn times_and_images_that_can_not_be_are_refused() {
    for (answer, word) in [
        (r#"{"seconds": 1e-300, "spp": 4}"#, "1e-300 s of rendering, and answered after"),
        (r#"{"seconds": 86400, "spp": 4}"#, "8.64e4 s of rendering, and answered after"),
        (r#"{"seconds": 0.001, "spp": 1e300}"#, "spp can not be"),
        (r#"{"seconds": 0.001, "spp": 4, "cpu_seconds": -1}"#, "cpu_seconds can not be -1"),
        (r#"{"seconds": 0.001}"#, "no seconds or no spp"),
        (r#"{"seconds": 0.001, "spp": 4}"#, "cannot be read: there is no such file"),
    ] {
        let error = failure(&format!("echo '{answer}'"), "30");
        assert!(error.contains(word), "{answer}: {error}");
    }
    let folder = tempfile::tempdir().unwrap();
    let image = folder.path().join("nan.exr");
    let nan = |x: usize, _| (1.0_f32, if x == 1 { f32::NAN } else { 0.0 }, 2.0_f32);
    exr::prelude::write_rgb_file(&image, 2, 1, nan).unwrap();
    let line = format!(r#"cp {} "$out"; echo '{{"seconds": 0.001, "spp": 4}}'"#, image.display());
    let error = failure(&line, "30");
    assert!(error.ends_with("image has NaN in pixel (1, 0)"), "{error}");
}
