//! What the page says, without a browser.

use std::path::{Path, PathBuf};

use pathspace_benches::report::{self, IMAGE_BYTES, page};
use pathspace_benches::results::{Images, Results};

use crate::sample::sample;

const INTEGRATORS: [&str; 4] = ["pt", "bdpt", "lt", "mitsuba:path"];

/// An empty folder that stays after the test, to be looked at.
pub fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report").join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

fn page_of(results: &Results, folder: &Path) -> String {
    page(results, folder, IMAGE_BYTES).unwrap()
}

#[test]
fn the_page_refers_to_nothing_outside() {
    let folder = folder("outside");
    let text = page_of(&sample(&folder, &["a", "b"], &INTEGRATORS), &folder);
    for reference in ["src=\"", "href=\"", "url(", "@import", "fetch(", "XMLHttpRequest", "import("]
    {
        for (at, _) in text.match_indices(reference) {
            let target: String = text[at + reference.len()..].chars().take(24).collect();
            let inside = ["#", "data:", "blob:"].iter().any(|s| target.starts_with(s));
            assert!(inside, "{reference}{target}");
        }
    }
    assert!(text.contains("default-src 'none'"));
}

#[test]
fn names_are_escaped() {
    let folder = folder("escaped");
    let evil = "<script>alert(1)</script>";
    let mut results = sample(&folder, &[evil, "b"], &["pt", "<img src=x onerror=alert(2)>"]);
    results.command = "</pre><script>alert(3)</script>".into();
    results.experiment = "a = \"</script><!--\"".into();
    let text = page_of(&results, &folder);
    assert!(!text.contains("<script>alert") && !text.contains("<img src=x"));
    assert!(text.contains("&lt;script&gt;alert(1)"));
    let clean = page_of(&sample(&folder, &["a", "b"], &["pt", "lt"]), &folder);
    let scripts = |t: &str| t.matches("</script").count();
    assert_eq!(scripts(&text), scripts(&clean));
}

#[test]
fn the_data_of_the_page_are_the_results() {
    let folder = folder("data");
    let results = sample(&folder, &["a"], &INTEGRATORS);
    let text = page_of(&results, &folder);
    let begin = text.find("id=\"data\">").unwrap() + 10;
    let end = begin + text[begin..].find("</script>").unwrap();
    let data: serde_json::Value = serde_json::from_str(&text[begin..end]).unwrap();
    let back: Results = serde_json::from_value(data["results"].clone()).unwrap();
    assert!(serde_json::to_string(&back).unwrap() == serde_json::to_string(&results).unwrap());
    assert_eq!(data["images"][0]["methods"][1]["frames"].as_array().unwrap().len(), 6);
}

#[test]
fn images_that_are_missing_are_named() {
    let folder = folder("missing");
    let mut results = sample(&folder, &["a"], &["pt", "lt"]);
    results.scenes[0].methods[0].images.mean = "nowhere.exr".into();
    results.scenes[0].methods[1].frames[0] = "nothing.png".into();
    let text = page_of(&results, &folder);
    assert!(text.contains("Not shown: nowhere.exr") && text.contains("Not shown: nothing.png"));
}

#[test]
fn a_page_needs_none_of_what_is_optional() {
    let folder = folder("optional");
    let mut results = sample(&folder, &["a"], &["pt", "lt"]);
    results.complete = false;
    results.citation = String::new();
    let scene = &mut results.scenes[0];
    scene.reference = None;
    scene.pairs.clear();
    for method in &mut scene.methods {
        method.images = Images::default();
        method.frames.clear();
        method.error_pngs.clear();
        (method.slope, method.ratio, method.time_to_error) = (None, None, None);
    }
    scene.methods[1].points.clear();
    let text = page_of(&results, &folder);
    assert!(text.contains("Interrupted.") && text.contains("No pair was tested"));
    assert!(!text.contains("Not shown") && !text.contains("NaN</td>"));
    results.scenes.clear();
    assert!(page_of(&results, &folder).contains("An empty comparison"));
}

#[test]
fn one_scene_needs_no_tabs_and_many_have_one_each() {
    let folder = folder("scenes");
    let one = page_of(&sample(&folder, &["a"], &["pt", "lt"]), &folder);
    assert!(!one.contains("role=\"tab\" id") && !one.contains("id=\"overall\""));
    let many = page_of(&sample(&folder, &["a", "b", "c"], &["pt", "lt"]), &folder);
    assert_eq!(many.matches("role=\"tab\" id").count(), 3);
    assert!(many.contains("id=\"overall\""));
}

#[test]
fn images_are_made_smaller_until_they_fit() {
    let folder = folder("budget");
    let results = sample(&folder, &["a", "b"], &INTEGRATORS);
    let images = |text: &str| -> usize {
        let scripts = text.split("<script type=\"text/plain\"").skip(1);
        scripts.map(|s| s.find("</script>").unwrap()).sum()
    };
    let large = page(&results, &folder, 1 << 30).unwrap();
    let small = page(&results, &folder, 600_000).unwrap();
    assert!(images(&large) > 1_000_000 && images(&small) <= 600_000, "{}", images(&small));
    assert!(!large.contains("To keep this page small"));
    assert!(small.contains("To keep this page small"));
}

#[test]
fn a_report_is_rebuilt_from_its_folder() {
    let folder = folder("rebuilt");
    let results = sample(&folder, &["a"], &["pt", "lt"]);
    assert!(report::rebuild(&folder).unwrap_err().to_string().contains("results.json"));
    std::fs::write(folder.join("results.json"), serde_json::to_string(&results).unwrap()).unwrap();
    let path = report::rebuild(&folder).unwrap();
    let direct = folder.join("direct.html");
    report::write(&results, &folder, &direct).unwrap();
    assert!(std::fs::read(path).unwrap() == std::fs::read(direct).unwrap());
    std::fs::write(folder.join("results.json"), "{}").unwrap();
    assert!(report::rebuild(&folder).is_err());
}

#[test]
fn the_first_sentence_says_who_is_best_and_who_is_apart() {
    let folder = folder("sentence");
    let mut results = sample(&folder, &["a"], &["pt", "bdpt"]);
    let text = page_of(&results, &folder);
    // In the sample bdpt lacks 3.1 % of the image of pt.
    assert!(text.contains("✓ no difference found"), "no chip");
    assert!(text.contains("pt, the baseline, among those that make the whole image"));
    assert!(text.contains("Ranked apart, because they make a part of the image only: bdpt."));
    assert!(text.contains("bdpt*") && text.contains("96.9 %"));
    results.scenes[0].pairs[0].judgement.unseen.clear();
    let text = page_of(&results, &folder);
    assert!(text.contains("bdpt: 3.4 × pt [2.7, 4.2]") && !text.contains("Ranked apart"));
}

#[test]
fn one_budget_is_shown_as_dots_and_several_as_curves() {
    let folder = folder("dots");
    let mut results = sample(&folder, &["a"], &["pt", "bdpt"]);
    let curves = page_of(&results, &folder);
    assert!(
        curves.contains("data-mount=\"curves\"") && curves.contains("aria-label=\"a: efficiency")
    );
    for method in &mut results.scenes[0].methods {
        method.points.drain(..5);
    }
    let dots = page_of(&results, &folder);
    assert!(
        !dots.contains("data-mount=\"curves\"")
            && dots.contains("aria-label=\"a: MSE of one render")
    );
    // Every axis has ticks and a name.
    assert!(dots.contains(">MSE of one render (lower is better)</text>"));
}

#[test]
fn charts_become_files_for_papers() {
    let folder = folder("charts");
    let results = sample(&folder, &["a"], &INTEGRATORS);
    let files = pathspace_benches::plots::write(&results, &folder.join("plots")).unwrap();
    let names: Vec<_> = files.iter().map(|f| f.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!(names, ["a.efficiency.svg", "a.efficiency.pdf", "a.error.svg", "a.error.pdf"]);
    for file in &files {
        let bytes = std::fs::read(file).unwrap();
        match file.extension().unwrap().to_str() {
            Some("svg") => {
                let text = String::from_utf8(bytes).unwrap();
                assert!(text.starts_with("<svg xmlns=") && text.contains(">bdpt"), "{text}");
                // A file of its own knows no colours of a page.
                assert!(!text.contains("var(--"));
            }
            _ => assert!(bytes.starts_with(b"%PDF-1.7")),
        }
    }
}

#[test]
fn the_table_for_papers_has_ratios_and_verdicts() {
    let folder = folder("csv");
    let text = pathspace_benches::csv(&sample(&folder, &["a"], &["pt", "bdpt"]));
    let rows: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
    assert!(rows.iter().all(|r| r.len() == rows[0].len()), "{text}");
    let column = |name: &str| rows[0].iter().position(|c| *c == name).unwrap();
    // The last budget of the second integrator.
    let last = rows.last().unwrap();
    assert_eq!((last[column("integrator")], last[column("baseline")]), ("bdpt", "pt"));
    assert_eq!((last[column("ratio")], last[column("verdict")]), ("3.4", "agree"));
    assert!((last[column("share_of_image")].parse::<f64>().unwrap() - 0.969).abs() < 1e-9);
    assert_eq!(rows[1][column("ratio")], "");
}
