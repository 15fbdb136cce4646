//! One step leaves the target as it is.

use pathspace_core::Scene;
use pathspace_integrators::chain::ChainTarget;

use super::{ChainCheck, FEATURES, Features, starts};

/// Changes of a feature below this are none. A move that keeps a path keeps it but for rounding, of
/// about 10⁻⁷, which may have a direction of its own.
const LEAST: f64 = 1e-4;

/// Z = W(x) a(x→y) φ(h(y) − h(x)) over `count` bootstrap samples x and one proposal y of each, for
/// every feature h; each kind of mutation by itself. φ cuts changes below 10⁻⁴ off; by detailed
/// balance E Z = 0 for any odd φ. With a in place of the decision no W a is much larger than f*(y)
/// of where a proposal of that density comes from: large W leave rarely. E Z = 0 exactly where
/// kinds are chosen without regard to the state.
pub fn invariance<T: ChainTarget>(
    name: &str,
    target: &T,
    scene: &Scene,
    own: &(impl Fn(&T::State) -> [f64; 2] + Sync),
    seed: u64,
    count: u64,
) -> Vec<ChainCheck> {
    let kinds = target.kinds();
    let moves = starts(target, scene, seed, count, |mut x, w, u| {
        let before = Features::of(target, scene, &x, own).list();
        let proposal = target.propose(scene, &mut x, u);
        let mut change = [0.0; FEATURES.len()];
        if let Some(y) = proposal.state {
            let after = Features::of(target, scene, &y, own).list();
            let w = w * proposal.acceptance.min(1.0);
            change = std::array::from_fn(|i| {
                let change = after[i] - before[i];
                if change.abs() < LEAST { 0.0 } else { w * change }
            });
        }
        let kind = usize::from(proposal.kind);
        (kind, change)
    });
    let mut checks = Vec::new();
    for (kind, kind_name) in kinds.iter().enumerate() {
        for (i, feature) in FEATURES.iter().enumerate() {
            let (mut n, mut sum, mut sum2) = (0.0, 0.0, 0.0);
            for (_, change) in moves.iter().filter(|(k, _)| *k == kind) {
                n += 1.0;
                sum += change[i];
                sum2 += change[i] * change[i];
            }
            // A feature that this mutation never changes says nothing.
            if sum2 > 0.0 {
                let z = sum / (sum2 - sum * sum / n).max(0.0).sqrt();
                let mutator = format!("{name}, {kind_name}");
                checks.push(ChainCheck::normal(mutator, format!("invariance of {feature}"), z));
            }
        }
    }
    checks
}
