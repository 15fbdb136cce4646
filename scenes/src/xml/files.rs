//! Files that a scene refers to: search path, reading and hash.

use std::path::{Path, PathBuf};

use crate::error::{Place, Result, SceneFileError};
use crate::source::FileSource;

/// Reads files and remembers what was read: search path and hash.
pub(crate) struct Files<'a> {
    source: &'a dyn FileSource,
    /// Where relative names are looked up, the most recent first.
    folders: Vec<PathBuf>,
    hasher: blake3::Hasher,
}

impl<'a> Files<'a> {
    pub(crate) fn new(source: &'a dyn FileSource, folder: &Path) -> Self {
        let folders = vec![folder.to_path_buf()];
        Files { source, folders, hasher: blake3::Hasher::new() }
    }

    /// First folder of the search path that has the file; the first folder where none has it.
    pub(crate) fn resolve(&self, name: &str) -> PathBuf {
        let path = Path::new(name);
        let all = || self.folders.iter().map(|folder| folder.join(path));
        all().find(|p| self.source.is_file(p)).or_else(|| all().next()).unwrap_or(path.into())
    }

    /// Contents of a file that the element at `place` refers to.
    pub(crate) fn read(&self, path: &Path, place: &Place) -> Result<Vec<u8>> {
        self.source.read(path).map_err(|e| SceneFileError::Read {
            place: place.clone(),
            file: path.display().to_string(),
            reason: e.to_string(),
        })
    }

    /// Adds a folder of the search path in front; false where there is none of this name.
    pub(super) fn add_folder(&mut self, name: &str) -> bool {
        let found = self.folders.iter().map(|f| f.join(name)).find(|p| self.source.is_dir(p));
        self.folders.splice(0..0, found.clone());
        found.is_some()
    }

    /// Names in an included file are relative to it. Returns the search path for [`Files::leave`].
    pub(super) fn enter(&mut self, included: &Path) -> Vec<PathBuf> {
        let before = self.folders.clone();
        self.folders.insert(0, included.parent().unwrap_or(Path::new("")).to_path_buf());
        before
    }

    /// Restores the search path after an included file.
    pub(super) fn leave(&mut self, before: Vec<PathBuf>) {
        self.folders = before;
    }

    /// Adds to the hash of the scene's content, with the length, so that parts cannot shift.
    pub(crate) fn hash(&mut self, bytes: &[u8]) {
        self.hasher.update(&(bytes.len() as u64).to_le_bytes());
        self.hasher.update(bytes);
    }

    /// Hexadecimal hash of everything that was added.
    pub(crate) fn finish(&self) -> String {
        self.hasher.finalize().to_hex().to_string()
    }
}
