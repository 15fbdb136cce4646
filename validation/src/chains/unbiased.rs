//! b̂ belongs to its chain.

use pathspace_core::Scene;
use pathspace_core::random::derive_seed;
use pathspace_integrators::chain::{Chain, ChainTarget, bootstrap};
use rayon::prelude::*;

use super::{ChainCheck, FEATURES, Features, starts, stream};

/// Bootstrap samples of a replicate: so few that a b̂ of other samples would be off by tens of per
/// cent.
const SAMPLES: u64 = 4;
/// Chains that the bootstrap deals starts to, of which one runs: enough for weights that are not 1.
const CHAINS: u64 = 8;
/// Mutations of each chain.
const STEPS: u32 = 5;

/// E b̂ w h(X_n) over `count` replicates, each with a bootstrap of four samples and one chain of
/// weight w and a few mutations, against ∫ f* h = E W h(x) over as many independent samples; h = 1
/// and the features.
pub fn unbiased<T: ChainTarget>(
    name: &str,
    target: &T,
    scene: &Scene,
    own: &(impl Fn(&T::State) -> [f64; 2] + Sync),
    seed: u64,
    count: u64,
) -> Vec<ChainCheck> {
    const N: usize = FEATURES.len() + 1;
    let kinds = target.kinds().len();
    let with_one = |x: &T::State, k: f64| -> [f64; N] {
        let f = Features::of(target, scene, x, own).list();
        std::array::from_fn(|i| k * if i == 0 { 1.0 } else { f[i - 1] })
    };
    let chains: Vec<[f64; N]> = (0..count)
        .into_par_iter()
        .map(|r| {
            let seed = derive_seed(derive_seed(seed, 23), r);
            let boot = bootstrap(target, scene, seed, SAMPLES, CHAINS);
            let Some(&start) = boot.starts.first() else { return [0.0; N] };
            let Some(x) = boot.replay(target, scene, start) else { return [0.0; N] };
            let mut chain = Chain::new(x, kinds);
            let mut u = stream(seed, 1);
            for _ in 0..STEPS {
                chain.mutate(target, scene, 1.0, &mut u, &mut super::Nowhere);
            }
            with_one(&chain.state, boot.b() * start.weight)
        })
        .collect();
    // A bootstrap costs four samples: as many for the reference.
    let reference = SAMPLES * count;
    let direct = starts(target, scene, seed, reference, |x, w, _| with_one(&x, w));
    let moments = |rows: &[[f64; N]], n: f64, i: usize| {
        let mean = rows.iter().map(|r| r[i]).sum::<f64>() / n;
        let second = rows.iter().map(|r| r[i] * r[i]).sum::<f64>() / n;
        (mean, (second - mean * mean).max(0.0) / (n - 1.0))
    };
    (0..N)
        .filter_map(|i| {
            let (a, va) = moments(&chains, count as f64, i);
            let (b, vb) = moments(&direct, reference as f64, i);
            let what = if i == 0 { "1" } else { FEATURES[i - 1] };
            let test = format!("normalisation of {what}");
            let z = (a - b) / (va + vb).sqrt();
            (va > 0.0).then(|| ChainCheck::normal(name.to_owned(), test, z))
        })
        .collect()
}
