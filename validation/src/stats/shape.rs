//! The shape of replicate means: skewness and tails, pooled over the cells of one kind.
//!
//! A t-test of two methods of different shape alarms in the tail of its own accord: E t ≈ −γ/(2√K)
//! for the skewness γ of the noisier method, and the tail on that side is heavier. Over a thousand
//! tiles that is a difference. A permutation of labels does not help; it makes both methods of one
//! shape. One tile's K replicates can not tell γ, all tiles of one kind together can.

use super::dist::student_sf;
use super::fault::StatsError;
use super::moments::Moments;
use super::pareto::pareto_khat;

/// Skewness of the cells of an method (rows are replicates, columns cells): the mean over cells
/// that are not constant of G₁ = K/((K−1)(K−2)) Σ(x−x̄)³/s³ (Joanes & Gill 1998), times 1 + 6/K.
///
/// G₁ of a skewed variable is too small because s³ grows with Σ(x−x̄)³; the factor is that of gamma
/// distributions of shape 4 to 50 to within 3 % from K = 16 on (by simulation). 0 with fewer than 3
/// replicates and where all cells are constant.
pub fn pooled_skewness(rows: &[Vec<f64>]) -> f64 {
    let n = rows.len();
    let cells = rows.first().map_or(0, Vec::len);
    let (mut sum, mut count) = (0.0, 0.0);
    for cell in 0..cells {
        let column: Vec<f64> = rows.iter().map(|r| r[cell]).collect();
        let Ok(m) = Moments::of(&column) else { continue };
        if n < 3 || m.variance == 0.0 {
            continue;
        }
        let s = m.variance.sqrt();
        let cubes: f64 = column.iter().map(|x| ((x - m.mean) / s).powi(3)).sum();
        let k = n as f64;
        sum += cubes * k / ((k - 1.0) * (k - 2.0));
        count += 1.0;
    }
    if count > 0.0 { (1.0 + 6.0 / n as f64) * sum / count } else { 0.0 }
}

/// A difference of means in standard errors, cleared of skewness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Skewed {
    /// Hall's transform of Welch's t, no further from 0 than t itself.
    pub t: f64,
    /// Two-sided p-value.
    pub p: f64,
}

/// Welch's test of methods with the known skewnesses `gamma`, by Hall's (1992) monotone
/// transformation g(t) = t + κt²/3 + κ²t³/27 + κ/6, κ the skewness of the difference of the means:
/// κ = (γ_A s_A³/K_A² − γ_B s_B³/K_B²)/(s_A²/K_A + s_B²/K_B)^{3/2}.
///
/// What is nearer to 0 of t and g(t), and 0 where their signs differ, is compared with Student's t
/// of Welch's degrees of freedom: γ is an average over cells, and one that is less skewed than that
/// must not seem to differ because of it. Two constants: p = 1 where they are equal and p = 0 where
/// they are not. Fails on fewer than 2 values in an method and on non-finite values.
pub fn skewed_welch(a: &[f64], b: &[f64], gamma: [f64; 2]) -> Result<Skewed, StatsError> {
    let (a, b) = (Moments::of(a)?, Moments::of(b)?);
    let (va, vb) = (a.squared_error(), b.squared_error());
    let d = a.mean - b.mean;
    if va + vb == 0.0 {
        let differ = d != 0.0;
        let t = if differ { d.signum() * f64::INFINITY } else { 0.0 };
        return Ok(Skewed { t, p: f64::from(u8::from(!differ)) });
    }
    let df = super::welch::satterthwaite(&[(va, a.n), (vb, b.n)]);
    let t = d / (va + vb).sqrt();
    // Each method's share of the squared error, so that tiny variances do not underflow.
    let share = |v: f64, n: usize| (v / (va + vb)).powf(1.5) / (n as f64).sqrt();
    let kappa = gamma[0] * share(va, a.n) - gamma[1] * share(vb, b.n);
    let g = t + kappa * t * t / 3.0 + kappa * kappa * t * t * t / 27.0 + kappa / 6.0;
    let nearer = if t < 0.0 { g.clamp(t, 0.0) } else { g.clamp(0.0, t) };
    Ok(Skewed { t: nearer, p: (2.0 * student_sf(nearer.abs(), df)).min(1.0) })
}

/// How heavy the tails of an method's cells are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tail {
    /// What a cell has missed, on average over the cells, in standard errors: √K times the mean
    /// excess of the residuals over their 1 − 1/K quantile. 0.2 for normal replicates at K = 16,
    /// 0.4 for gamma distributions of shape 4.
    pub missed: f64,
    /// Pareto shape k̂ of the residuals.
    pub khat: f64,
    /// The same excess in the unit of the values, the mean over all cells: what came in less than
    /// one of K replicates of a cell.
    pub rare: f64,
}

impl Tail {
    /// True where the variance is infinite by all signs and cells have missed more than chance
    /// explains.
    pub fn is_heavy(&self) -> bool {
        self.khat >= HEAVY && self.missed > MISSED
    }

    /// True where a t-test that knows the skewness can be trusted.
    pub fn is_light(&self) -> bool {
        self.khat < HEAVY && self.missed <= MISSED
    }
}

/// Most that a cell may have missed on average, in standard errors.
const MISSED: f64 = 0.4;
/// Pareto shape from which on the variance is infinite.
const HEAVY: f64 = 0.5;

/// Fewest residuals that say anything of a tail.
const FEWEST_RESIDUALS: usize = 200;

/// Tail of the residuals of all cells together; `None` where they are fewer than 200.
///
/// Residuals are (x − median)/s₋ with s₋ the root mean square below the median: fireflies enter
/// neither, and cells of unequal noise make no tail together. Light that falls in less than one of
/// K replicates is missing from most cells, mean and variance alike: nothing in such a cell shows
/// it, but other cells of its kind do.
pub fn tail(rows: &[Vec<f64>]) -> Result<Option<Tail>, StatsError> {
    let k = rows.len();
    let cells = rows.first().map_or(0, Vec::len);
    let (mut residuals, mut scales) = (Vec::new(), Vec::new());
    for cell in 0..cells {
        let mut column: Vec<f64> = rows.iter().map(|r| r[cell]).collect();
        column.sort_by(f64::total_cmp);
        let median = 0.5 * (column[(k - 1) / 2] + column[k / 2]);
        let below = &column[..k / 2];
        let square: f64 = below.iter().map(|x| (median - x) * (median - x)).sum();
        let scale = (square / below.len().max(1) as f64).sqrt();
        if scale > 1e-9 * median.abs() {
            residuals.extend(column.iter().map(|x| (x - median) / scale));
            scales.resize(residuals.len(), scale);
        }
    }
    if residuals.len() < FEWEST_RESIDUALS {
        return Ok(None);
    }
    let khat = pareto_khat(&residuals)?.unwrap_or(f64::INFINITY);
    let mut sorted = residuals.clone();
    sorted.sort_by(|x, y| y.total_cmp(x));
    let quantile = sorted[sorted.len() / k];
    let (mut excess, mut rare) = (0.0, 0.0);
    for (r, scale) in residuals.iter().zip(&scales).filter(|(r, _)| **r > quantile) {
        excess += r - quantile;
        rare += (r - quantile) * scale;
    }
    let missed = (k as f64).sqrt() * excess / residuals.len() as f64;
    Ok(Some(Tail { missed, khat, rare: rare / (k * cells) as f64 }))
}

#[cfg(test)]
mod tests {
    use super::super::testing::Source;
    use super::super::{binomial_interval, welch};
    use super::*;

    fn rows(k: usize, cells: usize, mut value: impl FnMut() -> f64) -> Vec<Vec<f64>> {
        (0..k).map(|_| (0..cells).map(|_| value()).collect()).collect()
    }

    /// Gamma of whole shape n and mean 1, as a sum of exponentials: skewness 2/√n.
    fn gamma(source: &mut Source, n: u32) -> f64 {
        -(0..n).map(|_| source.uniform().ln()).sum::<f64>() / f64::from(n)
    }

    #[test]
    fn skewness_of_gamma_replicates_is_recovered_at_16_a_cell() {
        let mut source = Source::new(70);
        for n in [4, 16] {
            let measured = pooled_skewness(&rows(16, 4000, || gamma(&mut source, n)));
            let exact = 2.0 / f64::from(n).sqrt();
            assert!((measured / exact - 1.0).abs() < 0.1, "{n}: {measured} against {exact}");
        }
    }

    #[test]
    fn without_skewness_the_test_is_welchs() {
        let mut source = Source::new(71);
        let (a, b) = (source.normals(16, 1.0, 0.3), source.normals(12, 1.1, 0.1));
        let (plain, same) = (welch(&a, &b).unwrap(), skewed_welch(&a, &b, [0.0; 2]).unwrap());
        assert!((plain.p - same.p).abs() < 1e-12 && (plain.t - same.t).abs() < 1e-12);
    }

    /// Comparisons of a skewed with a symmetric method over 200 cells that alarm at 5 %,
    /// family-wise.
    fn alarms(runs: u64, corrected: bool) -> u64 {
        let mut source = Source::new(72);
        let mut count = 0;
        for _ in 0..runs {
            let a = rows(16, 200, || gamma(&mut source, 4));
            let b = rows(16, 200, || 1.0 + 0.02 * source.normal());
            let skew =
                if corrected { [pooled_skewness(&a), pooled_skewness(&b)] } else { [0.0; 2] };
            let least = (0..200).fold(1.0, |least: f64, c| {
                let column = |rows: &[Vec<f64>]| rows.iter().map(|r| r[c]).collect::<Vec<_>>();
                least.min(skewed_welch(&column(&a), &column(&b), skew).unwrap().p)
            });
            count += u64::from(200.0 * least <= 0.05);
        }
        count
    }

    #[test]
    fn methods_of_different_shape_alarm_at_the_level_once_skewness_is_known() {
        let (with, without) = (alarms(500, true), alarms(500, false));
        let (_, high) = binomial_interval(with, 500, 0.95).unwrap();
        assert!(high <= 0.075, "{with} of 500");
        let (low, _) = binomial_interval(without, 500, 0.95).unwrap();
        assert!(low > 0.1, "{without} of 500");
    }

    #[test]
    fn rare_fireflies_show_in_the_tail_although_no_cell_shows_them() {
        let mut source = Source::new(73);
        let smooth = tail(&rows(16, 200, || 1.0 + 0.1 * source.normal())).unwrap().unwrap();
        assert!(smooth.missed < 0.3 && smooth.khat < 0.4, "{smooth:?}");
        let mut source = Source::new(74);
        let spiky = rows(16, 200, || {
            let firefly = if source.uniform() < 0.01 { 2.0 / source.uniform() } else { 0.0 };
            1.0 + 0.1 * source.normal() + firefly
        });
        let spiky = tail(&spiky).unwrap().unwrap();
        assert!(spiky.missed > 1.0 && spiky.khat > 0.5, "{spiky:?}");
    }

    #[test]
    fn cells_of_unequal_noise_make_no_tail() {
        let mut source = Source::new(75);
        let noise: Vec<f64> = (0..200).map(|_| (2.0 * source.normal()).exp()).collect();
        let rows: Vec<Vec<f64>> =
            (0..16).map(|_| noise.iter().map(|s| 100.0 + s * source.normal()).collect()).collect();
        let t = tail(&rows).unwrap().unwrap();
        assert!(t.missed < 0.3 && t.khat < 0.4, "{t:?}");
    }

    #[test]
    fn few_residuals_tell_nothing_and_constants_are_no_hypothesis() {
        assert_eq!(tail(&rows(16, 4, || 1.0)), Ok(None));
        assert_eq!(skewed_welch(&[1.0; 4], &[1.0; 4], [0.0; 2]).unwrap().p, 1.0);
        assert_eq!(skewed_welch(&[1.0; 4], &[2.0; 4], [0.0; 2]).unwrap().p, 0.0);
    }
}
