//! Errors of the replicates of one integrator.

use pathspace_core::color::luminance;
use pathspace_validation::stats::error::{
    Others, ReplicateErrors, half_variance, mean, relative_epsilon, squared_error_halves,
    trimmed_mean,
};
use pathspace_validation::stats::{Estimate, StatsError, mean_interval};

/// Share of the pixels that the trimmed relMSE leaves out: those where it is largest.
pub const TRIMMED: f64 = 0.001;

/// What the error of an image is measured against.
#[derive(Clone, Copy, Debug)]
pub enum Against<'a> {
    /// The other replicates: the error is then the variance, and a bias is not seen.
    Replicates,
    /// Two independent halves of a reference, by (A−R₁)(A−R₂).
    Halves(&'a [f32], &'a [f32]),
}

/// Errors of replicates.
#[derive(Clone, Debug, PartialEq)]
pub struct Errors {
    /// MSE of every replicate with their quantiles.
    pub mse: ReplicateErrors,
    /// Their mean with its interval; NaN where the replicates are too few for one.
    pub interval: Estimate,
    /// relMSE of every replicate.
    pub relative: Vec<f64>,
    /// Mean over the replicates of relMSE without the [`TRIMMED`] largest.
    pub trimmed: f64,
}

impl Errors {
    /// relMSE, the mean over the replicates.
    pub fn relmse(&self) -> f64 {
        self.relative.iter().sum::<f64>() / self.relative.len() as f64
    }
}

/// MSE and relMSE of replicates, images of `[r, g, b]` after each other.
///
/// For every replicate the map of unbiased squared errors e is averaged over pixels and channels;
/// relMSE is the mean of e/(R̄² + ε), ε = 10⁻²·(mean luminance)², with R̄ the mean of the reference
/// or of the replicates. Two replicates without a reference share one estimate, ½(A₁−A₂)², and have
/// no interval. Relative errors of a black image are 0 where there is no error, otherwise NaN.
///
/// # Errors
/// On fewer than 2 replicates, other lengths and values that are not finite.
pub fn errors(replicates: &[&[f32]], against: Against<'_>) -> Result<Errors, StatsError> {
    let (maps, reference) = maps(replicates, against)?;
    let epsilon = relative_epsilon(mean_luminance(&reference));
    let mut relative = Vec::with_capacity(maps.len());
    let mut trimmed = 0.0;
    for map in &maps {
        let scaled: Vec<f64> =
            map.iter().zip(&reference).map(|(e, r)| ratio(*e, r * r + epsilon)).collect();
        relative.push(mean(&scaled)?);
        trimmed += trimmed_mean(&scaled, TRIMMED).unwrap_or(f64::NAN) / maps.len() as f64;
    }
    let mse =
        ReplicateErrors::from_errors(maps.iter().map(|m| mean(m)).collect::<Result<_, _>>()?)?;
    let shared = replicates.len() == 2 && matches!(against, Against::Replicates);
    let interval = if shared {
        Estimate { value: mse.mse, low: f64::NAN, high: f64::NAN }
    } else {
        mean_interval(&mse.per_replicate, 0.95)?
    };
    Ok(Errors { mse, interval, relative, trimmed })
}

/// A map of squared errors for each replicate, and the image that relative errors are relative to.
fn maps(
    replicates: &[&[f32]],
    against: Against<'_>,
) -> Result<(Vec<Vec<f64>>, Vec<f64>), StatsError> {
    match against {
        Against::Halves(r1, r2) => {
            let maps = replicates.iter().map(|a| squared_error_halves(a, r1, r2));
            let middle = |(a, b): (&f32, &f32)| 0.5 * (f64::from(*a) + f64::from(*b));
            Ok((maps.collect::<Result<_, _>>()?, r1.iter().zip(r2).map(middle).collect()))
        }
        Against::Replicates => {
            if let [a, b] = replicates {
                let map = half_variance(a, b)?;
                let middle = |(a, b): (&f32, &f32)| 0.5 * (f64::from(*a) + f64::from(*b));
                return Ok((vec![map.clone(), map], a.iter().zip(*b).map(middle).collect()));
            }
            let others = Others::of(replicates)?;
            let maps = replicates.iter().map(|a| others.map(a));
            Ok((maps.collect::<Result<_, _>>()?, others.mean().to_vec()))
        }
    }
}

fn ratio(error: f64, size: f64) -> f64 {
    if size > 0.0 {
        error / size
    } else if error == 0.0 {
        0.0
    } else {
        f64::NAN
    }
}

fn mean_luminance(image: &[f64]) -> f64 {
    let (pixels, _) = image.as_chunks::<3>();
    pixels.iter().map(luminance).sum::<f64>() / pixels.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() <= 1e-9 * b.abs(), "{a} against {b}");
    }

    #[test]
    fn errors_against_a_reference_by_hand() {
        // One pixel. Channel errors of the first: (2−1)(2−3) = −1, 1·1 = 1, 0; of the second: 3,
        // 4, 0.
        let (r1, r2) = ([1.0, 1.0, 1.0], [3.0, 1.0, 1.0]);
        let e = errors(&[&[2.0, 2.0, 1.0], &[4.0, 3.0, 1.0]], Against::Halves(&r1, &r2)).unwrap();
        assert_eq!(e.mse.per_replicate, [0.0, 7.0 / 3.0]);
        close(e.mse.mse, 7.0 / 6.0);
        // R̄ = (2, 1, 1), whose luminance is 1.212671.
        let epsilon = 0.01 * 1.212671f64.powi(2);
        close(e.relative[0], (-1.0 / (4.0 + epsilon) + 1.0 / (1.0 + epsilon)) / 3.0);
        close(e.relmse() * 2.0, e.relative[0] + e.relative[1]);
    }

    #[test]
    fn errors_of_three_replicates_by_hand() {
        let image = |v: f32| [v; 3];
        let e = errors(&[&image(1.0), &image(2.0), &image(6.0)], Against::Replicates).unwrap();
        // (1−2)(1−6), (2−1)(2−6), (6−1)(6−2): negative for the one in the middle, and not clipped.
        for (got, expected) in e.mse.per_replicate.iter().zip([5.0, -4.0, 20.0]) {
            close(*got, expected);
        }
        close(e.mse.mse, 7.0);
        close(e.relmse(), 7.0 / (9.0 + 0.01 * 9.0));
    }

    #[test]
    fn two_replicates_have_a_variance_and_no_interval() {
        let e = errors(&[&[1.0; 3], &[3.0; 3]], Against::Replicates).unwrap();
        assert_eq!(e.mse.mse, 2.0);
        assert!(e.interval.low.is_nan());
    }

    #[test]
    fn trimming_drops_a_firefly() {
        let n = 3000;
        let mut images = vec![vec![1.0f32; n]; 4];
        images[1][17] = 1e4;
        let views: Vec<&[f32]> = images.iter().map(Vec::as_slice).collect();
        let e = errors(&views, Against::Replicates).unwrap();
        assert!(e.relmse() > 1e-3 && e.trimmed.abs() < 1e-6 * e.relmse(), "{e:?}");
        assert!(e.mse.firefly_index > 2.0);
    }

    #[test]
    fn a_black_image_has_no_error() {
        let e = errors(&[&[0.0; 6], &[0.0; 6], &[0.0; 6]], Against::Replicates).unwrap();
        assert_eq!((e.mse.mse, e.relmse()), (0.0, 0.0));
    }
}
