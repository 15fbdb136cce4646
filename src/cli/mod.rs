//! The command: `pathspace render`, `compare`, `validate` and the others.
//!
//! Exit status: 0 done, 1 integrators differ or one is wrong, 2 bad use or bad input (with one line
//! on stderr), 130 interrupted by Ctrl-C, 143 by SIGTERM (128 and the number of the signal).

mod agree;
mod args;
mod checkpoint;
mod compare;
mod docs;
mod image;
mod inspect;
mod interrupt;
mod merge;
mod mutants;
mod neumann;
mod new_plugin;
mod plain;
mod progress;
mod reference;
mod render;
mod replay;
mod report;
mod scene;
mod scenes;
mod table;
mod validate;
mod words;

use std::ffi::OsString;
use std::io::{self, Write};
use std::process::ExitCode;
use std::sync::OnceLock;

use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, Parser};
use pathspace_integrators::{Registry, SpecError};

use args::{Cli, Command, CompareArgs};
use plain::{Plain, plain};

/// How a command ended.
enum Done {
    Well,
    /// A pair of integrators differs, or one is wrong.
    Differ,
    /// A signal ended it early; what was done until then is kept.
    Interrupted,
}

/// Runs the command line of this process with the integrators of `registry`.
pub fn run(registry: Registry) -> ExitCode {
    run_from(registry, std::env::args_os())
}

/// [`run`] with arguments; the first one is the name of the program.
pub fn run_from(registry: Registry, args: impl IntoIterator<Item = OsString>) -> ExitCode {
    ExitCode::from(status_from(registry, args))
}

/// [`run_from`] with the exit status as a number, for programs that the command is a part of.
pub fn status_from(registry: Registry, args: impl IntoIterator<Item = OsString>) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    if let Some(name) = args.first().filter(|name| !name.is_empty()) {
        // The first call in a process names the program.
        let _ = PROGRAM.set(name.to_string_lossy().into_owned());
    }
    let cli = match Cli::try_parse_from(&args) {
        Ok(cli) => cli,
        Err(error) => return usage(&error, &args),
    };
    let verbose = cli.verbose;
    let mut out = Plain(io::stdout().lock());
    let done = match cli.command {
        Some(Command::Render(args)) => render::render(&registry, &args, verbose, &mut out),
        Some(Command::Merge(args)) => merge::merge(&args, &mut out),
        Some(Command::Compare(args)) => compare::compare(&registry, &args, verbose, &mut out),
        Some(Command::Agree(args)) => agree::agree(&args, &mut out),
        Some(Command::Reference(args)) => reference::reference(&registry, &args, verbose, &mut out),
        Some(Command::Validate(args)) => validate::validate(&registry, &args, &mut out),
        Some(Command::Report(args)) => report::report(&args, verbose, &mut out),
        Some(Command::Inspect(args)) => inspect::inspect(&registry, &args, verbose, &mut out),
        Some(Command::Neumann(args)) => neumann::neumann(&registry, &args, verbose, &mut out),
        Some(Command::Replay(args)) => replay::replay(&registry, &args, verbose, &mut out),
        Some(Command::Completions { shell }) => docs::completions(shell, &mut out),
        Some(Command::Man { dir }) => docs::manual(&dir, &mut out),
        Some(Command::Scenes(args)) => scenes::scenes(&args, &mut out),
        Some(Command::NewPlugin(args)) => new_plugin::new_plugin(&registry, &args, &mut out),
        None => {
            let args = CompareArgs::demonstration(registry.list().count());
            compare::compare(&registry, &args, verbose, &mut out)
        }
    };
    match done.and_then(|done| Ok(out.flush().map(|()| done)?)) {
        Ok(Done::Well) => 0,
        Ok(Done::Differ) => 1,
        Ok(Done::Interrupted) => interrupt::status(),
        // Whoever read our output has heard enough: `pathspace scenes | head -1`.
        Err(error) if is_broken_pipe(&error) => 0,
        Err(error) if error.is::<interrupt::Interrupted>() => {
            say(&one_line(&error.to_string()));
            interrupt::status()
        }
        Err(error) => {
            say(&format!("error: {}{}", one_line(&with_causes(&error)), meant(&error)));
            2
        }
    }
}

/// The program as it was called, for commands that are to be typed again.
fn program() -> String {
    words::quoted(PROGRAM.get().map_or("pathspace", String::as_str))
}

static PROGRAM: OnceLock<String> = OnceLock::new();

/// Help and version as they are; a mistake as one line, with the help of the command that it was
/// made in.
fn usage(error: &clap::Error, args: &[OsString]) -> u8 {
    if !error.use_stderr() {
        let _ = error.print();
        return 0;
    }
    let text = error.to_string();
    // What follows the first empty line is usage and tips.
    let first = text.split("\n\n").next().unwrap_or(&text);
    let first = if first.starts_with("error: ") { first } else { "error: a command is missing" };
    let named = args.iter().skip(1).filter_map(|a| a.to_str());
    let cli = Cli::command();
    let sub = named.into_iter().find_map(|a| cli.find_subcommand(a));
    let help = sub.map_or(String::new(), |c| format!(" {}", c.get_name()));
    say(&format!("{}{} (see '{}{help} --help')", one_line(first), suggestion(error), program()));
    2
}

/// What clap thinks was meant.
fn suggestion(error: &clap::Error) -> String {
    let kinds =
        [ContextKind::SuggestedArg, ContextKind::SuggestedSubcommand, ContextKind::SuggestedValue];
    let found = kinds.iter().find_map(|kind| match error.get(*kind)? {
        ContextValue::String(one) => Some(one.clone()),
        ContextValue::Strings(many) => many.last().cloned(),
        _ => None,
    });
    found.map_or(String::new(), |name| format!("; did you mean '{name}'?"))
}

/// The integrator or option that was meant.
fn meant(error: &anyhow::Error) -> String {
    let names = |known: &str, name: &str| words::did_you_mean(name, known.split(", "));
    match error.chain().find_map(|e| e.downcast_ref::<SpecError>()) {
        Some(SpecError::UnknownIntegrator { name, known }) => names(known, name),
        Some(SpecError::UnknownOption { option, known, .. }) => names(known, option),
        _ => String::new(),
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .filter_map(|e| e.downcast_ref::<io::Error>())
        .any(|e| e.kind() == io::ErrorKind::BrokenPipe)
}

/// An error with its causes, each said once: many messages hold their cause already.
fn with_causes(error: &anyhow::Error) -> String {
    let mut text = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// One line on stderr; a closed stderr is no reason to stop.
fn say(line: &str) {
    let _ = writeln!(io::stderr(), "{}", plain(line));
}
