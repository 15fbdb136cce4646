//! Other renderers as integrators.
//!
//! An adapter is a program that reads requests, one JSON object a line, and answers each with one (docs/peers.md). It is started once for a
//! scene, so that what it loads and compiles is paid for once and told apart from rendering; one that answers a single request and
//! ends is started anew for the next.
//!
//! | Spec | Renderer |
//! | --- | --- |
//! | `mitsuba:integrator=path,variant=llvm_ad_rgb` | Mitsuba 3 |
//! | `luxcore:engine=BIDIRCPU,sampler=RANDOM` | LuxCore |
//! | `external:command=FILE,…` | any other; all options are handed to the adapter |

mod image;
mod process;
mod protocol;
mod shipped;

use std::collections::BTreeMap;
use std::path::PathBuf;

use pathspace_core::film::Families;
use thiserror::Error;

use process::Process;
pub use protocol::Answer;
use protocol::{Described, Technique, Wanted};
pub use shipped::{PEERS, is_peer};

use crate::budget::Budget;

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
    folder: tempfile::TempDir,
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
        let folder = tempfile::Builder::new()
            .prefix("pathspace-peer-")
            .tempdir()
            .map_err(|e| failed(format!("no place for temporary files: {e}")))?;
        let command = shipped::command(name, options, folder.path()).map_err(&failed)?;
        let mut process = Process::new(command, folder.path().join("errors.txt"));
        let options: BTreeMap<String, String> =
            options.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        let wanted = Wanted::describe(&place, &options);
        let described: Described = match process.ask(&wanted) {
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
        Ok(Peer { spec, process, place, folder, families, version: described.version, options })
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

    /// Renders one image.
    ///
    /// # Errors
    /// Where the adapter fails or writes an image of another size.
    pub fn render(&mut self, request: &Request) -> Result<Rendered, PeerError> {
        let output = self.folder.path().join("image.exr");
        // One that is still there would be taken for the new one.
        let _ = std::fs::remove_file(&output);
        let failed = |reason: String| PeerError::Failed { peer: self.spec.clone(), reason };
        let wanted = Wanted::render(&self.place, &self.options, request, &output);
        let answer: Described = match self.process.ask(&wanted) {
            Err(process::Failure::NotFound(reason) | process::Failure::Other(reason)) => {
                return Err(failed(reason));
            }
            Ok(answer) => answer,
        };
        if let Some(reason) = answer.error {
            return Err(failed(reason));
        }
        let image = image::read(&output, self.place.width, self.place.height).map_err(&failed)?;
        if !(answer.cost.seconds > 0.0 && answer.cost.spp > 0.0) {
            return Err(failed("the answer to a render has no seconds or no spp".into()));
        }
        Ok(Rendered { image, answer: answer.cost })
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
