//! Files that appear whole or not at all: written beside their place, flushed to the disk, renamed.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::leftovers::Leftover;

/// Name beside `path` that is not visible in listings.
fn temporary(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.part", std::process::id()))
}

/// Makes and removes a file beside `path`, in whose place nothing but a file may stand, and removes
/// what killed processes have left of their writing to it.
pub(crate) fn probe(path: &Path) -> io::Result<()> {
    if path.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a directory"));
    }
    // A device or a pipe would be replaced by a file.
    if path.exists() && !path.is_file() {
        return Err(io::Error::other("it is no regular file"));
    }
    let temporary = temporary(path);
    File::create(&temporary)?;
    fs::remove_file(&temporary)?;
    sweep(path);
    Ok(())
}

/// The bytes of a regular file. Devices and pipes may have no end, or wait for ever.
///
/// # Errors
/// With the system's reason, or where it is something else.
pub fn read_file(path: &Path) -> io::Result<Vec<u8>> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::other("it is no regular file"));
    }
    fs::read(path)
}

/// [`read_file`] as text.
///
/// # Errors
/// As there, and where it is not in UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    String::from_utf8(read_file(path)?)
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is no text in UTF-8"))
}

/// True where two paths lead to one file, or would once it is there.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    let place = |path: &Path| {
        path.canonicalize().ok().or_else(|| {
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
            Some(folder.unwrap_or(Path::new(".")).canonicalize().ok()?.join(path.file_name()?))
        })
    };
    a == b || place(a).is_some_and(|a| place(b) == Some(a))
}

/// Writes what `content` writes, and leaves no temporary file behind when that fails. After it
/// returns, the file is on the disk under its name, whatever happens to the machine; before,
/// whatever was there.
pub(crate) fn write_whole(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let temporary = temporary(path);
    let _leftover = Leftover::file(&temporary);
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
        // A folder that may be written but not read, or a file system that can not flush one: the
        // file itself is on the disk.
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

/// Removes what killed processes have left of their writing to `path`.
fn sweep(path: &Path) {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let is_fragment = |file: &str| {
        let number = file
            .strip_prefix('.')
            .and_then(|f| f.strip_prefix(name.as_str()))
            .and_then(|f| f.strip_prefix('.'))
            .and_then(|f| f.strip_suffix(".part"));
        number.is_some_and(|n| n.parse().is_ok_and(|id: u32| !is_running(id)))
    };
    // Fragments do no harm but for the room they take: what can not be listed or removed stays.
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_str().is_some_and(is_fragment) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// True where a process of this number runs on this machine; false where the system does not tell.
fn is_running(id: u32) -> bool {
    Path::new("/proc").join(id.to_string()).exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fragments_of_dead_processes_go_and_those_of_living_ones_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.film");
        // Process numbers end below 2²²; 1 is always there.
        let names =
            [".a.film.4194305.part", ".a.film.1.part", ".b.film.4194305.part", ".a.film.x.part"];
        for name in names {
            fs::write(folder.path().join(name), "").unwrap();
        }
        probe(&path).unwrap();
        let there = names.map(|name| folder.path().join(name).exists());
        assert_eq!(there, [false, cfg!(target_os = "linux"), true, true]);
    }

    #[test]
    fn one_file_has_many_names() {
        let folder = tempfile::tempdir().unwrap();
        let (a, b) = (folder.path().join("a"), folder.path().join("x/../a"));
        fs::create_dir(folder.path().join("x")).unwrap();
        assert!(is_same_file(&a, &b));
        fs::write(&a, "").unwrap();
        assert!(is_same_file(&a, &b) && !is_same_file(&a, &folder.path().join("b")));
        assert!(!is_same_file(Path::new("/nowhere/a"), Path::new("/nowhere/b")));
    }

    #[cfg(unix)]
    #[test]
    fn devices_are_neither_read_nor_replaced() {
        let device = Path::new("/dev/zero");
        assert!(probe(device).unwrap_err().to_string().contains("no regular file"));
        assert!(read_file(device).unwrap_err().to_string().contains("no regular file"));
    }
}
