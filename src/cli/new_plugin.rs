//! `pathspace new-plugin`: a crate with an integrator of one's own, ready to compile.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use pathspace_integrators::Registry;

use super::Done;
use super::args::NewPluginArgs;

/// Files of the crate with `{{name}}`, `{{crate}}` and `{{dependency}}` to be filled in.
const FILES: [(&str, &str); 4] = [
    ("Cargo.toml", include_str!("skeleton/Cargo.toml.in")),
    ("README.md", include_str!("skeleton/README.md.in")),
    ("src/lib.rs", include_str!("skeleton/lib.rs.in")),
    ("src/main.rs", include_str!("skeleton/main.rs.in")),
];

/// Names that cargo or the crate's own imports would mistake for something else.
const TAKEN: [&str; 13] = [
    "pathspace",
    "core",
    "std",
    "alloc",
    "test",
    "proc_macro",
    "glam",
    "rayon",
    "build",
    "deps",
    "examples",
    "incremental",
    "main",
];

/// Words that Rust keeps for itself, as far as a lower-case name can meet them.
const KEYWORDS: [&str; 51] = [
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate",
    "do", "dyn", "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl",
    "in", "let", "loop", "macro", "match", "mod", "move", "mut", "override", "priv", "pub", "ref",
    "return", "self", "static", "struct", "super", "trait", "true", "try", "type", "typeof",
    "unsafe", "unsized", "use", "virtual", "where", "while", "yield",
];

/// Writes the crate and says what to do with it.
pub(super) fn new_plugin(
    registry: &Registry,
    args: &NewPluginArgs,
    out: &mut dyn Write,
) -> Result<Done> {
    let name = &args.name;
    check_name(name)?;
    if registry.all().any(|(known, _)| known == name) {
        bail!("'{name}' is an integrator already");
    }
    check_directory(&args.dir)?;
    let dependency = dependency(args.pathspace.as_deref())?;
    for (file, text) in FILES {
        let path = args.dir.join(file);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)
                .with_context(|| format!("{}: cannot make directory", parent.display()))?;
        }
        let text = text
            .replace("{{name}}", name)
            .replace("{{crate}}", &name.replace('-', "_"))
            .replace("{{dependency}}", &dependency);
        fs::write(&path, text).with_context(|| format!("{}: cannot write", path.display()))?;
        writeln!(out, "{}", path.display())?;
    }
    writeln!(
        out,
        "\nIt holds a path tracer to be changed. Next:\n  cd {}\n  cargo run --profile fast -- compare cornell-box -i {name} -i pt --seconds 0.5",
        args.dir.display()
    )?;
    Ok(Done::Well)
}

/// A name that is a package, a crate and a spec.
fn check_name(name: &str) -> Result<()> {
    let letters = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c);
    if !name.starts_with(|c: char| c.is_ascii_lowercase()) || !name.chars().all(letters) {
        bail!("'{name}' is no name for a plug-in: a-z first, then a-z, 0-9, '-' and '_'");
    }
    let as_crate = name.replace('-', "_");
    if TAKEN.contains(&as_crate.as_str()) || KEYWORDS.contains(&as_crate.as_str()) {
        bail!("'{name}' is no name for a plug-in: it means something else to Rust");
    }
    Ok(())
}

/// Nothing of anybody's is overwritten.
fn check_directory(dir: &Path) -> Result<()> {
    if !dir.exists() {
        return Ok(());
    }
    let mut entries =
        fs::read_dir(dir).with_context(|| format!("{}: not a directory", dir.display()))?;
    if entries.next().is_some() {
        bail!("{}: is not empty", dir.display());
    }
    Ok(())
}

/// What stands behind `pathspace =`: the source tree that was asked for or that this program was
/// built from, else the version.
fn dependency(asked: Option<&Path>) -> Result<String> {
    if let Some(path) = asked {
        let Some(tree) = source_tree(path) else {
            bail!("{}: is not the source tree of pathspace", path.display());
        };
        return by_path(&tree);
    }
    match source_tree(Path::new(env!("CARGO_MANIFEST_DIR"))) {
        Some(tree) => by_path(&tree),
        None => Ok(format!("\"{}\"", env!("CARGO_PKG_VERSION"))),
    }
}

/// The absolute path of the tree at `path`, if it is one; a package unpacked from a registry has no
/// room `core`.
fn source_tree(path: &Path) -> Option<PathBuf> {
    let manifest = fs::read_to_string(path.join("Cargo.toml")).ok()?;
    let is_it = manifest.lines().any(|line| line.trim() == "name = \"pathspace\"");
    (is_it && path.join("core/Cargo.toml").is_file()).then(|| path.canonicalize().ok())?
}

fn by_path(tree: &Path) -> Result<String> {
    let Some(text) = tree.to_str() else {
        bail!("{}: a manifest can not name a path that is not Unicode", tree.display());
    };
    // A basic string of TOML.
    let mut quoted = String::new();
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => quoted += &format!("\\u{:04x}", c as u32),
            c => quoted.push(c),
        }
    }
    Ok(format!("{{ path = \"{quoted}\" }}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_crates_and_specs_at_once() {
        for name in ["mine", "my-method", "a1", "no_t1"] {
            assert!(check_name(name).is_ok(), "{name}");
        }
        for name in
            ["", "1a", "-a", "Mine", "a b", "a:b", "a/b", "..", "ä", "fn", "core", "pathspace"]
        {
            assert!(check_name(name).is_err(), "{name}");
        }
    }

    #[test]
    fn paths_are_quoted_for_the_manifest() {
        let dependency = by_path(Path::new(r#"/a "b"\c"#)).unwrap();
        assert_eq!(dependency, r#"{ path = "/a \"b\"\\c" }"#);
    }
}
