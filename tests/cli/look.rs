//! Commands that look inside: `inspect`, `neumann`, `replay`, `completions`, `man`.

use crate::support::*;

#[test]
fn inspect_says_what_is_there_and_who_sees_it() {
    let output = run(&["inspect", "cornell-caustic"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let text = stdout(&output);
    for start in [
        "shapes",
        "triangles",
        "tree",
        "memory",
        "bounds",
        "BSDFs",
        "emitters",
        "camera",
        "film",
        "integrator",
    ] {
        assert!(text.lines().any(|l| l.starts_with(start)), "{start}: {text}");
    }
    let sees = text.lines().find(|l| l.starts_with("sight")).unwrap();
    assert!(sees.contains("the whole image: pt, bdpt"), "{sees}");
    // Light tracing lacks what is seen in the glass.
    assert!(text.contains("a part of it: lt "), "{text}");
}

#[test]
fn a_series_has_a_layer_for_each_term_and_each_sum() {
    let folder = Folder::new();
    let args = ["neumann", "cornell-box", "--size", "16x16", "--spp", "4", "--terms", "3"];
    let output = run_in(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let files =
        ["cornell-box.neumann.exr", "cornell-box.neumann.png", "cornell-box.neumann.sheet.png"];
    assert_eq!(folder.list(), files);
    let exr = Exr::read(&folder.file(files[0]));
    let sum: Vec<f32> =
        (0..256).map(|i| (0..3).map(|n| exr.channel(&format!("term.{n:02}.G"))[i]).sum()).collect();
    let close =
        |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-5 * b.abs());
    assert!(close(&sum, exr.channel("sum.02.G")) && close(&sum, exr.channel("G")));
    // The box is diffuse: finite elements stand beside it.
    assert!(mean(exr.channel("radiosity.term.01.G")) > 0.0);
    // Two rows for each.
    let sheet = image::open(folder.file(files[2])).unwrap();
    assert_eq!((sheet.width(), sheet.height()), (4 + 3 * 20, 4 + 4 * (16 + 12 + 4)));
    let glass = ["neumann", "cornell-caustic", "--size", "8x8", "--spp", "1", "--terms", "2"];
    let text = stdout(&run_in(folder.path(), &glass));
    assert!(text.contains("no radiosity beside it: "), "{text}");
}

/// What is replayed is what was rendered: the contributions of one pixel's sample make its value.
#[test]
fn a_replayed_path_is_the_one_that_was_rendered() {
    let folder = Folder::new();
    let out = folder.file("a.exr");
    let scene = ["cornell-box", "--size", "8x8", "-i", "pt:max_depth=2", "--seed", "3"];
    run(&[&["render"], &scene[..], &["--spp", "1", "-o", &out]].concat());
    let green = Exr::read(&out).channel("G").to_vec();
    let lit = green.iter().position(|v| *v > 0.0).unwrap();
    let item = lit.to_string();
    let output = run(&[&["replay"], &scene[..], &["--item", &item]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let text = stdout(&output);
    let value = |line: &str| {
        let list = line.rsplit_once("w f/p = [").unwrap().1.trim_end_matches(']').to_owned();
        list.split(", ").nth(1).unwrap().parse::<f64>().unwrap()
    };
    let values: Vec<f64> = text.lines().filter(|l| l.contains("w f/p = ")).map(value).collect();
    let (sum, pixel) = (values.iter().sum::<f64>(), f64::from(green[lit]));
    // As far as the three digits of each value go.
    let digits = 0.0005 * values.len() as f64 + 0.005 * pixel;
    assert!((sum - pixel).abs() <= digits, "{sum}, {pixel}: {text}");
    assert!(
        text.contains("x0 ") && text.contains("sensor") && text.contains("densities: (0,"),
        "{text}"
    );
    let (x, y) = (lit % 8, lit / 8);
    let same = run(&[&["replay"], &scene[..], &["--pixel", &format!("{x},{y}")]].concat());
    assert_eq!(stdout(&same), text);
}

#[test]
fn what_can_not_be_replayed_is_said() {
    for (more, expected) in [
        (&["-i", "mmlt"][..], "pt, lt and bdpt can be replayed"),
        (&["--item", "64"], "a step has the items 0 to 63"),
        (&["--pixel", "8,0"], "outside of the image"),
        (&["--pixel", "8"], "expected x,y"),
    ] {
        let output = run(&[&["replay", "cornell-box", "--size", "8x8"], more].concat());
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains(expected), "{}", stderr(&output));
    }
}

#[test]
fn completions_and_manual_know_the_commands() {
    for shell in ["bash", "zsh", "fish"] {
        let text = stdout(&run(&["completions", shell]));
        assert!(text.contains("neumann") && text.contains("exposure"), "{shell}");
    }
    let folder = Folder::new();
    assert_eq!(run_in(folder.path(), &["man", "pages"]).status.code(), Some(0));
    let page = std::fs::read_to_string(folder.file("pages/pathspace-render.1")).unwrap();
    assert!(page.contains(".TH") && page.contains("exposure"), "{page}");
}

#[test]
fn narrow_terminals_plain_locales_and_closed_pipes_break_nothing() {
    let folder = Folder::new();
    let mut small = command();
    small.args(["compare", "--help"]).env("COLUMNS", "20").env("LC_ALL", "C");
    assert!(small.output().unwrap().status.success());
    let script = format!("{} scenes >&-", env!("CARGO_BIN_EXE_pathspace"));
    let output = std::process::Command::new("sh")
        .args(["-c", &script])
        .current_dir(folder.path())
        .env("LC_ALL", "C")
        .output()
        .unwrap();
    assert!(!stderr(&output).contains("panicked"), "{}", stderr(&output));
}
