//! Transition densities say the same from both ends.

use super::{numbers, only, starts};
use crate::models;

/// f(x) T(x→y) a(x→y) = f(y) T(y→x) a(y→x), each side from its own call.
#[test]
fn detailed_balance_holds_to_rounding() {
    for mutation in ["bidir", "lens", "caustic", "multi", "manifold"] {
        let mut pairs = 0;
        for (name, scene) in models::all() {
            let chain = only(&scene, mutation, 6);
            let mutator = chain.mutators().next().unwrap();
            let mut u = numbers(3, 0);
            for (x, _) in starts(&chain, &scene, 2).take(4000) {
                let Some(candidate) = mutator.propose(&scene, &x, &mut u) else { continue };
                let (y, kept) = (&candidate.path, candidate.kept);
                let forward = mutator.ln_transition(&scene, &x, y, kept);
                let back = mutator.ln_transition(&scene, y, &x, kept);
                let (Some(forward), Some(back)) = (forward, back) else { continue };
                pairs += 1;
                let (fx, fy) = (x.target().ln(), y.target().ln());
                let accept = (fy + back - fx - forward).min(0.0);
                let accept_back = (fx + forward - fy - back).min(0.0);
                let flow = fx + forward + accept;
                let flow_back = fy + back + accept_back;
                assert!((flow - flow_back).abs() < 1e-10, "{mutation} on {name}");
                let ratio = mutator.ln_transition_ratio(&scene, &x, &candidate).unwrap();
                assert!((ratio - (back - forward)).abs() < 1e-10, "{mutation} on {name}");
            }
        }
        println!("{mutation}: {pairs} pairs");
        assert!(pairs > 150, "{mutation}: {pairs}");
    }
}
