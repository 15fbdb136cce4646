//! Is this integrator right? Renders, compares, reports.
//!
//! [`validate()`] compares integrators on one scene, pair by pair: the image, every path length,
//! and tiles for each kind of path. Exact scenes, Markov chains and hard cases are held to known
//! answers by the [suites](crate::suites).
//!
//! **How much is rendered.** A pilot of 8 short replicates measures variance and cost. It sets the
//! length of the 32 replicates proper, which begin afresh: the size of a sample never depends on
//! the data of its test (Stein 1945), and the test stays exact.
//!
//! **How sure a verdict is.** α = 10⁻⁵ for the whole report is shared out evenly among its pairs.
//! Levels that small are beyond what 32 replicates can carry, because the tail of a t-test is wrong
//! out there and a permutation test has no such p-values. So each pair is judged in rounds (Gandy
//! and Scott 2020): what has p > 1 % or so is accepted at once, what looks suspicious is rendered
//! again with fresh seeds and twice the samples, up to four times. *Differ* is said after two
//! rounds at least, never after one. A bias of the size MDB (p ≈ 2·10⁻⁷ in the first round) is
//! found in this way with a probability over 0.9.

mod config;
mod confirm;
mod methods;
mod page;
mod pairs;
mod render;
mod report;
mod sequential;
mod text;

pub use config::{Config, StoppingRule};
pub use report::{
    Check, CheckCell, CheckOutcome, Failure, MethodReport, MethodState, PairReport, Report,
    RoundReport, SceneReport,
};

pub(crate) use confirm::Confirmed;
pub(crate) use pairs::{Pairing, compare_on};
pub(crate) use render::{pilot, replicates};

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use pathspace_core::Scene;
use pathspace_core::integrator::Integrator;
use pathspace_core::random::derive_seed;

/// Compares integrators on a scene, every pair of them, and says which pairs agree, which differ
/// and what would have been seen.
///
/// An integrator that refuses the scene is left out and named with its reason; one that fails or
/// emits a contribution that is not finite is a failure of the report. Runs on the current rayon
/// pool; apart from times the report is the same for any number of threads.
///
/// ```
/// use std::sync::Arc;
/// use pathspace_core::Scene;
/// use pathspace_core::path::WalkRules;
/// use pathspace_integrators::{Defaults, Registry};
/// use pathspace_validation::validate::{Config, validate};
///
/// // A scene of the library, or one of your own.
/// let loaded = pathspace_scenes::library::find("furnace").unwrap();
/// let loaded = loaded.load(&[("res".into(), "16".into())])?;
/// let scene = Arc::new(Scene::new(&loaded.description)?);
///
/// // Your integrator takes the place of one of these.
/// let defaults = Defaults { rules: WalkRules { max_length: Some(4), rr_depth: 5 } };
/// let mine = Registry::builtin().create(&"lt".parse()?, &defaults)?;
/// let known = Registry::builtin().create(&"pt".parse()?, &defaults)?;
///
/// let config = Config { rays: 200_000, ..Config::default() };
/// let report = validate(&scene, &[&*mine, &*known], &config);
/// assert!(report.passed(), "{report}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn validate(scene: &Arc<Scene>, integrators: &[&dyn Integrator], config: &Config) -> Report {
    let clock = Instant::now();
    let n = integrators.len();
    let mut report = Report::new("", config, n * n.saturating_sub(1) / 2);
    let watch = &mut |_: &str| ControlFlow::Continue(());
    let level = report.level();
    report.scenes.extend(compare_on(
        "scene",
        scene,
        (integrators, Pairing::All),
        config,
        level,
        watch,
    ));
    report.seconds = clock.elapsed().as_secs_f64();
    report
}

/// The seed of something that has a name, so that it is the same whatever else is in the report:
/// derived from `seed` and the FNV-1a hash of the name.
pub fn seed_of(seed: u64, name: &str) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for byte in name.bytes() {
        hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
    }
    derive_seed(seed, hash)
}
