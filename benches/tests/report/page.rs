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
    assert_eq!(data["images"][0]["arms"][1]["frames"].as_array().unwrap().len(), 6);
}

#[test]
fn images_that_are_missing_are_named() {
    let folder = folder("missing");
    let mut results = sample(&folder, &["a"], &["pt", "lt"]);
    results.scenes[0].arms[0].images.mean = "nowhere.exr".into();
    results.scenes[0].arms[1].frames[0] = "nothing.png".into();
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
    for arm in &mut scene.arms {
        arm.images = Images::default();
        arm.frames.clear();
        arm.error_pngs.clear();
        (arm.slope, arm.ratio, arm.time_to_error) = (None, None, None);
    }
    scene.arms[1].points.clear();
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
