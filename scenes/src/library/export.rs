//! Writing a library scene to a directory.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::LibraryScene;

/// Why a scene could not be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LibraryError {
    /// The directory does not exist and cannot be made.
    #[error("cannot create directory {}: {source}", path.display())]
    CreateDirectory {
        /// The directory.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// A file cannot be written: no space, no permission, …
    #[error("cannot write {}: {source}", path.display())]
    WriteFile {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
}

impl LibraryScene {
    /// Writes all files of the scene below `dir`, which is created if need be, and returns their
    /// paths, `scene.xml` first.
    ///
    /// Each file appears whole or not at all: it is written under a temporary name beside its
    /// place and then renamed. The XML is written last, so that it never refers to a mesh that
    /// is not there. Files of the same name are replaced.
    ///
    /// # Errors
    /// The first directory that cannot be created or file that cannot be written.
    pub fn export(&self, dir: &Path) -> Result<Vec<PathBuf>, LibraryError> {
        let files = self.files();
        let paths: Vec<PathBuf> = files.iter().map(|file| dir.join(&file.path)).collect();
        for (file, path) in files.iter().zip(&paths).rev() {
            if let Some(parent) = path.parent() {
                fs::create_dir_all(parent).map_err(|source| LibraryError::CreateDirectory {
                    path: parent.to_path_buf(),
                    source,
                })?;
            }
            write_whole(path, &file.bytes)
                .map_err(|source| LibraryError::WriteFile { path: path.clone(), source })?;
        }
        Ok(paths)
    }
}

/// Writes beside `path` and renames, and leaves no temporary file behind when that fails.
fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".part{}", std::process::id()));
    let temporary = path.with_file_name(name);
    let written = File::create(&temporary)
        .and_then(|mut file| {
            file.write_all(bytes)?;
            // A full disk may show only here.
            file.sync_all()
        })
        .and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        // The first failure is the one to report; a file that was never made need not be removed.
        let _ = fs::remove_file(&temporary);
    }
    written
}
