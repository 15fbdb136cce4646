//! Which candidates the chains start at, and what each chain counts.

use pathspace_core::random::{Address, PrimarySample, RandomStream};

use super::Candidate;

/// A chain's start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Deal {
    /// Index of the candidate.
    pub candidate: usize,
    /// Weight of the chain; they sum to the number of chains.
    pub weight: f64,
}

/// Candidates that share some chains among themselves.
#[derive(Default)]
struct Group {
    /// Indices of the candidates.
    members: Vec<usize>,
    /// Running sum of their W.
    sums: Vec<f64>,
}

/// Deals `candidates`, in the order of [`Candidate::key`], to `chains` chains; nothing where all
/// weigh nothing.
///
/// Group g of the candidates has n_g chains, about as many as its share of ΣW and one at the least,
/// and each of them the weight q_g/n_g with q_g = C Σ_g W/ΣW. Given the samples, (b̂/C) Σ_c w_c E
/// h(X_c) = Σ_g (1/N) Σ_{i∈g} W_i E h(X | X₀ = x_i) whatever n_g is, so that every group, and with
/// it the light of every path length, has the brightness that the bootstrap gave it. With equal
/// weights and a random number of chains in a group that number would be most of the group's noise.
///
/// At most half of the chains go to the lightest groups in this way: where there are more groups
/// than that the lightest ones are one. Within a group starts are drawn by strata of equal W, one
/// for each chain; a random rotation deals them out, because the first chains may make a mutation
/// less than the last.
pub(super) fn deal(candidates: &[Candidate], seed: u64, chains: u64) -> Vec<Deal> {
    let groups = groups(candidates, chains);
    let total: f64 = groups.iter().map(Group::weight).sum();
    if chains == 0 || !(total > 0.0) {
        return Vec::new();
    }
    let quotas: Vec<f64> = groups.iter().map(|g| g.weight() / total * chains as f64).collect();
    let mut u = RandomStream::new(Address { seed, step: 1, item: 0 });
    // 48 bits: as fine as many samples of equal weight need.
    let mut number = || u.next() as f64 + u.next() as f64 / 16_777_216.0;
    let mut dealt = Vec::with_capacity(chains as usize);
    for ((group, quota), count) in groups.iter().zip(&quotas).zip(counts(&quotas, chains)) {
        let n = count as f64;
        dealt.extend((0..count).map(|stratum| {
            let place = (stratum as f64 + number()) / n;
            Deal { candidate: group.at(place), weight: quota / n }
        }));
    }
    dealt.rotate_left((number() * chains as f64) as usize);
    dealt
}

/// The candidates by [`Candidate::group`], the heaviest ones by themselves and the rest as one.
fn groups(candidates: &[Candidate], chains: u64) -> Vec<Group> {
    let mut each = Vec::new();
    let mut index = 0;
    for alike in candidates.chunk_by(|a, b| a.group() == b.group()) {
        let mut group = Group::default();
        for candidate in alike {
            group.add(index, candidate.weight);
            index += 1;
        }
        each.push(group);
    }
    let own = (chains / 2) as usize;
    if each.len() > own {
        // Equal weights stay in the order of their keys.
        each.sort_by(|a, b| b.weight().total_cmp(&a.weight()));
        let mut rest = Group::default();
        for i in each.drain(own..).flat_map(|group| group.members) {
            rest.add(i, candidates[i].weight);
        }
        each.push(rest);
    }
    each
}

impl Group {
    fn add(&mut self, index: usize, weight: f64) {
        self.sums.push(self.weight() + weight);
        self.members.push(index);
    }

    fn weight(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }

    /// The candidate at this part of the group's weight.
    fn at(&self, place: f64) -> usize {
        let total = self.weight();
        let last = self.sums.partition_point(|&sum| sum < total);
        // The first whose running sum exceeds x: samples without weight are never it.
        let x = place * total;
        self.members[self.sums.partition_point(|&sum| sum <= x).min(last)]
    }
}

/// Numbers of chains for groups whose fair shares are `quotas`, not more groups than chains: one
/// each, and the rest by what a share has over one (largest remainders).
fn counts(quotas: &[f64], chains: u64) -> Vec<u64> {
    let over = |q: &f64| (q - 1.0).max(0.0);
    let all: f64 = quotas.iter().map(over).sum();
    let rest = chains.saturating_sub(quotas.len() as u64);
    let scale = if all > 0.0 { rest as f64 / all } else { 0.0 };
    let fair: Vec<f64> = quotas.iter().map(|q| scale * over(q)).collect();
    let mut counts: Vec<u64> = fair.iter().map(|f| 1 + *f as u64).collect();
    let left = chains.saturating_sub(counts.iter().sum());
    let mut order: Vec<usize> = (0..fair.len()).collect();
    order.sort_by(|&a, &b| fair[b].fract().total_cmp(&fair[a].fract()));
    for &i in order.iter().cycle().take(left as usize) {
        counts[i] += 1;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Candidates of these groups and weights.
    fn candidates(list: &[(u64, f64)]) -> Vec<Candidate> {
        let one = |&(group, weight): &(u64, f64)| Candidate { weight, key: group << 32, index: 0 };
        list.iter().map(one).collect()
    }

    #[test]
    fn the_weight_on_a_candidate_is_on_average_its_share() {
        let list = candidates(&[(1, 0.5), (1, 1.5), (2, 3.0), (3, 0.02), (3, 0.04)]);
        let total: f64 = list.iter().map(|c| c.weight).sum();
        // With one and two chains groups are thrown together, with five each has its own.
        for chains in [1, 2, 5, 12] {
            let n = 20_000;
            let mut sums = vec![[0.0; 5]; chains as usize];
            let mut squares = vec![[0.0; 5]; chains as usize];
            for seed in 0..n {
                for (chain, one) in deal(&list, seed, chains).into_iter().enumerate() {
                    sums[chain][one.candidate] += one.weight;
                    squares[chain][one.candidate] += one.weight * one.weight;
                }
            }
            for (sums, squares) in sums.iter().zip(&squares) {
                for i in 0..list.len() {
                    let mean = sums[i] / n as f64;
                    let sd = ((squares[i] / n as f64 - mean * mean) / n as f64).sqrt();
                    let expected = list[i].weight / total;
                    assert!((mean - expected).abs() <= 4.5 * sd, "{chains}: {sums:?}");
                }
            }
        }
    }

    #[test]
    fn a_group_has_its_share_of_the_weight_in_every_deal() {
        let list = candidates(&[(1, 0.7), (1, 1.3), (2, 0.004), (3, 0.31)]);
        for seed in 0..20 {
            let mut groups = [0.0; 3];
            for one in deal(&list, seed, 16) {
                groups[list[one.candidate].group() as usize - 1] += one.weight / 16.0;
            }
            for (got, w) in groups.into_iter().zip([2.0, 0.004, 0.31]) {
                assert!((got - w / 2.314).abs() < 1e-12, "{groups:?}");
            }
        }
    }

    #[test]
    fn strata_share_the_chains_of_a_group_out() {
        // A sample of half the weight starts half the chains, but for one at each border.
        let dealt = deal(&candidates(&[(0, 1.0), (0, 2.0), (0, 1.0)]), 7, 100);
        assert!(dealt.iter().all(|d| d.weight == 1.0));
        let middle = dealt.iter().filter(|d| d.candidate == 1).count();
        assert!((49..=51).contains(&middle), "{middle}");
    }

    #[test]
    fn chains_follow_the_shares_and_none_is_without() {
        assert_eq!(counts(&[61.0], 61), [61]);
        assert_eq!(counts(&[30.5, 20.0, 0.5], 51), [30, 20, 1]);
        assert_eq!(counts(&[0.001, 99.0, 0.999], 100), [1, 98, 1]);
        assert_eq!(counts(&[1.0, 1.0], 2), [1, 1]);
    }

    #[test]
    fn no_weight_no_start() {
        assert!(deal(&[], 1, 4).is_empty());
        assert!(deal(&candidates(&[(0, 0.0), (1, 0.0)]), 1, 4).is_empty());
        assert!(deal(&candidates(&[(0, 1.0)]), 1, 0).is_empty());
    }
}
