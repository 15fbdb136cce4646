//! Texels in memory: bytes as they stand in the file, or numbers.

use crate::color::Rgb;

/// A rectangle of linear sRGB colours or grey values, stored row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Bitmap {
    width: u32,
    height: u32,
    /// 1 or 3.
    channels: u32,
    texels: Texels,
}

#[derive(Clone, Debug, PartialEq)]
enum Texels {
    /// Bytes, and the number that each byte stands for: a quarter of the memory of numbers.
    Bytes {
        data: Vec<u8>,
        table: Box<[f32; 256]>,
    },
    Floats(Vec<f32>),
}

/// Why a bitmap can not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BitmapError {
    /// The sizes do not fit together.
    #[error("{width} × {height} texels of {channels} channels are not {found} values")]
    Size {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Values of a texel.
        channels: u32,
        /// Values that were given.
        found: usize,
    },
    /// A value is NaN or infinite.
    #[error("texel ({x}, {y}) is not finite")]
    NotFinite {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
    },
}

impl Bitmap {
    /// From linear numbers, 1 or 3 for each texel.
    ///
    /// # Errors
    /// Sizes that do not fit, numbers that are not finite.
    pub fn from_floats(
        width: u32,
        height: u32,
        channels: u32,
        data: Vec<f32>,
    ) -> Result<Self, BitmapError> {
        check_size(width, height, channels, data.len())?;
        if let Some(at) = data.iter().position(|v| !v.is_finite()) {
            let texel = at / channels as usize;
            let (x, y) = (texel % width as usize, texel / width as usize);
            return Err(BitmapError::NotFinite { x: x as u32, y: y as u32 });
        }
        Ok(Bitmap { width, height, channels, texels: Texels::Floats(data) })
    }

    /// From bytes, 1 or 3 for each texel: with the transfer function of sRGB where `srgb`, as v/255
    /// where not.
    ///
    /// # Errors
    /// Sizes that do not fit.
    pub fn from_bytes(
        width: u32,
        height: u32,
        channels: u32,
        data: Vec<u8>,
        srgb: bool,
    ) -> Result<Self, BitmapError> {
        check_size(width, height, channels, data.len())?;
        let value = |i: usize| {
            let v = i as f32 / 255.0;
            if srgb { srgb_to_linear(v) } else { v }
        };
        let table = Box::new(std::array::from_fn(value));
        Ok(Bitmap { width, height, channels, texels: Texels::Bytes { data, table } })
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The colour of a texel.
    ///
    /// # Panics
    /// Outside the bitmap.
    #[inline]
    pub fn texel(&self, x: u32, y: u32) -> Rgb {
        let at = self.channels as usize * (y as usize * self.width as usize + x as usize);
        let value = |i: usize| match &self.texels {
            Texels::Bytes { data, table } => table[data[i] as usize],
            Texels::Floats(data) => data[i],
        };
        if self.channels == 1 {
            Rgb::grey(value(at))
        } else {
            Rgb::new(value(at), value(at + 1), value(at + 2))
        }
    }

    /// The bitmap with 0 for negative values, and how many there were.
    pub fn without_negatives(&self) -> (Bitmap, usize) {
        let mut bitmap = self.clone();
        let mut count = 0;
        if let Texels::Floats(data) = &mut bitmap.texels {
            for v in data.iter_mut().filter(|v| **v < 0.0) {
                *v = 0.0;
                count += 1;
            }
        }
        (bitmap, count)
    }

    /// Mean of all texels.
    pub fn mean(&self) -> Rgb {
        let mut sum = [0.0f64; 3];
        for (x, y) in self.positions() {
            let c = self.texel(x, y).to_array();
            sum.iter_mut().zip(c).for_each(|(s, v)| *s += f64::from(v));
        }
        let n = f64::from(self.width) * f64::from(self.height);
        Rgb::from(sum.map(|s| (s / n) as f32))
    }

    /// Largest value.
    pub fn max(&self) -> f32 {
        self.values().fold(f32::NEG_INFINITY, f32::max)
    }

    /// Smallest value.
    pub fn min(&self) -> f32 {
        self.values().fold(f32::INFINITY, f32::min)
    }

    fn positions(&self) -> impl Iterator<Item = (u32, u32)> + use<> {
        let width = self.width;
        (0..self.height).flat_map(move |y| (0..width).map(move |x| (x, y)))
    }

    fn values(&self) -> impl Iterator<Item = f32> + '_ {
        self.positions().flat_map(|(x, y)| self.texel(x, y).to_array())
    }
}

fn check_size(width: u32, height: u32, channels: u32, found: usize) -> Result<(), BitmapError> {
    let wanted = u64::from(width) * u64::from(height) * u64::from(channels);
    if wanted == 0 || wanted != found as u64 || !matches!(channels, 1 | 3) {
        return Err(BitmapError::Size { width, height, channels, found });
    }
    Ok(())
}

/// IEC 61966-2-1.
fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_decoded_with_and_without_the_curve() {
        let srgb = Bitmap::from_bytes(1, 1, 3, vec![0, 128, 255], true).unwrap();
        let c = srgb.texel(0, 0);
        assert_eq!((c.r, c.b), (0.0, 1.0));
        assert!((c.g - 0.215_860_5).abs() < 1e-6);
        let raw = Bitmap::from_bytes(1, 1, 1, vec![51], false).unwrap();
        assert_eq!(raw.texel(0, 0), Rgb::grey(0.2));
    }

    #[test]
    fn sizes_and_values_are_checked() {
        assert!(Bitmap::from_floats(2, 2, 3, vec![0.0; 11]).is_err());
        assert!(Bitmap::from_floats(0, 2, 3, vec![]).is_err());
        assert!(Bitmap::from_bytes(1, 1, 4, vec![0; 4], true).is_err());
        let nan = Bitmap::from_floats(2, 2, 1, vec![0.0, 0.0, 0.0, f32::NAN]);
        assert_eq!(nan, Err(BitmapError::NotFinite { x: 1, y: 1 }));
    }

    #[test]
    fn the_mean_counts_every_texel_once() {
        let b = Bitmap::from_floats(2, 1, 3, vec![0.0, 1.0, 2.0, 1.0, 1.0, 4.0]).unwrap();
        assert_eq!(b.mean(), Rgb::new(0.5, 1.0, 3.0));
        assert_eq!((b.min(), b.max()), (0.0, 4.0));
    }
}
