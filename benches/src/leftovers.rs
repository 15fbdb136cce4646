//! What has to go when the program ends at once: temporary files and folders, and processes of
//! other renderers.
//!
//! Each is removed by its owner in the ordinary way. A second Ctrl-C ends the program without that;
//! [`clear_leftovers`] is what it does before.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// What is there.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Item {
    File(PathBuf),
    Folder(PathBuf),
    /// Leader of a process group.
    #[cfg(unix)]
    Group(i32),
}

static ITEMS: Mutex<Vec<Item>> = Mutex::new(Vec::new());

fn items() -> std::sync::MutexGuard<'static, Vec<Item>> {
    ITEMS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Remembers something until it is dropped.
#[derive(Debug)]
pub(crate) struct Leftover(Item);

impl Leftover {
    pub(crate) fn file(path: &Path) -> Self {
        Leftover::of(Item::File(path.to_path_buf()))
    }

    pub(crate) fn folder(path: &Path) -> Self {
        Leftover::of(Item::Folder(path.to_path_buf()))
    }

    #[cfg(unix)]
    pub(crate) fn group(leader: i32) -> Self {
        Leftover::of(Item::Group(leader))
    }

    fn of(item: Item) -> Self {
        items().push(item.clone());
        Leftover(item)
    }
}

impl Drop for Leftover {
    fn drop(&mut self) {
        let mut items = items();
        if let Some(i) = items.iter().position(|item| *item == self.0) {
            items.swap_remove(i);
        }
    }
}

/// A folder for temporary files that goes away with this, and with the program.
///
/// # Errors
/// With the system's reason.
pub fn temporary_folder(prefix: &str) -> std::io::Result<TemporaryFolder> {
    let folder = tempfile::Builder::new().prefix(prefix).tempdir()?;
    Ok(TemporaryFolder { _leftover: Leftover::folder(folder.path()), folder })
}

/// See [`temporary_folder`].
#[derive(Debug)]
pub struct TemporaryFolder {
    folder: tempfile::TempDir,
    _leftover: Leftover,
}

impl TemporaryFolder {
    /// Where it is.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Ends processes of other renderers and removes temporary files and folders, for a program that
/// ends at once afterwards.
pub fn clear_leftovers() {
    let items: Vec<Item> = std::mem::take(&mut *items());
    // Processes first: they write into the folders.
    #[cfg(unix)]
    for item in &items {
        if let Item::Group(leader) = item {
            kill_group(*leader);
        }
    }
    // What can not be removed stays; there is nobody left to tell.
    for item in items {
        match item {
            Item::File(path) => drop(fs::remove_file(path)),
            Item::Folder(path) => drop(fs::remove_dir_all(path)),
            #[cfg(unix)]
            Item::Group(_) => {}
        }
    }
}

/// Kills a process and all that it has started, as far as they are in its group.
#[cfg(unix)]
pub(crate) fn kill_group(leader: i32) {
    // SAFETY: a plain system call; where the group has just ended there is nobody to end.
    unsafe { libc::kill(-leader, libc::SIGKILL) };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_dropped_is_forgotten() {
        let folder = temporary_folder("pathspace-test-").unwrap();
        let path = folder.path().to_path_buf();
        assert!(items().contains(&Item::Folder(path.clone())) && path.is_dir());
        drop(folder);
        assert!(!items().contains(&Item::Folder(path.clone())) && !path.exists());
    }
}
