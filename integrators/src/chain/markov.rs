//! One chain, mutation by mutation.

use pathspace_core::Scene;
use pathspace_core::film::Sink;
use pathspace_core::random::{PrimarySample, RandomStream};

use super::{ChainTarget, Proposal};

/// How often one kind of mutation was tried and taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Mutations tried.
    pub tried: u64,
    /// Mutations that found a state with f* > 0.
    pub possible: u64,
    /// Mutations accepted.
    pub accepted: u64,
}

impl Tally {
    /// Share of the tried mutations that were accepted; 0 where none was tried.
    pub fn acceptance(&self) -> f64 {
        if self.tried > 0 { self.accepted as f64 / self.tried as f64 } else { 0.0 }
    }
}

impl std::ops::AddAssign for Tally {
    fn add_assign(&mut self, other: Tally) {
        self.tried += other.tried;
        self.possible += other.possible;
        self.accepted += other.accepted;
    }
}

/// A chain at its current state.
#[derive(Clone, Debug)]
pub struct Chain<S> {
    /// X_n.
    pub state: S,
    /// What the chain counts among the others of its run.
    pub weight: f64,
    /// Weight of the state that the sink has not seen yet: the state is splatted once, when it is
    /// left.
    owed: f64,
    /// Statistics by kind of mutation.
    pub tallies: Vec<Tally>,
}

impl<S: Clone + Send> Chain<S> {
    /// A chain of weight 1 at its start.
    pub fn new(state: S, kinds: usize) -> Self {
        Chain { state, weight: 1.0, owed: 0.0, tallies: vec![Tally::default(); kinds] }
    }

    /// The same chain with this weight.
    pub fn weighing(self, weight: f64) -> Self {
        Chain { weight, ..self }
    }

    /// One mutation, normalised by `b` times the chain's weight: proposes, splats the proposal,
    /// moves or stays. What the current state has earned is kept until it is left or
    /// [`Chain::flush`]ed.
    pub fn mutate<T: ChainTarget<State = S>>(
        &mut self,
        target: &T,
        scene: &Scene,
        b: f64,
        u: &mut RandomStream,
        sink: &mut impl Sink,
    ) -> bool {
        let b = b * self.weight;
        let proposal = target.propose(scene, &mut self.state, u);
        // Drawn always, so that numbers keep their meaning.
        let decide = u.next() as f64;
        self.count(&proposal);
        if let Some(contribution) = proposal.nonfinite {
            sink.add(contribution);
        }
        self.owed += b * proposal.weight_current;
        let Some(proposed) = proposal.state else { return false };
        let earned = b * proposal.weight_proposed + proposal.weight_independent;
        if decide < proposal.acceptance {
            self.flush(target, scene, sink);
            self.owed = earned;
            let left = std::mem::replace(&mut self.state, proposed);
            target.recycle(&mut self.state, left);
            if let Some(tally) = self.tallies.get_mut(proposal.kind as usize) {
                tally.accepted += 1;
            }
            true
        } else {
            if earned > 0.0 {
                target.splat(scene, &proposed, earned, sink);
            }
            target.recycle(&mut self.state, proposed);
            false
        }
    }

    /// Splats what the current state has earned.
    pub fn flush<T: ChainTarget<State = S>>(
        &mut self,
        target: &T,
        scene: &Scene,
        sink: &mut impl Sink,
    ) {
        if self.owed > 0.0 {
            target.splat(scene, &self.state, self.owed, sink);
        }
        self.owed = 0.0;
    }

    fn count(&mut self, proposal: &Proposal<S>) {
        if let Some(tally) = self.tallies.get_mut(proposal.kind as usize) {
            tally.tried += 1;
            tally.possible += u64::from(proposal.state.is_some());
        }
    }
}
