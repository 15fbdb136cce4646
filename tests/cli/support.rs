//! Running the command, and looking at what it wrote.

use std::path::{Path, PathBuf};
#[cfg(unix)]
use std::process::Child;
use std::process::{Command, Output};
use std::sync::atomic::{AtomicU32, Ordering};
#[cfg(unix)]
use std::time::{Duration, Instant};

use exr::prelude::*;
use serde_json::Value;

/// A directory of its own that goes away with it.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!("pathspace-cli-{}-{number}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    pub fn file(&self, name: &str) -> String {
        self.0.join(name).to_str().unwrap().to_owned()
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        std::fs::write(self.0.join(name), content).unwrap();
        self.file(name)
    }

    /// Names of all files, sorted; hidden ones too.
    pub fn list(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).unwrap();
        let mut names: Vec<String> =
            entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// The command, in a directory where images may be left under names of their own.
pub fn command() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pathspace"));
    command.current_dir(env!("CARGO_TARGET_TMPDIR"));
    command
}

/// The arguments in a line, as a shell takes them where nothing is quoted.
pub fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

/// Runs a command that must fail with one line and exit status 2.
pub fn failure(args: &[&str]) -> String {
    let output = run(args);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
    assert_eq!(message.lines().count(), 1, "{args:?}: {message}");
    message
}

/// Sends a signal to a command that has not been waited for.
#[cfg(unix)]
pub fn signal(child: &Child, signal: libc::c_int) {
    // SAFETY: a plain system call; the child has not been waited for, so the id is its own.
    unsafe { libc::kill(child.id() as libc::pid_t, signal) };
}

/// Waits until `path` is another file than `before`.
#[cfg(unix)]
pub fn wait_for_change(path: &str, before: &Option<Vec<u8>>) {
    let begun = Instant::now();
    while std::fs::read(path).ok() == *before {
        assert!(begun.elapsed() < Duration::from_secs(60), "{path} is the same after a minute");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Runs the command in a directory.
pub fn run_in(folder: &Path, args: &[&str]) -> Output {
    command().args(args).current_dir(folder).output().unwrap()
}

pub fn run(args: &[&str]) -> Output {
    command().args(args).output().unwrap()
}

pub fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Runs a command that must end well, and reads the last line of stdout.
pub fn json(args: &[&str]) -> Value {
    let output = run(args);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", stderr(&output));
    last_line(&output)
}

pub fn last_line(output: &Output) -> Value {
    let text = stdout(output);
    serde_json::from_str(text.lines().last().unwrap()).unwrap()
}

/// Channels of an EXR file by name, and its one layer's attributes as text.
pub struct Exr {
    pub size: (usize, usize),
    pub channels: Vec<(String, Vec<f32>)>,
    pub attributes: Vec<(String, String)>,
    pub position: (i32, i32),
    pub display: (usize, usize),
}

impl Exr {
    pub fn read(path: &str) -> Exr {
        let image = read_all_flat_layers_from_file(path).unwrap();
        assert_eq!(image.layer_data.len(), 1);
        let layer = &image.layer_data[0];
        let channels = layer.channel_data.list.iter().map(|c| match &c.sample_data {
            FlatSamples::F32(v) => (c.name.to_string(), v.clone()),
            other => panic!("channel {} is not f32: {other:?}", c.name),
        });
        let attributes = layer.attributes.other.iter().map(|(key, value)| {
            let value = match value {
                AttributeValue::Text(t) => t.to_string(),
                AttributeValue::F64(v) => v.to_string(),
                other => format!("{other:?}"),
            };
            (key.to_string(), value)
        });
        let (position, display) =
            (layer.attributes.layer_position, image.attributes.display_window);
        Exr {
            size: (layer.size.0, layer.size.1),
            channels: channels.collect(),
            attributes: attributes.collect(),
            position: (position.0, position.1),
            display: (display.size.0, display.size.1),
        }
    }

    pub fn channel(&self, name: &str) -> &[f32] {
        let found = self.channels.iter().find(|(n, _)| n == name);
        &found.unwrap_or_else(|| panic!("no channel {name}")).1
    }

    pub fn attribute(&self, name: &str) -> &str {
        let found = self.attributes.iter().find(|(n, _)| n == name);
        &found.unwrap_or_else(|| panic!("no attribute {name}: {:?}", self.attributes)).1
    }
}

pub fn mean(values: &[f32]) -> f64 {
    values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64
}
