//! Image files → bitmaps: JPEG, PNG, BMP, TGA and Radiance HDR by the crate `image`, OpenEXR and
//! PFM by [`floats`](crate::floats).

use std::io::Cursor;

use ::image::{DynamicImage, ImageFormat, ImageReader, Limits};
use pathspace_core::texture::Bitmap;

use crate::floats::{self, FloatImage, MAX_SIZE, check_size, plain};

/// Reads an image. Integers are sRGB unless `raw`; floating-point formats are linear.
///
/// # Errors
/// What is wrong, without the name of the file.
pub(crate) fn decode(bytes: &[u8], name: &str, raw: bool) -> Result<Bitmap, String> {
    if let Some(image) = floats::decode(bytes) {
        let FloatImage { width, height, channels, values, .. } = image?;
        return Bitmap::from_floats(width, height, channels, values).map_err(|e| e.to_string());
    }
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|e| format!("cannot be read: {e}"))?;
    // TGA files have no mark.
    if reader.format().is_none() && name.to_ascii_lowercase().ends_with(".tga") {
        reader.set_format(ImageFormat::Tga);
    }
    let known =
        [ImageFormat::Bmp, ImageFormat::Hdr, ImageFormat::Jpeg, ImageFormat::Png, ImageFormat::Tga];
    if !reader.format().is_some_and(|format| known.contains(&format)) {
        return Err("is no image: known are BMP, EXR, HDR, JPEG, PFM, PNG and TGA".into());
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIZE);
    limits.max_image_height = Some(MAX_SIZE);
    limits.max_alloc = Some(1 << 32);
    reader.limits(limits);
    let decoded = reader.decode().map_err(|e| plain(&e.to_string()))?;
    check_size(decoded.width(), decoded.height())?;
    convert(decoded, raw)
}

/// Alpha is left out, as in Mitsuba.
fn convert(image: DynamicImage, raw: bool) -> Result<Bitmap, String> {
    let (w, h) = (image.width(), image.height());
    let is_grey = !image.color().has_color();
    let bitmap = match image {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            Bitmap::from_floats(w, h, 3, image.into_rgb32f().into_raw())
        }
        DynamicImage::ImageLuma16(_) | DynamicImage::ImageLumaA16(_) => {
            Bitmap::from_floats(w, h, 1, wide(image.into_luma16().into_raw(), raw))
        }
        DynamicImage::ImageRgb16(_) | DynamicImage::ImageRgba16(_) => {
            Bitmap::from_floats(w, h, 3, wide(image.into_rgb16().into_raw(), raw))
        }
        _ if is_grey => Bitmap::from_bytes(w, h, 1, image.into_luma8().into_raw(), !raw),
        _ => Bitmap::from_bytes(w, h, 3, image.into_rgb8().into_raw(), !raw),
    };
    bitmap.map_err(|e| e.to_string())
}

fn wide(values: Vec<u16>, raw: bool) -> Vec<f32> {
    let linear = |v: u16| {
        let v = f32::from(v) / 65535.0;
        if raw {
            v
        } else if v <= 0.04045 {
            v / 12.92
        } else {
            ((v + 0.055) / 1.055).powf(2.4)
        }
    };
    values.into_iter().map(linear).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::image::{ImageBuffer, Luma, Rgb, Rgba};
    use pathspace_core::Rgb as Colour;

    fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    fn assert_near(found: Colour, expected: [f32; 3], what: &str) {
        for c in 0..3 {
            assert!((found[c] - expected[c]).abs() < 2e-5, "{what}: {found:?} {expected:?}");
        }
    }

    /// The numbers are those of Mitsuba 3.9.1 for the same images.
    #[test]
    fn integers_are_srgb_or_raw_as_in_mitsuba() {
        let value = |x: u32, y: u32, c: u32| (20 * (3 * (2 * y + x) + c)) as u8;
        let rgb = DynamicImage::ImageRgb8(ImageBuffer::from_fn(2, 2, |x, y| {
            Rgb([value(x, y, 0), value(x, y, 1), value(x, y, 2)])
        }));
        let rgba = DynamicImage::ImageRgba8(ImageBuffer::from_fn(2, 2, |x, y| {
            Rgba([value(x, y, 0), value(x, y, 1), value(x, y, 2), 128])
        }));
        let linear = [0.45641, 0.57758, 0.71569];
        let plain = [0.70588, 0.78431, 0.86275];
        for (image, format) in [
            (&rgb, ImageFormat::Png),
            (&rgba, ImageFormat::Png),
            (&rgb, ImageFormat::Bmp),
            (&rgb, ImageFormat::Tga),
        ] {
            let bytes = encoded(image, format);
            for (raw, expected) in [(false, linear), (true, plain)] {
                let bitmap = decode(&bytes, "a.tga", raw).unwrap();
                assert_near(bitmap.texel(1, 1), expected, &format!("{format:?} {raw}"));
            }
        }
        let grey = DynamicImage::ImageLuma8(ImageBuffer::from_pixel(2, 1, Luma([180])));
        let bitmap = decode(&encoded(&grey, ImageFormat::Png), "a.png", false).unwrap();
        assert_near(bitmap.texel(0, 0), [0.45641; 3], "grey");
        let wide =
            DynamicImage::ImageRgb16(ImageBuffer::from_pixel(1, 1, Rgb([46260, 51400, 56540])));
        let bitmap = decode(&encoded(&wide, ImageFormat::Png), "a.png", false).unwrap();
        assert_near(bitmap.texel(0, 0), [0.45641, 0.57758, 0.71569], "16 bits");
    }

    #[test]
    fn photographs_are_read() {
        let image = DynamicImage::ImageRgb8(ImageBuffer::from_pixel(16, 8, Rgb([200, 100, 50])));
        let bitmap = decode(&encoded(&image, ImageFormat::Jpeg), "a.jpg", true).unwrap();
        assert_eq!((bitmap.width(), bitmap.height()), (16, 8));
        let c = bitmap.texel(5, 5).to_array();
        for (found, expected) in c.iter().zip([200.0, 100.0, 50.0]) {
            assert!((found * 255.0 - expected).abs() < 4.0, "{c:?}");
        }
    }

    #[test]
    fn numbers_stay_what_they_are() {
        let image =
            DynamicImage::ImageRgb32F(ImageBuffer::from_pixel(8, 2, Rgb([4.0f32, 0.5, 0.25])));
        for (format, raw) in [(ImageFormat::Hdr, false), (ImageFormat::Hdr, true)] {
            let bitmap = decode(&encoded(&image, format), "a.hdr", raw).unwrap();
            assert_near(bitmap.texel(3, 1), [4.0, 0.5, 0.25], "hdr");
        }
    }

    #[test]
    fn what_is_no_image_is_refused_with_the_reason() {
        let png = encoded(
            &DynamicImage::ImageLuma8(ImageBuffer::from_pixel(4, 4, Luma([1]))),
            ImageFormat::Png,
        );
        for (bytes, name) in [
            (b"".as_slice(), "a.png"),
            (b"hello", "a.png"),
            (b"\x76\x2f\x31\x01 and no more", "a.exr"),
            (&png[..30], "a.png"),
            (b"BM and no more", "a.bmp"),
            (b"#?RADIANCE\n\n-Y 1 +X\n", "a.hdr"),
            (b"hello", "a.tga"),
            (b"\xff\xd8\xff\xe0 and no more", "a.jpg"),
            (b"Pf\n1 1\n-1\n\x00\x00\xc0\x7f", "a.pfm"),
        ] {
            let error = decode(bytes, name, false).unwrap_err();
            assert!(!error.is_empty() && !error.contains('\n'), "{name}: {error}");
        }
        let known = decode(b"hello", "a.png", false).unwrap_err();
        assert_eq!(known, "is no image: known are BMP, EXR, HDR, JPEG, PFM, PNG and TGA");
    }
}
