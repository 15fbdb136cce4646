//! Every mutation, alone, leaves its target invariant.

use pathspace_core::Scene;
use pathspace_core::path::WalkRules;
use pathspace_integrators::Defaults;
use pathspace_validation::chains::chain_checks;
use pathspace_validation::stats::holm;

use crate::models;

/// Level of a scene as a whole.
const ALPHA: f64 = 1e-5;

fn judge(scene: &Scene, seed: u64, starts: u64) {
    let rules = WalkRules { max_length: Some(5), ..WalkRules::default() };
    let checks = chain_checks(scene, &Defaults { rules }, seed, starts).unwrap();
    let p = holm(&checks.iter().map(|c| c.p).collect::<Vec<_>>());
    let wrong: Vec<_> = checks.iter().zip(&p).filter(|(_, p)| **p < ALPHA).collect();
    assert!(checks.len() > 60 && wrong.is_empty(), "{} checks, {wrong:#?}", checks.len());
}

#[test]
fn mutations_leave_their_targets_invariant_in_a_glossy_room() {
    judge(&models::build(&models::glossy_room()), 1, 20_000);
}

#[test]
fn mutations_leave_their_targets_invariant_with_a_lens_and_many_emitters() {
    judge(&models::build(&models::emitters_and_lens()), 2, 20_000);
}
