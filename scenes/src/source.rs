//! Where files come from: the disk, or memory for scenes that are part of the program.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io;
use std::path::{Component, Path, PathBuf};

/// A set of files that can be read by path.
pub trait FileSource {
    /// Whole contents of a file.
    ///
    /// # Errors
    /// What the system says, [`io::ErrorKind::NotFound`] for files that do not exist.
    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;

    /// True where `path` names a file that can be tried.
    fn is_file(&self, path: &Path) -> bool;

    /// True where `path` names a directory.
    fn is_dir(&self, path: &Path) -> bool;
}

/// Files on disk.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk;

impl FileSource for Disk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        std::fs::read(path)
    }

    fn is_file(&self, path: &Path) -> bool {
        path.is_file()
    }

    fn is_dir(&self, path: &Path) -> bool {
        path.is_dir()
    }
}

/// Files in memory; paths are compared after resolving `.` and `..`.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    files: BTreeMap<PathBuf, Cow<'static, [u8]>>,
}

impl Memory {
    /// An empty set.
    pub fn new() -> Self {
        Memory::default()
    }

    /// Adds a file, or replaces the one of the same path.
    pub fn insert(&mut self, path: impl AsRef<Path>, bytes: impl Into<Cow<'static, [u8]>>) {
        self.files.insert(normalise(path.as_ref()), bytes.into());
    }

    /// The same as [`Memory::insert`], for chains.
    pub fn with(mut self, path: impl AsRef<Path>, bytes: impl Into<Cow<'static, [u8]>>) -> Self {
        self.insert(path, bytes);
        self
    }
}

impl FileSource for Memory {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        match self.files.get(&normalise(path)) {
            Some(bytes) => Ok(bytes.to_vec()),
            None => Err(io::Error::new(io::ErrorKind::NotFound, "no such file in memory")),
        }
    }

    fn is_file(&self, path: &Path) -> bool {
        self.files.contains_key(&normalise(path))
    }

    fn is_dir(&self, path: &Path) -> bool {
        let dir = normalise(path);
        self.files.keys().any(|file| *file != dir && file.starts_with(&dir))
    }
}

/// Resolves `.` and `..` in the text of a path.
fn normalise(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if out.file_name().is_some() => {
                out.pop();
            }
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_resolves_dots_in_paths() {
        let files = Memory::new().with("a/b.xml", b"x".as_slice());
        assert_eq!(files.read(Path::new("./a/../a/b.xml")).unwrap(), b"x");
        assert!(files.is_dir(Path::new("a")));
        assert!(!files.is_dir(Path::new("a/b.xml")));
        assert!(!files.is_file(Path::new("../a/b.xml")));
    }
}
