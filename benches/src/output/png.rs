//! PNG for looking at: exposure, a soft shoulder, the sRGB curve, 8 bits.

use std::io;

use pathspace_core::color::luminance;

use super::Picture;

/// Where the shoulder begins, as a share of white.
const SHOULDER: f64 = 0.8;

/// The exposure that brings the 95 % quantile of luminance to the begin of the shoulder; 1 for a
/// black image.
///
/// Lamps in the picture are among the brightest twentieth and do not darken the rest.
pub fn exposure(pixels: &[[f64; 3]]) -> f64 {
    let mut y: Vec<f64> = pixels.iter().map(luminance).filter(|v| v.is_finite()).collect();
    if y.is_empty() {
        return 1.0;
    }
    let at = (y.len() - 1) * 19 / 20;
    let (_, &mut quantile, brighter) = y.select_nth_unstable_by(at, f64::total_cmp);
    let level = if quantile > 0.0 {
        quantile
    } else {
        // Nearly all is black: what is not shall be seen.
        brighter.iter().copied().fold(0.0, f64::max)
    };
    if level > 0.0 { SHOULDER / level } else { 1.0 }
}

/// The file as bytes.
pub(super) fn encode(picture: &Picture<'_>, exposure: f64) -> io::Result<Vec<u8>> {
    let crop = picture.film.crop;
    let bytes: Vec<u8> =
        picture.pixels.iter().flatten().map(|v| to_byte(tone(v * exposure))).collect();
    file(&bytes, crop.width, crop.height)
}

/// Radiance times exposure as an sRGB colour of 8 bits.
pub fn tone_map(radiance: [f64; 3], exposure: f64) -> [u8; 3] {
    radiance.map(|v| to_byte(tone(v * exposure)))
}

/// The bytes of a picture without layers.
pub(super) fn encode_rgb(picture: &image::RgbImage) -> io::Result<Vec<u8>> {
    file(picture, picture.width(), picture.height())
}

/// A PNG file that says who wrote it.
fn file(bytes: &[u8], width: u32, height: u32) -> io::Result<Vec<u8>> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.add_text_chunk("Software".into(), "pathspace".into())?;
    encoder.write_header()?.write_image_data(bytes)?;
    Ok(out)
}

/// The identity below the shoulder, then an exponential towards 1 with the same slope.
fn tone(v: f64) -> f64 {
    if v <= SHOULDER {
        v.max(0.0)
    } else {
        let room = 1.0 - SHOULDER;
        1.0 - room * (-(v - SHOULDER) / room).exp()
    }
}

/// sRGB's transfer curve (IEC 61966-2-1) and rounding.
fn to_byte(v: f64) -> u8 {
    let s = if v <= 0.0031308 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (s * 255.0 + 0.5).clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tone_curve_is_monotonic_and_smooth_at_the_shoulder() {
        let values: Vec<f64> = (0..400).map(|i| tone(i as f64 * 0.01)).collect();
        assert!(values.windows(2).all(|w| w[0] < w[1]) && values[399] < 1.0);
        let h = 1e-6;
        assert!(((tone(SHOULDER + h) - tone(SHOULDER)) / h - 1.0).abs() < 1e-4);
        assert_eq!((to_byte(0.0), to_byte(1.0), to_byte(0.2159)), (0, 255, 128));
    }

    #[test]
    fn a_lamp_does_not_set_the_exposure() {
        let mut pixels = vec![[0.4; 3]; 100];
        pixels[3] = [1000.0; 3];
        assert!((exposure(&pixels) - 2.0).abs() < 1e-9);
        assert_eq!(exposure(&[[0.0; 3]; 4]), 1.0);
    }
}
