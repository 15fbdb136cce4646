//! Files that appear whole or not at all: written beside their place, flushed to the disk, renamed.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Name beside `path` that is not visible in listings.
fn temporary(path: &Path) -> std::path::PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.part", std::process::id()))
}

/// Makes and removes a file beside `path`, in whose place no directory may stand.
pub(crate) fn probe(path: &Path) -> io::Result<()> {
    if path.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a directory"));
    }
    let temporary = temporary(path);
    File::create(&temporary)?;
    fs::remove_file(&temporary)
}

/// Writes what `content` writes, and leaves no temporary file behind when that fails. After it returns, the file is on the disk
/// under its name, whatever happens to the machine; before, whatever was there.
pub(crate) fn write_whole(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let temporary = temporary(path);
    let written = File::create(&temporary)
        .and_then(|file| {
            let mut file = BufWriter::new(file);
            content(&mut file)?;
            // A full disk may show only here.
            file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
        })
        .and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        // The first failure is the one to report; a file that was never made need not be removed.
        let _ = fs::remove_file(&temporary);
        return written;
    }
    sync_folder(path)
}

/// Brings the new name to the disk.
#[cfg(unix)]
fn sync_folder(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        // A folder that may be written but not read, or a file system that can not flush one: the file itself is on the disk.
        Err(e)
            if matches!(
                e.kind(),
                io::ErrorKind::PermissionDenied | io::ErrorKind::InvalidInput
            ) =>
        {
            Ok(())
        }
        done => done,
    }
}

#[cfg(not(unix))]
fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}

/// Removes what a killed process has left of its writing to `path`.
pub(crate) fn sweep(path: &Path) {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let is_fragment = |file: &str| {
        let number = file
            .strip_prefix('.')
            .and_then(|f| f.strip_prefix(name.as_str()))
            .and_then(|f| f.strip_prefix('.'))
            .and_then(|f| f.strip_suffix(".part"));
        number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
    };
    // Fragments do no harm but for the room they take: what can not be listed or removed stays.
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_str().is_some_and(is_fragment) {
            let _ = fs::remove_file(entry.path());
        }
    }
}
