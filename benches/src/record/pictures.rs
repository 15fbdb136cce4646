//! Pictures of images and of their errors.

use std::io::{self, Cursor};
use std::path::Path;

use image::{ImageFormat, Rgb, RgbImage};
use pathspace_core::color::luminance;
use pathspace_validation::stats::error::relative_epsilon;

use crate::output::tone_map;

/// Relative errors from 10⁻³ to 1 go through the colours from dark to bright, on the logarithm.
const DECADES: f64 = 3.0;

pub(super) fn write_png(path: &Path, picture: &RgbImage) -> io::Result<()> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png).map_err(|e| io::Error::other(e.to_string()))?;
    crate::output::write_bytes(path, &bytes.into_inner())
}

pub(super) fn tone_mapped(image: &[[f64; 3]], width: u32, height: u32, exposure: f64) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        let at = y as usize * width as usize + x as usize;
        Rgb(image.get(at).map_or([0; 3], |p| tone_map(*p, exposure)))
    })
}

/// Standard deviation of a replicate over √(mean² + ε), of luminance, in false colour.
pub(super) fn sigma_map(
    mean: &[[f64; 3]],
    variance: &[[f64; 3]],
    width: u32,
    height: u32,
) -> RgbImage {
    // Channels of one pixel go up and down together.
    let sigma = |v: &[f64; 3]| luminance(&v.map(f64::sqrt));
    let pairs = mean.iter().zip(variance).map(|(m, v)| (luminance(m), sigma(v)));
    false_colour(&pairs.collect::<Vec<_>>(), width, height)
}

/// |image − truth| over √(truth² + ε), of luminance, in false colour.
pub(super) fn error_map(
    image: &[[f64; 3]],
    truth: &[[f64; 3]],
    width: u32,
    height: u32,
) -> RgbImage {
    let error =
        |(a, t): (&[f64; 3], &[f64; 3])| (luminance(t), (luminance(a) - luminance(t)).abs());
    false_colour(&image.iter().zip(truth).map(error).collect::<Vec<_>>(), width, height)
}

/// Magma over the logarithm of error over size.
fn false_colour(pairs: &[(f64, f64)], width: u32, height: u32) -> RgbImage {
    let epsilon =
        relative_epsilon(pairs.iter().map(|p| p.0).sum::<f64>() / pairs.len().max(1) as f64);
    RgbImage::from_fn(width, height, |x, y| {
        let (size, error) = pairs[y as usize * width as usize + x as usize];
        let relative = error / (size * size + epsilon).sqrt();
        // NaN and 0, also of a black image, are dark.
        let level = if relative > 0.0 { 1.0 + relative.log10() / DECADES } else { 0.0 };
        let colour = colorous::MAGMA.eval_continuous(level.clamp(0.0, 1.0));
        Rgb([colour.r, colour.g, colour.b])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_errors_are_brighter() {
        let truth = vec![[1.0; 3]; 3];
        let map = error_map(&[[1.0; 3], [1.01; 3], [1.5; 3]], &truth, 3, 1);
        let sum = |x: u32| map.get_pixel(x, 0).0.iter().map(|v| u32::from(*v)).sum::<u32>();
        assert!(sum(0) < sum(1) && sum(1) < sum(2));
    }

    #[test]
    fn a_black_image_has_a_dark_map() {
        let map = sigma_map(&[[0.0; 3]], &[[0.0; 3]], 1, 1);
        assert!(map.get_pixel(0, 0).0.iter().all(|v| *v < 8));
    }
}
