//! The message of a checkpoint: mirrors of the types of core, which knows no file format.

use std::io::{self, Write};

use glam::Vec2;
use pathspace_core::color::Rgb;
use pathspace_core::description::{Crop, FilmDescription, FilterKind};
use pathspace_core::driver::Work;
use pathspace_core::film::{Contribution, Families, Film, FilmParts, LayerKey, Layers, NonFinite};
use pathspace_core::integrator::State;
use pathspace_core::path::WalkRules;
use pathspace_core::random::Address;
use serde::{Deserialize, Serialize};

use super::{Checkpoint, Identity, Shards};
use crate::budget::Goal;
use crate::clock::Spent;
use crate::precision::Precision;
use crate::session::{Progress, Replicate};

/// All of a checkpoint; `P` is a plane, borrowed for writing and owned after reading.
#[derive(Serialize, Deserialize)]
pub(super) struct Message<P> {
    identity: IdentityWire,
    progress: ProgressWire,
    samples: u64,
    nonfinite: u64,
    nonfinite_examples: Vec<NonFiniteWire>,
    sums: P,
    /// By [`LayerKey::name`].
    planes: Vec<(String, P)>,
}

#[derive(Serialize, Deserialize)]
struct IdentityWire {
    version: String,
    program: String,
    scene: String,
    scene_hash: String,
    integrator: String,
    max_length: Option<u32>,
    rr_depth: u32,
    seed: u64,
    /// Width and height of the whole, then x, y, width and height of the window.
    film: [u32; 6],
    filter: FilterWire,
    /// length, technique, unweighted, emitter, class.
    layers: [bool; 5],
    shards: Shards,
}

#[derive(Serialize, Deserialize)]
enum FilterWire {
    Box,
    Tent(f64),
    Gaussian(f64),
}

#[derive(Serialize, Deserialize)]
struct ProgressWire {
    steps: u64,
    samples: u64,
    rays: u64,
    seconds: f64,
    cpu_seconds: f64,
    by_steps: bool,
    state_step: u64,
    state: Vec<u8>,
    precision: Option<Precision>,
    goal: Goal,
    complete: bool,
    replicate: Replicate,
}

#[derive(Serialize, Deserialize)]
struct NonFiniteWire {
    seed: u64,
    step: u64,
    item: u64,
    film: [f32; 2],
    value: [f32; 3],
    weight: f32,
    s: u16,
    t: u16,
    emitter: u32,
    families: u8,
}

impl<'a> Message<&'a [[f64; 3]]> {
    pub(super) fn of(identity: &Identity, progress: &Progress, film: &'a Film) -> Self {
        let planes = film.planes().iter().map(|(key, plane)| (key.name(), plane.sums()));
        Message {
            identity: identity.into(),
            progress: progress.into(),
            samples: film.samples(),
            nonfinite: film.nonfinite(),
            nonfinite_examples: film.nonfinite_examples().iter().map(NonFiniteWire::from).collect(),
            sums: film.sums().sums(),
            planes: planes.collect(),
        }
    }
}

/// Writes a message, and hands back the writer.
pub(super) fn write<W: Write>(message: &Message<&[[f64; 3]]>, out: W) -> io::Result<W> {
    let mut out = Remembering { inner: out, error: None };
    match postcard::to_io(message, &mut out) {
        Ok(_) => Ok(out.inner),
        // postcard says only that the writer failed; the writer knows why.
        Err(e) => Err(out.error.unwrap_or_else(|| io::Error::other(e))),
    }
}

/// Keeps the first error of a writer.
struct Remembering<W> {
    inner: W,
    error: Option<io::Error>,
}

impl<W> Remembering<W> {
    fn remember<T>(&mut self, done: io::Result<T>) -> io::Result<T> {
        done.map_err(|e| {
            let kind = e.kind();
            self.error.get_or_insert(e);
            kind.into()
        })
    }
}

impl<W: Write> Write for Remembering<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let done = self.inner.write(bytes);
        self.remember(done)
    }

    fn flush(&mut self) -> io::Result<()> {
        let done = self.inner.flush();
        self.remember(done)
    }
}

/// Reads a message that is known to be whole; says what does not fit otherwise.
pub(super) fn read(bytes: &[u8]) -> Result<Checkpoint, String> {
    let (message, rest): (Message<Vec<[f64; 3]>>, &[u8]) =
        postcard::take_from_bytes(bytes).map_err(|e| e.to_string())?;
    if !rest.is_empty() {
        return Err(format!("{} bytes too many", rest.len()));
    }
    let identity = Identity::from(message.identity);
    if let Some(problem) = identity.shards.problem() {
        return Err(problem);
    }
    let mut planes = std::collections::BTreeMap::new();
    for (name, plane) in message.planes {
        let key = LayerKey::from_name(&name).ok_or_else(|| format!("unknown layer {name}"))?;
        planes.insert(key, plane);
    }
    let parts = FilmParts {
        samples: message.samples,
        nonfinite: message.nonfinite,
        nonfinite_examples: message.nonfinite_examples.iter().map(NonFinite::from).collect(),
        sums: message.sums,
        planes,
    };
    let film = Film::from_parts(&identity.film, identity.layers, parts);
    Ok(Checkpoint {
        film: film.map_err(|e| e.to_string())?,
        progress: message.progress.into(),
        identity,
    })
}

impl From<&Identity> for IdentityWire {
    fn from(i: &Identity) -> Self {
        let FilmDescription { width, height, crop, filter } = i.film;
        let Layers { length, technique, unweighted, emitter, class } = i.layers;
        IdentityWire {
            version: i.version.clone(),
            program: i.program.clone(),
            scene: i.scene.clone(),
            scene_hash: i.scene_hash.clone(),
            integrator: i.integrator.clone(),
            max_length: i.rules.max_length,
            rr_depth: i.rules.rr_depth,
            seed: i.seed,
            film: [width, height, crop.x, crop.y, crop.width, crop.height],
            filter: match filter {
                FilterKind::Box => FilterWire::Box,
                FilterKind::Tent { radius } => FilterWire::Tent(radius),
                FilterKind::Gaussian { stddev } => FilterWire::Gaussian(stddev),
            },
            layers: [length, technique, unweighted, emitter, class],
            shards: i.shards.clone(),
        }
    }
}

impl From<IdentityWire> for Identity {
    fn from(w: IdentityWire) -> Self {
        let [width, height, x, y, crop_width, crop_height] = w.film;
        let [length, technique, unweighted, emitter, class] = w.layers;
        Identity {
            version: w.version,
            program: w.program,
            scene: w.scene,
            scene_hash: w.scene_hash,
            integrator: w.integrator,
            rules: WalkRules { max_length: w.max_length, rr_depth: w.rr_depth },
            seed: w.seed,
            film: FilmDescription {
                width,
                height,
                crop: Crop { x, y, width: crop_width, height: crop_height },
                filter: match w.filter {
                    FilterWire::Box => FilterKind::Box,
                    FilterWire::Tent(radius) => FilterKind::Tent { radius },
                    FilterWire::Gaussian(stddev) => FilterKind::Gaussian { stddev },
                },
            },
            layers: Layers { length, technique, unweighted, emitter, class },
            shards: w.shards,
        }
    }
}

impl From<&Progress> for ProgressWire {
    fn from(p: &Progress) -> Self {
        ProgressWire {
            steps: p.steps,
            samples: p.work.samples,
            rays: p.work.rays,
            seconds: p.spent.seconds,
            cpu_seconds: p.spent.cpu_seconds,
            by_steps: p.by_steps,
            state_step: p.state.step,
            state: p.state.bytes.clone(),
            precision: p.precision.clone(),
            goal: p.goal,
            complete: p.complete,
            replicate: p.replicate,
        }
    }
}

impl From<ProgressWire> for Progress {
    fn from(w: ProgressWire) -> Self {
        Progress {
            steps: w.steps,
            work: Work { samples: w.samples, rays: w.rays },
            spent: Spent { seconds: w.seconds, cpu_seconds: w.cpu_seconds },
            by_steps: w.by_steps,
            state: State { step: w.state_step, bytes: w.state },
            precision: w.precision,
            goal: w.goal,
            complete: w.complete,
            replicate: w.replicate,
        }
    }
}

impl From<&NonFinite> for NonFiniteWire {
    fn from(n: &NonFinite) -> Self {
        let (a, c) = (n.address, n.contribution);
        NonFiniteWire {
            seed: a.seed,
            step: a.step,
            item: a.item,
            film: c.film.to_array(),
            value: c.value.to_array(),
            weight: c.weight,
            s: c.s,
            t: c.t,
            emitter: c.emitter,
            families: c.families.bits(),
        }
    }
}

impl From<&NonFiniteWire> for NonFinite {
    fn from(w: &NonFiniteWire) -> Self {
        NonFinite {
            address: Address { seed: w.seed, step: w.step, item: w.item },
            contribution: Contribution {
                film: Vec2::from(w.film),
                value: Rgb::from(w.value),
                weight: w.weight,
                s: w.s,
                t: w.t,
                emitter: w.emitter,
                families: Families::from_bits(w.families),
            },
        }
    }
}
