//! Plants all mutants in a copy of a source tree, so that one build serves every hunt.
//!
//! Each changed place of the copy asks a module of the copy alone which mutant is on. The
//! environment variable [`VARIABLE`] of a process says so, by the mutant's place in the catalogue.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::MutantError;
use super::catalogue::Mutant;

/// The variable that turns a mutant on in a build of the copy.
pub const VARIABLE: &str = "PATHSPACE_MUTANT";

/// The module that the copy has and the source tree has not.
const SWITCH: &str = r#"//! Which deliberate bug is on.
#![allow(missing_docs)]

use std::sync::LazyLock;

static ON: LazyLock<usize> = LazyLock::new(|| {
    std::env::var("PATHSPACE_MUTANT").ok().and_then(|v| v.parse().ok()).unwrap_or(usize::MAX)
});

#[inline]
pub fn is_on(index: usize) -> bool {
    *ON == index
}
"#;
/// The file of the module, and that which declares it.
const SWITCH_FILE: &str = "core/src/mutant.rs";
const ROOT_FILE: &str = "core/src/lib.rs";

/// Where a text is replaced, by what, and the name of the mutant.
type Planted<'a> = (Range<usize>, String, &'a str);

/// The files that the mutants change, with all of their changes in place.
///
/// # Errors
/// Where the text that a mutant changes is not in its file exactly once, or two mutants change the
/// same text.
pub fn planted(
    source: &Path,
    mutants: &[Mutant],
) -> Result<BTreeMap<PathBuf, String>, MutantError> {
    let mut files: BTreeMap<&str, Vec<Planted<'_>>> = BTreeMap::new();
    let mut texts: BTreeMap<&str, String> = BTreeMap::new();
    for (index, mutant) in mutants.iter().enumerate() {
        if mutant.edits.is_empty() {
            return Err(MutantError::Stale(format!("mutant {} changes nothing", mutant.name)));
        }
        for edit in &mutant.edits {
            let text = match texts.get(edit.file.as_str()) {
                Some(text) => text,
                None => {
                    let path = source.join(&edit.file);
                    let text = fs::read_to_string(&path)
                        .map_err(|e| MutantError::file(&path, format!("{}: {e}", mutant.name)))?;
                    texts.entry(&edit.file).or_insert(text)
                }
            };
            let mut places = text.match_indices(&edit.old);
            let (Some((start, _)), None) = (places.next(), places.next()) else {
                let count = text.matches(&edit.old).count();
                return Err(MutantError::Stale(format!(
                    "mutant {}: {} has {count} times, not once, the text it changes: {}",
                    mutant.name, edit.file, edit.old
                )));
            };
            let own = if edit.file.starts_with("core/") { "crate" } else { "pathspace_core" };
            let on = format!("{own}::mutant::is_on({index})");
            let new = if edit.new.contains("@on") {
                edit.new.replace("@on", &on)
            } else {
                format!("(if {on} {{ {} }} else {{ {} }})", edit.new, edit.old)
            };
            let changes = files.entry(&edit.file).or_default();
            changes.push((start..start + edit.old.len(), new, &mutant.name));
        }
    }
    let mut planted = BTreeMap::new();
    for (file, mut changes) in files {
        changes.sort_by_key(|(range, ..)| range.start);
        if let Some(two) = changes.windows(2).find(|two| two[0].0.end > two[1].0.start) {
            let (a, b) = (two[0].2, two[1].2);
            let text = format!("mutants {a} and {b} change the same text of {file}");
            return Err(MutantError::Stale(text));
        }
        let mut text = texts.remove(file).unwrap_or_default();
        for (range, new, _) in changes.into_iter().rev() {
            text.replace_range(range, &new);
        }
        planted.insert(PathBuf::from(file), text);
    }
    Ok(planted)
}

/// Makes `into` a copy of the source tree with all mutants in it. Files that are right already are
/// left as they are, so that a build in there compiles only what has changed since the last one.
///
/// # Errors
/// [`planted`], or where a file cannot be read or written.
pub fn plant(source: &Path, into: &Path, mutants: &[Mutant]) -> Result<(), MutantError> {
    let mut planted = planted(source, mutants)?;
    let root = planted.remove(Path::new(ROOT_FILE)).map_or_else(
        || {
            let path = source.join(ROOT_FILE);
            fs::read_to_string(&path).map_err(|e| MutantError::file(&path, e))
        },
        Ok,
    )?;
    planted.insert(ROOT_FILE.into(), format!("{root}\npub mod mutant;\n"));
    planted.insert(SWITCH_FILE.into(), SWITCH.into());
    let mut wanted: BTreeSet<PathBuf> = planted.keys().cloned().collect();
    for file in files(source)? {
        if !planted.contains_key(&file) {
            let path = source.join(&file);
            let bytes = fs::read(&path).map_err(|e| MutantError::file(&path, e))?;
            write(&into.join(&file), &bytes)?;
            wanted.insert(file);
        }
    }
    for (file, text) in &planted {
        write(&into.join(file), text.as_bytes())?;
    }
    for file in files(into)?.difference(&wanted) {
        let path = into.join(file);
        fs::remove_file(&path).map_err(|e| MutantError::file(&path, e))?;
    }
    Ok(())
}

/// Files of a source tree, from its root; without what is built and what is hidden.
fn files(root: &Path) -> Result<BTreeSet<PathBuf>, MutantError> {
    let mut found = BTreeSet::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(folder) = folders.pop() {
        let at = root.join(&folder);
        for entry in fs::read_dir(&at).map_err(|e| MutantError::file(&at, e))? {
            let entry = entry.map_err(|e| MutantError::file(&at, e))?;
            let name = entry.file_name();
            if name == "target" || name.to_string_lossy().starts_with('.') {
                continue;
            }
            let kind = entry.file_type().map_err(|e| MutantError::file(&at, e))?;
            if kind.is_dir() {
                folders.push(folder.join(name));
            } else if kind.is_file() {
                found.insert(folder.join(name));
            }
        }
    }
    Ok(found)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), MutantError> {
    if fs::read(path).is_ok_and(|old| old == bytes) {
        return Ok(());
    }
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(|e| MutantError::file(folder, e))?;
    }
    fs::write(path, bytes).map_err(|e| MutantError::file(path, e))
}

#[cfg(test)]
mod tests {
    use super::super::catalogue::{Edit, Test};
    use super::*;

    fn mutant(name: &str, old: &str, new: &str) -> Mutant {
        let (file, old, new) = ("core/src/a.rs".into(), old.into(), new.into());
        let scene = String::new();
        let test = Test::Oracle { scene, integrator: String::new(), samples: 1 };
        Mutant {
            name: name.into(),
            about: String::new(),
            edits: vec![Edit { file, old, new }],
            test,
        }
    }

    fn tree() -> tempfile::TempDir {
        let tree = tempfile::tempdir().unwrap();
        fs::create_dir_all(tree.path().join("core/src")).unwrap();
        fs::write(tree.path().join("core/src/a.rs"), "let x = 1 + 2;\nlet y = 2;\n").unwrap();
        fs::write(tree.path().join(ROOT_FILE), "mod a;\n").unwrap();
        tree
    }

    #[test]
    fn a_copy_has_all_mutants_each_with_its_own_condition() {
        let (tree, copy) = (tree(), tempfile::tempdir().unwrap());
        let mutants = [mutant("a", "1 + 2", "3"), mutant("b", "let y = 2;", "let y = f(@on);")];
        plant(tree.path(), copy.path(), &mutants).unwrap();
        let text = fs::read_to_string(copy.path().join("core/src/a.rs")).unwrap();
        assert!(text.starts_with("let x = (if crate::mutant::is_on(0) { 3 } else { 1 + 2 });"));
        assert!(text.ends_with("let y = f(crate::mutant::is_on(1));\n"), "{text}");
        assert!(copy.path().join(SWITCH_FILE).exists());
        assert!(SWITCH.contains(VARIABLE));
    }

    #[test]
    fn text_that_is_gone_or_there_twice_is_an_error_that_names_the_mutant() {
        let tree = tree();
        for old in ["1 - 2", "let"] {
            let error = planted(tree.path(), &[mutant("stale", old, "3")]).unwrap_err();
            assert!(error.to_string().contains("mutant stale: core/src/a.rs"), "{error}");
        }
        let both = [mutant("a", "1 + 2", "3"), mutant("b", "+ 2;", "3")];
        let error = planted(tree.path(), &both).unwrap_err();
        assert!(error.to_string().contains("mutants a and b change the same text"), "{error}");
    }

    #[test]
    fn what_the_source_tree_has_lost_goes_from_the_copy() {
        let (tree, copy) = (tree(), tempfile::tempdir().unwrap());
        fs::create_dir_all(copy.path().join("core")).unwrap();
        fs::write(copy.path().join("core/old.rs"), "").unwrap();
        plant(tree.path(), copy.path(), &[mutant("a", "1 + 2", "3")]).unwrap();
        assert!(!copy.path().join("core/old.rs").exists());
    }
}
