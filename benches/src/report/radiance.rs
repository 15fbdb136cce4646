//! Radiance for the page: half floats with 7 bits of mantissa, compressed without further loss.
//!
//! A step is at most 2⁻⁷ of the value and the rounding half of it, less than half a code of 8-bit
//! sRGB at every exposure. The codes are monotonic in the value, so that a neighbourhood of noise
//! is a neighbourhood of numbers: each is predicted by the mean of its left and upper neighbour,
//! red and blue also by the error made on green, and deflate packs what remains.

use std::io::{self, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use half::f16;

/// Mantissa bits of a half float that are dropped.
const DROPPED: u32 = 3;
/// Code of infinity; finite values are below.
const INFINITE: i32 = 0x7c00 >> DROPPED;
/// Code of a value that is not a number.
const NOT_A_NUMBER: i32 = 0x7fff >> DROPPED;

/// Packs planes of `width` columns into base64 text.
///
/// Three planes are red, green and blue; other counts are independent of each other. The page's
/// `unpack` is the inverse.
///
/// # Errors
/// None in practice: the stream is in memory.
pub(super) fn pack(planes: &[Vec<f32>], width: usize) -> io::Result<String> {
    let mut residuals: Vec<Vec<i32>> = planes.iter().map(|p| predict(p, width)).collect();
    if let [red, green, blue] = residuals.as_mut_slice() {
        for plane in [red, blue] {
            for (r, g) in plane.iter_mut().zip(green.iter()) {
                *r -= g;
            }
        }
    }
    let mut stream = ZlibEncoder::new(Vec::new(), Compression::best());
    for plane in &residuals {
        // Low bytes are noise, high bytes nearly all 0: apart they pack better.
        let folded: Vec<u16> = plane.iter().map(|r| fold(*r)).collect();
        stream.write_all(&folded.iter().map(|v| *v as u8).collect::<Vec<u8>>())?;
        stream.write_all(&folded.iter().map(|v| (v >> 8) as u8).collect::<Vec<u8>>())?;
    }
    Ok(STANDARD.encode(stream.finish()?))
}

/// The code of a value: sign, exponent and 7 bits of mantissa of the nearest half float.
fn code(value: f32) -> i32 {
    if value.is_nan() {
        return NOT_A_NUMBER;
    }
    let bits = i32::from(f16::from_f32(value.abs()).to_bits());
    let rounded = (bits + (1 << (DROPPED - 1))) >> DROPPED;
    let code = if value.is_infinite() { INFINITE } else { rounded.min(INFINITE - 1) };
    if value < 0.0 { -code } else { code }
}

/// Codes minus their predictions, row by row.
fn predict(plane: &[f32], width: usize) -> Vec<i32> {
    let codes: Vec<i32> = plane.iter().map(|v| code(*v)).collect();
    let residual = |i: usize| {
        let left = (!i.is_multiple_of(width)).then(|| codes[i - 1]);
        let up = (i >= width).then(|| codes[i - width]);
        let predicted = match (left, up) {
            (Some(l), Some(u)) => (l + u) >> 1,
            (one, other) => one.or(other).unwrap_or(0),
        };
        codes[i] - predicted
    };
    (0..codes.len()).map(residual).collect()
}

/// 0, −1, 1, −2, 2, … as 0, 1, 2, 3, 4, …; residuals of residuals of codes fit 16 bits.
fn fold(residual: i32) -> u16 {
    ((residual << 1) ^ (residual >> 31)) as u16
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use flate2::read::ZlibDecoder;

    use super::*;

    /// What the page does, in Rust.
    fn unpack(text: &str, count: usize, pixels: usize, width: usize) -> Vec<Vec<f32>> {
        let packed = STANDARD.decode(text).unwrap();
        let mut bytes = Vec::new();
        ZlibDecoder::new(packed.as_slice()).read_to_end(&mut bytes).unwrap();
        let mut planes: Vec<Vec<i32>> = bytes
            .chunks(2 * pixels)
            .map(|p| {
                let folded = |i: usize| i32::from(p[i]) | i32::from(p[pixels + i]) << 8;
                (0..pixels).map(|i| (folded(i) >> 1) ^ -(folded(i) & 1)).collect()
            })
            .collect();
        assert_eq!(planes.len(), count);
        if let [red, green, blue] = planes.as_mut_slice() {
            for ((r, g), b) in red.iter_mut().zip(green.iter()).zip(blue.iter_mut()) {
                *r += g;
                *b += g;
            }
        }
        for plane in &mut planes {
            for i in 0..pixels {
                plane[i] += match (!i.is_multiple_of(width), i >= width) {
                    (true, true) => (plane[i - 1] + plane[i - width]) >> 1,
                    (true, false) => plane[i - 1],
                    (false, true) => plane[i - width],
                    (false, false) => 0,
                };
            }
        }
        let value = |code: &i32| {
            let v = f16::from_bits((code.unsigned_abs() << DROPPED) as u16).to_f32();
            if *code < 0 { -v } else { v }
        };
        planes.iter().map(|p| p.iter().map(value).collect()).collect()
    }

    #[test]
    fn values_come_back_within_half_a_step() {
        let mut x = 0.37_f32;
        let mut next = || {
            x = (x * 997.0 + 0.1).fract();
            (20.0 * (x - 0.6)).exp2()
        };
        let planes: Vec<Vec<f32>> =
            (0..3).map(|_| (0..35 * 20).map(|_| next()).collect()).collect();
        let back = unpack(&pack(&planes, 35).unwrap(), 3, 35 * 20, 35);
        for (v, w) in planes.iter().flatten().zip(back.iter().flatten()) {
            // Below 2⁻¹⁴ the steps of half floats are all alike.
            assert!((v - w).abs() <= v / 256.0 + 3e-7, "{v} {w}");
        }
    }

    #[test]
    fn signs_zeros_and_values_that_are_not_finite_come_back() {
        let plane =
            vec![0.0, -1.0, 1.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e9, -65504.0, 1e-30];
        let back = &unpack(&pack(&[plane], 3).unwrap(), 1, 9, 3)[0];
        assert_eq!(back[..5], [0.0, -1.0, 1.0, f32::INFINITY, f32::NEG_INFINITY]);
        assert!(back[5].is_nan());
        assert!(back[6].is_finite() && back[6] > 6e4 && back[7] < -6e4 && back[8] == 0.0);
    }

    #[test]
    fn a_smooth_image_packs_well() {
        let plane: Vec<f32> = (0..128 * 128).map(|i| 1.0 + (i % 128) as f32 / 256.0).collect();
        let text = pack(&[plane.clone(), plane.clone(), plane], 128).unwrap();
        assert!(text.len() < 128 * 128 / 8, "{}", text.len());
    }
}
