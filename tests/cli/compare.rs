//! `pathspace compare`.

use std::time::Instant;

use crate::support::*;

#[test]
fn equal_integrators_agree_and_the_object_is_complete() {
    let folder = Folder::new();
    let dir = folder.file("new/out");
    let v = json(&words(&format!(
        "compare cornell-box -i pt -i lt --size 32x32 --max-depth 4 --spp 24 \
         --replicates 16 -o {dir} --json"
    )));
    assert_eq!((&v["scene"], &v["replicates"]), (&"cornell-box".into(), &16.into()));
    let integrators = v["integrators"].as_array().unwrap();
    assert_eq!(integrators.len(), 2);
    for (i, name) in integrators.iter().zip(["pt", "lt"]) {
        assert_eq!((&i["integrator"], &i["spp"]), (&name.into(), &24.0.into()));
        let number = |key: &str| i[key].as_f64().unwrap();
        for key in ["seconds", "cpu_seconds", "mse", "relmse", "efficiency", "rays"] {
            assert!(number(key) > 0.0, "{name}: {key}");
        }
        let product = number("efficiency") * number("mse") * number("seconds");
        assert!((product - 1.0).abs() < 1e-9);
        let exr = Exr::read(i["output"].as_str().unwrap());
        assert_eq!(exr.attribute("pathspace.replicates"), "16");
        assert!(mean(exr.channel("variance.G")) > 0.0);
    }
    let pairs = v["pairs"].as_array().unwrap();
    assert_eq!(pairs.len(), 1);
    let pair = &pairs[0];
    assert_eq!((&pair["a"], &pair["b"]), (&"pt".into(), &"lt".into()));
    assert_eq!(pair["verdict"], "agree", "{pair}");
    assert!(pair["p"].as_f64().unwrap() > 1e-4 && pair["mdb"].as_f64().unwrap() <= 0.05);
    let lengths: Vec<u64> =
        pair["lengths"].as_array().unwrap().iter().map(|l| l["length"].as_u64().unwrap()).collect();
    assert_eq!(lengths, [1, 2, 3, 4]);
    assert_eq!(pair["tiles"]["columns"], 16);
    assert_eq!(pair["unseen"].as_array().unwrap().len(), 0);
}

#[test]
fn different_depths_differ_and_that_is_the_exit_status() {
    let output = run(&words(
        "compare cornell-box -i lt:max_depth=2 -i lt:max_depth=3 --size 16x16 \
         --spp 128 --replicates 8 --json",
    ));
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let pair = &last_line(&output)["pairs"][0];
    assert_eq!((&pair["verdict"], &pair["image"]["verdict"]), (&"differ".into(), &"differ".into()));
    assert!(pair["p"].as_f64().unwrap() < 1e-4);
    // Direct light alone is the same, and one of them never makes length 3.
    assert_eq!(pair["lengths"][1]["verdict"], "agree");
    assert_eq!(pair["lengths"][2]["reason"], "never_sampled");
    let text = stdout(&output);
    assert!(
        text.contains(
            "ARE THEY RIGHT?  No: 1 of 1 pair differs: lt:max_depth=2 and lt:max_depth=3."
        ),
        "{text}"
    );
    assert!(text.contains("WHICH IS BEST?   Not to be said while integrators differ"), "{text}");
}

#[test]
fn what_light_tracing_can_not_make_is_left_out_and_said() {
    let output = run(&words(
        "compare cornell-caustic -i pt -i lt --size 32x32 --spp 64 --replicates 16 \
         --json --verbose",
    ));
    let v = last_line(&output);
    let pair = &v["pairs"][0];
    assert_ne!(pair["verdict"], "differ", "{pair}");
    let unseen = pair["unseen"].as_array().unwrap();
    assert_eq!(unseen.len(), 1);
    assert_eq!((&unseen[0]["integrator"], &unseen[0]["of"]), (&"lt".into(), &"pt".into()));
    let fraction = unseen[0]["fraction"].as_f64().unwrap();
    assert!(fraction > 0.005 && fraction < 0.5, "{fraction}");
    assert!(
        stdout(&output).contains("of pt's image (paths whose vertex at the sensor is specular)")
    );
    let share = format!("{:.1} %", 100.0 * (1.0 - fraction));
    let text = stdout(&output);
    let row = text.lines().find(|l| l.trim_start().starts_with("lt*")).unwrap();
    assert!(row.ends_with(&share), "{row}");
    assert!(text.contains("* cannot see glass or mirrors directly"), "{text}");
    // The whole image of pt is brighter by just that part.
    let whole = v["integrators"][0]["mean"].as_array().unwrap();
    let rgb: Vec<f64> = whole.iter().map(|c| c.as_f64().unwrap()).collect();
    let y = 0.212671 * rgb[0] + 0.715160 * rgb[1] + 0.072169 * rgb[2];
    let common = pair["image"]["mean_a"].as_f64().unwrap();
    assert!((common / y - (1.0 - fraction)).abs() < 1e-6);
}

#[test]
fn all_registered_integrators_take_part_unless_named() {
    let v =
        json(&["compare", "furnace", "--size", "8x8", "--spp", "1", "--replicates", "2", "--json"]);
    let names: Vec<&str> = v["integrators"]
        .as_array()
        .unwrap()
        .iter()
        .map(|i| i["integrator"].as_str().unwrap())
        .collect();
    let registry = pathspace::integrators::Registry::builtin();
    assert_eq!(names, registry.list().map(|(name, _)| name).collect::<Vec<_>>());
}

#[test]
fn the_same_integrator_twice_has_independent_replicates() {
    let v =
        json(&words("compare cornell-box -i pt -i pt --size 16x16 --spp 8 --replicates 4 --json"));
    assert_eq!(v["integrators"][1]["integrator"], "pt#2");
    assert_ne!(v["integrators"][0]["mean"], v["integrators"][1]["mean"]);
    assert_eq!(v["pairs"][0]["tiles"], serde_json::Value::Null);
}

#[test]
fn figures_do_not_depend_on_the_number_of_threads() {
    let mse = |threads: &str| {
        let v = json(&words(&format!(
            "compare cornell-box -i pt -i lt --size 40x40 --spp 2 --replicates 3 \
             --threads {threads} --json"
        )));
        (v["integrators"][0]["mse"].clone(), v["pairs"][0]["p"].clone())
    };
    assert_eq!(mse("1"), mse("3"));
}

#[test]
fn seconds_are_those_of_one_replicate() {
    let line = "compare cornell-box -i pt --size 32x32 --seconds 0.4 --replicates 3 --json";
    let begin = Instant::now();
    let v = json(&words(line));
    let seconds = v["integrators"][0]["seconds"].as_f64().unwrap();
    // Three of them, one after the other, fit into the time of the whole command, however busy the
    // machine is; three times their sum would not.
    assert!(3.0 * seconds <= begin.elapsed().as_secs_f64(), "{seconds}");
    assert!(seconds > 0.0 && v["integrators"][0]["spp"].as_f64().unwrap() > 0.0, "{v}");
}

#[test]
fn pictures_of_a_scene_share_the_exposure_that_is_asked_for() {
    let folder = Folder::new();
    let line = "compare furnace -i pt -i bdpt --size 8x8 --max-depth 1 --spp 1 --replicates 2";
    // The background is 1 everywhere: sRGB of ½ where a stop less is asked for, nearly white where
    // nothing is.
    for (more, levels) in [("--exposure -1", 187..=188), ("", 231..=255)] {
        let line = format!("{line} {more} -o out");
        let output = run_in(folder.path(), &words(&line));
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        for name in ["pt", "bdpt"] {
            let picture = image::open(folder.file(&format!("out/furnace/{name}/mean.png")));
            let level = picture.unwrap().to_rgb8().get_pixel(0, 0).0[1];
            assert!(levels.contains(&level), "{name} {more}: {level}");
        }
    }
    let output = run_in(folder.path(), &words(&format!("{line} --exposure auto -o out")));
    assert!(stderr(&output).contains("furnace: exposure "), "{}", stderr(&output));
}

/// What a person reads without asking for more: verdicts, the best, a row each, and what to type
/// next.
#[test]
fn the_first_screen_is_short_and_its_commands_run() {
    let folder = Folder::new();
    let args =
        words("compare cornell-box -i pt -i bdpt -i lt --size 8x8 --spp 2 --replicates 4 -o out");
    let output = run_in(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let text = stdout(&output);
    assert!(text.lines().count() <= 24, "{text}");
    let line = |start: &str| {
        let found = text.lines().find_map(|l| l.strip_prefix(start));
        found.unwrap_or_else(|| panic!("no line {start}: {text}")).trim().to_owned()
    };
    assert!(
        text.starts_with("cornell-box 8×8 · 3 integrators × 4 renders · 2 samples per pixel each")
    );
    assert!(line("ARE THEY RIGHT?").starts_with("No difference found in 3 pairs"), "{text}");
    line("WHICH IS BEST?");
    assert!(!text.contains("path length"), "{text}");
    assert!(folder.path().join(line("Open")).is_file());
    for start in ["Firmer", "Details"] {
        let mut words = line(start);
        words = words.replace(env!("CARGO_BIN_EXE_pathspace"), "");
        let words: Vec<&str> = words.split_whitespace().collect();
        let output = run_in(folder.path(), &words);
        assert_eq!(output.status.code(), Some(0), "{words:?}: {}", stderr(&output));
    }
    assert!(folder.path().join("out2/report.html").is_file());
    let details = run_in(folder.path(), &["report", "out", "--verbose"]);
    assert!(stdout(&details).contains("path length"));
}
