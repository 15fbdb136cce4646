//! Renders that begin, go on, stop and are put together.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use pathspace::benches::checkpoint::{self, Checkpoint, Identity, Merged, Shards};
use pathspace::benches::{Budget, Goal, Shard};
use pathspace::core::film::{Film, LayerKey, Layers};
use pathspace::integrators::{Defaults, Spec};
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::Integrators;
use crate::error::failed;
use crate::image::{array, narrow};
use crate::scene::Scene;
use crate::worker::{Answer, Frame, Job, Worker, pool};

/// Between two looks at signals and progress.
const TICK: Duration = Duration::from_millis(50);
/// How long Ctrl-C waits for the step under way.
const PATIENCE: Duration = Duration::from_millis(700);

/// A render that can be stopped and gone on with.
#[pyclass(frozen, module = "pathspace._native")]
pub struct Session {
    worker: Worker,
    identity: Identity,
    shard: Shard,
}

/// What a session is beside scene and integrator, a dictionary.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Options {
    seed: u64,
    layers: Vec<String>,
    threads: Option<usize>,
    shard: Option<(u32, u32)>,
    resume: Option<PathBuf>,
}

#[pymethods]
impl Session {
    #[new]
    fn new(
        py: Python<'_>,
        integrators: &Integrators,
        scene: &Scene,
        spec: &str,
        options: Options,
    ) -> PyResult<Self> {
        let Options { seed, layers, threads, shard, resume } = options;
        let shard = match shard {
            None => Shard::WHOLE,
            Some((index, count)) => Shard::new(index, count).map_err(failed)?,
        };
        let spec: Spec = spec.parse().map_err(failed)?;
        let defaults = Defaults { rules: scene.rules };
        let integrator = integrators.registry.create(&spec, &defaults).map_err(failed)?;
        let identity = Identity {
            version: env!("CARGO_PKG_VERSION").into(),
            program: pathspace::benches::program().into(),
            scene: scene.asked.clone(),
            scene_hash: scene.hash.clone(),
            integrator: integrator.spec(),
            rules: scene.rules,
            seed,
            film: *scene.world.film(),
            layers: these(&layers)?,
            shards: Shards::from(shard),
        };
        let from = match resume {
            None => None,
            Some(path) => Some(Checkpoint::read_of(&path, &identity).map_err(failed)?),
        };
        let job = Job {
            integrator,
            world: Arc::clone(&scene.world),
            shard,
            identity: identity.clone(),
            from,
            pool: pool(threads)?,
        };
        let (worker, ready) = Worker::start(job);
        wait(py, ready)?;
        Ok(Session { worker, identity, shard })
    }

    /// Renders until the first of the goals. `progress(used, samples_per_pixel, seconds)` is called
    /// now and then. The answer is the frame, and true where Ctrl-C stopped it.
    #[pyo3(signature = (spp=None, seconds=None, error=None, progress=None))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        spp: Option<u64>,
        seconds: Option<f64>,
        error: Option<f64>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(Bound<'py, PyDict>, bool)> {
        let budget = match (spp, seconds) {
            (Some(0), _) => return Err(PyValueError::new_err("spp must be 1 at least")),
            (Some(n), _) => Some(Budget::Samples(n)),
            (None, Some(s)) if !(s > 0.0 && s.is_finite()) => {
                return Err(PyValueError::new_err("seconds must be a number over 0"));
            }
            (None, s) => s.map(Budget::Seconds),
        };
        if error.is_some_and(|e| !(e > 0.0 && e < 1.0)) {
            return Err(PyValueError::new_err("error must lie between 0 and 1"));
        }
        if budget.is_none() && error.is_none() {
            return Err(PyValueError::new_err("a goal is missing: spp, seconds or error"));
        }
        if budget.map(|b| self.shard.share_of(b)) == Some(Budget::Samples(0)) {
            return Err(PyValueError::new_err("there are fewer samples per pixel than shards"));
        }
        let answer = Mutex::new(self.worker.run(Goal { budget, error }));
        let mut interrupted: Option<Instant> = None;
        loop {
            match next(py, &answer) {
                Ok(frame) => {
                    let frame = frame.map_err(failed)?;
                    return Ok((self.told(py, &frame)?, interrupted.is_some()));
                }
                Err(RecvTimeoutError::Disconnected) => return Err(gone()),
                Err(RecvTimeoutError::Timeout) => {}
            }
            if let Err(signal) = py.check_signals() {
                self.worker.stop();
                if !signal.is_instance_of::<PyKeyboardInterrupt>(py) {
                    return Err(signal);
                }
                interrupted.get_or_insert_with(Instant::now);
            }
            if interrupted.is_some_and(|at| at.elapsed() > PATIENCE) {
                // The step under way ends by itself, and nobody looks at it.
                return match self.worker.last() {
                    Some(frame) => Ok((self.told(py, &frame)?, true)),
                    None => {
                        Err(PyKeyboardInterrupt::new_err("stopped before the first step was done"))
                    }
                };
            }
            if let (Some(progress), Some(s)) = (&progress, self.worker.status())
                && let Err(e) = progress.call1(py, (s.used, s.samples_per_pixel, s.seconds))
            {
                self.worker.stop();
                return Err(e);
            }
        }
    }

    /// The frame as it is after the step under way.
    fn look<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let frame = wait(py, self.worker.look())?;
        self.told(py, &frame)
    }

    /// Writes a checkpoint.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        wait(py, self.worker.save(path))
    }

    /// Ends the run under way in another thread after its step.
    fn stop(&self) {
        self.worker.stop();
    }

    /// Spec of the integrator with every option that is not its default.
    #[getter]
    fn spec(&self) -> &str {
        &self.identity.integrator
    }
}

impl Session {
    fn told<'py>(&self, py: Python<'py>, frame: &Frame) -> PyResult<Bound<'py, PyDict>> {
        told(py, frame, &self.identity)
    }
}

/// Waits without the GIL, and notices Ctrl-C.
fn wait<T: Send>(py: Python<'_>, answer: Receiver<Answer<T>>) -> PyResult<T> {
    let answer = Mutex::new(answer);
    loop {
        match next(py, &answer) {
            Ok(answer) => return answer.map_err(failed),
            Err(RecvTimeoutError::Disconnected) => return Err(gone()),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
        }
    }
}

/// The answer, if it comes before the next tick. Other threads of Python go on meanwhile.
fn next<T: Send>(py: Python<'_>, answer: &Mutex<Receiver<T>>) -> Result<T, RecvTimeoutError> {
    py.detach(|| match answer.lock() {
        Ok(answer) => answer.recv_timeout(TICK),
        Err(_) => Err(RecvTimeoutError::Disconnected),
    })
}

fn gone() -> PyErr {
    failed("the rendering thread has ended; the reason is on stderr")
}

/// A frame as a dictionary: arrays and figures.
fn told<'py>(py: Python<'py>, frame: &Frame, identity: &Identity) -> PyResult<Bound<'py, PyDict>> {
    let film: &Film = &frame.film;
    let (width, height) = (film.width(), film.height());
    let layers = PyDict::new(py);
    let keys: Vec<LayerKey> = film.planes().keys().copied().collect();
    for key in keys {
        if let Some(pixels) = film.layer_image(key) {
            layers.set_item(key.name(), array(py, width, height, narrow(&pixels))?)?;
        }
    }
    let d = film.description();
    let told = PyDict::new(py);
    told.set_item("image", array(py, width, height, narrow(&film.image()))?)?;
    told.set_item("layers", layers)?;
    told.set_item("steps", frame.steps)?;
    told.set_item("samples", film.samples())?;
    told.set_item("samples_per_pixel", film.samples_per_pixel())?;
    told.set_item("seconds", frame.seconds)?;
    told.set_item("cpu_seconds", frame.cpu_seconds)?;
    told.set_item("rays", frame.work.rays)?;
    told.set_item("nonfinite", film.nonfinite())?;
    told.set_item("complete", frame.complete)?;
    told.set_item("error", frame.error.map(|e| (e.value, e.low, e.high)))?;
    told.set_item("mean", film.mean())?;
    told.set_item("integrator", &identity.integrator)?;
    told.set_item("scene", &identity.scene)?;
    told.set_item("scene_hash", &identity.scene_hash)?;
    told.set_item("seed", identity.seed)?;
    let c = d.crop;
    told.set_item("window", (d.width, d.height, c.x, c.y, c.width, c.height))?;
    Ok(told)
}

fn these(names: &[String]) -> PyResult<Layers> {
    let mut layers = Layers::NONE;
    for name in names {
        match name.as_str() {
            "length" => layers.length = true,
            "st" => layers.technique = true,
            "unweighted" => layers.unweighted = true,
            "emitter" => layers.emitter = true,
            _ => {
                let text =
                    format!("unknown layer '{name}' (known: length, st, unweighted, emitter)");
                return Err(PyValueError::new_err(text));
            }
        }
    }
    Ok(layers)
}

/// Puts the sums of shards together; the answer is the frame, and the shards that are missing,
/// counted from 0.
#[pyfunction]
#[pyo3(signature = (paths, output=None))]
pub(crate) fn merge(
    py: Python<'_>,
    paths: Vec<PathBuf>,
    output: Option<PathBuf>,
) -> PyResult<(Bound<'_, PyDict>, Vec<u32>)> {
    let merged = py.detach(|| -> PyResult<Merged> {
        let merged = checkpoint::merge(&paths).map_err(failed)?;
        if let Some(path) = output {
            let Checkpoint { identity, progress, film } = &merged.checkpoint;
            checkpoint::write(&path, identity, progress, film).map_err(failed)?;
        }
        Ok(merged)
    })?;
    let Merged { checkpoint: Checkpoint { identity, progress, film }, missing, .. } = merged;
    let frame = Frame {
        film,
        steps: progress.steps,
        work: progress.work,
        seconds: progress.spent.seconds,
        cpu_seconds: progress.spent.cpu_seconds,
        error: None,
        complete: missing.is_empty(),
    };
    Ok((told(py, &frame, &identity)?, missing))
}
