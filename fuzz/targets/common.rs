//! A file for readers that take a path.

use std::path::PathBuf;

/// Writes the bytes to a file of this process, in memory where the system has such a place.
pub fn file(name: &str, parts: &[&[u8]]) -> PathBuf {
    let memory = PathBuf::from("/dev/shm");
    let folder = if memory.is_dir() { memory } else { std::env::temp_dir() };
    let path = folder.join(format!("pathspace-fuzz-{}-{name}", std::process::id()));
    // Where it cannot be written, nothing is tested, which shows in the coverage.
    let _ = std::fs::write(&path, parts.concat());
    path
}
