//! Multiplexed Metropolis light transport (Hachisuka, Kaplanyan and Dachsbacher 2014).
//!
//! A chain of path length k walks the primary sample space of bidirectional path tracing with one
//! coordinate more, that selects the technique (s, t), s + t = k + 1. One point is one path, by one
//! technique; its contribution n_k w_{s,t} f/p_{s,t}, with n_k the number of techniques, has the
//! same integral as all techniques together. The chain finds techniques in proportion to what they
//! contribute.
//!
//! The bootstrap does not draw one technique at a time, as the paper does: it makes every technique
//! of a pair of subpaths ([`Bdpt::estimate_every`]), each of which is a point of one of these
//! spaces. b̂ then has the variance of bidirectional path tracing instead of one many times as
//! large.

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::film::{Contribution, Families, Sink};
use pathspace_core::integrator::{Integrator, IntegratorError, Run, State};
use pathspace_core::path::{PathRecord, Technique};
use pathspace_core::random::{PrimarySample, RandomStream, Stream, coordinate_between};

use crate::bdpt::{Bdpt, TechniqueNumbers};
use crate::chain::{Candidate, Candidates, ChainRun, ImageWeight, film_key};
use crate::primary::{Integrand, PrimaryOptions, PrimaryTarget};
use crate::spec::{Defaults, Options, Spec, SpecError};

/// Name in the registry.
pub const NAME: &str = "mmlt";

/// Multiplexed Metropolis light transport.
#[derive(Clone, Debug)]
pub struct Mmlt {
    /// Its paths.
    pub techniques: Multiplexed,
    /// Its chains.
    pub options: PrimaryOptions,
    spec: String,
}

impl Mmlt {
    /// From options: `heuristic`, `s`, `t`, `max_depth`; `lengths` = chain | step, whether a large
    /// step draws the length anew, and `continue`, the ratio of the probabilities of lengths k + 1
    /// and k then; `mis`, which needs that; and those of [`PrimaryOptions::from_options`].
    ///
    /// # Errors
    /// Where an option is unknown or its value out of range.
    pub fn from_spec(spec: &Spec, defaults: &Defaults) -> Result<Self, SpecError> {
        let mut options = spec.options();
        let mmlt = Mmlt::from_options(&mut options, defaults)?;
        options.finish()?;
        Ok(Mmlt { spec: spec.to_string(), ..mmlt })
    }

    /// The same for an integrator that has options beside those.
    pub(crate) fn from_options(
        options: &mut Options<'_>,
        defaults: &Defaults,
    ) -> Result<Self, SpecError> {
        let redraw = options.choice("lengths", &[("chain", false), ("step", true)])?;
        let mis = options.boolean("mis", false)?;
        if mis && !redraw {
            return Err(options.bad("mis", "true", "false, or lengths=step"));
        }
        let chain = PrimaryOptions::from_options(options)?;
        Ok(Mmlt {
            techniques: Multiplexed::from_options(options, defaults)?,
            options: PrimaryOptions { mis, redraw, ..chain },
            spec: NAME.to_owned(),
        })
    }
}

impl Integrator for Mmlt {
    fn name(&self) -> &str {
        NAME
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn families(&self, scene: &Scene) -> Families {
        self.techniques.bdpt.families(scene)
    }

    fn sees_media(&self) -> bool {
        true
    }

    fn resume(
        &self,
        scene: Arc<Scene>,
        seed: u64,
        state: &State,
    ) -> Result<Box<dyn Run>, IntegratorError> {
        let target = PrimaryTarget::new(self.techniques.clone(), self.options);
        let run = ChainRun::resume(NAME, target, scene, seed, state, self.options.chain)?;
        Ok(Box::new(run))
    }
}

/// All techniques of one path length as one integrand; the parts are the lengths.
#[derive(Clone, Debug)]
pub struct Multiplexed {
    /// The techniques, without roulette: the length is given.
    pub bdpt: Bdpt,
    /// Probability of length k + 1 over that of length k.
    pub ratio: f64,
}

impl Multiplexed {
    /// From options: those of bdpt but `connect` and `roulette`, and `continue`.
    ///
    /// # Errors
    /// [`SpecError::BadValue`].
    pub fn from_options(options: &mut Options<'_>, defaults: &Defaults) -> Result<Self, SpecError> {
        let ratio = options.number("continue", 0.9, 0.01..=0.99)?;
        Ok(Multiplexed { bdpt: Bdpt::for_chains(options, defaults)?, ratio })
    }

    /// The coordinate that selects the technique.
    pub const SELECTOR: (Stream, usize) = (Stream::Connection, 0);

    /// A value of the selector for the techniques with s emitter-side vertices, any of them by the
    /// uniform number `u`.
    pub fn select(scene: &Scene, k: u16, s: usize, u: f32) -> Option<f32> {
        let (count, s) = (f64::from(Multiplexed::count(scene, k)), s as f64);
        coordinate_between(s / count, (s + 1.0) / count, u)
    }

    /// Number of techniques of paths with k edges: s = 0 … k + 1, without t = 0 where the sensor is
    /// a pinhole.
    pub fn count(scene: &Scene, k: u16) -> u32 {
        u32::from(k) + if scene.sensor().is_pinhole() { 1 } else { 2 }
    }

    /// 1 − ratio^K, the sum of the unnormalised probabilities.
    fn total(&self) -> f64 {
        self.bdpt.max_length.map_or(1.0, |k| 1.0 - self.ratio.powf(k.into()))
    }
}

impl Integrand for Multiplexed {
    fn part(&self, u: &mut RandomStream) -> (u16, f64) {
        let x = u.next() as f64 + u.next() as f64 / 16_777_216.0;
        // Inversion of 1 − ratio^k.
        let k = 1.0 + ((1.0 - x * self.total()).ln() / self.ratio.ln()).floor();
        let most = self.bdpt.max_length.unwrap_or(u32::from(u16::MAX / 4));
        let k = k.clamp(1.0, f64::from(most.max(1))) as u16;
        (k, self.probability(k))
    }

    fn probability(&self, k: u16) -> f64 {
        (1.0 - self.ratio) * self.ratio.powi(i32::from(k) - 1) / self.total()
    }

    fn evaluate<U: PrimarySample, S: Sink>(&self, scene: &Scene, k: u16, u: &mut U, sink: &mut S) {
        if self.bdpt.max_length == Some(0) {
            return;
        }
        let count = Multiplexed::count(scene, k);
        u.stream(Stream::Connection);
        let s = (u.next() as f64 * f64::from(count)) as usize;
        let technique = Technique::new(s, usize::from(k) + 1 - s);
        let mut sink = Times { sink, factor: count as f32 };
        self.bdpt.estimate_technique(scene, technique, u, &mut sink);
    }

    /// Every technique of one pair of subpaths, one candidate for each length.
    fn candidates(
        &self,
        scene: &Scene,
        u: &mut RandomStream,
        scalar: impl Fn(&Contribution) -> f64,
        found: &mut Candidates,
    ) {
        if self.bdpt.max_length == Some(0) {
            return;
        }
        let (seed, _) = pair(u);
        self.bdpt.estimate_every(scene, seed, |c, survival| {
            let (k, s) = (c.length(), c.s);
            let candidate = Candidate {
                weight: scalar(&c) / survival,
                key: film_key(scene, k, c.film),
                index: u32::from(k) << 16 | u32::from(s),
            };
            found.merge(candidate, u.next());
        });
    }

    fn start(
        &self,
        scene: &Scene,
        u: &mut RandomStream,
        index: u32,
    ) -> (u16, Box<dyn PrimarySample>) {
        let (seed, select) = pair(u);
        let (k, s) = ((index >> 16) as u16, (index & 0xffff) as usize);
        let technique = Technique::new(s, usize::from(k) + 1 - s);
        // Every interval holds coordinates: techniques are far fewer than 2²⁴.
        let selector = Multiplexed::select(scene, k, s, select).unwrap_or(0.0);
        let numbers = TechniqueNumbers::new(seed, technique, selector);
        (k, Box::new(numbers))
    }

    fn image_weight(&self, scene: &Scene, seed: u64, samples: u64) -> ImageWeight {
        // Without a given length walks need roulette.
        let mut bdpt = self.bdpt.clone();
        bdpt.roulette = true;
        ImageWeight::pilot(scene, &bdpt, seed, samples)
    }
}

/// A pair of subpaths, by 48 bits, and the number that places the selector of a start within its
/// technique.
fn pair(u: &mut RandomStream) -> (u64, f32) {
    let mut bits = || (f64::from(u.next()) * f64::from(1 << 24)) as u64;
    (bits() << 24 | bits(), u.next())
}

/// Multiplies values by the inverse probability of the technique.
struct Times<'a, S> {
    sink: &'a mut S,
    factor: f32,
}

impl<S: Sink> Sink for Times<'_, S> {
    const RECORDS_PATHS: bool = S::RECORDS_PATHS;

    fn add(&mut self, c: Contribution) {
        self.sink.add(Contribution { value: c.value * self.factor, ..c });
    }

    fn record(&mut self, record: PathRecord) {
        self.sink.record(record);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pathspace_core::random::Address;

    fn lengths(spec: &str) -> Multiplexed {
        Mmlt::from_spec(&spec.parse().unwrap(), &Defaults::default()).unwrap().techniques
    }

    #[test]
    fn lengths_are_drawn_with_their_probability() {
        for spec in ["mmlt", "mmlt:max_depth=3", "mmlt:max_depth=1", "mmlt:continue=0.5"] {
            let techniques = lengths(spec);
            let n = 100_000;
            let mut counts = [0.0; 12];
            for item in 0..n {
                let mut u = RandomStream::new(Address { seed: 1, step: 0, item });
                let (k, p) = techniques.part(&mut u);
                assert_eq!(p, techniques.probability(k));
                if let Some(count) = counts.get_mut(k as usize) {
                    *count += 1.0;
                }
            }
            let most = techniques.bdpt.max_length.unwrap_or(11) as u16;
            for k in 1..=most {
                let expected = n as f64 * techniques.probability(k);
                let sd = expected.sqrt();
                assert!((counts[k as usize] - expected).abs() < 5.0 * sd, "{spec}: {counts:?}");
            }
        }
    }

    #[test]
    fn weighting_large_steps_needs_lengths_that_they_draw() {
        let spec = |text: &str| Mmlt::from_spec(&text.parse().unwrap(), &Defaults::default());
        assert!(spec("mmlt:mis=true").is_err());
        assert!(spec("mmlt:mis=true,lengths=step").is_ok());
    }
}
