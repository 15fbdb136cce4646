//! Mutation tests of the validation itself (L5): deliberate bugs that the tests must find.
//!
//! A [`Mutant`] is a bug in the one line where it would be made; the build has them with the feature `mutants` of `pathspace-core` alone.
//! For each there is a [`Hunt`] of one of the levels: a path against the oracle, an integrator against an exact answer, two
//! integrators against each other, or a chain by itself. A hunt must find its mutant, and find nothing in the same place without it.

mod catalogue;
mod hunt;

pub use catalogue::{Chain, Hunt, Level, hunts};
pub use hunt::{MutantError, Outcome, hunt};

pub use pathspace_core::mutant::Mutant;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mutant_is_hunted_once() {
        let hunts = hunts();
        assert_eq!(hunts.len(), Mutant::ALL.len());
        assert!(Mutant::ALL.iter().all(|m| hunts.iter().any(|h| h.mutant == *m)));
    }
}
