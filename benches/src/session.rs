//! A render that can stop and go on: film, run and counters. Built on [`Run`] alone.

use std::ops::ControlFlow;
use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::driver::Work;
use pathspace_core::film::{Film, Layers};
use pathspace_core::integrator::{Integrator, IntegratorError, Run, State};
use pathspace_core::random::derive_seed;
use serde::{Deserialize, Serialize};

use crate::budget::{Budget, Goal};
use crate::clock::{Spent, Stopwatch};
use crate::precision::{Precision, RelativeError};
use crate::shard::Shard;

/// Sets the seeds of replicates apart from those that integrators derive for themselves.
const REPLICATES: u64 = 0x7265_706c_6963;
/// Fewest and most steps of a replicate of a chain.
const REPLICATE_STEPS: std::ops::RangeInclusive<u64> = 8..=4096;
/// Seconds of steps that are made together, so that threads wait for each other seldom and small
/// films are not all overhead.
const TOGETHER: f64 = 0.05;
/// A chain's start may take this share of a replicate.
const START_SHARE: f64 = 0.25;

/// What is rendered; all that the film depends on besides the budget.
#[derive(Clone, Copy)]
pub struct Plan<'a> {
    /// The integrator.
    pub integrator: &'a dyn Integrator,
    /// The scene.
    pub scene: &'a Arc<Scene>,
    /// Layers of the film.
    pub layers: Layers,
    /// Seed of the whole render.
    pub seed: u64,
    /// Which share of it.
    pub shard: Shard,
}

/// Where a run is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Status {
    /// Steps done.
    pub steps: u64,
    /// Samples per pixel done.
    pub samples_per_pixel: f64,
    /// Wall-clock seconds of rendering.
    pub seconds: f64,
    /// Share of the budget that is used up, in [0, 1].
    pub used: f64,
}

/// A finished (or interrupted) render.
#[derive(Clone, Debug)]
pub struct Exposure {
    /// The film.
    pub film: Film,
    /// Steps done.
    pub steps: u64,
    /// Samples and rays.
    pub work: Work,
    /// Time for rendering, start-up of the integrator included, the building of the scene not.
    pub spent: Spent,
    /// False where `watch` stopped it before the budget was used up.
    pub complete: bool,
}

/// How far a render has come, besides its film: what [`Session::resume`] goes on from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Progress {
    /// Steps done.
    pub steps: u64,
    /// Samples and rays.
    pub work: Work,
    /// Time spent on rendering.
    pub spent: Spent,
    /// True where the steps are those of the whole render's seed, false where this is a run with a
    /// seed of its own; see [`Shard`].
    pub by_steps: bool,
    /// State of the run.
    pub state: State,
    /// What is known about the error, where it was asked for.
    pub precision: Option<Precision>,
    /// What it is to reach, for the whole render; nothing before [`Session::run`].
    pub goal: Goal,
    /// True where the goal was reached.
    pub complete: bool,
    /// Where it was, and the run is a chain: the replicate under way.
    pub replicate: Replicate,
}

/// A chain says nothing about its own error: it is rendered as several, with seeds of their own,
/// whose films are added.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Replicate {
    /// Number of the replicate under way, from 0.
    pub index: u64,
    /// Its steps so far.
    pub steps: u64,
    /// Steps of each; 0 while it is not decided.
    pub length: u64,
    /// Seconds of its first step, which holds the chain's start.
    pub first_step: f64,
}

/// A render under way.
pub struct Session<'a> {
    plan: Plan<'a>,
    film: Film,
    run: Box<dyn Run>,
    by_steps: bool,
    steps: u64,
    work: Work,
    /// Spent before this process, or this session, began.
    before: Spent,
    clock: Stopwatch,
    /// Spent outside of rendering: on writing files, on talking to viewers.
    aside: Spent,
    /// What the clock showed when rendering paused; `None` while it is under way.
    paused: Option<Spent>,
    start_up: f64,
    /// Steps since `clock` was started.
    own_steps: u64,
    precision: Option<Precision>,
    goal: Goal,
    complete: bool,
    replicate: Replicate,
}

impl<'a> Session<'a> {
    /// Begins a render.
    ///
    /// # Errors
    /// Where the integrator does not render this scene.
    pub fn start(plan: Plan<'a>) -> Result<Self, IntegratorError> {
        let clock = Stopwatch::start();
        let Plan { integrator, scene, seed, shard, .. } = plan;
        // The seed of a shard's own first: a chain has a costly start, which then is the right one
        // at once.
        let mut run = integrator.start(Arc::clone(scene), shard.seed(seed))?;
        let by_steps = run.seek(shard.step(0));
        if by_steps && !shard.is_whole() {
            run = integrator.start(Arc::clone(scene), seed)?;
            run.seek(shard.step(0));
        }
        let film = Film::new(scene.film(), plan.layers);
        let progress = Progress { by_steps, ..Progress::default() };
        Ok(Session::new(plan, film, run, &progress, clock))
    }

    /// Goes on from where [`Session::progress`] and the film were taken, to the bit as if never
    /// interrupted.
    ///
    /// # Errors
    /// Where the integrator does not render this scene, or the state is not one of this integrator.
    pub fn resume(
        plan: Plan<'a>,
        progress: &Progress,
        film: Film,
    ) -> Result<Self, IntegratorError> {
        let clock = Stopwatch::start();
        let Plan { integrator, scene, seed, shard, .. } = plan;
        let seed = match progress.replicate.index {
            _ if progress.by_steps => seed,
            0 => shard.seed(seed),
            index => replicate_seed(seed, index),
        };
        let mut run = integrator.resume(Arc::clone(scene), seed, &progress.state)?;
        if progress.by_steps && !run.seek(shard.step(progress.steps)) {
            return Err(IntegratorError::BadState {
                integrator: integrator.spec(),
                reason: "its steps are no longer independent of each other".into(),
            });
        }
        Ok(Session::new(plan, film, run, progress, clock))
    }

    fn new(
        plan: Plan<'a>,
        film: Film,
        run: Box<dyn Run>,
        progress: &Progress,
        clock: Stopwatch,
    ) -> Self {
        Session {
            plan,
            film,
            run,
            by_steps: progress.by_steps,
            steps: progress.steps,
            work: progress.work,
            before: progress.spent,
            start_up: clock.seconds(),
            clock,
            aside: Spent::default(),
            paused: None,
            own_steps: 0,
            precision: progress.precision.clone(),
            goal: progress.goal,
            complete: progress.complete,
            replicate: progress.replicate,
        }
    }

    /// The film so far.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// How far it has come.
    pub fn progress(&self) -> Progress {
        Progress {
            steps: self.steps,
            work: self.work,
            spent: self.spent(),
            by_steps: self.by_steps,
            state: self.run.save(),
            precision: self.precision.clone(),
            goal: self.goal,
            complete: self.complete,
            replicate: self.replicate,
        }
    }

    /// Begins to estimate the relative error of the image; to be asked for before the first step.
    ///
    /// Batches are the steps of the run where these are independent of each other; the film is then
    /// the one it would have been anyway. They are whole replicates with seeds of their own where
    /// it is a chain, long enough for a chain's start to take a quarter of the time at most.
    pub fn watch_error(&mut self) {
        let film = &self.film;
        self.precision.get_or_insert_with(|| Precision::new(film.pixels()));
    }

    /// What is known about the error.
    pub fn precision(&self) -> Option<&Precision> {
        self.precision.as_ref()
    }

    /// The relative error of the image so far; `None` where nobody asked for it or too little is
    /// known.
    pub fn error(&self) -> Option<RelativeError> {
        self.precision.as_ref()?.error(&self.film)
    }

    /// Time spent on rendering, start-up of the integrator included, time in `watch` and after
    /// [`Session::run`] not; sessions before this one included.
    pub fn spent(&self) -> Spent {
        let mut spent = self.paused.unwrap_or_else(|| self.clock.spent()) - self.aside;
        spent += self.before;
        spent
    }

    /// Rendering time stands still from here on.
    fn pause(&mut self) {
        self.paused = Some(self.clock.spent());
    }

    /// Rendering time runs again.
    fn unpause(&mut self) {
        if let Some(at) = self.paused.take() {
            self.aside += self.clock.spent() - at;
        }
    }

    /// How many steps are made before anybody looks again. One where each of them counts by itself.
    fn together(&self, budget: Option<Budget>) -> u64 {
        let alone = self.precision.is_some() || (self.by_steps && !self.plan.shard.is_whole());
        if alone || self.own_steps == 0 {
            return 1;
        }
        let seconds = self.step_seconds().max(1e-9);
        let most = (TOGETHER / seconds) as u64;
        let left = match budget {
            Some(Budget::Samples(n)) => n.saturating_sub(self.steps),
            // By half of what is left: the last steps are single ones.
            Some(Budget::Seconds(s)) => (0.5 * (s - self.spent().seconds) / seconds) as u64,
            None => most,
        };
        most.min(left).max(1)
    }

    /// So many steps of the run; one where the error is watched.
    fn step(&mut self, count: u64) -> Result<(), IntegratorError> {
        let begun = self.clock.seconds();
        self.work += self.run.prepare(&mut self.film);
        self.start_up += self.clock.seconds() - begun;
        self.work += self.run.steps(&mut self.film, count);
        self.steps += count;
        self.own_steps += count;
        if self.by_steps && !self.plan.shard.is_whole() {
            self.run.seek(self.plan.shard.step(self.steps));
        }
        let Some(precision) = &mut self.precision else { return Ok(()) };
        if self.by_steps {
            precision.end_batch(&self.film);
            return Ok(());
        }
        let r = &mut self.replicate;
        let seconds = self.clock.seconds() - begun;
        r.steps += 1;
        match r.steps {
            1 => r.first_step = seconds,
            2 if r.length == 0 => r.length = replicate_length(r.first_step, seconds),
            _ => {}
        }
        if r.length > 0 && r.steps >= r.length {
            precision.end_batch(&self.film);
            r.index += 1;
            r.steps = 0;
            let seed = replicate_seed(self.plan.seed, r.index);
            self.run = self.plan.integrator.start(Arc::clone(self.plan.scene), seed)?;
        }
        Ok(())
    }

    /// Seconds of a step, on average.
    fn step_seconds(&self) -> f64 {
        if self.own_steps == 0 {
            return self.before.seconds / self.steps.max(1) as f64;
        }
        (self.clock.seconds() - self.aside.seconds - self.start_up) / self.own_steps as f64
    }

    /// Renders until the goal is reached (budgets are those of the whole render, see
    /// [`Shard::share_of`]) or `watch`, which is called after every few steps but the last, says to
    /// stop. True where the goal was reached; where there is an error to reach, a budget is only a
    /// limit.
    ///
    /// # Errors
    /// Where the integrator does not go on.
    pub fn run(
        &mut self,
        goal: impl Into<Goal>,
        watch: &mut dyn FnMut(&Session<'a>, &Status) -> ControlFlow<()>,
    ) -> Result<bool, IntegratorError> {
        self.goal = goal.into();
        self.complete = false;
        let Goal { budget, error: target } = self.goal;
        let budget = budget.map(|b| self.plan.shard.share_of(b));
        if target.is_some() {
            self.watch_error();
        }
        self.unpause();
        let done = self.go_on(budget, target, watch);
        self.pause();
        self.complete = matches!(done, Ok(true));
        done
    }

    fn go_on(
        &mut self,
        budget: Option<Budget>,
        target: Option<f64>,
        watch: &mut dyn FnMut(&Session<'a>, &Status) -> ControlFlow<()>,
    ) -> Result<bool, IntegratorError> {
        loop {
            let seconds = self.spent().seconds;
            let error = self.error();
            if let (Some(target), Some(error)) = (target, error)
                && error.high <= target
            {
                return Ok(true);
            }
            let is_spent = |b: Budget| b.is_spent(self.steps, seconds, self.step_seconds());
            if self.steps > 0 && budget.is_some_and(is_spent) {
                return Ok(target.is_none());
            }
            if self.own_steps > 0 {
                // The error falls with the root of the samples.
                let near = target.zip(error).map_or(0.0, |(t, e)| (t / e.high).powi(2).min(1.0));
                let used = budget.map_or(0.0, |b| b.used(self.steps, seconds));
                let status = Status {
                    steps: self.steps,
                    samples_per_pixel: self.film.samples_per_pixel(),
                    seconds,
                    used: used.max(near),
                };
                self.pause();
                let flow = watch(self, &status);
                self.unpause();
                if flow.is_break() {
                    return Ok(false);
                }
            }
            self.step(self.together(budget))?;
        }
    }

    /// Ends the render.
    pub fn finish(self) -> Exposure {
        let (spent, complete) = (self.spent(), self.complete);
        Exposure { film: self.film, steps: self.steps, work: self.work, spent, complete }
    }
}

fn replicate_seed(seed: u64, index: u64) -> u64 {
    if index == 0 { seed } else { derive_seed(derive_seed(seed, REPLICATES), index) }
}

/// Steps of a replicate of which the first one took so many seconds, and the second one so many.
fn replicate_length(first: f64, second: f64) -> u64 {
    let start = (first - second).max(0.0);
    let steps = (start / second.max(1e-9) * (1.0 / START_SHARE - 1.0)).ceil();
    // `as` saturates.
    (steps as u64).clamp(*REPLICATE_STEPS.start(), *REPLICATE_STEPS.end())
}

#[cfg(test)]
mod tests;
