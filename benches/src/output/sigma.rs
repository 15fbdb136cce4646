//! Maps of differences as pictures.

use image::{Rgb, RgbImage};

/// Differences of this many standard deviations, and larger ones, have the full colour.
pub const FULL_SIGMA: f64 = 5.0;
/// A map is enlarged to about so many pixels along its longer side.
const SIDE: usize = 512;

/// A map in standard deviations as a picture: red where the first side has more light, blue where
/// it has less, white at 0.
pub fn sigma_picture(columns: usize, sigma: &[f64]) -> RgbImage {
    let columns = columns.max(1);
    let rows = sigma.len() / columns;
    let scale = (SIDE / columns.max(rows).max(1)).max(1);
    RgbImage::from_fn((columns * scale) as u32, (rows * scale) as u32, |x, y| {
        let value = sigma[(y as usize / scale) * columns + x as usize / scale];
        // The gradient runs from red to blue.
        let at = 0.5 - 0.5 * (value / FULL_SIGMA).clamp(-1.0, 1.0);
        Rgb(colorous::RED_BLUE.eval_continuous(at).into_array())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_light_is_red_and_less_is_blue() {
        let picture = sigma_picture(2, &[9.0, -9.0]);
        assert_eq!(picture.dimensions(), (512, 256));
        let [left, right] = [picture.get_pixel(0, 0).0, picture.get_pixel(511, 255).0];
        assert!(left[0] > 2 * left[2] && right[2] > 2 * right[0], "{left:?} {right:?}");
    }
}
