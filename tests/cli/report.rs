//! `pathspace report`.

use crate::support::*;

#[test]
fn a_folder_without_results_is_one_line_on_stderr() {
    let folder = Folder::new();
    let output = run_in(folder.path(), &["report", "."]);
    assert_eq!(output.status.code(), Some(2));
    let text = stderr(&output);
    assert!(text.starts_with("error: ./results.json: ") && text.lines().count() == 1, "{text}");
    assert!(folder.list().is_empty());
}

#[test]
fn a_page_is_written_from_the_results_alone() {
    let folder = Folder::new();
    let results = serde_json::json!({
        "schema": 1, "version": "0", "citation": "", "command": "", "experiment": "", "seed": 1, "complete": true,
        "machine": { "cpu": "", "threads": 1, "os": "" }, "overall": [], "notes": ["a note"],
        "scenes": [{ "name": "a", "hash": "", "width": 4, "height": 4, "reference": null, "methods": [], "pairs": [] }],
    });
    folder.write("results.json", results.to_string());
    let output = run_in(folder.path(), &["report", "."]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).ends_with("Open    ./report.html\n"), "{}", stdout(&output));
    let page = std::fs::read_to_string(folder.file("report.html")).unwrap();
    assert!(page.contains("a note") && page.trim_end().ends_with("</html>"));
    assert_eq!(folder.list(), ["report.html", "results.json"]);
}
