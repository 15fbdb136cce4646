//! Which mutant is hunted where, and with how much work: the files of validation/mutants.

use std::fs;
use std::path::Path;

use serde::Deserialize;

use super::MutantError;

/// Where the catalogue lies in a source tree.
pub const FOLDER: &str = "validation/mutants";

/// A deliberate bug as a change of source text, and the test that must find it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mutant {
    /// Name, that of its file: `no-cosine-at-light`.
    #[serde(skip)]
    pub name: String,
    /// What is wrong.
    pub about: String,
    /// The lines that change.
    #[serde(rename = "edit")]
    pub edits: Vec<Edit>,
    /// The test.
    pub test: Test,
}

/// A change of one file.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Edit {
    /// The file, from the root of the source tree.
    pub file: String,
    /// Text that occurs once in it.
    pub old: String,
    /// What stands there instead. `@on` is a condition: true where the mutant is on. Text without
    /// it is an expression that takes the place of another one.
    pub new: String,
}

/// A test of one level.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Test {
    /// L0: weights of this many paths of a library scene by an integrator against the oracle.
    Oracle {
        /// The scene.
        scene: String,
        /// A path tracer with its options.
        integrator: String,
        /// Samples.
        samples: u64,
    },
    /// L2: an integrator against an exact scene.
    Exact {
        /// Name of the exact scene.
        scene: String,
        /// The integrator.
        integrator: String,
        /// Rays in the first round.
        rays: u64,
        /// Turn flat emitters over by a transform that mirrors, so that all is dark.
        #[serde(default)]
        mirrored: bool,
    },
    /// L4: a chain of one kind of mutation on a library scene, by the tests of [`crate::chains`].
    Chain {
        /// The scene.
        scene: String,
        /// What is mutated, with its options.
        chain: Chain,
        /// Bootstrap samples that each test starts from in the first round.
        starts: u64,
    },
    /// L1: random numbers and the steps of kernels.
    Numbers,
    /// L3: two integrators on a library scene.
    Pair {
        /// The scene.
        scene: String,
        /// The integrators.
        integrators: [String; 2],
        /// Rays of each in the first round.
        rays: u64,
        /// Render a part of the film only.
        #[serde(default)]
        cropped: bool,
    },
}

/// A chain that is tested by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Chain {
    /// Numbers of path tracing, Kelemen's kernel.
    Primary,
    /// Whole paths, bidirectional mutation.
    PathSpace,
    /// Numbers of bidirectional path tracing, jumps between techniques most of the time.
    Jumps,
    /// Whole paths, manifold perturbation.
    Manifold,
}

impl Test {
    /// `L0` to `L4`.
    pub fn level(&self) -> &'static str {
        match self {
            Test::Oracle { .. } => "L0",
            Test::Exact { .. } => "L2",
            Test::Numbers => "L1",
            Test::Pair { .. } => "L3",
            Test::Chain { .. } => "L4",
        }
    }

    /// What is looked at, in words.
    pub fn subject(&self) -> String {
        match self {
            Test::Oracle { scene, integrator, samples } => {
                format!("{integrator} on {scene}, {samples} samples")
            }
            Test::Exact { scene, integrator, rays, .. } => {
                format!("{integrator} on {scene}, {:.1e} rays", *rays as f64)
            }
            Test::Chain { scene, chain, starts } => {
                let chain = match chain {
                    Chain::Primary => "pssmlt over pt",
                    Chain::PathSpace => "mlt, bidirectional mutation",
                    Chain::Jumps => "rjmlt, jumps",
                    Chain::Manifold => "mlt, manifold perturbation",
                };
                format!("{chain} on {scene}, {:.1e} starts", *starts as f64)
            }
            Test::Numbers => "random numbers and kernels".into(),
            Test::Pair { scene, integrators: [a, b], rays, .. } => {
                format!("{a} and {b} on {scene}, {:.1e} rays each", *rays as f64)
            }
        }
    }
}

/// The catalogue of the source tree at `source`, by name.
///
/// # Errors
/// Where a file cannot be read or is not of this form.
pub fn catalogue(source: &Path) -> Result<Vec<Mutant>, MutantError> {
    let folder = source.join(FOLDER);
    let entries = fs::read_dir(&folder).map_err(|e| MutantError::file(&folder, e))?;
    let mut mutants = Vec::new();
    for entry in entries {
        let path = entry.map_err(|e| MutantError::file(&folder, e))?.path();
        if path.extension().is_none_or(|e| e != "toml") {
            continue;
        }
        let text = fs::read_to_string(&path).map_err(|e| MutantError::file(&path, e))?;
        let mutant: Mutant = toml::from_str(&text).map_err(|e| MutantError::file(&path, e))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        mutants.push(Mutant { name, ..mutant });
    }
    mutants.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(mutants)
}
