//! A bias that is spread over many cells, whatever the shapes of the arms.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::fault::{StatsError, all_finite, at_least, same_length};
use super::max_t::PermutationConfig;

/// Tests whether the differences of paired replicates have mean zero in all cells, by a sum of squares that is cleared of its own noise.
///
/// With D_r the differences of pair r in the cells c, U = Σ_{r≠s} Σ_c D_rc D_sc / v_c^{(−r,−s)}, v_c^{(−r,−s)} the mean of D² over the
/// other pairs (a U-statistic as that of Chen & Qin 2010). Every term has mean zero under the null, because its three factors are
/// independent: no skewness moves it, as it moves Σt and Σt². Its size is judged by random signs of whole pairs, which keep the correlation of
/// the cells; p = (1+#)/(1+B). Sees a bias of any sign that is spread over many cells.
///
/// Fails on fewer than 4 pairs, other numbers of cells or of replicates, and non-finite values.
pub fn spread_test(
    a: &[Vec<f64>],
    b: &[Vec<f64>],
    config: &PermutationConfig,
) -> Result<f64, StatsError> {
    same_length("replicates of the arms", a.len(), b.len())?;
    at_least("pairs of replicates", 4, a.len())?;
    at_least("permutations", 1, config.permutations)?;
    let cells = a[0].len();
    for row in a.iter().chain(b) {
        same_length("cells of replicates", cells, row.len())?;
        all_finite("replicate", row)?;
    }
    let products = products(a, b);
    let k = products.len();
    let mut rng = Pcg64Mcg::seed_from_u64(config.seed);
    let value = |signs: &[f64]| -> f64 {
        let row = |r: usize| -> f64 { (0..r).map(|s| signs[s] * products[r][s]).sum() };
        (0..k).map(|r| signs[r] * row(r)).sum()
    };
    let observed = value(&vec![1.0; k]);
    // Signs that are all the same give the observed value again; it must count in spite of rounding.
    let bound = observed - 1e-9 * observed.abs();
    let mut signs = vec![1.0; k];
    let above = (0..config.permutations).filter(|_| {
        signs.fill_with(|| if rng.random::<bool>() { 1.0 } else { -1.0 });
        value(&signs) >= bound
    });
    Ok((1 + above.count()) as f64 / (1 + config.permutations) as f64)
}

/// Σ_c D_rc D_sc / v_c^{(−r,−s)} for all s < r; they change with the signs of r and s alone.
fn products(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let k = a.len();
    let mut differences = vec![Vec::new(); k];
    for cell in 0..a[0].len() {
        let d: Vec<f64> = a.iter().zip(b).map(|(x, y)| x[cell] - y[cell]).collect();
        let scale = (d.iter().map(|d| d * d).sum::<f64>() / k as f64).sqrt();
        // Cells where every pair is equal are no hypotheses.
        if scale > 0.0 {
            for (row, d) in differences.iter_mut().zip(&d) {
                row.push(d / scale);
            }
        }
    }
    let all = k as f64;
    let product = |x: &[f64], y: &[f64]| -> f64 {
        let term = |(x, y): (&f64, &f64)| {
            // Where these two pairs are all there is, their weight is kept finite.
            let rest = ((all - x * x - y * y) / (all - 2.0)).max(1e-3);
            x * y / rest
        };
        x.iter().zip(y).map(term).sum()
    };
    (0..k).map(|r| (0..r).map(|s| product(&differences[r], &differences[s])).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{binomial_interval, testing::Source};
    use super::*;

    const B199: PermutationConfig = PermutationConfig { permutations: 199, seed: 3 };

    fn rows(k: usize, cells: usize, mut value: impl FnMut(usize) -> f64) -> Vec<Vec<f64>> {
        (0..k).map(|_| (0..cells).map(&mut value).collect()).collect()
    }

    #[test]
    fn skewed_against_symmetric_arms_alarm_at_the_level() {
        let mut source = Source::new(80);
        let (runs, mut hits) = (600, 0);
        for _ in 0..runs {
            let a = rows(16, 100, |_| -0.25 * (0..4).map(|_| source.uniform().ln()).sum::<f64>());
            let b = rows(16, 100, |_| 1.0 + 0.02 * source.normal());
            hits += u64::from(spread_test(&a, &b, &B199).unwrap() <= 0.05);
        }
        let (low, high) = binomial_interval(hits, runs, 0.99).unwrap();
        assert!(low <= 0.06 && high <= 0.12, "{hits} of {runs}: [{low}, {high}]");
    }

    #[test]
    fn a_faint_bias_of_changing_sign_is_found() {
        let mut source = Source::new(81);
        let a = rows(16, 200, |c| 0.4 * (1.0 - 2.0 * (c % 2) as f64) + source.normal());
        let b = rows(16, 200, |_| source.normal());
        let config = PermutationConfig { permutations: 999, seed: 1 };
        assert!(spread_test(&a, &b, &config).unwrap() <= 0.002);
    }

    #[test]
    fn equal_arms_are_no_evidence_and_bad_input_is_an_error() {
        let a = vec![vec![1.0, 2.0]; 4];
        assert_eq!(spread_test(&a, &a, &B199), Ok(1.0));
        assert!(spread_test(&a, &a[..3], &B199).is_err());
        assert!(spread_test(&a[..3], &a[..3], &B199).is_err());
    }
}
