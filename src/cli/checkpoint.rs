//! Keeping a render on disk: checkpoints now and then, and the sums of a shard beside its image.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use pathspace_benches::Session;
use pathspace_benches::checkpoint::{self, Checkpoint, CheckpointError, Identity};
use pathspace_benches::output::Output;

use super::args::CheckpointArgs;
use super::say;

/// Writes the checkpoints of one render.
pub(super) struct Keeper<'a> {
    identity: &'a Identity,
    from: Option<PathBuf>,
    checkpoint: Option<PathBuf>,
    /// Sums of a shard, for `pathspace merge`.
    sums: Option<PathBuf>,
    every: Duration,
    last: Instant,
    failed: bool,
}

impl<'a> Keeper<'a> {
    /// Finds the checkpoint to go on from, if any, and makes sure that new ones can be written.
    pub(super) fn open(
        args: &CheckpointArgs,
        output: Option<&Output>,
        identity: &'a Identity,
    ) -> Result<(Self, Option<Checkpoint>)> {
        let checkpoint = args.checkpoint.clone().or_else(|| args.resume.clone());
        let from = match (&args.checkpoint, &args.resume) {
            (Some(to), Some(from)) if to != from && to.exists() => bail!(
                "{}: is there already; take another file for --checkpoint, or go on from this one",
                to.display()
            ),
            (_, Some(from)) => Some(from),
            (to, None) => to.as_ref().filter(|to| to.exists()),
        };
        let found = from.map(|from| Checkpoint::read_of(from, identity)).transpose()?;
        let is_shard = identity.shards.count > 1;
        let sums = output.filter(|_| is_shard).map(|o| checkpoint::sums_of(o.path()));
        let sums = sums.filter(|sums| checkpoint.as_ref() != Some(sums));
        for path in [&checkpoint, &sums].into_iter().flatten() {
            checkpoint::probe(path)?;
        }
        if let (Some(from), Some(found)) = (from, &found) {
            let (spp, seconds) = (found.film.samples_per_pixel(), found.progress.spent.seconds);
            say(&format!(
                "going on from {}: {spp} samples per pixel in {seconds:.2} s",
                from.display()
            ));
        }
        let keeper = Keeper {
            identity,
            from: from.cloned(),
            checkpoint: checkpoint.clone(),
            sums,
            every: Duration::from_secs_f64(args.checkpoint_every),
            last: Instant::now(),
            failed: false,
        };
        Ok((keeper, found))
    }

    /// The file that the rendering goes on from, for messages.
    pub(super) fn from(&self) -> String {
        self.from.as_ref().map_or(String::new(), |p| p.display().to_string())
    }

    /// The checkpoint, for messages.
    pub(super) fn path(&self) -> Option<String> {
        self.checkpoint.as_ref().map(|p| p.display().to_string())
    }

    /// Writes a checkpoint where it is time for one. A render goes on where that fails: the one
    /// before is still there, and the disk may have room again the next time.
    pub(super) fn now_and_then(&mut self, session: &Session<'_>) {
        let Some(path) = self.checkpoint.as_ref().filter(|_| self.last.elapsed() >= self.every)
        else {
            return;
        };
        let written = write(path, self.identity, session);
        self.last = Instant::now();
        match written {
            Err(error) if !self.failed => {
                say(&format!(
                    "warning: {error}; the checkpoint before is kept, and rendering goes on"
                ));
                self.failed = true;
            }
            Err(_) => {}
            Ok(()) => self.failed = false,
        }
    }

    /// Writes the last checkpoint, and the sums of a shard.
    pub(super) fn at_the_end(&self, session: &Session<'_>) -> Result<()> {
        for path in [&self.checkpoint, &self.sums].into_iter().flatten() {
            write(path, self.identity, session)?;
        }
        Ok(())
    }
}

fn write(
    path: &std::path::Path,
    identity: &Identity,
    session: &Session<'_>,
) -> Result<(), CheckpointError> {
    checkpoint::write(path, identity, &session.progress(), session.film())
}
