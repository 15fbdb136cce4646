//! Experiments of `pathspace compare`: several scenes, sweeps, files, going on after a stop.

use std::process::Stdio;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::support::*;

fn results(folder: &Folder, dir: &str) -> Value {
    let text = std::fs::read_to_string(folder.path().join(dir).join("results.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

const FILE: &str = r#"
scenes = ["cornell-box", { scene = "furnace", size = "8x8" }]
integrators = ["pt", "bdpt"]
sweep = "0..2"
replicates = 4
size = "16x16"
max_depth = 4
baseline = "bdpt"
target_error = 0.5
"#;

#[test]
fn an_experiment_file_gives_results_curves_and_pictures() {
    let folder = Folder::new();
    folder.write("e.toml", FILE);
    let output = run_in(
        folder.path(),
        &["compare", "--experiment", "e.toml", "-o", "out", "--json", "--threads", "1"],
    );
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).contains("geometric mean over scenes"));
    assert_eq!(last_line(&output)["scenes"].as_array().unwrap().len(), 2);

    let r = results(&folder, "out");
    assert_eq!((&r["schema"], &r["complete"], &r["seed"]), (&1.into(), &true.into(), &1.into()));
    assert_eq!(r["machine"]["threads"], 1);
    assert_eq!(r["overall"][0]["baseline"], "bdpt");
    let scenes = r["scenes"].as_array().unwrap();
    assert_eq!((&scenes[0]["width"], &scenes[1]["width"]), (&16.into(), &8.into()));
    for method in scenes.iter().flat_map(|s| s["methods"].as_array().unwrap()) {
        let points = method["points"].as_array().unwrap();
        let spp: Vec<u64> = points.iter().map(|p| p["spp"].as_f64().unwrap() as u64).collect();
        assert_eq!(spp, [1, 2, 4]);
        assert!(points.iter().all(|p| p["per_replicate_mse"].as_array().unwrap().len() == 4));
        let has_ratio = method["ratio"]["value"].as_f64().is_some();
        assert_eq!(has_ratio, method["integrator"] == "pt");
        assert!(method["time_to_error"]["target"] == 0.5);
        // Every picture that is named is there.
        let images = &method["images"];
        let mut files: Vec<&Value> =
            ["mean", "png", "sigma_png", "techniques"].map(|k| &images[k]).to_vec();
        files.extend(method["frames"].as_array().unwrap());
        files.extend(method["error_pngs"].as_array().unwrap());
        files.extend(images["lengths"].as_array().unwrap().iter().map(|l| &l[1]));
        assert_eq!(method["frames"].as_array().unwrap().len(), 3);
        for file in files {
            let path = folder.path().join("out").join(file.as_str().unwrap());
            assert!(path.is_file(), "{}", path.display());
        }
    }
    // Finished renders are of no more use.
    assert!(!folder.path().join("out/cells").exists());
    // The file that is stored repeats the experiment.
    let stored = r["experiment"].as_str().unwrap();
    assert_eq!(std::fs::read_to_string(folder.path().join("out/experiment.toml")).unwrap(), stored);
    let again =
        run_in(folder.path(), &["compare", "--experiment", "out/experiment.toml", "-o", "again"]);
    assert_eq!(again.status.code(), Some(0), "{}", stderr(&again));
    let mse = |r: &Value| r["scenes"][1]["methods"][0]["points"][2]["per_replicate_mse"].clone();
    assert_eq!(mse(&results(&folder, "again")), mse(&r));
}

#[test]
fn the_table_of_points_has_a_line_for_each() {
    let folder = Folder::new();
    let args =
        words("compare furnace cornell-box -i pt --size 8x8 --sweep 1..2 --replicates 3 -o out");
    let output = run_in(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let csv = std::fs::read_to_string(folder.path().join("out/results.csv")).unwrap();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 1 + 2 * 2);
    assert!(lines[1].starts_with("furnace,pt,false,2,spp,"));
    let columns = lines[0].split(',').count();
    assert!(lines.iter().all(|l| l.split(',').count() == columns));
}

#[test]
fn killed_at_any_moment_it_goes_on_and_ends_the_same() {
    let folder = Folder::new();
    let args = words(
        "compare cornell-box -i pt -i bdpt --size 24x24 --spp 64 --replicates 8 \
         --max-depth 5 -o",
    );
    let whole = run_in(folder.path(), &[&args[..], &["whole"]].concat());
    assert_eq!(whole.status.code(), Some(0), "{}", stderr(&whole));
    let cells = folder.path().join("out/cells");
    let finished = || std::fs::read_dir(&cells).map_or(0, Iterator::count);
    let mut kills = 0;
    // Killed after two more renders each time, until it gets through.
    loop {
        let before = finished();
        let mut child = command()
            .args([&args[..], &["out"]].concat())
            .current_dir(folder.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let begin = Instant::now();
        let done = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break Some(status);
            }
            if kills < 3 && finished() >= before + 2 {
                break None;
            }
            assert!(begin.elapsed() < Duration::from_secs(60));
            std::thread::sleep(Duration::from_millis(1));
        };
        match done {
            Some(status) => {
                assert!(status.success());
                break;
            }
            None => {
                child.kill().unwrap();
                child.wait().unwrap();
                kills += 1;
                assert!(finished() >= before + 2, "finished renders were lost");
            }
        }
    }
    assert!(kills > 0, "it was never killed");
    let errors = |dir: &str| -> Vec<Value> {
        let r = results(&folder, dir);
        let methods = r["scenes"][0]["methods"].as_array().unwrap();
        methods.iter().map(|a| a["points"][0]["per_replicate_mse"].clone()).collect()
    };
    assert_eq!(errors("out"), errors("whole"));
}

#[test]
fn a_reference_is_built_once_and_measured_against() {
    let folder = Folder::new();
    let reference = |more: &[&str]| {
        let args = ["reference", "furnace", "--size", "8x8", "-i", "pt", "-i", "bdpt", "--json"];
        run_in(folder.path(), &[&args[..], more].concat())
    };
    let output = reference(&["--error", "0.02", "--seconds", "0.01"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let made = last_line(&output);
    assert_eq!((&made["verdict"], &made["cached"]), (&"agree".into(), &false.into()));
    assert!(made["relative_error"].as_f64().unwrap() <= 0.02);
    assert_eq!(last_line(&reference(&["--error", "0.02"]))["cached"], true);

    let args = words(
        "compare furnace --size 8x8 -i lt --spp 16 --replicates 8 \
         --references references -o out",
    );
    let output = run_in(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).contains("errors are measured against a reference"));
    let r = results(&folder, "out");
    assert_eq!(r["scenes"][0]["reference"]["integrators"], serde_json::json!(["pt", "bdpt"]));
    // A reference that is a share of what is compared.
    let output = reference(&["--for", "out/results.json", "--fraction", "1"]);
    assert_eq!(last_line(&output)["cached"], true, "{}", stderr(&output));
}

#[test]
fn integrators_that_differ_make_no_reference() {
    let folder = Folder::new();
    let output = run_in(
        folder.path(),
        &words(
            "reference cornell-box --size 8x8 -i lt:max_depth=2 -i lt:max_depth=3 \
             --error 0.5 --seconds 0.05",
        ),
    );
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("differ (p = "), "{}", stderr(&output));
    assert!(stderr(&output).contains("no reference"));
    assert!(folder.list().iter().all(|f| f == "references"));
}

#[test]
fn renderers_that_are_absent_are_left_out_with_a_line() {
    let folder = Folder::new();
    let output = run_in(
        folder.path(),
        &words(
            "compare furnace -i pt -i external:command=no-such-renderer --size 8x8 --spp 1 \
             --replicates 2 -o out",
        ),
    );
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("external:command=no-such-renderer is not there"));
    let r = results(&folder, "out");
    assert_eq!(r["scenes"][0]["methods"].as_array().unwrap().len(), 1);
    assert!(r["notes"][0].as_str().unwrap().contains("left out"));
}

/// A peer that is wrong is left out by name, one that ignores its seed is noted, and the comparison
/// goes on.
#[cfg(unix)]
#[test]
fn renderers_that_fail_are_left_out_by_name() {
    use std::os::unix::fs::PermissionsExt;

    let folder = Folder::new();
    let image = |name: &str, value: f32| {
        let path = folder.path().join(name);
        exr::prelude::write_rgb_file(&path, 8, 8, |x, y| {
            let v = if (x, y) == (3, 4) { value } else { 1.0 };
            (v, v, v)
        })
        .unwrap();
    };
    image("nan.exr", f32::NAN);
    image("same.exr", 1.0);
    let adapter = |name: &str, act: &str| {
        let path = folder.write(
            name,
            format!(
                r#"#!/bin/sh
cd "$(dirname "$0")"
while read -r line; do
    out=$(echo "$line" | sed 's/.*"output":"\([^"]*\)".*/\1/')
    case "$line" in
    *'"ask":"describe"'*) echo '{{"version": "{name}"}}' ;;
    *) {act}; echo '{{"seconds": 0.001, "spp": 1}}' ;;
    esac
done
"#
            ),
        );
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        format!("external:command={path}")
    };
    let nan = adapter("nan.sh", r#"cp nan.exr "$out""#);
    let same = adapter("same.sh", r#"cp same.exr "$out""#);
    let hangs = adapter("hangs.sh", "sleep 60") + ",timeout=0.3";
    let bad = adapter("bad.sh", ":") + ",timeout=never";
    let mut args = vec!["compare", "furnace", "--size", "8x8", "--spp", "1", "--replicates", "3"];
    for spec in ["pt", &nan, &same, &hangs, &bad] {
        args.extend(["-i", spec]);
    }
    let output = run_in(folder.path(), &[&args[..], &["-o", "out"]].concat());
    let told = stderr(&output);
    assert!(matches!(output.status.code(), Some(0 | 1)), "{told}");
    for (spec, why) in [
        (&nan, "the adapter's image has NaN in pixel (3, 4)"),
        (&hangs, "no answer after 0.3 s"),
        (&bad, "timeout=never: expected seconds over 0"),
    ] {
        let line = told.lines().find(|l| l.contains(spec.as_str())).unwrap_or_default();
        assert!(line.contains("left out") && line.contains(why), "{line} in {told}");
    }
    assert!(told.contains("gave 1 different images: it ignores the seed"), "{told}");
    let r = results(&folder, "out");
    let methods: Vec<&str> = r["scenes"][0]["methods"]
        .as_array()
        .unwrap()
        .iter()
        .map(|a| a["integrator"].as_str().unwrap())
        .collect();
    assert_eq!(methods, ["pt", &same]);
    assert_eq!(r["notes"].as_array().unwrap().len(), 4);
}
