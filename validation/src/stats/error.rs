//! Error of images: MSE without a perfect reference, relative and trimmed forms.
//!
//! Images are flat slices of values, one entry a pixel (luminance) or several (channels,
//! interleaved); the two images of a call have the same layout. A metric first makes a map of
//! per-entry errors, which is then averaged with [`mean`] or [`trimmed_mean`]. Estimates of squared
//! errors may be negative; they are never clipped before averaging, since clipping would bias the
//! mean.

use serde::Serialize;

use super::fault::{StatsError, all_finite, at_least, open_unit, same_length};
use super::moments::Moments;

/// Map of (A−R)², the squared error of A against a reference R; unit of the values squared.
///
/// If R is itself noisy with variance σ_R², the mean is too large by σ_R²: use
/// [`squared_error_halves`] then.
pub fn squared_error<T: Copy + Into<f64>>(a: &[T], r: &[T]) -> Result<Vec<f64>, StatsError> {
    squared_error_halves(a, r, r)
}

/// Map of (A−R₁)(A−R₂) with two independent unbiased references.
///
/// Given A, E[(A−R₁)(A−R₂)] = (A−E R)² for A, R₁ and R₂ independent: the mean over pixels is the
/// MSE of A without the noise of the references. Entries may be negative. Fails on other lengths
/// and on non-finite values.
pub fn squared_error_halves<T: Copy + Into<f64>>(
    a: &[T],
    r1: &[T],
    r2: &[T],
) -> Result<Vec<f64>, StatsError> {
    same_length("image and reference", a.len(), r1.len())?;
    same_length("image and reference", a.len(), r2.len())?;
    let map: Vec<f64> = a
        .iter()
        .zip(r1.iter().zip(r2))
        .map(|(&a, (&p, &q))| {
            let a: f64 = a.into();
            (a - p.into()) * (a - q.into())
        })
        .collect();
    all_finite("squared errors", &map)?;
    Ok(map)
}

/// Map of ½(A₁−A₂)², an unbiased estimate of the variance of one half from two independent halves.
///
/// The mean of both halves has half of that variance.
pub fn half_variance<T: Copy + Into<f64>>(a1: &[T], a2: &[T]) -> Result<Vec<f64>, StatsError> {
    Ok(squared_error(a1, a2)?.into_iter().map(|d| 0.5 * d).collect())
}

/// The ε of relMSE, 10⁻²·(mean luminance)², so that black pixels weigh a finite amount in any unit.
pub fn relative_epsilon(mean_luminance: f64) -> f64 {
    1e-2 * mean_luminance * mean_luminance
}

/// Map of (A−R)²/(R²+ε), dimensionless; ε from [`relative_epsilon`].
pub fn relative_error<T: Copy + Into<f64>>(
    a: &[T],
    r: &[T],
    epsilon: f64,
) -> Result<Vec<f64>, StatsError> {
    relative_error_halves(a, r, r, epsilon)
}

/// Map of (A−R₁)(A−R₂)/(R̄²+ε) with R̄ = ½(R₁+R₂), dimensionless.
///
/// The numerator is unbiased; R̄² in the denominator exceeds R² by the variance of R̄, so the
/// references should be clearly better than A. Fails where ε is not positive.
pub fn relative_error_halves<T: Copy + Into<f64>>(
    a: &[T],
    r1: &[T],
    r2: &[T],
    epsilon: f64,
) -> Result<Vec<f64>, StatsError> {
    if !(epsilon > 0.0 && epsilon.is_finite()) {
        let expected = "a positive number (is the image black?)";
        return Err(StatsError::OutOfRange { what: "epsilon of relMSE", value: epsilon, expected });
    }
    let mut map = squared_error_halves(a, r1, r2)?;
    for (e, (&p, &q)) in map.iter_mut().zip(r1.iter().zip(r2)) {
        let r = 0.5 * (p.into() + q.into());
        *e /= r * r + epsilon;
    }
    Ok(map)
}

/// Mean of an error map; fails on an empty one.
pub fn mean(map: &[f64]) -> Result<f64, StatsError> {
    at_least("pixels", 1, map.len())?;
    Ok(map.iter().sum::<f64>() / map.len() as f64)
}

/// Mean of an error map without its largest `fraction`, ⌈fraction·n⌉ entries; 0.001 for trimmed
/// relMSE.
///
/// Tells noise that is everywhere from a few fireflies. It is not an estimate of the MSE: the
/// trimmed part is error too. Fails where nothing is left or the fraction lies outside (0, 1).
pub fn trimmed_mean(map: &[f64], fraction: f64) -> Result<f64, StatsError> {
    open_unit("trimmed fraction", fraction)?;
    let drop = (fraction * map.len() as f64).ceil() as usize;
    at_least("pixels", drop + 1, map.len())?;
    let keep = map.len() - drop;
    let mut sorted = map.to_vec();
    sorted.select_nth_unstable_by(keep - 1, f64::total_cmp);
    mean(&sorted[..keep])
}

/// The replicates of one method as references for each other.
///
/// For replicate r and pixel value A_r the squared error is estimated by the mean of
/// (A_r−A_i)(A_r−A_j) over all pairs i<j of other replicates: the two-reference form of
/// [`squared_error_halves`] over all splits. With d_i = A_i − Ā this is (K(K−1)d_r² −
/// Σd²)/((K−1)(K−2)).
#[derive(Clone, Debug, PartialEq)]
pub struct Others {
    count: f64,
    mean: Vec<f64>,
    squares: Vec<f64>,
}

impl Others {
    /// Sums over the replicates.
    ///
    /// # Errors
    /// On fewer than 3 replicates, other lengths and non-finite values.
    pub fn of<T: Copy + Into<f64>>(replicates: &[&[T]]) -> Result<Self, StatsError> {
        at_least("replicates", 3, replicates.len())?;
        let pixels = replicates[0].len();
        at_least("pixels", 1, pixels)?;
        for r in replicates {
            same_length("images of replicates", pixels, r.len())?;
        }
        let count = replicates.len() as f64;
        let values = |i: usize| replicates.iter().map(move |r| -> f64 { r[i].into() });
        let mean: Vec<f64> = (0..pixels).map(|i| values(i).sum::<f64>() / count).collect();
        all_finite("images of replicates", &mean)?;
        let square = |i: usize| values(i).map(|v| (v - mean[i]).powi(2)).sum();
        let squares = (0..pixels).map(square).collect();
        Ok(Others { count, mean, squares })
    }

    /// The mean over the replicates.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Map of the squared error of one of the replicates; entries may be negative.
    ///
    /// # Errors
    /// On another length.
    pub fn map<T: Copy + Into<f64>>(&self, replicate: &[T]) -> Result<Vec<f64>, StatsError> {
        same_length("images of replicates", self.mean.len(), replicate.len())?;
        let (n, pairs) = (self.count, (self.count - 1.0) * (self.count - 2.0));
        let pixels = replicate.iter().zip(self.mean.iter().zip(&self.squares));
        let error = |(&a, (m, s)): (&T, (&f64, &f64))| {
            let d = a.into() - m;
            (n * (n - 1.0) * d * d - s) / pairs
        };
        Ok(pixels.map(error).collect())
    }
}

/// Errors of single replicates of one method, estimated from the replicates alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReplicateErrors {
    /// MSE of each replicate, estimated with the others as its reference; may be negative.
    pub per_replicate: Vec<f64>,
    /// Their mean: the average over pixels of the across-replicate variance, the MSE of one
    /// replicate.
    pub mse: f64,
    /// Their median.
    pub median: f64,
    /// Their 90 % quantile.
    pub q90: f64,
    /// The largest.
    pub max: f64,
    /// Coefficient of variation of the per-replicate MSE.
    pub cv: f64,
    /// Mean over median: 1 for noise that is the same everywhere, large where fireflies carry the
    /// error.
    pub firefly_index: f64,
}

/// Error of the replicates of one unbiased method, without any reference.
///
/// The estimate for one replicate is the mean of its map of [`Others`]. Its mean over r is exactly
/// the unbiased variance over replicates. It sees noise and no bias, which is what tests on means
/// are for. The estimates of different r share data, so their spread is right to O(1/K). Fails on
/// fewer than 3 replicates, other lengths and non-finite values.
pub fn replicate_errors<T: Copy + Into<f64>>(
    replicates: &[&[T]],
) -> Result<ReplicateErrors, StatsError> {
    let others = Others::of(replicates)?;
    let per_replicate =
        replicates.iter().map(|r| mean(&others.map(r)?)).collect::<Result<Vec<_>, _>>()?;
    ReplicateErrors::from_errors(per_replicate)
}

impl ReplicateErrors {
    /// Mean, quantiles and firefly index of the errors of single replicates, however they were
    /// measured.
    ///
    /// # Errors
    /// On fewer than 2 replicates and non-finite errors.
    pub fn from_errors(per_replicate: Vec<f64>) -> Result<Self, StatsError> {
        all_finite("errors of replicates", &per_replicate)?;
        let moments = Moments::of(&per_replicate)?;
        let mut sorted = per_replicate.clone();
        sorted.sort_by(f64::total_cmp);
        let median = quantile(&sorted, 0.5);
        Ok(ReplicateErrors {
            mse: moments.mean,
            median,
            q90: quantile(&sorted, 0.9),
            max: sorted[sorted.len() - 1],
            cv: moments.cv(),
            firefly_index: match (moments.mean, median) {
                (0.0, _) => 1.0,
                (mean, median) if median > 0.0 => mean / median,
                _ => f64::INFINITY,
            },
            per_replicate,
        })
    }
}

/// Quantile of sorted values by linear interpolation at (n−1)q (type 7 of Hyndman & Fan 1996).
///
/// `sorted` must not be empty.
fn quantile(sorted: &[f64], q: f64) -> f64 {
    let h = (sorted.len() - 1) as f64 * q;
    let (low, high) = (h.floor() as usize, h.ceil() as usize);
    sorted[low] + (h - low as f64) * (sorted[high] - sorted[low])
}

#[cfg(test)]
mod tests {
    use super::super::efficiency::efficiency;
    use super::super::testing::Source;
    use super::*;

    fn close(a: f64, b: f64, relative: f64) {
        assert!((a - b).abs() <= relative * b.abs(), "{a} against {b}");
    }

    #[test]
    fn two_halves_estimate_the_error_without_the_noise_of_the_reference() {
        let mut source = Source::new(21);
        let n = 40_000;
        let a = source.normals(n, 1.1, 0.2);
        let (r1, r2) = (source.normals(n, 1.0, 0.3), source.normals(n, 1.0, 0.3));
        // Bias² + variance = 0.01 + 0.04; one reference alone would add its 0.09.
        let mse = mean(&squared_error_halves(&a, &r1, &r2).unwrap()).unwrap();
        assert!((mse - 0.05).abs() < 0.004, "{mse}");
        let naive = mean(&squared_error(&a, &r1).unwrap()).unwrap();
        assert!((naive - 0.14).abs() < 0.004, "{naive}");
    }

    #[test]
    fn half_variance_is_the_variance_of_one_half() {
        let mut source = Source::new(22);
        let (a, b) = (source.normals(40_000, 5.0, 0.3), source.normals(40_000, 5.0, 0.3));
        let v = mean(&half_variance(&a, &b).unwrap()).unwrap();
        assert!((v - 0.09).abs() < 0.003, "{v}");
    }

    #[test]
    fn relative_error_is_the_same_in_any_unit() {
        let (a, r) = ([1.0f32, 0.5, 0.0], [1.5f32, 0.25, 0.0]);
        let scaled = |v: &[f32]| v.iter().map(|x| 1024.0 * x).collect::<Vec<_>>();
        let one = relative_error(&a, &r, relative_epsilon(0.5)).unwrap();
        let kilo = relative_error(&scaled(&a), &scaled(&r), relative_epsilon(512.0)).unwrap();
        assert_eq!(one, kilo);
        close(one[0], 0.25 / (2.25 + 0.0025), 1e-12);
        assert!(relative_error(&a, &r, 0.0).is_err());
    }

    #[test]
    fn trimming_drops_the_largest_entries_only() {
        let mut map = vec![1.0; 1000];
        map[17] = 1e9;
        assert_eq!(trimmed_mean(&map, 0.001).unwrap(), 1.0);
        map[18] = 2.0;
        close(trimmed_mean(&map, 0.001).unwrap(), 1000.0 / 999.0, 1e-12);
        assert!(trimmed_mean(&[1.0], 0.001).is_err());
    }

    #[test]
    fn mean_of_replicate_errors_is_the_pixel_variance() {
        let mut source = Source::new(23);
        let images: Vec<Vec<f64>> = (0..5).map(|_| source.normals(50, 1e3, 0.5)).collect();
        let views: Vec<&[f64]> = images.iter().map(Vec::as_slice).collect();
        let errors = replicate_errors(&views).unwrap();
        let variance: f64 = (0..50)
            .map(|i| Moments::of(&views.iter().map(|v| v[i]).collect::<Vec<_>>()).unwrap().variance)
            .sum();
        close(errors.mse, variance / 50.0, 1e-9);
    }

    #[test]
    fn replicate_error_is_the_mean_over_pairs_of_the_others() {
        let images: [&[f64]; 4] = [&[1.0], &[3.0], &[4.0], &[8.0]];
        // Replicate 0: pairs (3,4), (3,8), (4,8) give 2·3, 2·7, 3·7.
        close(replicate_errors(&images).unwrap().per_replicate[0], 41.0 / 3.0, 1e-12);
    }

    #[test]
    fn a_firefly_in_one_replicate_raises_the_index() {
        let mut source = Source::new(24);
        let mut images: Vec<Vec<f64>> = (0..8).map(|_| source.normals(400, 1.0, 0.1)).collect();
        let index = |images: &[Vec<f64>]| {
            let views: Vec<&[f64]> = images.iter().map(Vec::as_slice).collect();
            replicate_errors(&views).unwrap().firefly_index
        };
        assert!((index(&images) - 1.0).abs() < 0.1);
        images[2][7] = 50.0;
        assert!(index(&images) > 5.0);
    }

    #[test]
    fn exact_images_have_no_error_and_infinite_efficiency() {
        let image = [0.1f32, 0.2, 0.3];
        let errors = replicate_errors(&[&image[..]; 4]).unwrap();
        assert_eq!((errors.mse, errors.max), (0.0, 0.0));
        assert_eq!(efficiency(errors.mse, 2.0), f64::INFINITY);
    }

    #[test]
    fn bad_images_are_errors() {
        assert!(squared_error(&[1.0], &[1.0, 2.0]).is_err());
        assert!(squared_error(&[f64::NAN], &[1.0]).is_err());
        assert!(replicate_errors::<f64>(&[&[1.0], &[2.0]]).is_err());
        assert!(mean(&[]).is_err());
    }
}
