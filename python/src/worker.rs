//! A render on a thread of its own, which owns integrator, session and pool; Python asks it for
//! things and can stop waiting at any time.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use pathspace::benches::checkpoint::{self, Checkpoint, Identity};
use pathspace::benches::{Goal, Plan, RelativeError, Session, Shard, Status};
use pathspace::core::Scene as World;
use pathspace::core::driver::Work;
use pathspace::core::film::Film;
use pathspace::core::integrator::Integrator;
use pyo3::PyResult;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::failed;

/// After steps longer than this the film is kept, so that there is something to hand over while the
/// next one is under way.
const SLOW_STEP: Duration = Duration::from_millis(250);

/// Worker threads: as many as asked for, or as there are processors.
pub(crate) fn pool(threads: Option<usize>) -> PyResult<ThreadPool> {
    let threads = match threads {
        Some(n) => n.clamp(1, 1024),
        None => thread::available_parallelism().map_or(1, usize::from),
    };
    ThreadPoolBuilder::new().num_threads(threads).build().map_err(failed)
}

/// A render as it is at some moment.
pub(crate) struct Frame {
    pub(crate) film: Film,
    pub(crate) steps: u64,
    pub(crate) work: Work,
    pub(crate) seconds: f64,
    pub(crate) cpu_seconds: f64,
    pub(crate) error: Option<RelativeError>,
    /// True where the goal was reached.
    pub(crate) complete: bool,
}

impl Frame {
    fn of(session: &Session<'_>, complete: bool) -> Frame {
        let (progress, spent) = (session.progress(), session.spent());
        Frame {
            film: session.film().clone(),
            steps: progress.steps,
            work: progress.work,
            seconds: spent.seconds,
            cpu_seconds: spent.cpu_seconds,
            error: session.error(),
            complete,
        }
    }
}

/// What a thread renders.
pub(crate) struct Job {
    pub(crate) integrator: Box<dyn Integrator>,
    pub(crate) world: Arc<World>,
    pub(crate) shard: Shard,
    pub(crate) identity: Identity,
    pub(crate) from: Option<Checkpoint>,
    pub(crate) pool: ThreadPool,
}

/// An answer, or why there is none.
pub(crate) type Answer<T> = Result<T, String>;

enum Request {
    Run(Goal, Sender<Answer<Frame>>),
    Look(Sender<Answer<Frame>>),
    Save(PathBuf, Sender<Answer<()>>),
}

#[derive(Default)]
struct Shared {
    stop: AtomicBool,
    status: Mutex<Option<Status>>,
    last: Mutex<Option<Frame>>,
}

/// The thread, seen from Python.
pub(crate) struct Worker {
    requests: Sender<Request>,
    shared: Arc<Shared>,
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Worker {
    /// Starts the thread; the receiver tells whether the render could begin.
    pub(crate) fn start(job: Job) -> (Worker, Receiver<Answer<()>>) {
        let shared = Arc::new(Shared::default());
        let (requests, theirs) = channel();
        let (begun, ready) = channel();
        let own = Arc::clone(&shared);
        thread::spawn(move || work(job, theirs, &own, &begun));
        (Worker { requests, shared }, ready)
    }

    /// Renders until the goal.
    pub(crate) fn run(&self, goal: Goal) -> Receiver<Answer<Frame>> {
        self.shared.stop.store(false, Ordering::SeqCst);
        *lock(&self.shared.status) = None;
        *lock(&self.shared.last) = None;
        self.ask(|reply| Request::Run(goal, reply))
    }

    /// The render as it is after the step under way.
    pub(crate) fn look(&self) -> Receiver<Answer<Frame>> {
        self.ask(Request::Look)
    }

    /// Saves it after the step under way.
    pub(crate) fn save(&self, path: PathBuf) -> Receiver<Answer<()>> {
        self.ask(|reply| Request::Save(path, reply))
    }

    /// Ends the run after the step under way.
    pub(crate) fn stop(&self) {
        self.shared.stop.store(true, Ordering::SeqCst);
    }

    /// How far the run has come.
    pub(crate) fn status(&self) -> Option<Status> {
        *lock(&self.shared.status)
    }

    /// The film after the last step, where steps are slow.
    pub(crate) fn last(&self) -> Option<Frame> {
        lock(&self.shared.last).take()
    }

    fn ask<T>(&self, request: impl FnOnce(Sender<T>) -> Request) -> Receiver<T> {
        let (reply, answer) = channel();
        // Where the thread is gone, the answer says so: its sender is dropped here.
        let _ = self.requests.send(request(reply));
        answer
    }
}

fn work(job: Job, requests: Receiver<Request>, shared: &Shared, begun: &Sender<Answer<()>>) {
    let Job { integrator, world, shard, identity, from, pool } = job;
    pool.install(move || {
        let (layers, seed) = (identity.layers, identity.seed);
        let plan = Plan { integrator: &*integrator, scene: &world, layers, seed, shard };
        let session = match from {
            None => Session::start(plan),
            Some(c) => Session::resume(plan, &c.progress, c.film),
        };
        let mut session = match session {
            Ok(session) => session,
            Err(e) => {
                let _ = begun.send(Err(e.to_string()));
                return;
            }
        };
        let _ = begun.send(Ok(()));
        // Who asked may have gone on; an answer that nobody takes is no fault.
        for request in &requests {
            match request {
                Request::Run(goal, reply) => {
                    let _ = reply.send(run(&mut session, goal, &requests, shared, &identity));
                }
                other => answer(other, &session, &identity),
            }
        }
    });
}

fn run(
    session: &mut Session<'_>,
    goal: Goal,
    requests: &Receiver<Request>,
    shared: &Shared,
    identity: &Identity,
) -> Answer<Frame> {
    let mut step = Instant::now();
    let complete = session.run(goal, &mut |session, status| {
        *lock(&shared.status) = Some(*status);
        if step.elapsed() > SLOW_STEP {
            *lock(&shared.last) = Some(Frame::of(session, false));
        }
        requests.try_iter().for_each(|request| answer(request, session, identity));
        step = Instant::now();
        match shared.stop.load(Ordering::SeqCst) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    });
    Ok(Frame::of(session, complete.map_err(|e| e.to_string())?))
}

/// Answers what needs no rendering.
fn answer(request: Request, session: &Session<'_>, identity: &Identity) {
    match request {
        Request::Look(reply) => {
            let _ = reply.send(Ok(Frame::of(session, false)));
        }
        Request::Save(path, reply) => {
            let saved = checkpoint::write(&path, identity, &session.progress(), session.film());
            let _ = reply.send(saved.map_err(|e| e.to_string()));
        }
        Request::Run(_, reply) => {
            let _ = reply.send(Err("this session is rendering already".into()));
        }
    }
}
