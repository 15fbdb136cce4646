//! Mean and variance of every pixel over replicates.

use pathspace_core::color::luminance;
use pathspace_validation::stats::error::relative_epsilon;

/// Running mean and sum of squared deviations of images (Welford 1962), pixel by pixel and channel
/// by channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageMoments {
    count: u64,
    mean: Vec<[f64; 3]>,
    squares: Vec<[f64; 3]>,
}

impl ImageMoments {
    /// Moments of images of this many pixels.
    pub fn new(pixels: usize) -> Self {
        ImageMoments { count: 0, mean: vec![[0.0; 3]; pixels], squares: vec![[0.0; 3]; pixels] }
    }

    /// Adds the image of a replicate, which must have as many pixels.
    pub fn push(&mut self, image: &[[f64; 3]]) {
        self.count += 1;
        let n = self.count as f64;
        for ((mean, square), pixel) in self.mean.iter_mut().zip(&mut self.squares).zip(image) {
            for c in 0..3 {
                let d = pixel[c] - mean[c];
                mean[c] += d / n;
                square[c] += d * (pixel[c] - mean[c]);
            }
        }
    }

    /// Number of images.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The mean image.
    pub fn mean(&self) -> &[[f64; 3]] {
        &self.mean
    }

    /// Unbiased variance of one image, pixel by pixel; NaN with fewer than two images.
    pub fn variance(&self) -> Vec<[f64; 3]> {
        let k = self.count.saturating_sub(1) as f64;
        self.squares.iter().map(|s| s.map(|v| v / k)).collect()
    }

    /// MSE of one image where the integrator is unbiased: the mean over pixels and channels of the
    /// variance.
    pub fn mse(&self) -> f64 {
        let k = self.count.saturating_sub(1) as f64 * self.squares.len() as f64 * 3.0;
        self.squares.iter().flatten().sum::<f64>() / k
    }

    /// Relative MSE of one image: the mean over pixels and channels of variance / (mean² + ε), with
    /// ε = 10⁻²·(mean luminance)². 0 where the image is black.
    pub fn relative_mse(&self) -> f64 {
        let luminance = self.mean.iter().map(luminance).sum::<f64>() / self.mean.len() as f64;
        let epsilon = relative_epsilon(luminance);
        if epsilon == 0.0 {
            return if self.mse() == 0.0 { 0.0 } else { f64::NAN };
        }
        let k = self.count.saturating_sub(1) as f64 * self.squares.len() as f64 * 3.0;
        let pixels = self.squares.iter().flatten().zip(self.mean.iter().flatten());
        pixels.map(|(s, m)| s / (m * m + epsilon)).sum::<f64>() / k
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(values: &[f64]) -> ImageMoments {
        let mut m = ImageMoments::new(2);
        for v in values {
            m.push(&[[*v; 3], [2.0; 3]]);
        }
        m
    }

    #[test]
    fn mse_is_the_mean_over_pixels_of_the_variance() {
        let m = moments(&[1.0, 2.0, 6.0]);
        assert_eq!(m.mean()[0], [3.0; 3]);
        assert_eq!(m.variance(), vec![[7.0; 3], [0.0; 3]]);
        assert!((m.mse() - 3.5).abs() < 1e-12);
    }

    #[test]
    fn relative_mse_does_not_depend_on_the_unit() {
        let (one, kilo) = (moments(&[1.0, 2.0, 6.0]), moments(&[1.0e3, 2.0e3, 6.0e3]));
        // The second pixel is constant in both, and dark in one: it changes ε only.
        assert!(one.relative_mse() > 0.0 && kilo.relative_mse() > one.relative_mse());
        let mut scaled = ImageMoments::new(2);
        for v in [1.0, 2.0, 6.0] {
            scaled.push(&[[v * 8.0; 3], [16.0; 3]]);
        }
        assert!((scaled.relative_mse() - one.relative_mse()).abs() < 1e-12);
    }

    #[test]
    fn a_black_image_without_noise_has_no_error() {
        let mut m = ImageMoments::new(1);
        m.push(&[[0.0; 3]]);
        m.push(&[[0.0; 3]]);
        assert_eq!((m.mse(), m.relative_mse()), (0.0, 0.0));
    }
}
