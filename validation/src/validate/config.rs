//! How much is rendered, and how sure a verdict has to be.

use serde::{Deserialize, Serialize};

/// Settings of [`super::validate()`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Seed of all: of the renders through [`super::seed_of`] and of the tests.
    pub seed: u64,
    /// Bound on the probability of one false *differ* or more in the whole report, shared out
    /// evenly (Bonferroni) among its pairs.
    pub alpha: f64,
    /// Replicates of each integrator in a round: 32, for chains' sake, where less is not enough.
    pub replicates: usize,
    /// Samples per pixel of a pilot replicate, and fewest of a replicate.
    pub samples: u64,
    /// Most rays that an integrator may trace in its first round on a scene, over all replicates.
    /// Rays and not seconds, so that every machine renders the same.
    pub rays: u64,
    /// The relative minimum detectable bias of the image that is wished for; an integrator goes on
    /// until it reaches it or its rays are used up.
    pub mdb: f64,
    /// An integrator that would not reach this minimum detectable bias with all of its rays gets a
    /// quarter of them: it stays inconclusive either way. None spends them all.
    #[serde(default)]
    pub hopeless: Option<f64>,
    /// Most tiles along a side of the image.
    pub tiles: usize,
    /// How a verdict is reached.
    pub stopping: StoppingRule,
}

/// How a verdict is reached while more replicates may follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum StoppingRule {
    /// Rounds of Gandy and Scott (2020): what looks suspicious is rendered again with fresh seeds,
    /// and only what fails again differs.
    Rounds {
        /// Most rounds.
        most: u32,
        /// Samples of a later round in units of those of the first.
        growth: u32,
    },
    /// The anytime-valid e-process over image and path lengths, looked at after every `batch`
    /// replicates: stops as soon as the pair differs or is resolved, at the latest after `most`
    /// replicates.
    Sequential {
        /// Replicates between two looks.
        batch: usize,
        /// Most replicates.
        most: usize,
    },
}

impl Default for Config {
    /// α = 10⁻⁵, 32 replicates, 2·10⁷ rays, MDB 1 %, all rays to everybody, 16 × 16 tiles, up to 4
    /// rounds of which the later ones have twice the samples.
    fn default() -> Self {
        Config {
            seed: 1,
            alpha: 1e-5,
            replicates: 32,
            samples: 4,
            rays: 20_000_000,
            mdb: 0.01,
            hopeless: None,
            tiles: 16,
            stopping: StoppingRule::Rounds { most: 4, growth: 2 },
        }
    }
}
