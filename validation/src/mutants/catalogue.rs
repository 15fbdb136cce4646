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
        /// Put flat emitters there by a transform that mirrors.
        mirrored: bool,
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

impl Level {
    /// `L0`, `L2` or `L3`.
    pub fn name(&self) -> &'static str {
        match self {
            Level::Oracle { .. } => "L0",
            Level::Exact { .. } => "L2",
            Level::Pair { .. } => "L3",
        }
    }

    /// What is looked at, in words.
    pub fn subject(&self) -> String {
        match self {
            Level::Oracle { scene, integrator, samples } => {
                format!("{integrator} on {scene}, {samples} samples")
            }
            Level::Exact { scene, integrator, rays, .. } => {
                format!("{integrator} on {scene}, {:.0e} rays", *rays as f64)
            }
            Level::Pair { scene, integrators: [a, b], rays, .. } => {
                format!("{a} and {b} on {scene}, {:.0e} rays each", *rays as f64)
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

/// Chains of a bootstrap that replicates can afford.
const CHAINS: &str = "pssmlt:bootstrap=4096,chains=64";

/// A hunt for every mutant.
pub fn hunts() -> Vec<Hunt> {
    use Mutant::*;
    const FEW: u64 = 1_000_000;
    const MANY: u64 = 4_000_000;
    vec![
        exact(CosineAtLight, "sphere light", "pt", FEW),
        Hunt {
            mutant: CosineInWeights,
            level: Level::Oracle { scene: "cornell-box", integrator: "pt", samples: 2000 },
        },
        pair(RouletteUndivided, "cornell-box", ["pt", "bdpt"], FEW),
        pair(RouletteForwardOnly, "cornell-box", ["pt", "bdpt"], MANY),
        exact(RadianceUncompressed, "glass in a furnace, from inside", "pt", FEW),
        exact(ImportanceCompressed, "refractive plane", "lt", MANY),
        pair(TechniqueForgotten, "cornell-box", ["pt", "bdpt"], FEW),
        exact(DeltaLightTwice, "integrating sphere with a point light", "bdpt", FEW),
        exact(EnvironmentSine, "white corner in a furnace", "pt", MANY),
        pair(ShadingAdjoint, "smooth-shading", ["pt", "lt"], MANY),
        pair(SharedSeed, "cornell-box", ["pt", "lt"], FEW),
        pair(LobeProbability, "cornell-caustic", ["lt", "bdpt:s=0..1"], MANY),
        exact(TotalReflection, "glass cube in a furnace", "pt", FEW),
        pair(NanDropped, "cornell-box", ["pt", "bdpt"], MANY),
        Hunt {
            mutant: CropScale,
            level: Level::Pair {
                scene: "cornell-box",
                integrators: ["pt", "lt"],
                rays: FEW,
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
                rays: FEW,
                mirrored: true,
            },
        },
        pair(Multiplexing, "cornell-box", ["bdpt", "mmlt:bootstrap=4096,chains=64"], FEW),
        pair(ProposalAsymmetry, "cornell-box", ["bdpt", "mlt:bootstrap=4096,chains=64"], MANY),
        pair(RejectedDropped, "cornell-box", ["bdpt", CHAINS], FEW),
        pair(OtherLengths, "cornell-box", ["bdpt", CHAINS], FEW),
        pair(IndependentB, "cornell-box", ["bdpt", "pssmlt:bootstrap=16,chains=4"], MANY),
        pair(
            LargeStepWeight,
            "cornell-box",
            ["bdpt", "pssmlt:bootstrap=4096,chains=64,mis=true"],
            FEW,
        ),
        pair(JumpJacobian, "cornell-box", ["bdpt", "rjmlt:bootstrap=4096,chains=64,jump=0.5"], FEW),
        pair(RejectedKept, "cornell-caustic", ["bdpt", CHAINS], MANY),
    ]
}
