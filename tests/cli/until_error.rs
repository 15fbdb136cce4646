//! `pathspace render --error`.

use crate::support::*;

fn render<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["render", "cornell-box", "--size", "24x18", "--max-depth", "4"], more].concat()
}

#[test]
fn rendering_ends_at_the_error_and_says_the_interval() {
    let output = run(&render(&["--error", "0.08", "--json"]));
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let v = last_line(&output);
    let figure = |name: &str| v["error"][name].as_f64().unwrap();
    assert_eq!((figure("target"), figure("confidence")), (0.08, 0.95));
    assert!(figure("low") < figure("value") && figure("value") < figure("high"), "{v}");
    assert!(figure("high") <= 0.08 && figure("low") > 0.04, "{v}");
    assert_eq!((&v["complete"], figure("batch_samples_per_pixel")), (&true.into(), 1.0));
    assert!(figure("batches") <= v["samples_per_pixel"].as_f64().unwrap());
    let text = stdout(&output);
    assert!(text.contains("relative error ") && text.contains("with 95 % confidence"), "{text}");
}

#[test]
fn a_limit_comes_first_where_it_does() {
    let v = json(&render(&["--error", "0.0001", "--spp", "20", "--json"]));
    assert_eq!((&v["complete"], &v["samples_per_pixel"]), (&false.into(), &20.0.into()));
    assert!(v["error"]["low"].as_f64().unwrap() > 0.0001);
    // Of too few batches nothing is known.
    let output = run(&render(&["--error", "0.0001", "--spp", "3"]));
    assert!(stdout(&output).contains("relative error: unknown after 2 batches"));
    assert_eq!(json(&render(&["--spp", "3", "--json"]))["error"], serde_json::Value::Null);
}

#[test]
fn it_stops_and_goes_on_to_the_bit() {
    let folder = Folder::new();
    let (save, whole, parts) =
        (folder.file("save.film"), folder.file("whole.exr"), folder.file("parts.exr"));
    json(&render(&["--error", "0.08", "-o", &whole, "--json"]));
    let own = ["--error", "0.08", "--checkpoint", &save, "--json"];
    json(&render(&[&own[..], &["--spp", "9"]].concat()));
    let v = json(&render(&[&own[..], &["-o", &parts]].concat()));
    assert_eq!(v["resumed_at"], 9.0);
    assert!(Exr::read(&whole).channels == Exr::read(&parts).channels);
    let output = run(&render(&["--spp", "100", "--resume", &save]));
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2));
    assert!(message.contains("save.film: was rendered with --error, and can not go on without"));
}

#[test]
fn shares_and_errors_do_not_go_together() {
    for (more, expected) in [
        (&["--error", "0.1", "--shard", "1/2"][..], "--shard"),
        (&["--error", "1"], "expected a number between 0 and 1"),
        (&["--error", "0.1", "--spp", "1", "--seconds", "1"], "--seconds"),
    ] {
        let output = run(&render(more));
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains(expected), "{message}");
    }
}
