//! Do several chains agree with each other? Split-R̂ and effective sample size over chains, for
//! reports.

use super::chains::autocovariance;
use super::dist::normal_quantile;
use super::fault::{StatsError, all_finite, at_least, same_length};
use super::moments::Moments;

/// Split-R̂ of Gelman et al. (2013), section 11.4: √(v̂ar⁺/W) with every chain cut in halves.
///
/// With M half-chains of N steps, W the mean of their variances and B/N the variance of their
/// means, v̂ar⁺ = (N−1)/N·W + B/N. Near 1 where the chains have mixed; 1 for constants, infinite
/// for different constants. Fails on no chains, fewer than 4 steps, unequal lengths and non-finite
/// values.
pub fn split_rhat(chains: &[Vec<f64>]) -> Result<f64, StatsError> {
    rhat(&halves(chains)?)
}

/// Rank-normalised split-R̂ of Vehtari et al. (2021), section 4: the larger of the bulk's and the
/// tails'.
///
/// The bulk takes values to z = Φ⁻¹((rank−3/8)/(S+1/4)), which survives infinite variance; the
/// tails do the same to
/// |x − median|, which sees chains that differ in scale. Below 1.01 is usual for mixed chains. Fails as [`split_rhat`].
pub fn rank_rhat(chains: &[Vec<f64>]) -> Result<f64, StatsError> {
    let halves = halves(chains)?;
    let mut all: Vec<f64> = halves.iter().flatten().copied().collect();
    all.sort_by(f64::total_cmp);
    let n = all.len();
    let median = 0.5 * (all[(n - 1) / 2] + all[n / 2]);
    let folded: Vec<Vec<f64>> =
        halves.iter().map(|c| c.iter().map(|x| (x - median).abs()).collect()).collect();
    Ok(rhat(&rank_normalise(&halves)?)?.max(rhat(&rank_normalise(&folded)?)?))
}

/// Effective sample size of the mean over several chains, with what they disagree on counted as
/// correlation.
///
/// Gelman et al. (2013), section 11.5, on split chains: ρ_k = 1 − (W − mean_m c_{m,k}
/// N/(N−1))/v̂ar⁺ with c_{m,k} the autocovariance of chain m, summed by Geyer's initial monotone
/// sequence; at most S log₁₀ S of S values. Fails as [`split_rhat`].
pub fn multi_chain_ess(chains: &[Vec<f64>]) -> Result<f64, StatsError> {
    ess(&halves(chains)?)
}

/// [`multi_chain_ess`] of the rank-normalised values, the bulk ESS of Vehtari et al. (2021).
pub fn bulk_ess(chains: &[Vec<f64>]) -> Result<f64, StatsError> {
    ess(&rank_normalise(&halves(chains)?)?)
}

/// Both halves of every chain; the middle step of an odd number is left out.
fn halves(chains: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, StatsError> {
    at_least("chains", 1, chains.len())?;
    at_least("steps of the chain", 4, chains[0].len())?;
    let mut halves = Vec::with_capacity(2 * chains.len());
    for c in chains {
        same_length("chains", chains[0].len(), c.len())?;
        all_finite("chain", c)?;
        let half = c.len() / 2;
        halves.push(c[..half].to_vec());
        halves.push(c[c.len() - half..].to_vec());
    }
    Ok(halves)
}

/// W and v̂ar⁺ of chains of equal length.
fn variances(chains: &[Vec<f64>]) -> Result<(f64, f64), StatsError> {
    let moments: Vec<Moments> = chains.iter().map(|c| Moments::of(c)).collect::<Result<_, _>>()?;
    let n = chains[0].len() as f64;
    let within = moments.iter().map(|m| m.variance).sum::<f64>() / moments.len() as f64;
    let between = Moments::of(&moments.iter().map(|m| m.mean).collect::<Vec<_>>())?.variance;
    Ok((within, (n - 1.0) / n * within + between))
}

fn rhat(chains: &[Vec<f64>]) -> Result<f64, StatsError> {
    let (within, total) = variances(chains)?;
    Ok(if total == 0.0 { 1.0 } else { (total / within).sqrt() })
}

/// Normal scores of the pooled ranks (Blom 1958); equal values share their mean rank.
fn rank_normalise(chains: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, StatsError> {
    let all: Vec<f64> = chains.iter().flatten().copied().collect();
    let s = all.len();
    let mut order: Vec<usize> = (0..s).collect();
    order.sort_by(|&i, &j| all[i].total_cmp(&all[j]));
    let mut score = vec![0.0; s];
    let mut start = 0;
    while start < s {
        let mut end = start + 1;
        while end < s && all[order[end]] == all[order[start]] {
            end += 1;
        }
        let rank = 0.5 * (start + 1 + end) as f64;
        let z = normal_quantile((rank - 0.375) / (s as f64 + 0.25))?;
        order[start..end].iter().for_each(|&i| score[i] = z);
        start = end;
    }
    Ok(score.chunks_exact(chains[0].len()).map(<[f64]>::to_vec).collect())
}

fn ess(chains: &[Vec<f64>]) -> Result<f64, StatsError> {
    let n = chains[0].len();
    let s = (n * chains.len()) as f64;
    let (within, total) = variances(chains)?;
    if total == 0.0 {
        return Ok(s);
    }
    let centred: Vec<Vec<f64>> = chains
        .iter()
        .map(|c| {
            let mean = c.iter().sum::<f64>() / n as f64;
            c.iter().map(|x| x - mean).collect()
        })
        .collect();
    let correlation = |lag: usize| {
        let sum: f64 = centred.iter().map(|c| autocovariance(c, lag)).sum();
        1.0 - (within - sum / chains.len() as f64) / total
    };
    let (mut sum, mut smallest, mut lag) = (0.0, f64::INFINITY, 0);
    let (mut even, mut odd) = (1.0, correlation(1));
    // The last three lags rest on too few products to be used.
    while even + odd > 0.0 && lag + 4 < n {
        smallest = smallest.min(even + odd);
        sum += smallest;
        lag += 2;
        (even, odd) = (correlation(lag), correlation(lag + 1));
    }
    // The even term at the cut is positive for reversible chains even where the pair is not.
    let tau = 2.0 * sum - 1.0 + even.max(0.0);
    Ok(s / tau.max(1.0 / s.log10()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// AR(1) driven by a congruential generator, so that other programs can make the same numbers.
    fn chain(seed: u64, n: usize, phi: f64) -> Vec<f64> {
        let (mut x, mut y) = (seed, 0.0);
        (0..n)
            .map(|_| {
                x = (1_103_515_245 * x + 12_345) % (1 << 31);
                y = phi * y + (x as f64 / (1u64 << 31) as f64 - 0.5);
                y
            })
            .collect()
    }

    fn four(change: impl Fn(f64) -> f64) -> Vec<Vec<f64>> {
        let mut chains: Vec<Vec<f64>> = (1..=4).map(|s| chain(s, 200, 0.6)).collect();
        chains[3].iter_mut().for_each(|v| *v = change(*v));
        chains
    }

    fn close(a: f64, b: f64, relative: f64) {
        assert!((a - b).abs() <= relative * b, "{a} against {b}");
    }

    // Expected figures: ArviZ 0.23.4 on the same arrays.

    #[test]
    fn mixed_chains_match_arviz() {
        let chains = four(|v| v);
        close(split_rhat(&chains).unwrap(), 1.003_236_438_357_279, 1e-9);
        close(rank_rhat(&chains).unwrap(), 1.005_577_601_862_709_6, 1e-9);
        close(bulk_ess(&chains).unwrap(), 234.801_400_664_830_3, 1e-9);
        close(multi_chain_ess(&chains).unwrap(), 233.683_345_452_182_18, 1e-9);
    }

    #[test]
    fn a_shifted_chain_matches_arviz_and_stands_out() {
        let chains = four(|v| v + 0.5);
        close(split_rhat(&chains).unwrap(), 1.145_106_492_123_407_3, 1e-9);
        close(rank_rhat(&chains).unwrap(), 1.142_159_765_995_194_8, 1e-9);
        close(bulk_ess(&chains).unwrap(), 25.340_189_186_427_07, 1e-9);
    }

    #[test]
    fn a_chain_of_another_scale_is_seen_by_the_folded_ranks_only() {
        let chains = four(|v| 4.0 * v);
        close(split_rhat(&chains).unwrap(), 1.023_717_126_352_550_2, 1e-9);
        close(rank_rhat(&chains).unwrap(), 1.186_808_184_350_463_4, 1e-9);
    }

    #[test]
    fn odd_lengths_match_arviz() {
        let cubed = |s| chain(s, 101, 0.3).iter().map(|v| v.powi(3)).collect();
        let chains: Vec<Vec<f64>> = (5..=7).map(cubed).collect();
        close(split_rhat(&chains).unwrap(), 1.007_628_111_060_317_1, 1e-9);
        close(rank_rhat(&chains).unwrap(), 1.008_425_326_240_836_7, 1e-9);
        close(bulk_ess(&chains).unwrap(), 181.630_284_742_018_7, 1e-9);
    }

    #[test]
    fn constants_agree_with_themselves_and_not_with_others() {
        let same = vec![vec![1.0; 10]; 3];
        assert_eq!((rank_rhat(&same).unwrap(), bulk_ess(&same).unwrap()), (1.0, 30.0));
        let other = [vec![1.0; 10], vec![2.0; 10]];
        assert_eq!(split_rhat(&other).unwrap(), f64::INFINITY);
    }

    #[test]
    fn bad_chains_are_errors() {
        assert!(split_rhat(&[]).is_err());
        assert!(split_rhat(&[vec![1.0; 3]]).is_err());
        assert!(split_rhat(&[vec![1.0; 8], vec![1.0; 9]]).is_err());
    }
}
