//! The chain on primary sample space, whatever is integrated over it.

use pathspace_core::Scene;
use pathspace_core::description::Crop;
use pathspace_core::film::{Contribution, Sink};
use pathspace_core::random::{Address, PrimarySample, RandomStream, Stream, derive_seed};
use rayon::prelude::*;

use super::state::{PrimaryPoint, PrimaryState};
use super::{Kernel, Moving, Place, PrimaryVector, Recorder};
use crate::chain::rounds::Rounds;
use crate::chain::{
    Candidate, Candidates, ChainOptions, ChainTarget, ImageWeight, Proposal, Reader, Writer,
    film_key,
};
use crate::spec::{Options, SpecError};

/// An integrand on one or several cubes [0, 1)^∞, called parts (path lengths, say).
pub trait Integrand: Send + Sync + 'static {
    /// Draws a part and says with which probability.
    fn part(&self, u: &mut RandomStream) -> (u16, f64);

    /// Probability of a part.
    fn probability(&self, part: u16) -> f64;

    /// Emits the contributions of one point of a part, for the whole crop window.
    fn evaluate<U: PrimarySample, S: Sink>(
        &self,
        scene: &Scene,
        part: u16,
        u: &mut U,
        sink: &mut S,
    );

    /// The candidates of a bootstrap sample, by the f* of their contributions (NaN where one is not
    /// finite). Here: one point of one part.
    fn candidates(
        &self,
        scene: &Scene,
        u: &mut RandomStream,
        scalar: impl Fn(&Contribution) -> f64,
        found: &mut Candidates,
    ) {
        let (part, probability) = self.part(u);
        let mut list = Vec::new();
        self.evaluate(scene, part, u, &mut List(&mut list));
        let w: f64 = list.iter().map(&scalar).sum();
        let film = list.first().map_or(glam::Vec2::ZERO, |c| c.film);
        let key = film_key(scene, part, film);
        found.add(Candidate { weight: w / probability, key, index: 0 });
    }

    /// The part and the numbers of a candidate, by those of its sample.
    fn start(
        &self,
        _scene: &Scene,
        u: &mut RandomStream,
        _index: u32,
    ) -> (u16, Box<dyn PrimarySample>) {
        (self.part(u).0, Box::new(u.clone()))
    }

    /// A coordinate that small steps leave alone because jumps change it; `None` for an integrand
    /// without jumps.
    fn held(&self) -> Option<(Stream, usize)> {
        None
    }

    /// Proposes other coordinates of the same part for what x stands for; writes them to `y`. An
    /// integrand without jumps always stays.
    fn jump(
        &self,
        _scene: &Scene,
        _x: &mut PrimaryPoint,
        _y: &mut PrimaryVector,
        _u: &mut RandomStream,
    ) -> Jump {
        Jump::Stays
    }

    /// An image for the two-stage target.
    fn image_weight(&self, scene: &Scene, seed: u64, samples: u64) -> ImageWeight;
}

/// What came of a jump ([`Integrand::jump`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Jump {
    /// There is nowhere to go, or the choice fell on where the chain is.
    Stays,
    /// No coordinates were found, or those found do not lead back: counted as a move of its own.
    Lost,
    /// A point was found.
    To {
        /// What the point contributes.
        contribution: Contribution,
        /// |∂u′/∂u| T(y→x)/T(x→y): the ratio of f* times this is the ratio of Metropolis, Hastings and Green (Green 1995).
        factor: f64,
    },
}

/// How a chain moves through primary sample space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrimaryOptions {
    /// Probability of a large step.
    pub large: f64,
    /// Probability of a jump, for integrands that have them.
    pub jump: f64,
    /// Small steps.
    pub kernel: Kernel,
    /// Large steps draw the part anew; else a chain stays in the part that it starts in.
    pub redraw: bool,
    /// Large steps are also used as independent samples, weighted against the chain's own (Kelemen
    /// et al. 2002, §5). With several parts it needs `redraw`, because how many chains a part has
    /// follows from the bootstrap and not from its probability.
    pub mis: bool,
    /// Film positions of large steps are stratified across chains.
    pub stratify: bool,
    /// The target is luminance over a pilot image.
    pub two_stage: bool,
    /// The chains.
    pub chain: ChainOptions,
}

impl PrimaryOptions {
    /// From options: `large`, `kernel` (`s1`, `s2`, `sigma`), `stratify`, `target` = luminance |
    /// two-stage, and those of [`ChainOptions::from_options`]. `jump`, `mis` and `redraw` are left
    /// to the integrator.
    ///
    /// # Errors
    /// [`SpecError::BadValue`].
    pub fn from_options(options: &mut Options<'_>) -> Result<Self, SpecError> {
        let large = options.number("large", 0.3, 0.0..=1.0)?;
        options.used_if("stratify", large > 0.0, "large steps")?;
        Ok(PrimaryOptions {
            large,
            jump: 0.0,
            kernel: Kernel::from_options(options)?,
            redraw: true,
            mis: false,
            stratify: options.boolean("stratify", false)?,
            two_stage: options.choice("target", &[("luminance", false), ("two-stage", true)])?,
            chain: ChainOptions::from_options(options)?,
        })
    }
}

/// Names of the moves, in the order of their kinds; the last two only where there are jumps.
pub const KINDS: [&str; 4] = ["large step", "small step", "jump", "lost jump"];

/// Fewest and most samples of the pilot.
const PILOT: std::ops::RangeInclusive<u64> = 64..=65_536;

/// The chain's target: f* of an [`Integrand`] over its parts.
#[derive(Clone, Debug)]
pub struct PrimaryTarget<I> {
    integrand: I,
    options: PrimaryOptions,
    image: Option<ImageWeight>,
    /// ∫f* by the pilot: only shares samples out between the two estimators of
    /// [`PrimaryOptions::mis`], so that it need not be exact; but b̂ itself in its place would
    /// correlate with the starts.
    pilot_b: f64,
}

impl<I: Integrand> PrimaryTarget<I> {
    /// The target of `integrand`.
    pub fn new(integrand: I, options: PrimaryOptions) -> Self {
        PrimaryTarget { integrand, options, image: None, pilot_b: 0.0 }
    }

    /// The integrand.
    pub fn integrand(&self) -> &I {
        &self.integrand
    }

    /// Evaluates a point whose coordinates `u` gives; the contribution that is not finite, if there
    /// is one.
    pub(crate) fn evaluate<U: PrimarySample>(
        &self,
        scene: &Scene,
        part: u16,
        u: &mut U,
        into: (&mut Vec<Contribution>, &mut f64),
    ) -> Option<Contribution> {
        self.collect(into, |sink| self.integrand.evaluate(scene, part, u, sink))
    }

    /// f* of one contribution; NaN where it is not finite.
    fn scalar(&self, c: &Contribution) -> f64 {
        if !(c.value.is_finite() && c.film.is_finite()) {
            return f64::NAN;
        }
        let scalar = ImageWeight::luminance(c);
        self.image.as_ref().map_or(scalar, |image| scalar * image.at(c.film))
    }

    /// Sums f* of the contributions that `emit` makes.
    fn collect(
        &self,
        (contributions, f): (&mut Vec<Contribution>, &mut f64),
        emit: impl FnOnce(&mut Collector<'_>),
    ) -> Option<Contribution> {
        contributions.clear();
        let image = self.image.as_ref();
        let mut sink = Collector { contributions, f: 0.0, fault: None, image };
        emit(&mut sink);
        *f = sink.f;
        // Sums of finite numbers can still leave the range.
        match sink.fault {
            None if !f.is_finite() => sink.contributions.last().copied(),
            fault => fault,
        }
    }

    /// Share of the chain's samples at a point of this W = f*/p, against independent ones: balance
    /// heuristic of the densities W/b and `large`.
    fn share(&self, w: f64) -> f64 {
        if self.mixes() { 1.0 / (1.0 + self.options.large * self.pilot_b / w) } else { 1.0 }
    }

    /// f*/p of a point among all that a large step can reach.
    fn w(&self, x: &PrimaryPoint) -> f64 {
        if self.options.redraw { x.f / self.integrand.probability(x.part) } else { x.f }
    }

    fn mixes(&self) -> bool {
        self.options.mis && self.options.large > 0.0 && self.pilot_b > 0.0
    }

    fn large_step(
        &self,
        scene: &Scene,
        x: &mut PrimaryState,
        mut y: Box<PrimaryPoint>,
        u: &mut RandomStream,
    ) -> Proposal<PrimaryState> {
        let stratified = x.place.next(u);
        let (part, probability) =
            if self.options.redraw { self.integrand.part(u) } else { (x.point.part, 1.0) };
        y.part = part;
        let mut moving = Moving::large(&mut x.point.vector, &mut y.vector, u);
        if let Some(film) = stratified {
            moving.set(Stream::Sensor, 0, film[0]);
            moving.set(Stream::Sensor, 1, film[1]);
        }
        let fault = self.evaluate(scene, part, &mut moving, (&mut y.contributions, &mut y.f));
        let (w_x, w_y) = (self.w(&x.point), y.f / probability);
        let share_x = self.share(w_x);
        if fault.is_some() || y.f == 0.0 {
            x.spare = Some(y);
            return Proposal { weight_current: share_x, nonfinite: fault, ..Proposal::rejected(0) };
        }
        let share_y = self.share(w_y);
        let state = PrimaryState { point: y, place: x.place, spare: None };
        let proposal = Proposal::new(state, w_y / w_x, 0);
        Proposal {
            weight_current: proposal.weight_current * share_x,
            weight_proposed: proposal.weight_proposed * share_y,
            weight_independent: if self.mixes() { self.pilot_b * share_y } else { 0.0 },
            ..proposal
        }
    }

    fn small_step(
        &self,
        scene: &Scene,
        x: &mut PrimaryState,
        mut y: Box<PrimaryPoint>,
        u: &mut RandomStream,
    ) -> Proposal<PrimaryState> {
        y.part = x.point.part;
        let mut moving = Moving::small(&mut x.point.vector, &mut y.vector, self.options.kernel, u);
        if let Some((stream, index)) = self.integrand.held() {
            moving.hold(stream, index);
        }
        let fault = self.evaluate(scene, y.part, &mut moving, (&mut y.contributions, &mut y.f));
        self.judge(x, y, fault, 1.0, 1)
    }

    fn jump(
        &self,
        scene: &Scene,
        x: &mut PrimaryState,
        mut y: Box<PrimaryPoint>,
        u: &mut RandomStream,
    ) -> Proposal<PrimaryState> {
        y.part = x.point.part;
        y.contributions.clear();
        y.f = 0.0;
        let jump = self.integrand.jump(scene, &mut x.point, &mut y.vector, u);
        let (kind, factor, fault) = match jump {
            Jump::Stays => (2, 0.0, None),
            Jump::Lost => (3, 0.0, None),
            Jump::To { contribution, factor } => {
                let into = (&mut y.contributions, &mut y.f);
                let fault = self.collect(into, |sink| sink.add(contribution));
                (2, factor, fault)
            }
        };
        self.judge(x, y, fault, factor, kind)
    }

    /// The proposal y from x of a move that depends on x; a = `factor` f*(y)/f*(x).
    fn judge(
        &self,
        x: &mut PrimaryState,
        y: Box<PrimaryPoint>,
        fault: Option<Contribution>,
        factor: f64,
        kind: u8,
    ) -> Proposal<PrimaryState> {
        let share_x = self.share(self.w(&x.point));
        if fault.is_some() || y.f == 0.0 {
            x.spare = Some(y);
            return Proposal {
                weight_current: share_x,
                nonfinite: fault,
                ..Proposal::rejected(kind)
            };
        }
        let share_y = self.share(self.w(&y));
        let acceptance = factor * (y.f / x.point.f);
        let state = PrimaryState { point: y, place: x.place, spare: None };
        let proposal = Proposal::new(state, acceptance, kind);
        Proposal {
            weight_current: proposal.weight_current * share_x,
            weight_proposed: proposal.weight_proposed * share_y,
            ..proposal
        }
    }
}

impl<I: Integrand> ChainTarget for PrimaryTarget<I> {
    type State = PrimaryState;

    fn kinds(&self) -> Vec<String> {
        let count = if self.options.jump > 0.0 { 4 } else { 2 };
        KINDS[..count].iter().map(|&kind| kind.to_owned()).collect()
    }

    fn prepare(&mut self, scene: &Scene, seed: u64) {
        let Crop { width, height, .. } = scene.film().crop;
        let rounds = Rounds::new(&self.options.chain, u64::from(width) * u64::from(height));
        let samples = rounds.at(0).samples.clamp(*PILOT.start(), *PILOT.end());
        if self.options.two_stage {
            let seed = derive_seed(seed, 0);
            self.image = Some(self.integrand.image_weight(scene, seed, samples));
        }
        if self.options.mis && self.options.large > 0.0 {
            let seed = derive_seed(seed, 1);
            let target = &*self;
            let batches: Vec<f64> = (0..samples / 64)
                .into_par_iter()
                .map(|batch| {
                    let weight = |item| {
                        let mut u = RandomStream::new(Address { seed, step: 0, item });
                        let mut found = Candidates::default();
                        target.candidates(scene, &mut u, &mut found);
                        found.total()
                    };
                    let finite = |w: &f64| w.is_finite();
                    (batch * 64..(batch + 1) * 64).map(weight).filter(finite).sum()
                })
                .collect();
            self.pilot_b = batches.iter().sum::<f64>() / (64 * batches.len()) as f64;
        }
    }

    /// One point of one part, drawn as a large step draws it: W = f*/p of the point alone.
    fn bootstrap(&self, scene: &Scene, u: &mut RandomStream) -> Option<(PrimaryState, f64)> {
        let (part, probability) = self.integrand.part(u);
        let mut point = Box::new(PrimaryPoint { part, ..PrimaryPoint::default() });
        let mut recorder = Recorder::new(&mut point.vector, u);
        let fault =
            self.evaluate(scene, part, &mut recorder, (&mut point.contributions, &mut point.f));
        let w = if fault.is_some() { f64::NAN } else { point.f / probability };
        (w != 0.0).then(|| (PrimaryState { point, place: Place::default(), spare: None }, w))
    }

    fn candidates(&self, scene: &Scene, u: &mut RandomStream, found: &mut Candidates) {
        self.integrand.candidates(scene, u, |c| self.scalar(c), found);
    }

    fn start(&self, scene: &Scene, u: &mut RandomStream, index: u32) -> Option<PrimaryState> {
        let (part, mut numbers) = self.integrand.start(scene, u, index);
        let mut point = Box::new(PrimaryPoint { part, ..PrimaryPoint::default() });
        let mut recorder = Recorder::new(&mut point.vector, &mut *numbers);
        self.evaluate(scene, part, &mut recorder, (&mut point.contributions, &mut point.f));
        Some(PrimaryState { point, place: Place::default(), spare: None })
    }

    fn place(&self, x: &mut PrimaryState, scene: &Scene, chain: u64, chains: u64, seed: u64) {
        if self.options.stratify {
            let crop = scene.film().crop;
            x.place = Place::new(chain, chains, seed, [crop.width, crop.height]);
        }
    }

    fn propose(
        &self,
        scene: &Scene,
        x: &mut PrimaryState,
        u: &mut RandomStream,
    ) -> Proposal<PrimaryState> {
        let y = x.spare.take().unwrap_or_default();
        let choice = u.next() as f64;
        if choice < self.options.large {
            self.large_step(scene, x, y, u)
        } else if choice < self.options.large + self.options.jump {
            self.jump(scene, x, y, u)
        } else {
            self.small_step(scene, x, y, u)
        }
    }

    fn recycle(&self, x: &mut PrimaryState, unused: PrimaryState) {
        x.spare = Some(unused.point);
    }

    fn splat<S: Sink>(&self, _: &Scene, x: &PrimaryState, weight: f64, sink: &mut S) {
        // In f64: f* may be smaller than any f32.
        let scale = weight / x.point.f;
        for c in &x.point.contributions {
            sink.add(Contribution { value: c.value.map(|v| (v as f64 * scale) as f32), ..*c });
        }
    }

    fn encode(&self, x: &PrimaryState, w: &mut Writer) {
        x.encode(w);
    }

    fn decode(&self, _: &Scene, r: &mut Reader<'_>) -> Option<PrimaryState> {
        PrimaryState::decode(r)
    }
}

/// Keeps contributions.
struct List<'a>(&'a mut Vec<Contribution>);

impl Sink for List<'_> {
    fn add(&mut self, c: Contribution) {
        self.0.push(c);
    }
}

/// Keeps contributions and sums their f*.
struct Collector<'a> {
    contributions: &'a mut Vec<Contribution>,
    f: f64,
    fault: Option<Contribution>,
    image: Option<&'a ImageWeight>,
}

impl Sink for Collector<'_> {
    #[inline]
    fn add(&mut self, c: Contribution) {
        if !(c.value.is_finite() && c.film.is_finite()) {
            self.fault = Some(c);
            return;
        }
        if c.value.is_black() {
            return;
        }
        let scalar = ImageWeight::luminance(&c);
        self.f += self.image.map_or(scalar, |image| scalar * image.at(c.film));
        self.contributions.push(c);
    }
}
