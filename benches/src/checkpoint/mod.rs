//! Checkpoints: a render with all that goes on from it, or is merged with its shards, in one file.
//!
//! A file begins with a line that says what it is, holds one [`postcard`] message with numbers as
//! they are in memory, and ends with the BLAKE3 hash of all before. It appears whole or not at all:
//! whatever happens while it is written, the one before is still there.

mod identity;
mod merge;
mod wire;

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use pathspace_core::film::Film;
use thiserror::Error;

use crate::output::whole;
use crate::session::Progress;
pub use identity::{Identity, Shards};
pub use merge::{MergeError, Merged, Part, Short, merge, sums_of};

/// First bytes of every checkpoint; the number is that of the format.
const MAGIC: &[u8] = b"pathspace checkpoint 2\n";
/// What they have in common whatever the format.
const FAMILY: &[u8] = b"pathspace checkpoint ";
const HASH: usize = blake3::OUT_LEN;

/// A render as it was saved.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// What is rendered.
    pub identity: Identity,
    /// How far it has come.
    pub progress: Progress,
    /// Its film.
    pub film: Film,
}

/// Why a checkpoint was not written, or is of no use.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The file cannot be read: no such file, no permission, …
    #[error("{}: cannot read: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        error: io::Error,
    },
    /// The file cannot be written: no such directory, no permission, no space, …
    #[error("{}: cannot write: {error}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        error: io::Error,
    },
    /// The file is something else.
    #[error("{}: is not a checkpoint of pathspace", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// The file is of another format.
    #[error("{}: was written by another version of pathspace, in a format that this one does not know", path.display())]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// The file is cut short or was changed.
    #[error("{}: is damaged: {reason}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        reason: String,
    },
    /// The file is of another render.
    #[error("{}: is of another render: {difference}", path.display())]
    Other {
        /// The file.
        path: PathBuf,
        /// What differs, in words.
        difference: String,
    },
}

/// Checks that a checkpoint can be written, and removes what killed processes have left of their
/// writing.
///
/// # Errors
/// [`CheckpointError::Write`].
pub fn probe(path: &Path) -> Result<(), CheckpointError> {
    whole::probe(path).map_err(|error| unwritten(path, error))
}

/// Writes a checkpoint in the place of the one before.
///
/// # Errors
/// [`CheckpointError::Write`]; the one before is then still there.
pub fn write(
    path: &Path,
    identity: &Identity,
    progress: &Progress,
    film: &Film,
) -> Result<(), CheckpointError> {
    let message = wire::Message::of(identity, progress, film);
    whole::write_whole(path, |file| {
        let mut out = Hashing { inner: file, hasher: blake3::Hasher::new() };
        out.write_all(MAGIC)?;
        // The message comes number by number; hashes like it better by the page.
        let out = wire::write(&message, BufWriter::with_capacity(1 << 16, out))?;
        let mut out = out.into_inner().map_err(io::IntoInnerError::into_error)?;
        let hash = out.hasher.finalize();
        out.write_all(hash.as_bytes())
    })
    .map_err(|error| unwritten(path, error))
}

fn unwritten(path: &Path, error: io::Error) -> CheckpointError {
    CheckpointError::Write { path: path.to_path_buf(), error }
}

impl Checkpoint {
    /// Reads a checkpoint.
    ///
    /// # Errors
    /// Where there is none, or it is not whole.
    pub fn read(path: &Path) -> Result<Checkpoint, CheckpointError> {
        let own = || path.to_path_buf();
        let damaged =
            |reason: &str| CheckpointError::Damaged { path: own(), reason: reason.into() };
        let bytes =
            whole::read_file(path).map_err(|error| CheckpointError::Read { path: own(), error })?;
        if !bytes.starts_with(MAGIC) {
            return Err(if bytes.starts_with(FAMILY) {
                CheckpointError::Format { path: own() }
            } else {
                CheckpointError::Foreign { path: own() }
            });
        }
        let end = bytes.len().checked_sub(HASH).filter(|end| *end >= MAGIC.len());
        let (content, hash) = bytes.split_at(end.ok_or_else(|| damaged("it is cut short"))?);
        if blake3::hash(content).as_bytes() != hash {
            return Err(damaged("it is cut short or was changed"));
        }
        wire::read(&content[MAGIC.len()..]).map_err(|reason| damaged(&reason))
    }

    /// Reads a checkpoint of this very render.
    ///
    /// # Errors
    /// As [`Checkpoint::read`], and [`CheckpointError::Other`], which names what differs.
    pub fn read_of(path: &Path, identity: &Identity) -> Result<Checkpoint, CheckpointError> {
        let found = Checkpoint::read(path)?;
        match found.identity.difference(identity) {
            None => Ok(found),
            Some(difference) => {
                Err(CheckpointError::Other { path: path.to_path_buf(), difference })
            }
        }
    }
}

/// Hashes what is written.
struct Hashing<'a> {
    inner: &'a mut dyn Write,
    hasher: blake3::Hasher,
}

impl Write for Hashing<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = self.inner.write(bytes)?;
        self.hasher.update(&bytes[..n]);
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

#[cfg(test)]
mod tests;
