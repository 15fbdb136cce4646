//! Shards of one render put together.

use std::path::{Path, PathBuf};

use pathspace_core::driver::Work;
use pathspace_core::film::FilmError;
use thiserror::Error;

use super::{Checkpoint, CheckpointError, Identity};
use crate::clock::Spent;
use crate::session::Progress;

/// Why files were not put together.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MergeError {
    /// A file is of no use.
    #[error(transparent)]
    File(#[from] CheckpointError),
    /// Two files are not of the same render.
    #[error("{} is of another render than {}: {difference}", other.display(), first.display())]
    Other {
        /// The first file.
        first: PathBuf,
        /// The one that does not fit.
        other: PathBuf,
        /// What differs.
        difference: String,
    },
    /// Two files have a shard in common: its samples would count twice.
    #[error("{} and {} overlap: both hold shard {shard}/{count}", first.display(), other.display())]
    Overlap {
        /// One file.
        first: PathBuf,
        /// The other file.
        other: PathBuf,
        /// The shard in both, counted from 1.
        shard: u32,
        /// Into how many shards the render was shared out.
        count: u32,
    },
    /// Nothing to put together.
    #[error("no files to merge")]
    Nothing,
    /// The films do not fit although they say they would.
    #[error("{}: {error}", path.display())]
    Film {
        /// The file.
        path: PathBuf,
        /// Why.
        error: FilmError,
    },
}

/// A file as the merge saw it.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// The file.
    pub path: PathBuf,
    /// What it holds.
    pub identity: Identity,
    /// Its samples per pixel.
    pub samples_per_pixel: f64,
}

/// Shards put together.
#[derive(Debug)]
pub struct Merged {
    /// The sum of all. It can be merged on where shards are missing; no run goes on from it.
    pub checkpoint: Checkpoint,
    /// The files in the order of their sums.
    pub parts: Vec<Part>,
    /// Shards that are in none of the files, counted from 0.
    pub missing: Vec<u32>,
}

/// Puts shards together: sums and samples are added, so that each shard weighs by its samples.
///
/// Files are added in the order of their lowest shard, whatever the order of `paths`: the same files give the same bits. Sums of the
/// render in one piece are those of the same contributions in another order, equal but for the rounding of `f64`, and to the bit
/// where no sum was rounded. Steps, samples, rays and seconds are those of all together.
///
/// # Errors
/// [`MergeError`]: a file that is not whole, of another render, or with a shard that another one has.
pub fn merge(paths: &[PathBuf]) -> Result<Merged, MergeError> {
    // Films are large: what fits together is found out first, with one in memory at a time.
    let mut parts: Vec<Part> = Vec::new();
    for path in paths {
        let Checkpoint { identity, film, .. } = Checkpoint::read(path)?;
        let part =
            Part { path: path.clone(), identity, samples_per_pixel: film.samples_per_pixel() };
        for other in &parts {
            fits(other, &part)?;
        }
        parts.push(part);
    }
    parts.sort_by_key(|p| p.identity.shards.present.iter().min().copied());
    let mut parts_in_order = parts.iter();
    let first = parts_in_order.next().ok_or(MergeError::Nothing)?;
    let mut sum = Checkpoint::read(&first.path)?;
    sum.progress = merged_progress(Progress::default(), &sum.progress);
    for part in parts_in_order {
        let next = read_again(part)?;
        sum.film
            .merge(&next.film)
            .map_err(|error| MergeError::Film { path: part.path.clone(), error })?;
        sum.identity.shards.present.extend(&next.identity.shards.present);
        sum.progress = merged_progress(sum.progress, &next.progress);
    }
    let shards = &mut sum.identity.shards;
    shards.present.sort_unstable();
    let missing = (0..shards.count).filter(|i| shards.present.binary_search(i).is_err()).collect();
    Ok(Merged { checkpoint: sum, parts, missing })
}

/// The file once more; it may have changed in between.
fn read_again(part: &Part) -> Result<Checkpoint, CheckpointError> {
    Checkpoint::read_of(&part.path, &part.identity)
}

fn fits(a: &Part, b: &Part) -> Result<(), MergeError> {
    let other =
        |difference| MergeError::Other { first: a.path.clone(), other: b.path.clone(), difference };
    if let Some(difference) = b.identity.difference_but_shards(&a.identity) {
        return Err(other(difference));
    }
    let (ours, theirs) = (&a.identity.shards, &b.identity.shards);
    if ours.count != theirs.count {
        return Err(other(format!(
            "it is a shard of {}, the other one of {}",
            theirs.count, ours.count
        )));
    }
    match ours.present.iter().find(|i| theirs.present.contains(i)) {
        None => Ok(()),
        Some(shard) => Err(MergeError::Overlap {
            first: a.path.clone(),
            other: b.path.clone(),
            shard: shard + 1,
            count: ours.count,
        }),
    }
}

fn merged_progress(a: Progress, b: &Progress) -> Progress {
    let (mut work, mut spent): (Work, Spent) = (a.work, a.spent);
    work += b.work;
    spent += b.spent;
    Progress { steps: a.steps + b.steps, work, spent, by_steps: b.by_steps, ..Progress::default() }
}

/// Where the sums of an image are: beside `NAME.exr` stands `NAME.film`; any other file is one of sums itself.
pub fn sums_of(path: &Path) -> PathBuf {
    let is_image = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    if is_image { path.with_extension("film") } else { path.to_path_buf() }
}
