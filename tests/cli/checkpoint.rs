//! Checkpoints: stop, go on, be killed, run out of disk.

use crate::support::*;

const SCENE: [&str; 6] = ["render", "cornell-caustic", "--size", "32x24", "--max-depth", "6"];

fn with<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&SCENE[..], more].concat()
}

#[test]
fn stop_and_resume_is_the_same_image_to_the_bit() {
    let folder = Folder::new();
    let (whole, parts) = (folder.file("whole.exr"), folder.file("parts.exr"));
    let save = folder.file("save.film");
    for integrator in ["pt", "bdpt"] {
        let own = with(&["-i", integrator, "--layers", "length,st", "--seed", "5", "--json"]);
        json(&[&own[..], &["--spp", "7", "-o", &whole]].concat());
        let first = json(&[&own[..], &["--spp", "3", "--checkpoint", &save]].concat());
        assert_eq!(first["checkpoint"], save.as_str());
        assert_eq!(first["resumed_at"], serde_json::Value::Null);
        let args = [&own[..], &["--spp", "7", "--resume", &save, "-o", &parts]].concat();
        let output = run(&args);
        let v = last_line(&output);
        assert_eq!((&v["resumed_at"], &v["samples_per_pixel"]), (&3.0.into(), &7.0.into()));
        assert!(stderr(&output).starts_with("going on from "), "{}", stderr(&output));
        assert!(v["rays"].as_u64() > first["rays"].as_u64());
        assert!(v["seconds"].as_f64() > first["seconds"].as_f64());
        let (a, b) = (Exr::read(&whole), Exr::read(&parts));
        assert!(a.channels.len() > 9 && a.channels == b.channels, "{integrator}");
        // It went on in the same file: all is done, and nothing more is rendered.
        let again = json(&args);
        assert_eq!((&again["resumed_at"], &again["rays"]), (&7.0.into(), &v["rays"]));
        std::fs::remove_file(&save).unwrap();
    }
}

#[test]
fn the_same_command_goes_on_where_it_stopped() {
    let folder = Folder::new();
    let save = folder.file("save.film");
    let args = |spp| with(&["--spp", spp, "--checkpoint", &save, "--json"]);
    assert_eq!(json(&args("2"))["resumed_at"], serde_json::Value::Null);
    assert_eq!(json(&args("4"))["resumed_at"], 2.0);
    assert_eq!(folder.list(), ["save.film"]);
}

#[test]
fn a_checkpoint_of_another_render_is_refused_and_kept() {
    let folder = Folder::new();
    let save = folder.file("save.film");
    let own = ["--spp", "2", "--checkpoint", &save];
    json(&with(&[&own[..], &["--json"]].concat()));
    let before = std::fs::read(&save).unwrap();
    let table: &[(&[&str], &str)] = &[
        (&["--seed", "2"], "its seed is 1, not 2"),
        (&["-i", "lt"], "its integrator is pt, not lt"),
        (&["--layers", "length"], "its set of layers is none, not length"),
        (&["--crop", "0,0,4,4"], "its window is 0,0,32,24, not 0,0,4,4"),
        (&["--shard", "1/2"], "its shard is 1/1, not 1/2"),
        (&["-D", "spp=3"], "its content of the scene is cornell-caustic ("),
    ];
    for (more, expected) in table {
        let message = failure(&with(&[&own[..], more].concat()));
        assert!(message.contains("save.film: is of another render: "), "{message}");
        assert!(message.contains(expected), "{message}");
    }
    let mut deeper = with(&own);
    deeper[5] = "7";
    assert!(failure(&deeper).contains("its path length is up to 6 with roulette from"));
    deeper[5] = "6";
    deeper[3] = "31x24";
    assert!(failure(&deeper).contains("its size is 32x24, not 31x24"));
    assert_eq!(std::fs::read(&save).unwrap(), before);
}

/// Another build under the same version may use other random numbers.
#[test]
fn a_checkpoint_of_another_build_is_refused() {
    let folder = Folder::new();
    let (save, other) = (folder.file("save.film"), folder.file("other"));
    let mut program = std::fs::read(env!("CARGO_BIN_EXE_pathspace")).unwrap();
    program.push(0);
    std::fs::copy(env!("CARGO_BIN_EXE_pathspace"), &other).unwrap();
    std::fs::write(&other, program).unwrap();
    let args = with(&["--spp", "1", "--checkpoint", &save]);
    let mut made = std::process::Command::new(&other);
    let made = made.args(&args).current_dir(folder.path()).output().unwrap();
    assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    let message = failure(&args);
    assert!(
        message.contains("save.film: is of another render: its program is build "),
        "{message}"
    );
}

#[test]
fn files_that_are_read_are_not_written_over() {
    let folder = Folder::new();
    let (save, long) = (folder.file("x.exr"), ["--spp", "1000000000"]);
    let table: &[(&str, &str, &str)] = &[
        ("x.exr", "x.exr", "x.exr: is the checkpoint, and the image"),
        ("x.png", "x.exr", "x.png: is the checkpoint, and the image"),
        ("./x.techniques.png", "x.exr", "x.techniques.png: is the checkpoint, and the image"),
    ];
    for (checkpoint, image, expected) in table {
        let more = ["--checkpoint", &folder.file(checkpoint), "-o", &folder.file(image)];
        let message = failure(&with(&[&long[..], &more].concat()));
        assert!(message.contains(expected), "{message}");
    }
    json(&with(&["--spp", "1", "--checkpoint", &save, "--json"]));
    let before = std::fs::read(&save).unwrap();
    let link = folder.file("link.exr");
    #[cfg(unix)]
    std::os::unix::fs::symlink(&save, &link).unwrap();
    #[cfg(not(unix))]
    std::fs::hard_link(&save, &link).unwrap();
    for option in ["--checkpoint", "--resume"] {
        failure(&with(&["--spp", "2", option, &link, "-o", &save]));
    }
    assert_eq!(std::fs::read(&save).unwrap(), before);
}

#[cfg(unix)]
#[test]
fn devices_are_no_checkpoints() {
    for device in ["/dev/zero", "/dev/full", "/dev/null"] {
        for option in ["--checkpoint", "--resume"] {
            let message = failure(&with(&["--spp", "1", option, device]));
            assert!(message.contains(device) && message.contains("no regular file"), "{message}");
        }
    }
}

#[test]
fn places_that_can_not_be_used_are_found_before_the_rendering() {
    let folder = Folder::new();
    let (long, missing) = (["--spp", "1000000000"], folder.file("missing.film"));
    let other = folder.write("other.film", "pathspace checkpoint 0\nfrom long ago");
    let picture = folder.write("a.exr", b"\x76\x2f\x31\x01");
    let nowhere = folder.file("nowhere/a.film");
    let table: &[(&[&str], &str)] = &[
        (&["--resume", &missing], "missing.film: cannot read: No such file"),
        (&["--checkpoint", &nowhere], "nowhere/a.film: cannot write: No such file"),
        (&["--checkpoint", &picture], "a.exr: is not a checkpoint of pathspace"),
        (&["--checkpoint", &other], "other.film: was written by another version"),
        (&["--resume", &missing, "--checkpoint", &other], "other.film: is there already"),
        (&["--checkpoint", "/proc/a.film"], "/proc/a.film: cannot write"),
        (&["--checkpoint", &missing, "--checkpoint-every", "0"], "--checkpoint-every"),
    ];
    for (more, expected) in table {
        let message = failure(&with(&[&long[..], more].concat()));
        assert!(message.contains(expected), "{more:?}: {message}");
    }
    assert_eq!(folder.list(), ["a.exr", "other.film"]);
}

#[cfg(unix)]
mod signals {
    use super::*;
    use std::process::{Child, Stdio};
    use std::time::Duration;

    fn spawn(args: &[&str]) -> Child {
        let mut command = command();
        command.args(args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    }

    /// The image after `spp` samples in one piece.
    fn uninterrupted(folder: &Folder, spp: &str) -> Vec<(String, Vec<f32>)> {
        let out = folder.file("whole.exr");
        json(&with(&["--spp", spp, "-o", &out, "--json"]));
        Exr::read(&out).channels
    }

    #[test]
    fn ctrl_c_and_sigterm_leave_a_checkpoint_to_go_on_from() {
        for number in [libc::SIGINT, libc::SIGTERM] {
            let folder = Folder::new();
            let (save, out) = (folder.file("save.film"), folder.file("a.exr"));
            let args = |spp| {
                let every = "0.05";
                with(&["--spp", spp, "--checkpoint", &save, "--checkpoint-every", every, "--json"])
            };
            let child = spawn(&args("100000000"));
            wait_for_change(&save, &None);
            signal(&child, number);
            let output = child.wait_with_output().unwrap();
            assert_eq!(output.status.code(), Some(128 + number), "{}", stderr(&output));
            assert!(stdout(&output).contains("to go on: the same command with --resume "));
            let v = last_line(&output);
            let done = v["samples_per_pixel"].as_f64().unwrap();
            assert_eq!(v["complete"], false);
            let spp = (done + 3.0).to_string();
            let v = json(&[&args(&spp)[..], &["-o", &out]].concat());
            // The last step before the signal is in it, not only the last interval.
            assert_eq!(v["resumed_at"], done);
            assert!(Exr::read(&out).channels == uninterrupted(&folder, &spp));
        }
    }

    #[test]
    fn kill_9_loses_one_interval_at_most() {
        let folder = Folder::new();
        let (save, out) = (folder.file("save.film"), folder.file("a.exr"));
        let own = ["--checkpoint", &save, "--checkpoint-every", "0.02", "--json"];
        let mut before = None;
        for round in 0..6 {
            let child = spawn(&with(&[&own[..], &["--spp", "100000000"]].concat()));
            // Every round finishes an interval, and dies somewhere in one of the next.
            wait_for_change(&save, &before);
            std::thread::sleep(Duration::from_millis(7 * round));
            signal(&child, libc::SIGKILL);
            child.wait_with_output().unwrap();
            before = std::fs::read(&save).ok();
        }
        // What is there is whole, and nothing of it is lost or twice in the image.
        let stop = json(&with(&[&own[..], &["--spp", "1"]].concat()));
        let done = stop["samples_per_pixel"].as_f64().unwrap();
        assert!(done >= 6.0, "{done}");
        let spp = (done + 2.0).to_string();
        json(&with(&[&own[..], &["--spp", &spp, "-o", &out]].concat()));
        assert!(Exr::read(&out).channels == uninterrupted(&folder, &spp));
        // Fragments of files that were being written are gone.
        assert!(folder.list().iter().all(|name| !name.ends_with(".part")), "{:?}", folder.list());
    }

    /// Files may not grow beyond 4 kB here; a checkpoint of 32 × 24 pixels has 18.
    #[test]
    fn a_full_disk_keeps_the_checkpoint_before() {
        let folder = Folder::new();
        let save = folder.file("save.film");
        json(&with(&["--spp", "2", "--checkpoint", &save, "--json"]));
        let before = std::fs::read(&save).unwrap();
        let script = format!(
            "trap '' XFSZ; ulimit -f 8; exec {} {} --checkpoint-every 0.000001",
            env!("CARGO_BIN_EXE_pathspace"),
            with(&["--spp", "5", "--no-image", "--checkpoint", &save]).join(" ")
        );
        let output = std::process::Command::new("sh").args(["-c", &script]).output().unwrap();
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{message}");
        let lines: Vec<&str> = message.lines().collect();
        assert_eq!(lines.len(), 3, "{message}");
        assert!(lines[1].starts_with("warning: ") && lines[2].starts_with("error: "), "{message}");
        for line in &lines[1..] {
            assert!(line.contains("save.film: cannot write: File too large"), "{message}");
        }
        assert_eq!(std::fs::read(&save).unwrap(), before);
        assert_eq!(folder.list(), ["save.film"]);
    }
}
