//! `pathspace scenes`.

use std::io::Write;

use anyhow::{Result, bail};
use pathspace_scenes::library;

use super::Done;
use super::args::{ScenesArgs, ScenesCommand};
use super::words::did_you_mean;

/// Lists the library or exports one scene.
pub(super) fn scenes(args: &ScenesArgs, out: &mut dyn Write) -> Result<Done> {
    match &args.command {
        None => {
            let width = library::all().iter().map(|s| s.name.len()).max().unwrap_or(0);
            for scene in library::all() {
                writeln!(out, "{:width$}  {}", scene.name, scene.summary)?;
            }
        }
        Some(ScenesCommand::Export { name, dir }) => {
            let Some(scene) = library::find(name) else {
                let known = || library::all().iter().map(|s| s.name);
                bail!(
                    "no scene '{name}' in the library (known: {}){}",
                    known().collect::<Vec<_>>().join(", "),
                    did_you_mean(name, known())
                );
            };
            for path in scene.export(dir)? {
                writeln!(out, "{}", path.display())?;
            }
        }
    }
    Ok(Done::Well)
}
