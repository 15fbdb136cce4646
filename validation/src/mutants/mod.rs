//! Mutation tests of the validation itself (L5): deliberate bugs that the tests must find.
//!
//! A [`Mutant`] is a change of source text with the test that must find it, a file of
//! validation/mutants. Production lines know nothing of it: [`plant()`] makes a copy of the source
//! tree that has all of them, each turned on by an environment variable, and whoever hunts builds
//! the copy and runs [`hunt()`] in it. A test must find its mutant, and find nothing in the same
//! place without it.

mod catalogue;
mod hunt;
mod plant;

use std::fmt::Display;
use std::path::Path;

pub use catalogue::{Chain, Edit, FOLDER, Mutant, Test, catalogue};
pub use hunt::{Outcome, hunt};
pub use plant::{VARIABLE, plant, planted};

/// Why there is no hunt.
#[derive(Debug, thiserror::Error, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum MutantError {
    /// A file of the source tree or of the copy.
    #[error("{0}: {1}")]
    File(String, String),
    /// The source tree has changed under a mutant.
    #[error("{0}")]
    Stale(String),
    /// A test can not be run as it stands in the catalogue.
    #[error("{0}")]
    Bad(String),
}

impl MutantError {
    fn file(path: &Path, error: impl Display) -> Self {
        MutantError::File(path.display().to_string(), error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where a line that a mutant changes is gone, this fails: change the mutant with it.
    #[test]
    fn every_mutant_finds_its_lines_in_the_source_tree() {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let mutants = catalogue(&source).unwrap();
        assert!(mutants.len() >= 27);
        planted(&source, &mutants).unwrap();
    }
}
