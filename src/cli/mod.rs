//! The command: `pathspace render`, `merge`, `compare`, `reference`, `report`, `validate`, `scenes` and `new-plugin`.
//!
//! Exit status: 0 done, 1 integrators differ or one is wrong, 2 bad use or bad input (with one line on stderr).

mod args;
mod checkpoint;
mod compare;
mod image;
mod interrupt;
mod merge;
mod mutants;
mod new_plugin;
mod progress;
mod reference;
mod render;
mod report;
mod scene;
mod scenes;
mod table;
mod validate;

use std::ffi::OsString;
use std::io::{self, Write};
use std::process::ExitCode;

use clap::Parser;
use pathspace_integrators::Registry;

use args::{Cli, Command, CompareArgs};

/// How a command ended.
enum Done {
    Well,
    /// A pair of integrators differs, or one is wrong.
    Differ,
}

/// Runs the command line of this process with the integrators of `registry`.
pub fn run(registry: Registry) -> ExitCode {
    run_from(registry, std::env::args_os())
}

/// [`run`] with arguments; the first one is the name of the program.
pub fn run_from(registry: Registry, args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    let mut out = io::stdout().lock();
    let done = match cli.command {
        Some(Command::Render(args)) => render::render(&registry, &args, &mut out),
        Some(Command::Merge(args)) => merge::merge(&args, &mut out),
        Some(Command::Compare(args)) => compare::compare(&registry, &args, &mut out),
        Some(Command::Reference(args)) => reference::reference(&registry, &args, &mut out),
        Some(Command::Validate(args)) => validate::validate(&registry, &args, &mut out),
        Some(Command::Report(args)) => report::report(&args, &mut out),
        Some(Command::Scenes(args)) => scenes::scenes(&args, &mut out),
        Some(Command::NewPlugin(args)) => new_plugin::new_plugin(&registry, &args, &mut out),
        None => {
            let args = CompareArgs::demonstration(registry.list().count());
            compare::compare(&registry, &args, &mut out)
        }
    };
    match done.and_then(|done| Ok(out.flush().map(|()| done)?)) {
        Ok(Done::Well) => ExitCode::SUCCESS,
        Ok(Done::Differ) => ExitCode::from(1),
        // Whoever read our output has heard enough: `pathspace scenes | head -1`.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            say(&format!("error: {}", one_line(&format!("{error:#}"))));
            ExitCode::from(2)
        }
    }
}

/// Help and version as they are; a mistake as one line.
fn usage(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    let text = error.to_string();
    // What follows the first empty line is usage and tips.
    let first = text.split("\n\n").next().unwrap_or(&text);
    let first = if first.starts_with("error: ") { first } else { "error: a command is missing" };
    say(&format!("{} (see 'pathspace --help')", one_line(first)));
    ExitCode::from(2)
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .filter_map(|e| e.downcast_ref::<io::Error>())
        .any(|e| e.kind() == io::ErrorKind::BrokenPipe)
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// One line on stderr; a closed stderr is no reason to stop.
fn say(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}
