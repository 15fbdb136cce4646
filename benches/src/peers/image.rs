//! The EXR file that an adapter writes.

use std::path::Path;

use exr::prelude::*;

/// R, G and B of an image of `width` × `height` pixels, `[r, g, b]` in rows from top to bottom.
pub(super) fn read(path: &Path, width: u32, height: u32) -> std::result::Result<Vec<f32>, String> {
    let (wide, high) = (width as usize, height as usize);
    let image = read_first_rgba_layer_from_file(
        path,
        |size, _| Pixels { width: size.width(), values: vec![0.0; size.area() * 3] },
        |pixels: &mut Pixels, at, (r, g, b, _): (f32, f32, f32, f32)| {
            let i = 3 * (at.y() * pixels.width + at.x());
            pixels.values[i..i + 3].copy_from_slice(&[r, g, b]);
        },
    )
    .map_err(|e| format!("the adapter's image cannot be read: {e}"))?;
    let size = image.layer_data.size;
    if (size.width(), size.height()) != (wide, high) {
        return Err(format!(
            "the adapter's image has {}×{} pixels, not {width}×{height}",
            size.width(),
            size.height()
        ));
    }
    Ok(image.layer_data.channel_data.pixels.values)
}

struct Pixels {
    width: usize,
    values: Vec<f32>,
}
