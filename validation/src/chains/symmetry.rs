//! Reversible mutations go from A to B as often as from B to A.

use std::collections::BTreeMap;

use pathspace_core::Scene;
use pathspace_integrators::chain::ChainTarget;

use super::{ChainCheck, Features, starts};

/// Bowker's (1948) test of symmetry, weighted: χ² = Σ_{A<B} (Σ±W)²/ΣW² over pairs of cells, W times
/// the acceptance of a proposal from A to B, − from B to A. Cells repeat over the film with period
/// three, so that a drift in one direction is seen, which smaller periods would hide; and once more
/// by path length and technique.
pub fn symmetry<T: ChainTarget>(
    name: &str,
    target: &T,
    scene: &Scene,
    seed: u64,
    count: u64,
) -> Vec<ChainCheck> {
    let kinds = target.kinds();
    let own = |_: &T::State| [0.0; 2];
    let moves = starts(target, scene, seed, count, |mut x, w, u| {
        let before = cells(&Features::of(target, scene, &x, &own));
        let proposal = target.propose(scene, &mut x, u);
        let y = proposal.state.filter(|_| proposal.acceptance > 0.0)?;
        let w = w * proposal.acceptance.min(1.0);
        let after = cells(&Features::of(target, scene, &y, &own));
        Some((usize::from(proposal.kind), w, before, after))
    });
    let mut checks = Vec::new();
    for (kind, kind_name) in kinds.iter().enumerate() {
        for (i, what) in ["film", "technique"].into_iter().enumerate() {
            // ΣW and ΣW² from A to B and from B to A.
            let mut pairs: BTreeMap<[i64; 2], [[f64; 2]; 2]> = BTreeMap::new();
            for (_, w, a, b) in moves.iter().flatten().filter(|m| m.0 == kind) {
                let (a, b) = (a[i], b[i]);
                if a != b {
                    let way =
                        &mut pairs.entry([a.min(b), a.max(b)]).or_default()[usize::from(a > b)];
                    way[0] += w;
                    way[1] += w * w;
                }
            }
            // Too few moves, (ΣW)²/ΣW² of them, are no normal sum; in either direction, because a
            // few heavy moves one way balance many light ones the other way.
            let many = |[sum, squares]: &[f64; 2]| *sum > 0.0 && sum * sum >= 20.0 * squares;
            let used: Vec<_> = pairs.values().filter(|p| p.iter().all(many)).collect();
            if !used.is_empty() {
                let term =
                    |[on, back]: &[[f64; 2]; 2]| (on[0] - back[0]).powi(2) / (on[1] + back[1]);
                let chi2 = used.iter().map(|p| term(p)).sum();
                checks.push(ChainCheck::chi_squared(
                    format!("{name}, {kind_name}"),
                    format!("symmetry over {what}"),
                    chi2,
                    used.len() as f64,
                ));
            }
        }
    }
    checks
}

fn cells(f: &Features) -> [i64; 2] {
    let third = |v: f64| ((v * 48.0).floor() as i64).rem_euclid(3);
    let class = |v: f64| (v.round() as i64).clamp(0, 7);
    [3 * third(f.film[0]) + third(f.film[1]), 8 * class(f.length) + class(f.s)]
}
