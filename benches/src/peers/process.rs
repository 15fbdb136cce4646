//! The adapter's process: a line to its stdin, a line from its stdout.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde::Serialize;
use serde::de::DeserializeOwned;

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
    output: BufReader<ChildStdout>,
}

/// An adapter; it is started by the first request, and again where it has ended.
pub(super) struct Process {
    command: Vec<OsString>,
    /// What it says on stderr.
    errors: PathBuf,
    running: Option<Running>,
}

impl Process {
    pub(super) fn new(command: Vec<OsString>, errors: PathBuf) -> Self {
        Process { command, errors, running: None }
    }

    /// Sends a request and reads the answer.
    pub(super) fn ask<A: DeserializeOwned>(
        &mut self,
        request: &impl Serialize,
    ) -> Result<A, Failure> {
        let line = serde_json::to_string(request).map_err(|e| Failure::Other(e.to_string()))?;
        if self.running.as_mut().is_some_and(|r| !matches!(r.child.try_wait(), Ok(None))) {
            self.running = None;
        }
        let fresh = self.running.is_none();
        let mut answer = self.exchange(&line)?;
        // One that has ended after its last answer may not have been seen to end yet.
        if answer.is_none() && !fresh {
            self.stop();
            answer = self.exchange(&line)?;
        }
        let Some(text) = answer else {
            self.stop();
            return Err(Failure::Other(format!(
                "the adapter ended without an answer{}",
                self.last_words()
            )));
        };
        serde_json::from_str(&text).map_err(|e| {
            Failure::Other(format!("the answer is not one of the protocol ({e}): {text}"))
        })
    }

    /// The first line of the answer that is an object; `None` where the process ended before.
    fn exchange(&mut self, line: &str) -> Result<Option<String>, Failure> {
        let running = match &mut self.running {
            Some(running) => running,
            None => self.running.insert(start(&self.command, &self.errors)?),
        };
        if writeln!(running.input, "{line}").and_then(|()| running.input.flush()).is_err() {
            return Ok(None);
        }
        loop {
            let mut text = String::new();
            match running.output.read_line(&mut text) {
                Ok(0) => return Ok(None),
                // Libraries print what they like.
                Ok(_) if !text.trim_start().starts_with('{') => {}
                Ok(_) => return Ok(Some(text)),
                Err(e) => return Err(Failure::Other(e.to_string())),
            }
        }
    }

    /// The last line of stderr, after a colon.
    fn last_words(&self) -> String {
        let text = std::fs::read_to_string(&self.errors).unwrap_or_default();
        text.lines()
            .rev()
            .find(|l| !l.trim().is_empty())
            .map_or(String::new(), |l| format!(": {}", l.trim()))
    }

    fn stop(&mut self) {
        if let Some(Running { mut child, input, .. }) = self.running.take() {
            // The end of its input tells it to end; one that does not listen is killed.
            drop(input);
            for _ in 0..50 {
                if !matches!(child.try_wait(), Ok(None)) {
                    return;
                }
                std::thread::sleep(std::time::Duration::from_millis(20));
            }
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.stop();
    }
}

fn start(command: &[OsString], errors: &Path) -> Result<Running, Failure> {
    let other = |e: io::Error| Failure::Other(e.to_string());
    let Some((program, arguments)) = command.split_first() else {
        return Err(Failure::Other("no command".into()));
    };
    let errors = File::options().create(true).append(true).open(errors).map_err(other)?;
    let child = Command::new(program)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(errors)
        .spawn();
    let mut child = child.map_err(|e| match e.kind() {
        io::ErrorKind::NotFound => Failure::NotFound(format!("no program {}", program.display())),
        _ => Failure::Other(format!("{}: {e}", program.display())),
    })?;
    match (child.stdin.take(), child.stdout.take()) {
        (Some(input), Some(output)) => Ok(Running { child, input, output: BufReader::new(output) }),
        _ => Err(Failure::Other("the adapter has no stdin or stdout".into())),
    }
}
