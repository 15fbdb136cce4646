//! `pathspace completions` and `pathspace man`.

use std::fs;
use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result};
use clap::CommandFactory;

use super::Done;
use super::args::Cli;

/// Prints completions for a shell.
pub(super) fn completions(shell: clap_complete::Shell, out: &mut dyn Write) -> Result<Done> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "pathspace", &mut script);
    out.write_all(&script)?;
    Ok(Done::Well)
}

/// Writes the manual page of the program and of every command.
pub(super) fn manual(dir: &Path, out: &mut dyn Write) -> Result<Done> {
    fs::create_dir_all(dir).with_context(|| format!("{}: cannot make directory", dir.display()))?;
    clap_mangen::generate_to(Cli::command(), dir)
        .with_context(|| format!("{}: cannot write", dir.display()))?;
    writeln!(out, "manual pages in {}: man {0}/pathspace.1", dir.display())?;
    Ok(Done::Well)
}
