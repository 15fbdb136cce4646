//! Other renderers as integrators.
//!
//! An adapter is a program that reads requests, one JSON object a line, and answers each with one
//! (docs/peers.md). It is started once for a scene, so that what it loads and compiles is paid for
//! once and told apart from rendering; one that answers a single request and ends is started anew
//! for the next.
//!
//! | Spec | Renderer |
//! | --- | --- |
//! | `mitsuba:integrator=path,variant=llvm_ad_rgb` | Mitsuba 3 |
//! | `luxcore:engine=BIDIRCPU,sampler=RANDOM` | LuxCore |
//! | `external:command=FILE,…` | any other; all options are handed to the adapter |

mod ears;
mod image;
mod process;
mod protocol;
mod shipped;

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use pathspace_core::film::Families;
use thiserror::Error;

use process::Process;
pub use protocol::Answer;
use protocol::{Described, Technique, Wanted};
pub use shipped::{PEERS, is_peer};

use crate::budget::Budget;
use crate::leftovers::{TemporaryFolder, temporary_folder};

/// Option of every peer: seconds to wait for an answer.
const TIMEOUT: &str = "timeout";
/// Seconds to wait for an answer unless told otherwise; those that it is to render for come on top.
const PATIENCE: f64 = 3600.0;
/// Seconds that an adapter's clock may run ahead of ours, and the share of the time.
const CLOCKS: (f64, f64) = (0.1, 0.05);
/// Shortest time that a render can take, seconds.
const MOMENT: f64 = 1e-6;

/// Why another renderer does not render.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PeerError {
    /// It is not on this machine.
    #[error("{peer} is not there: {how}")]
    Absent {
        /// The spec.
        peer: String,
        /// How to install it.
        how: String,
    },
    /// It cannot render the scene, or not with the same meaning.
    #[error("{peer} does not render this scene: {reason}")]
    Refused {
        /// The spec.
        peer: String,
        /// Its reason.
        reason: String,
    },
    /// The adapter ended, or answered something else than the protocol has.
    #[error("{peer}: {reason}")]
    Failed {
        /// The spec.
        peer: String,
        /// What happened.
        reason: String,
    },
}

/// The scene as a file that other renderers can read.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// The scene file, in Mitsuba's XML.
    pub file: PathBuf,
    /// Values for `$key` in it.
    pub define: BTreeMap<String, String>,
    /// Width of the film, pixels.
    pub width: u32,
    /// Height of the film, pixels.
    pub height: u32,
    /// Longest path in edges; unlimited where `None`.
    pub max_depth: Option<u32>,
}

/// One render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// Seed; another renderer may use fewer bits of it.
    pub seed: u64,
    /// Number of the replicate.
    pub replicate: u32,
    /// How long.
    pub budget: Budget,
    /// Threads.
    pub threads: usize,
}

/// A finished render.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendered {
    /// `[r, g, b]` of every pixel, rows from top to bottom.
    pub image: Vec<f32>,
    /// What it cost.
    pub answer: Answer,
}

/// Another renderer with one scene.
pub struct Peer {
    spec: String,
    process: Process,
    place: Place,
    folder: TemporaryFolder,
    patience: f64,
    families: Families,
    version: String,
    options: BTreeMap<String, String>,
}

impl Peer {
    /// Starts the adapter of `name` and asks whether it renders the scene.
    ///
    /// # Errors
    /// [`PeerError::Absent`] and [`PeerError::Refused`] are no failures: leave it out and say so.
    pub fn open(name: &str, options: &[(&str, &str)], place: Place) -> Result<Self, PeerError> {
        let mut spec = name.to_owned();
        for (i, (key, value)) in options.iter().enumerate() {
            spec += &format!("{}{key}={value}", if i == 0 { ':' } else { ',' });
        }
        let failed = |reason: String| PeerError::Failed { peer: spec.clone(), reason };
        let folder = temporary_folder("pathspace-peer-")
            .map_err(|e| failed(format!("no place for temporary files: {e}")))?;
        let patience = patience(options).map_err(&failed)?;
        let command = shipped::command(name, options, folder.path()).map_err(&failed)?;
        let mut process = Process::new(command);
        let options: BTreeMap<String, String> = options
            .iter()
            .filter(|(key, _)| *key != TIMEOUT)
            .map(|(k, v)| ((*k).to_owned(), (*v).to_owned()))
            .collect();
        let wanted = Wanted::describe(&place, &options);
        let limit = Duration::from_secs_f64(patience);
        let mut go_on = || ControlFlow::Continue(());
        let described: Described = match process.ask(&wanted, limit, &mut go_on) {
            Err(process::Failure::NotFound(how)) => {
                return Err(PeerError::Absent { peer: spec, how });
            }
            Err(process::Failure::Other(reason)) => return Err(failed(reason)),
            Ok(described) => described,
        };
        if let Some(how) = described.absent {
            return Err(PeerError::Absent { peer: spec, how });
        }
        if let Some(reason) = described.error {
            return Err(PeerError::Refused { peer: spec, reason });
        }
        let families =
            described.techniques.iter().fold(Families::NONE, |all, t| all | t.families());
        let families = if described.techniques.is_empty() { Families::ALL } else { families };
        let version = described.version;
        Ok(Peer { spec, process, place, folder, patience, families, version, options })
    }

    /// Name with options, as on the command line.
    pub fn spec(&self) -> &str {
        &self.spec
    }

    /// Name and version of the renderer, as it told.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// Families of techniques that it uses: which paths it can see.
    pub fn families(&self) -> Families {
        self.families
    }

    /// Renders one image. `watch` is asked now and then whether to stop, which ends the adapter and
    /// is an error like any other.
    ///
    /// # Errors
    /// Where the adapter fails, takes too long, writes an image of another size or one that is not
    /// finite, or tells of times that can not be.
    pub fn render(
        &mut self,
        request: &Request,
        watch: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<Rendered, PeerError> {
        let output = self.folder.path().join("image.exr");
        // One that is still there would be taken for the new one.
        let _ = std::fs::remove_file(&output);
        let failed = |reason: String| PeerError::Failed { peer: self.spec.clone(), reason };
        let wanted = Wanted::render(&self.place, &self.options, request, &output);
        let rendering = match request.budget {
            Budget::Seconds(s) => s,
            Budget::Samples(_) => 0.0,
        };
        // A duration has room for what a budget may be.
        let limit = Duration::from_secs_f64(self.patience + rendering);
        let begun = Instant::now();
        let answer: Described = match self.process.ask(&wanted, limit, watch) {
            Err(process::Failure::NotFound(reason) | process::Failure::Other(reason)) => {
                return Err(failed(reason));
            }
            Ok(answer) => answer,
        };
        if let Some(reason) = answer.error {
            return Err(failed(reason));
        }
        check(&answer.cost, begun.elapsed().as_secs_f64()).map_err(&failed)?;
        let image = image::read(&output, self.place.width, self.place.height).map_err(&failed)?;
        Ok(Rendered { image, answer: answer.cost })
    }
}

/// Seconds to wait for an answer.
fn patience(options: &[(&str, &str)]) -> Result<f64, String> {
    let Some((_, text)) = options.iter().find(|(key, _)| *key == TIMEOUT) else {
        return Ok(PATIENCE);
    };
    let seconds = text.parse().ok().filter(|s: &f64| *s > 0.0 && *s < 1e9);
    seconds.ok_or_else(|| format!("{TIMEOUT}={text}: expected seconds over 0"))
}

/// Holds what an adapter tells of its render to what can be, with `elapsed` seconds from the
/// request to the answer.
fn check(cost: &Answer, elapsed: f64) -> Result<(), String> {
    let Answer { seconds, spp, .. } = *cost;
    if !(seconds > 0.0 && spp > 0.0) {
        return Err("the answer to a render has no seconds or no spp".into());
    }
    if !(seconds >= MOMENT) || seconds > elapsed * (1.0 + CLOCKS.1) + CLOCKS.0 {
        return Err(format!(
            "it tells of {seconds:e} s of rendering, and answered after {elapsed:.3} s"
        ));
    }
    let others = [
        ("spp", spp),
        ("startup_seconds", cost.startup_seconds),
        ("cpu_seconds", cost.cpu_seconds.unwrap_or(0.0)),
    ];
    match others.into_iter().find(|(_, v)| !(0.0..1e15).contains(v)) {
        Some((name, value)) => Err(format!("{name} can not be {value}")),
        None => Ok(()),
    }
}

impl Technique {
    fn families(self) -> Families {
        match self {
            Technique::S0 => Families::S0,
            Technique::S1 => Families::S1,
            Technique::Inner => Families::INNER,
            Technique::T1 => Families::T1,
            Technique::T0 => Families::T0,
        }
    }
}

#[cfg(all(test, unix))]
mod tests;
