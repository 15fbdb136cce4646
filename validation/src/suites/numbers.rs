//! What all integrators stand on and no comparison of them sees: random numbers of different
//! addresses, and steps of kernels that must be symmetric.

use pathspace_core::random::{Address, PrimarySample, RandomStream, derive_seed};
use pathspace_integrators::primary::Kernel;

use crate::stats::{StatsError, holm, normal_sf};
use crate::validate::{Check, CheckCell, CheckOutcome, Confirmed, Report, seed_of};

/// Addresses from which one bit is changed.
const BASES: u64 = 64;
/// Numbers of each stream that are compared.
const NUMBERS: usize = 8;
/// Steps of each kernel in the first round.
const STEPS: u64 = 1 << 22;
/// Values that a random number takes.
const VALUES: f64 = (1u32 << 24) as f64;

/// Number of tests of [`numbers`].
pub(super) const TESTS: usize = 2;

/// Tests streams and kernels at this level each and adds the checks.
pub(crate) fn numbers(report: &mut Report, level: f64) -> Result<(), StatsError> {
    let config = report.config;
    for (scene, cells) in [("streams", streams as fn(u64, u64) -> Vec<Cell>), ("kernels", kernels)]
    {
        let mut check = Check::new("numbers", scene, "random numbers".into());
        let own = seed_of(config.seed, scene);
        let mut test = Confirmed::new(level, config.rounds().0)?;
        let rejected = test.run(&config, |round, factor, _| {
            let cells = cells(derive_seed(own, round), factor);
            let adjusted = holm(&cells.iter().map(|c| c.1).collect::<Vec<_>>());
            let least = adjusted.iter().copied().fold(1.0, f64::min);
            check.cells = cells.into_iter().zip(adjusted).map(named).collect();
            Ok::<_, StatsError>(Some((least, 2)))
        })?;
        check.outcome = if rejected { CheckOutcome::Failed } else { CheckOutcome::Passed };
        check.rounds = test.rounds;
        report.checks.push(check);
        report.add_done(1);
    }
    Ok(())
}

/// Name and p-value.
type Cell = (String, f64);

fn named(((name, _), p): (Cell, f64)) -> CheckCell {
    CheckCell { name, length: None, p, mean: None, expected: None, mdb: None }
}

/// Streams of addresses that differ in one bit of seed, step or item: numbers that are equal, and
/// their correlation.
fn streams(seed: u64, factor: u64) -> Vec<Cell> {
    let mut base = RandomStream::new(Address { seed, step: 0, item: 0 });
    let mut word = || {
        u64::from((base.next() as f64 * VALUES) as u32) << 40
            | u64::from((base.next() as f64 * VALUES) as u32) << 20
            | u64::from((base.next() as f64 * VALUES) as u32)
    };
    let mut cells = Vec::new();
    for field in ["seed", "step", "item"] {
        let (mut equal, mut count, mut sum) = (0_u64, 0_u64, 0.0);
        for _ in 0..BASES * factor {
            let at = Address { seed: word(), step: word() >> 32, item: word() >> 32 };
            for bit in 0..64 {
                let mut other = at;
                let value = match field {
                    "seed" => &mut other.seed,
                    "step" => &mut other.step,
                    _ => &mut other.item,
                };
                *value ^= 1 << bit;
                let (mut x, mut y) = (RandomStream::new(at), RandomStream::new(other));
                for _ in 0..NUMBERS {
                    let (x, y) = (x.next(), y.next());
                    equal += u64::from(x == y);
                    sum += 12.0 * (f64::from(x) - 0.5) * (f64::from(y) - 0.5);
                    count += 1;
                }
            }
        }
        cells.push((
            format!("equal numbers, one bit of {field}"),
            at_least(equal, count as f64 / VALUES),
        ));
        let z = sum / (count as f64).sqrt();
        cells.push((format!("correlation, one bit of {field}"), 2.0 * normal_sf(z.abs())));
    }
    cells
}

/// P(N ≥ n) of a Poisson variable.
fn at_least(n: u64, mean: f64) -> f64 {
    let (mut term, mut below) = ((-mean).exp(), 0.0);
    for k in 0..n.min(1000) {
        below += term;
        term *= mean / (k + 1) as f64;
    }
    // The tail by itself where 1 − P loses its digits.
    if n == 0 {
        1.0
    } else if below < 0.5 {
        1.0 - below
    } else {
        (term / (1.0 - mean / (n + 1) as f64)).clamp(0.0, 1.0)
    }
}

/// Steps of kernels forwards and backwards: as many, and as long.
fn kernels(seed: u64, factor: u64) -> Vec<Cell> {
    let mut cells = Vec::new();
    for (name, kernel) in
        [("kelemen", Kernel::KELEMEN), ("gaussian", Kernel::Gaussian { sigma: 1.0 / 64.0 })]
    {
        let step = kernel.prepare();
        let mut u = RandomStream::new(Address { seed, step: 0, item: 0 });
        let half = VALUES as i64 / 2;
        // Count, sum and sum of squares of ln of the size, each way.
        let mut ways = [[0.0_f64; 3]; 2];
        for _ in 0..STEPS * factor {
            let from = (u.next() as f64 * VALUES) as u32;
            let moved = i64::from(step.apply(from, 1, &mut u)) - i64::from(from);
            let moved = (moved + 3 * half).rem_euclid(2 * half) - half;
            if moved != 0 {
                let way = &mut ways[usize::from(moved < 0)];
                let size = (moved.unsigned_abs() as f64).ln();
                way[0] += 1.0;
                way[1] += size;
                way[2] += size * size;
            }
        }
        let [f, b] = ways;
        let z = (f[0] - b[0]) / (f[0] + b[0]).sqrt();
        cells.push((format!("{name}: steps each way"), 2.0 * normal_sf(z.abs())));
        let moments = |w: [f64; 3]| {
            let mean = w[1] / w[0];
            (mean, (w[2] / w[0] - mean * mean) / w[0])
        };
        let ((mean_f, var_f), (mean_b, var_b)) = (moments(f), moments(b));
        let z = (mean_f - mean_b) / (var_f + var_b).sqrt();
        cells.push((format!("{name}: size of steps each way"), 2.0 * normal_sf(z.abs())));
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::validate::Config;

    #[test]
    fn streams_and_kernels_pass() {
        let mut report = Report::new("", &Config::default(), TESTS);
        numbers(&mut report, 1e-6).unwrap();
        assert!(report.passed(), "{report}");
        assert_eq!(report.checks.len(), TESTS);
    }

    #[test]
    fn tails_of_counts() {
        assert_eq!(at_least(0, 0.1), 1.0);
        assert!((at_least(1, 0.006) - 0.005_982).abs() < 1e-6);
        assert!((at_least(3, 0.006) / 3.58e-8 - 1.0).abs() < 0.01);
        assert!((at_least(1, 2.0) - (1.0 - (-2f64).exp())).abs() < 1e-12);
    }
}
