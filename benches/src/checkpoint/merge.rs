//! Shards of one render put together.

use std::fmt;
use std::path::{Path, PathBuf};

use pathspace_core::driver::Work;
use pathspace_core::film::FilmError;
use pathspace_core::integrator::State;
use thiserror::Error;

use super::{Checkpoint, CheckpointError, Identity, Shards};
use crate::budget::{Budget, Goal};
use crate::clock::Spent;
use crate::session::Progress;
use crate::shard::Shard;

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
    /// What it has not reached of what it was to reach.
    pub short: Option<Short>,
}

/// A file that holds less than what was asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Short {
    /// What there is, in the unit of the budget.
    pub done: f64,
    /// What its shards were to reach together; `None` where it was never said.
    pub wanted: Option<Budget>,
}

impl Short {
    /// What a file lacks where the whole render was to reach `most` samples per pixel by one of its
    /// shards.
    fn of(identity: &Identity, progress: &Progress, most: u64) -> Option<Short> {
        let Shards { count, present } = &identity.shards;
        let shards = present.iter().filter_map(|i| Shard::new(*i, *count).ok());
        let steps = |s: Shard| match s.share_of(Budget::Samples(most)) {
            Budget::Samples(n) => n,
            Budget::Seconds(_) => 0,
        };
        match progress.goal.budget {
            Some(Budget::Samples(_)) => {
                let wanted = shards.map(steps).fold(0, u64::saturating_add);
                let short =
                    Short { done: progress.steps as f64, wanted: Some(Budget::Samples(wanted)) };
                (!progress.complete || progress.steps < wanted).then_some(short)
            }
            Some(Budget::Seconds(s)) => {
                let wanted = Some(Budget::Seconds(s * present.len() as f64));
                (!progress.complete).then_some(Short { done: progress.spent.seconds, wanted })
            }
            None => {
                (!progress.complete).then_some(Short { done: progress.steps as f64, wanted: None })
            }
        }
    }
}

impl fmt::Display for Short {
    /// `222 of 50000 spp`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.wanted {
            None => write!(f, "{} spp and no goal", self.done),
            Some(Budget::Samples(n)) => write!(f, "{} of {n} spp", self.done),
            Some(Budget::Seconds(s)) => write!(f, "{:.1} of {s} s", self.done),
        }
    }
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
/// Files are added in the order of their lowest shard, whatever the order of `paths`: the same
/// files give the same bits. Sums of the render in one piece are those of the same contributions in
/// another order, equal but for the rounding of `f64`, and to the bit where no sum was rounded.
/// Steps, samples, rays and seconds are those of all together.
///
/// # Errors
/// [`MergeError`]: a file that is not whole, of another render, or with a shard that another one
/// has.
pub fn merge(paths: &[PathBuf]) -> Result<Merged, MergeError> {
    // Films are large: what fits together is found out first, with one in memory at a time.
    let mut parts: Vec<Part> = Vec::new();
    let mut reached: Vec<Progress> = Vec::new();
    for path in paths {
        let Checkpoint { identity, film, progress } = Checkpoint::read(path)?;
        let samples_per_pixel = film.samples_per_pixel();
        let part = Part { path: path.clone(), identity, samples_per_pixel, short: None };
        for other in &parts {
            fits(other, &part)?;
        }
        parts.push(part);
        // Without the state of its run, which may be large.
        reached.push(Progress { state: State::default(), precision: None, ..progress });
    }
    let most = reached.iter().filter_map(|p| match p.goal.budget {
        Some(Budget::Samples(n)) => Some(n),
        Some(Budget::Seconds(_)) | None => None,
    });
    let most = most.max().unwrap_or(0);
    for (part, progress) in parts.iter_mut().zip(&reached) {
        part.short = Short::of(&part.identity, progress, most);
    }
    parts.sort_by_key(|p| p.identity.shards.present.iter().min().copied());
    let mut parts_in_order = parts.iter();
    let first = parts_in_order.next().ok_or(MergeError::Nothing)?;
    let mut sum = Checkpoint::read(&first.path)?;
    sum.progress = merged_progress(
        Progress { goal: sum.progress.goal, complete: true, ..Progress::default() },
        &sum.progress,
    );
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
    Progress {
        steps: a.steps + b.steps,
        work,
        spent,
        by_steps: b.by_steps,
        goal: larger(a.goal, b.goal),
        complete: a.complete && b.complete,
        ..Progress::default()
    }
}

fn larger(a: Goal, b: Goal) -> Goal {
    let amount = |g: &Goal| g.budget.map_or(0.0, Budget::amount);
    if amount(&b) > amount(&a) { b } else { a }
}

/// Where the sums of an image are: beside `NAME.exr` stands `NAME.film`; any other file is one of
/// sums itself.
pub fn sums_of(path: &Path) -> PathBuf {
    let is_image = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    if is_image { path.with_extension("film") } else { path.to_path_buf() }
}
