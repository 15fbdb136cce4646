//! The adapter's process: a line to its stdin, a line from its stdout, and limits on all that it
//! may do in between.

use std::ffi::OsString;
use std::io::{self, Write};
use std::ops::ControlFlow;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::ears::{LastWords, Said, Stdout};
#[cfg(unix)]
use crate::leftovers::{Leftover, kill_group};

/// Longest request: less than a pipe holds, so that writing one never waits.
const REQUEST: usize = 60_000;
/// How often it is asked whether to stop.
const POLL: Duration = Duration::from_millis(50);
/// How long an adapter has to end after the end of its input.
const GRACE: Duration = Duration::from_secs(1);

/// Why there is no answer.
pub(super) enum Failure {
    /// The program is not there.
    NotFound(String),
    /// Anything else.
    Other(String),
}

struct Running {
    child: Child,
    input: ChildStdin,
    output: Stdout,
    words: LastWords,
    /// Ended with the program, whatever ends it.
    #[cfg(unix)]
    _leftover: Leftover,
}

/// An adapter; it is started by the first request, and again where it has ended.
pub(super) struct Process {
    command: Vec<OsString>,
    running: Option<Running>,
    last_words: String,
}

impl Process {
    pub(super) fn new(command: Vec<OsString>) -> Self {
        Process { command, running: None, last_words: String::new() }
    }

    /// Sends a request and waits for the answer, no longer than `limit` and until `watch` says to
    /// stop. An adapter that has not answered by then is ended with all that it has started.
    pub(super) fn ask<A: DeserializeOwned>(
        &mut self,
        request: &impl Serialize,
        limit: Duration,
        watch: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<A, Failure> {
        let line = serde_json::to_string(request).map_err(|e| Failure::Other(e.to_string()))?;
        if line.len() > REQUEST {
            return Err(Failure::Other(format!(
                "the request has {} bytes, and {REQUEST} are the limit",
                line.len()
            )));
        }
        if self.running.as_mut().is_some_and(|r| !matches!(r.child.try_wait(), Ok(None))) {
            self.stop();
        }
        let fresh = self.running.is_none();
        let mut answer = self.exchange(&line, limit, watch);
        // One that has ended after its last answer may not have been seen to end yet.
        if matches!(answer, Ok(None)) && !fresh {
            self.stop();
            answer = self.exchange(&line, limit, watch);
        }
        match answer {
            Ok(Some(text)) => serde_json::from_str(&text).map_err(|e| {
                Failure::Other(format!("the answer is not one of the protocol ({e}): {text}"))
            }),
            Ok(None) => {
                self.stop();
                let words = &self.last_words;
                Err(Failure::Other(format!("the adapter ended without an answer{words}")))
            }
            Err(failure) => {
                self.end();
                Err(failure)
            }
        }
    }

    /// The answer; `None` where the process ended before.
    fn exchange(
        &mut self,
        line: &str,
        limit: Duration,
        watch: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<Option<String>, Failure> {
        let running = match &mut self.running {
            Some(running) => running,
            None => self.running.insert(start(&self.command)?),
        };
        let begun = Instant::now();
        running.output.forget();
        if writeln!(running.input, "{line}").and_then(|()| running.input.flush()).is_err() {
            return Ok(None);
        }
        loop {
            match running.output.hear(POLL) {
                Ok(Said::Answer(text)) => return Ok(Some(text)),
                Ok(Said::TooMuch(what)) => return Err(Failure::Other(what.into())),
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
                Err(RecvTimeoutError::Timeout) if watch().is_break() => {
                    return Err(Failure::Other("it was stopped".into()));
                }
                Err(RecvTimeoutError::Timeout) if begun.elapsed() > limit => {
                    let seconds = limit.as_secs_f64();
                    return Err(Failure::Other(format!(
                        "no answer after {seconds} s; timeout=S waits longer"
                    )));
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// Lets it end, and ends it where it does not listen.
    fn stop(&mut self) {
        let Some(mut running) = self.running.take() else { return };
        // The end of its input tells it to end.
        drop(running.input);
        let begun = Instant::now();
        while matches!(running.child.try_wait(), Ok(None)) && begun.elapsed() < GRACE {
            std::thread::sleep(Duration::from_millis(10));
        }
        kill(&mut running.child);
        self.last_words = running.words.tell();
    }

    /// Ends it at once.
    fn end(&mut self) {
        if let Some(mut running) = self.running.take() {
            kill(&mut running.child);
            self.last_words = running.words.tell();
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.stop();
    }
}

/// Kills a child with all that it has started, also where it has ended itself.
fn kill(child: &mut Child) {
    #[cfg(unix)]
    if let Ok(leader) = i32::try_from(child.id()) {
        kill_group(leader);
    }
    let _ = child.kill();
    let _ = child.wait();
}

fn start(command: &[OsString]) -> Result<Running, Failure> {
    let Some((program, arguments)) = command.split_first() else {
        return Err(Failure::Other("no command".into()));
    };
    let mut command = Command::new(program);
    command.args(arguments);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    // A group of its own, to be ended as a whole; Ctrl-C at the terminal is ours to hand on.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let mut child = command.spawn().map_err(|e| match e.kind() {
        io::ErrorKind::NotFound => Failure::NotFound(format!("no program {}", program.display())),
        _ => Failure::Other(format!("{}: {e}", program.display())),
    })?;
    match (child.stdin.take(), child.stdout.take(), child.stderr.take()) {
        (Some(input), Some(output), Some(errors)) => Ok(Running {
            #[cfg(unix)]
            _leftover: Leftover::group(i32::try_from(child.id()).unwrap_or(i32::MAX)),
            child,
            input,
            output: Stdout::listen(output),
            words: LastWords::listen(errors),
        }),
        _ => {
            kill(&mut child);
            Err(Failure::Other("the adapter has no stdin, stdout or stderr".into()))
        }
    }
}
