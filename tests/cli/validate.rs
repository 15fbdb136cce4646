//! `pathspace validate`.

use crate::support::*;

const SMALL: &[&str] = &["--effort", "0.02", "--json"];

fn quick(args: &[&str]) -> std::process::Output {
    run(&[&["validate", "quick"], args, SMALL].concat())
}

#[test]
fn integrators_that_do_not_differ_pass_and_the_object_is_complete() {
    let folder = Folder::new();
    let dir = folder.file("new");
    let output = quick(&["-i", "pt", "-i", "bdpt", "--scene", "thin-lens", "-o", &dir]);
    assert_eq!(output.status.code(), Some(0), "{}", stdout(&output));
    let v = last_line(&output);
    assert_eq!((&v["passed"], &v["complete"]), (&true.into(), &true.into()));
    let scene = &v["scenes"][0];
    assert_eq!((&scene["scene"], &scene["size"]), (&"thin-lens".into(), &[32, 32].into()));
    let pair = &scene["pairs"][0];
    // Every integrator is held to bdpt.
    assert_eq!((&pair["a"], &pair["b"]), (&"bdpt".into(), &"pt".into()));
    assert!(pair["mdb"].as_f64().unwrap() > 0.0 && pair["rounds"][0]["p"].as_f64().unwrap() > 0.0);
    let file = std::fs::read_to_string(folder.path().join("new/report.json")).unwrap();
    let file: serde_json::Value = serde_json::from_str(&file).unwrap();
    assert_eq!(file["scenes"], v["scenes"]);
    let page = std::fs::read_to_string(folder.path().join("new/report.html")).unwrap();
    let cell = format!("cell {}", pair["outcome"].as_str().unwrap());
    assert!(page.contains("thin-lens") && page.contains(&cell), "{cell}");
    assert!(!page.contains("http://") && !page.contains("https://"));
}

#[test]
fn a_difference_fails_with_what_replays_it() {
    let args = ["-i", "pt:max_depth=2", "-i", "pt:max_depth=3", "--scene", "smooth-shading"];
    let output = quick(&args);
    assert_eq!(output.status.code(), Some(1), "{}", stdout(&output));
    let v = last_line(&output);
    assert_eq!(v["passed"], false);
    let failure = &v["failures"][0];
    assert_eq!(failure["scene"], "smooth-shading");
    assert_eq!(failure["integrators"], serde_json::json!(["pt:max_depth=2", "pt:max_depth=3"]));
    assert!(failure["tile"].is_array(), "{failure}");
    let pair = &v["scenes"][0]["pairs"][0];
    assert_eq!(pair["outcome"], "differ");
    // Said after a second look with fresh seeds, never after one.
    assert!(pair["rounds"].as_array().unwrap().len() >= 2);
    assert_eq!(pair["maps"][0]["sigma"].as_array().unwrap().len(), 256);
    // The command that is printed does the same again.
    let replay = failure["replay"].as_str().unwrap().replace('\'', "");
    let again: Vec<&str> = replay.split(' ').skip(1).collect();
    let again = run(&[&again[..], &["--json"]].concat());
    assert_eq!(again.status.code(), Some(1));
    assert_eq!(last_line(&again)["scenes"][0]["pairs"][0]["rounds"], pair["rounds"]);
}

#[test]
fn figures_are_the_same_for_any_number_of_threads_and_company() {
    let with = |args: &[&str]| {
        let v = last_line(&quick(&[&["--scene", "mis-plates", "--level", "1e-7"], args].concat()));
        v["scenes"][0]["pairs"][0].clone()
    };
    let pair = with(&["-i", "pt", "-i", "bdpt", "--threads", "1"]);
    assert_eq!(pair, with(&["-i", "pt", "-i", "bdpt", "-i", "lt", "--threads", "3"]));
}

#[test]
fn exact_answers_are_met_and_what_is_not_seen_is_left_out() {
    let output = quick(&["-i", "pt", "-i", "lt", "--scene", "refractive plane"]);
    let v = last_line(&output);
    let outcomes: Vec<_> =
        v["checks"].as_array().unwrap().iter().map(|c| c["outcome"].clone()).collect();
    assert_eq!(outcomes[0], "skipped");
    assert_ne!(outcomes[1], "failed");
    assert!(stdout(&output).contains("left out: pt on refractive plane"));
}

#[test]
fn another_seed_is_another_experiment() {
    let mean = |seed: &str| {
        let args = ["-i", "pt", "-i", "bdpt", "--scene", "thin-lens", "--seed", seed];
        last_line(&quick(&args))["scenes"][0]["pairs"][0]["image"]["mean_a"].clone()
    };
    assert_ne!(mean("1"), mean("2"));
}

#[test]
fn the_sequential_form_says_what_it_finds() {
    let args = ["-i", "pt:max_depth=2", "-i", "pt:max_depth=3", "--scene", "smooth-shading"];
    let output = quick(&[&args[..], &["--sequential"]].concat());
    assert_eq!(output.status.code(), Some(1), "{}", stdout(&output));
    let round = &last_line(&output)["scenes"][0]["pairs"][0]["rounds"][0];
    // Stopped early: the limit is 128.
    assert!(round["replicates"].as_u64().unwrap() < 64, "{round}");
}

#[test]
fn unknown_suites_and_scenes_are_refused_in_one_line() {
    for args in [&["validate", "everything"][..], &["validate", "quick", "--scene", "nowhere"]] {
        let output = run(args);
        assert_eq!(output.status.code(), Some(2));
        assert_eq!(stderr(&output).lines().count(), 1, "{}", stderr(&output));
    }
}
