//! Which mutant is hunted where, and with how much work.

use pathspace_core::mutant::Mutant;

/// A test and the mutant that it must find.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hunt {
    /// The bug.
    pub mutant: Mutant,
    /// The test.
    pub level: Level,
}

/// A test of one level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Level {
    /// L0: weights of this many paths of a library scene by an integrator against the oracle.
    Oracle {
        /// The scene.
        scene: &'static str,
        /// A path tracer with its options.
        integrator: &'static str,
        /// Samples.
        samples: u64,
    },
    /// L2: an integrator against an exact scene.
    Exact {
        /// Name of the exact scene.
        scene: &'static str,
        /// The integrator.
        integrator: &'static str,
        /// Replicates.
        replicates: usize,
        /// Rays in the first round.
        rays: u64,
        /// Turn flat emitters over by a transform that mirrors, so that all is dark.
        mirrored: bool,
    },
    /// L4: a chain of one kind of mutation on a library scene, by the tests of [`crate::chains`].
    Chain {
        /// The scene.
        scene: &'static str,
        /// What is mutated, with its options.
        chain: Chain,
        /// Bootstrap samples that each test starts from in the first round.
        starts: u64,
    },
    /// L3: two integrators on a library scene.
    Pair {
        /// The scene.
        scene: &'static str,
        /// The integrators.
        integrators: [&'static str; 2],
        /// Rays of each in the first round.
        rays: u64,
        /// Render a part of the film only.
        cropped: bool,
    },
}

/// A chain that is tested by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chain {
    /// Numbers of path tracing, Kelemen's kernel.
    Primary,
    /// Whole paths, bidirectional mutation.
    PathSpace,
    /// Numbers of bidirectional path tracing, jumps between techniques most of the time.
    Jumps,
}

impl Level {
    /// `L0`, `L2`, `L3` or `L4`.
    pub fn name(&self) -> &'static str {
        match self {
            Level::Oracle { .. } => "L0",
            Level::Exact { .. } => "L2",
            Level::Pair { .. } => "L3",
            Level::Chain { .. } => "L4",
        }
    }

    /// What is looked at, in words.
    pub fn subject(&self) -> String {
        match self {
            Level::Oracle { scene, integrator, samples } => {
                format!("{integrator} on {scene}, {samples} samples")
            }
            Level::Exact { scene, integrator, rays, .. } => {
                format!("{integrator} on {scene}, {:.1e} rays", *rays as f64)
            }
            Level::Chain { scene, chain, starts } => {
                let chain = match chain {
                    Chain::Primary => "pssmlt over pt",
                    Chain::PathSpace => "mlt, bidirectional mutation",
                    Chain::Jumps => "rjmlt, jumps",
                };
                format!("{chain} on {scene}, {:.1e} starts", *starts as f64)
            }
            Level::Pair { scene, integrators: [a, b], rays, .. } => {
                format!("{a} and {b} on {scene}, {:.1e} rays each", *rays as f64)
            }
        }
    }
}

const fn exact(mutant: Mutant, scene: &'static str, integrator: &'static str, rays: u64) -> Hunt {
    let level = Level::Exact { scene, integrator, replicates: 32, rays, mirrored: false };
    Hunt { mutant, level }
}

const fn pair(
    mutant: Mutant,
    scene: &'static str,
    integrators: [&'static str; 2],
    rays: u64,
) -> Hunt {
    Hunt { mutant, level: Level::Pair { scene, integrators, rays, cropped: false } }
}

const fn chain(mutant: Mutant, scene: &'static str, chain: Chain, starts: u64) -> Hunt {
    Hunt { mutant, level: Level::Chain { scene, chain, starts } }
}

/// Chains of a bootstrap that short replicates can afford.
const CHAINS: &str = "pssmlt:bootstrap=256,chains=16,mis=false";
/// Chains that hardly ever take a large step, which would mend what small steps spoil.
const LOCAL: &str = "pssmlt:bootstrap=64,chains=1,mis=false,large=0.01,kernel=gaussian,sigma=0.05";
/// The same with large steps as samples of their own.
const MIXED: &str = "pssmlt:bootstrap=256,chains=16,mis=true";

/// A scene of the hunt alone.
pub(super) const COARSE_BALL: &str = "coarse ball";

/// A hunt for every mutant.
pub fn hunts() -> Vec<Hunt> {
    use Mutant::*;
    const TINY: u64 = 100_000;
    const FEW: u64 = 250_000;
    const MANY: u64 = 1_000_000;
    vec![
        exact(CosineAtLight, "sphere light", "pt", FEW),
        Hunt {
            mutant: CosineInWeights,
            level: Level::Oracle { scene: "cornell-box", integrator: "pt", samples: 2000 },
        },
        pair(RouletteUndivided, "cornell-box", ["pt", "bdpt"], FEW),
        pair(RouletteForwardOnly, "cornell-box", ["pt", "bdpt"], 2 * FEW),
        exact(RadianceUncompressed, "glass in a furnace, from inside", "pt", FEW),
        exact(ImportanceCompressed, "refractive plane", "lt", FEW),
        pair(TechniqueForgotten, "cornell-box", ["pt", "bdpt"], FEW),
        exact(DeltaLightTwice, "integrating sphere with a point light", "bdpt", TINY),
        exact(EnvironmentSine, "white corner in a furnace", "pt", FEW),
        pair(ShadingAdjoint, COARSE_BALL, ["pt", "lt"], FEW),
        pair(SharedSeed, "cornell-box", ["pt", "lt"], TINY),
        exact(LobeProbability, "glass in a furnace, from outside", "pt", FEW),
        exact(TotalReflection, "glass cube in a furnace", "pt", FEW),
        pair(NanDropped, "cornell-box", ["pt", "bdpt"], 2 * MANY),
        Hunt {
            mutant: CropScale,
            level: Level::Pair {
                scene: "cornell-box",
                integrators: ["pt", "lt"],
                rays: TINY,
                cropped: true,
            },
        },
        pair(UniformEmission, "cornell-box", ["pt", "lt"], FEW),
        Hunt {
            mutant: MirroredSide,
            level: Level::Exact {
                scene: "perpendicular rectangles",
                integrator: "pt",
                replicates: 32,
                rays: TINY,
                mirrored: true,
            },
        },
        pair(
            Multiplexing,
            "cornell-box",
            ["bdpt", "mmlt:bootstrap=256,chains=16,lengths=step"],
            FEW,
        ),
        chain(ProposalAsymmetry, "cornell-box", Chain::PathSpace, 20_000),
        pair(RejectedDropped, "cornell-box", ["bdpt", CHAINS], FEW),
        pair(OtherLengths, "cornell-box", ["bdpt", CHAINS], FEW),
        chain(IndependentB, "cornell-box", Chain::Primary, 10_000),
        pair(ChainWeight, "cornell-box", ["bdpt", "mmlt:bootstrap=256,chains=16"], FEW),
        pair(LargeStepWeight, "cornell-box", ["bdpt", MIXED], FEW),
        pair(RejectedKept, "cornell-box", ["bdpt", LOCAL], MANY),
        pair(LazyTime, "cornell-box", ["bdpt", LOCAL], 2 * MANY),
        chain(JumpJacobian, "cornell-box", Chain::Jumps, 40_000),
    ]
}
