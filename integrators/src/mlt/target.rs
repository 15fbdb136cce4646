//! The chain on path space: which mutation, and its acceptance.

use pathspace_core::Scene;
use pathspace_core::film::{Families, Sink};
use pathspace_core::random::{PrimarySample, RandomStream};

use super::mutator::Mutator;
use super::path::MltPath;
use super::start::Seeds;
use super::{codec, start};
use crate::chain::{
    Candidate, Candidates, ChainTarget, ImageWeight, Proposal, Reader, Writer, film_key,
};

/// Samples of the pilot image of a two-stage target.
const PILOT: u64 = 20_000;

/// A mutation and how often it is tried, relative to the others.
pub struct Weighted {
    /// The mutation.
    pub mutator: Box<dyn Mutator>,
    /// Its share.
    pub share: f64,
}

/// Path-space Metropolis as a chain: starts by bidirectional path tracing, moves by a mixture of
/// mutations.
pub struct PathChain {
    seeds: Seeds,
    families: Families,
    image: ImageWeight,
    two_stage: bool,
    mutators: Vec<Weighted>,
}

impl PathChain {
    /// A chain on the paths that `seeds` can make, by the mutations of positive share. `two_stage`:
    /// the target is luminance over that of a coarse pilot image instead of luminance.
    pub fn new(scene: &Scene, seeds: Seeds, two_stage: bool, mutators: Vec<Weighted>) -> Self {
        PathChain {
            families: seeds.families(scene),
            image: ImageWeight::uniform(scene),
            two_stage,
            mutators: mutators.into_iter().filter(|m| m.share > 0.0).collect(),
            seeds,
        }
    }

    /// The target density at a state, up to its norm.
    fn target(&self, x: &MltPath) -> f64 {
        x.target() * self.image.at(x.film())
    }

    /// The mutations.
    pub fn mutators(&self) -> impl Iterator<Item = &dyn Mutator> {
        self.mutators.iter().map(|m| &*m.mutator)
    }

    /// Σ of the shares of the mutations that apply to `x`.
    fn total(&self, x: &MltPath) -> f64 {
        self.mutators.iter().filter(|m| m.mutator.applies(x)).map(|m| m.share).sum()
    }

    /// Index of a mutation that applies to `x`, by the shares.
    fn pick(&self, x: &MltPath, total: f64, u: f32) -> Option<usize> {
        let mut rest = f64::from(u) * total;
        let mut picked = None;
        for (i, m) in self.mutators.iter().enumerate().filter(|(_, m)| m.mutator.applies(x)) {
            picked = Some(i);
            if rest < m.share {
                break;
            }
            rest -= m.share;
        }
        picked
    }
}

impl ChainTarget for PathChain {
    type State = MltPath;

    fn kinds(&self) -> Vec<String> {
        self.mutators().map(|m| m.name().to_owned()).collect()
    }

    fn prepare(&mut self, scene: &Scene, seed: u64) {
        if self.two_stage {
            self.image = match &self.seeds {
                Seeds::Bdpt(bdpt) => ImageWeight::pilot(scene, bdpt, seed, PILOT),
                Seeds::Pt(pt) => ImageWeight::pilot(scene, pt, seed, PILOT),
            };
        }
    }

    fn bootstrap(&self, scene: &Scene, u: &mut RandomStream) -> Option<(MltPath, f64)> {
        start::start(scene, &self.seeds, &self.image, u)
    }

    fn candidates(&self, scene: &Scene, u: &mut RandomStream, found: &mut Candidates) {
        if let Some((x, weight)) = self.bootstrap(scene, u) {
            let key = film_key(scene, x.length() as u16, x.film());
            found.add(Candidate { weight, key, index: 0 });
        }
    }

    /// a = min(1, f*(ȳ) P(ȳ) T(ȳ→x̄) / (f*(x̄) P(x̄) T(x̄→ȳ))) with P(x̄) the probability of the
    /// mutation among those that apply to x̄.
    fn propose(&self, scene: &Scene, x: &mut MltPath, u: &mut RandomStream) -> Proposal<MltPath> {
        let x = &*x;
        let total = self.total(x);
        let Some(index) = self.pick(x, total, u.next()) else { return Proposal::rejected(0) };
        let kind = index as u8;
        let mutator = &*self.mutators[index].mutator;
        let Some(candidate) = mutator.propose(scene, x, u) else { return Proposal::rejected(kind) };
        let y = &candidate.path;
        if !y.families().intersects(self.families) {
            return Proposal::rejected(kind);
        }
        if !y.target().is_finite() {
            let nonfinite = Some(start::not_finite(y));
            return Proposal { nonfinite, ..Proposal::rejected(kind) };
        }
        match mutator.ln_transition_ratio(scene, x, &candidate) {
            Some(ln_ratio) if !ln_ratio.is_nan() => {
                let f = self.target(y) / self.target(x);
                let a = f * ln_ratio.exp() * (total / self.total(y));
                Proposal::new(candidate.path, if a.is_nan() { 0.0 } else { a }, kind)
            }
            _ => Proposal::rejected(kind),
        }
    }

    fn splat<S: Sink>(&self, _: &Scene, x: &MltPath, weight: f64, sink: &mut S) {
        let scale = weight / self.target(x);
        sink.add(start::contribution(x, x.value().map(|v| v * scale)));
    }

    fn encode(&self, x: &MltPath, out: &mut Writer) {
        codec::encode(x, out);
    }

    fn decode(&self, scene: &Scene, bytes: &mut Reader<'_>) -> Option<MltPath> {
        codec::decode(scene, bytes)
    }
}
