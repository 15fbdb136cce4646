//! Finished cells on the disk, so that an experiment goes on where it was stopped.
//!
//! A cell's file is named by a hash of all that its content depends on, the program included; what
//! belongs to another experiment is never mixed in. Files appear whole or not at all and end in a
//! hash of their content.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;
use thiserror::Error;

use super::cell::Cell;
use crate::leftovers::{TemporaryFolder, temporary_folder};
use crate::output::write_bytes;
use crate::program::program;

/// Why cells cannot be kept.
#[derive(Debug, Error)]
#[error("{}: cannot keep results: {reason}", path.display())]
pub struct StoreError {
    path: PathBuf,
    reason: String,
}

/// All that a cell's content depends on.
#[derive(Clone, Debug, Serialize)]
pub struct Key<'a> {
    /// Hash of the scene's content, with what the command line changed of it.
    pub scene: &'a str,
    /// Name of the integrator, unique among those of the scene.
    pub integrator: &'a str,
    /// The budget in words.
    pub budget: &'a str,
    /// Number of the replicate.
    pub replicate: u32,
    /// Seed of the experiment.
    pub seed: u64,
    /// Worker threads: they change seconds, not images.
    pub threads: usize,
}

impl Key<'_> {
    /// Seed of the cell: from all of the key but the threads, so that it does not depend on what
    /// else is compared.
    pub fn seed(&self) -> u64 {
        let key = (self.scene, self.integrator, self.budget, self.replicate, self.seed);
        let hash = blake3::hash(format!("{key:?}").as_bytes());
        let (first, _) = hash.as_bytes().as_chunks::<8>();
        u64::from_le_bytes(first[0])
    }
}

/// A folder of cells.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    /// Keeps a folder of its own until it is dropped.
    temporary: Option<TemporaryFolder>,
}

impl Store {
    /// Cells in `folder`, which is made where it does not exist.
    ///
    /// # Errors
    /// Where it cannot be made.
    pub fn open(folder: &Path) -> Result<Self, StoreError> {
        fs::create_dir_all(folder).map_err(|e| failed(folder, &e))?;
        Ok(Store { folder: folder.to_path_buf(), temporary: None })
    }

    /// Cells in a folder that goes away with the store.
    ///
    /// # Errors
    /// Where there is no place for temporary files.
    pub fn temporary() -> Result<Self, StoreError> {
        let own = temporary_folder("pathspace-").map_err(|e| failed(&std::env::temp_dir(), &e))?;
        Ok(Store { folder: own.path().to_path_buf(), temporary: Some(own) })
    }

    /// The cell, where it is there whole.
    pub fn get(&self, key: &Key<'_>) -> Option<Cell> {
        let bytes = fs::read(self.path(key)).ok()?;
        let (content, hash) = bytes.split_last_chunk::<32>()?;
        (blake3::hash(content) == *hash).then(|| postcard::from_bytes(content).ok())?
    }

    /// True where there is a file of the cell.
    pub fn has(&self, key: &Key<'_>) -> bool {
        self.path(key).is_file()
    }

    /// Keeps a cell.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn put(&self, key: &Key<'_>, cell: &Cell) -> Result<(), StoreError> {
        let path = self.path(key);
        let bytes = postcard::to_stdvec(cell)
            .map_err(|e| StoreError { path: path.clone(), reason: e.to_string() })?;
        let mut content = bytes;
        let hash = blake3::hash(&content);
        content.extend_from_slice(hash.as_bytes());
        // What goes away with the process need not survive the machine.
        let written = match self.temporary {
            Some(_) => fs::write(&path, &content),
            None => write_bytes(&path, &content),
        };
        written.map_err(|e| failed(&path, &e))
    }

    /// Removes the folder, where nothing but cells is in it.
    pub fn remove(self) {
        if self.temporary.is_some() {
            return;
        }
        // A cell that stays does no harm: the next experiment finds it, or knows it for another's.
        for entry in fs::read_dir(&self.folder).into_iter().flatten().flatten() {
            if entry.path().extension().is_some_and(|e| e == "cell") {
                let _ = fs::remove_file(entry.path());
            }
        }
        let _ = fs::remove_dir(&self.folder);
    }

    fn path(&self, key: &Key<'_>) -> PathBuf {
        let hash = blake3::hash(format!("{key:?} {}", program()).as_bytes());
        self.folder.join(format!("{}.cell", &hash.to_hex()[..32]))
    }
}

fn failed(path: &Path, error: &std::io::Error) -> StoreError {
    StoreError { path: path.to_path_buf(), reason: error.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pathspace_core::film::Families;
    use pathspace_validation::pairs::Tiles;

    fn key(replicate: u32) -> Key<'static> {
        Key { scene: "s", integrator: "pt", budget: "1 spp", replicate, seed: 1, threads: 2 }
    }

    fn cell() -> Cell {
        Cell::of_image(vec![0.1, 0.2, 0.3], Families::ALL, 5, &Tiles::new(1, 1))
    }

    #[test]
    fn cells_come_back_as_they_were() {
        let store = Store::temporary().unwrap();
        assert!(store.get(&key(0)).is_none());
        let mut cell = cell();
        cell.cpu_seconds = 1.25;
        store.put(&key(0), &cell).unwrap();
        assert_eq!(store.get(&key(0)), Some(cell));
        assert!(!store.has(&key(1)));
    }

    #[test]
    fn a_damaged_cell_is_none() {
        let store = Store::temporary().unwrap();
        store.put(&key(0), &cell()).unwrap();
        let path = store.path(&key(0));
        let mut bytes = fs::read(&path).unwrap();
        bytes[3] ^= 1;
        fs::write(&path, &bytes).unwrap();
        assert!(store.get(&key(0)).is_none());
        fs::write(&path, &bytes[..10]).unwrap();
        assert!(store.get(&key(0)).is_none());
    }

    #[test]
    fn seeds_differ_by_replicate_and_not_by_threads() {
        assert_ne!(key(0).seed(), key(1).seed());
        assert_eq!(key(0).seed(), Key { threads: 9, ..key(0) }.seed());
    }
}
