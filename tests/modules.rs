//! No circular modules: within a crate, what a module uses does not use it.
//!
//! A plain reader of `crate::a` and `use crate::{a, b}` in the files of each crate, without
//! comments and tests. Modules are those directly in the crate: inside a folder, parent and
//! children may know each other.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

type Edges = BTreeMap<String, BTreeSet<String>>;

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if path.is_dir() && name != "tests" {
            files(&path, found);
        } else if name.ends_with(".rs") && name != "tests.rs" {
            found.push(path);
        }
    }
}

/// The text without comments, up to the tests at its end.
fn code(text: &str) -> String {
    let tests = text.find("#[cfg(test)]\nmod tests {").or_else(|| text.find("#[cfg(all(test"));
    let lines = text[..tests.unwrap_or(text.len())].lines();
    lines.map(|line| line.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n")
}

/// First names after `crate::`, those of a list in braces included.
fn used(code: &str) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    let word = |text: &str| {
        text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>()
    };
    for rest in code.split("crate::").skip(1) {
        let Some(list) = rest.strip_prefix('{') else {
            names.insert(word(rest));
            continue;
        };
        let (mut depth, mut begins) = (1, true);
        for (at, c) in list.char_indices() {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 1 => begins = true,
                c if begins && depth == 1 && !c.is_whitespace() => {
                    names.insert(word(&list[at..]));
                    begins = false;
                }
                _ => {}
            }
            if depth == 0 {
                break;
            }
        }
    }
    names
}

/// Which module uses which.
fn edges(source: &Path) -> Edges {
    let mut found = Vec::new();
    files(source, &mut found);
    let mut edges = Edges::new();
    for path in found {
        let inside = path.strip_prefix(source).unwrap();
        let first = inside.components().next().unwrap().as_os_str().to_str().unwrap();
        let module = first.trim_end_matches(".rs").to_owned();
        if !["lib", "main"].contains(&module.as_str()) {
            let text = fs::read_to_string(&path).unwrap();
            edges.entry(module).or_default().extend(used(&code(&text)));
        }
    }
    let modules: BTreeSet<String> = edges.keys().cloned().collect();
    for (module, uses) in &mut edges {
        uses.retain(|name| name != module && modules.contains(name));
    }
    edges
}

/// All that can be reached from a module.
fn reach(edges: &Edges, from: &str) -> BTreeSet<String> {
    let mut seen = BTreeSet::new();
    let mut open: Vec<&str> = vec![from];
    while let Some(module) = open.pop() {
        for next in &edges[module] {
            if seen.insert(next.clone()) {
                open.push(next);
            }
        }
    }
    seen
}

/// Sets of modules that reach each other.
fn circles(edges: &Edges) -> BTreeSet<BTreeSet<String>> {
    let of = |module: &String| {
        let back = |other: &String| reach(edges, other).contains(module);
        let circle: BTreeSet<String> = reach(edges, module).into_iter().filter(back).collect();
        (circle.len() > 1).then_some(circle)
    };
    edges.keys().filter_map(of).collect()
}

#[test]
fn no_circular_modules() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for name in ["core", "integrators", "scenes", "validation", "benches"] {
        let edges = edges(&root.join(name).join("src"));
        assert!(edges.len() > 5, "{name}");
        if let Some(circle) = circles(&edges).first() {
            let inner: Vec<String> = circle
                .iter()
                .map(|n| format!("{n} -> {:?}", edges[n].intersection(circle)))
                .collect();
            panic!("{name}: {}", inner.join("; "));
        }
    }
}

#[test]
fn uses_are_found_wherever_they_stand() {
    let text = "use crate::a::B;\nuse crate::{c, d::{e, f}, g as h};\nfn x() { crate::i::j() } // crate::k\n\
                #[cfg(test)]\nmod tests {\n use crate::l;\n}";
    let names: Vec<String> = used(&code(text)).into_iter().collect();
    assert_eq!(names, ["a", "c", "d", "g", "i"]);
    let edge = |from: &str, to: &[&str]| {
        (from.to_owned(), to.iter().map(|t| (*t).to_owned()).collect::<BTreeSet<_>>())
    };
    let ring =
        Edges::from([edge("a", &["b"]), edge("b", &["c"]), edge("c", &["a"]), edge("d", &["a"])]);
    let found: Vec<Vec<String>> =
        circles(&ring).into_iter().map(|c| c.into_iter().collect()).collect();
    assert_eq!(found, [["a", "b", "c"]]);
}
