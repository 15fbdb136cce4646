//! Deliberate bugs, to test the tests: what a validation suite is worth is how many of them it finds.
//!
//! A [`Mutant`] is a mistake that somebody has made, at the one line where it would be made. [`switch`] turns one on for the whole process. The
//! hooks are there only with the crate's feature `mutants`; without it [`is_on`] is the constant `false` and nothing of them is
//! compiled.

#[cfg(feature = "mutants")]
use std::sync::atomic::{AtomicU8, Ordering};

macro_rules! mutants {
    ($($(#[doc = $doc:literal])* $name:ident = $text:literal,)*) => {
        /// A deliberate bug.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        #[repr(u8)]
        pub enum Mutant {
            $($(#[doc = $doc])* $name,)*
        }

        impl Mutant {
            /// Every mutant.
            pub const ALL: &[Mutant] = &[$(Mutant::$name,)*];

            /// Short name: `no-cosine-at-light`.
            pub fn name(self) -> &'static str {
                match self {
                    $(Mutant::$name => $text,)*
                }
            }
        }
    };
}

mutants! {
    /// p_A = p_ω/d² for a light sampled by solid angle: the cosine at the light is missing in what is divided by.
    CosineAtLight = "no-cosine-at-light",
    /// The same in the weights of `pt` alone, in both techniques alike: unbiased, only noisier.
    CosineInWeights = "no-cosine-in-weights",
    /// `bdpt` does not divide by the probability to survive roulette.
    RouletteUndivided = "roulette-not-divided",
    /// Densities of `bdpt` against the walk leave roulette out.
    RouletteForwardOnly = "roulette-forward-only",
    /// Refracted radiance is not compressed by 1/η².
    RadianceUncompressed = "radiance-not-compressed",
    /// Refracted importance is compressed by 1/η².
    ImportanceCompressed = "importance-compressed",
    /// The weights of `bdpt` forget the technique with one sensor vertex less.
    TechniqueForgotten = "technique-forgotten",
    /// Next-event estimation of `bdpt` gives light from delta emitters full weight, as if nothing else made these paths.
    DeltaLightTwice = "delta-light-twice",
    /// The environment is sampled uniformly in θ with the density of uniform directions.
    EnvironmentSine = "environment-without-sine",
    /// Light walks take f|ω·n_s| towards where they go, as walks from the sensor do: the adjoint factor of shading normals is left out.
    ShadingAdjoint = "no-shading-adjoint",
    /// Replicates of a validation share a seed.
    SharedSeed = "shared-seed",
    /// The lobe of a dielectric is picked at random and not divided by its probability.
    LobeProbability = "no-lobe-probability",
    /// Total internal reflection absorbs.
    TotalReflection = "total-reflection-absorbed",
    /// Some contributions are NaN, and the film drops them in silence.
    NanDropped = "nan-dropped",
    /// `lt` scales its splats by the share of the crop window.
    CropScale = "crop-scales-splats",
    /// Area lights emit uniformly, with the density of the cosine.
    UniformEmission = "uniform-emission",
    /// A mirrored transform turns the emitting side of flat shapes.
    MirroredSide = "mirror-turns-emitter",
    /// `mmlt` forgets the number of techniques that it picked one of.
    Multiplexing = "no-multiplexing-factor",
    /// `mlt` leaves T(y→x)/T(x→y) out of the acceptance.
    ProposalAsymmetry = "no-proposal-asymmetry",
    /// A chain that stays where it is adds nothing.
    RejectedDropped = "rejected-state-dropped",
    /// b̂ is taken from shorter paths than the chains walk over.
    OtherLengths = "b-of-other-lengths",
    /// b̂ is taken from another bootstrap than the starts.
    IndependentB = "independent-b",
    /// Chains of path lengths that have more or fewer chains than their share all count the same.
    ChainWeight = "no-chain-weight",
    /// Large steps are weighted as if there were no small ones.
    LargeStepWeight = "large-step-weight",
    /// `rjmlt` leaves the Jacobian of a jump out of the acceptance.
    JumpJacobian = "no-jump-jacobian",
    /// A lazily mutated vector keeps the moves of a proposal that was rejected.
    RejectedKept = "rejected-move-kept",
    /// A lazily mutated vector dates what a move has read one move too early.
    LazyTime = "lazy-time-off-by-one",
}

#[cfg(feature = "mutants")]
static ON: AtomicU8 = AtomicU8::new(u8::MAX);

/// Turns one mutant on for the whole process, or all off. False, and nothing done, where the build has none.
pub fn switch(mutant: Option<Mutant>) -> bool {
    #[cfg(feature = "mutants")]
    ON.store(mutant.map_or(u8::MAX, |m| m as u8), Ordering::SeqCst);
    #[cfg(not(feature = "mutants"))]
    let _ = mutant;
    cfg!(feature = "mutants")
}

/// True where this mutant is on; a constant without the feature.
#[inline(always)]
pub fn is_on(mutant: Mutant) -> bool {
    #[cfg(feature = "mutants")]
    return ON.load(Ordering::Relaxed) == mutant as u8;
    #[cfg(not(feature = "mutants"))]
    {
        let _ = mutant;
        false
    }
}

/// `right`, or `wrong` of it where the mutant is on.
#[inline(always)]
pub fn swap<T>(mutant: Mutant, right: T, wrong: impl FnOnce(T) -> T) -> T {
    if is_on(mutant) { wrong(right) } else { right }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_different() {
        let mut names: Vec<_> = Mutant::ALL.iter().map(|m| m.name()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), Mutant::ALL.len());
    }

    #[cfg(not(feature = "mutants"))]
    #[test]
    fn an_ordinary_build_has_no_mutants() {
        assert!(!switch(Some(Mutant::CosineAtLight)));
        assert!(!is_on(Mutant::CosineAtLight));
    }
}
