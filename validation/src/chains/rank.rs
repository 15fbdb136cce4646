//! Ranks in stationary reversible chains are uniform (Gandy and Scott 2020, "Unit Testing for MCMC
//! and other Monte Carlo Methods").

use pathspace_core::Scene;
use pathspace_core::random::PrimarySample;
use pathspace_integrators::chain::{Chain, ChainTarget};

use super::{ChainCheck, FEATURES, Features, starts, step};

/// Steps of each chain.
const STEPS: usize = 6;
/// Features are compared on a grid of 1/`GRID`: a film position or a distance that a mutation keeps
/// is evaluated anew and may differ by rounding, which would decide what is a tie.
const GRID: f64 = 16384.0;

/// A start x is put at a random place of a chain of `STEPS` steps: the chain is run from it in both
/// directions, which are the same for a reversible mutation. Weighted by W, the rank of h(x) among
/// all states is uniform; Wald's test of the mean of W (1{rank = r} − 1/(L+1)) with its own
/// covariance, χ² with L degrees of freedom. All kinds of mutations together.
pub fn rank<T: ChainTarget>(
    name: &str,
    target: &T,
    scene: &Scene,
    own: &(impl Fn(&T::State) -> [f64; 2] + Sync),
    seed: u64,
    count: u64,
) -> Vec<ChainCheck> {
    const N: usize = FEATURES.len();
    let kinds = target.kinds().len();
    let ranks = starts(target, scene, seed, count, |x, w, u| {
        let place = (u.next() as f64 * (STEPS + 1) as f64) as usize;
        let at =
            |x: &T::State| Features::of(target, scene, x, own).list().map(|v| (v * GRID).round());
        let own_features = at(&x);
        let mut below = [0usize; N];
        let mut equal = [0usize; N];
        for steps in [place, STEPS - place] {
            let mut chain = Chain::new(x.clone(), kinds);
            let mut features = own_features;
            for _ in 0..steps {
                if step(target, scene, &mut chain, u).1 {
                    features = at(&chain.state);
                }
                for i in 0..N {
                    below[i] += usize::from(features[i] < own_features[i]);
                    equal[i] += usize::from(features[i] == own_features[i]);
                }
            }
        }
        // Ties are broken at random.
        let tie = u.next() as f64;
        (w, std::array::from_fn::<_, N, _>(|i| below[i] + (tie * (equal[i] + 1) as f64) as usize))
    });
    let mut checks = Vec::new();
    for (i, feature) in FEATURES.iter().enumerate() {
        // Sums and second moments of W(1{r} − 1/(L+1)), the last rank left out because all sum
        // to 0.
        let mut sum = [0.0; STEPS];
        let mut second = [[0.0; STEPS]; STEPS];
        for (w, ranks) in &ranks {
            let d: [f64; STEPS] = std::array::from_fn(|r| {
                w * (f64::from(u8::from(ranks[i] == r)) - 1.0 / (STEPS + 1) as f64)
            });
            for a in 0..STEPS {
                sum[a] += d[a];
                for b in 0..STEPS {
                    second[a][b] += d[a] * d[b];
                }
            }
        }
        if let Some(x) = solve(second, sum) {
            let chi2 = x.iter().zip(sum).map(|(x, s)| x * s).sum();
            let test = format!("rank of {feature}");
            checks.push(ChainCheck::chi_squared(name.to_owned(), test, chi2, STEPS as f64));
        }
    }
    checks
}

/// Solves A x = b by elimination with pivots; `None` where A is singular.
fn solve<const N: usize>(mut a: [[f64; N]; N], mut b: [f64; N]) -> Option<[f64; N]> {
    for i in 0..N {
        let pivot = (i..N).max_by(|&p, &q| a[p][i].abs().total_cmp(&a[q][i].abs()))?;
        a.swap(i, pivot);
        b.swap(i, pivot);
        if !(a[i][i].abs() > 0.0) {
            return None;
        }
        let (row, value) = (a[i], b[i]);
        for r in (0..N).filter(|r| *r != i) {
            let k = a[r][i] / row[i];
            for (x, p) in a[r].iter_mut().zip(row) {
                *x -= k * p;
            }
            b[r] -= k * value;
        }
    }
    Some(std::array::from_fn(|i| b[i] / a[i][i]))
}
