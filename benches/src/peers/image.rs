//! The EXR file that an adapter writes.

use std::path::Path;

use exr::meta::MetaData;
use exr::prelude::*;

/// R, G and B of an image of `width` × `height` pixels, `[r, g, b]` in rows from top to bottom.
pub(super) fn read(path: &Path, width: u32, height: u32) -> std::result::Result<Vec<f32>, String> {
    let unread = |e: &dyn std::fmt::Display| format!("the adapter's image cannot be read: {e}");
    if !path.is_file() {
        return Err(unread(&"there is no such file"));
    }
    // The size first: pixels are made room for by what the header says.
    let meta = MetaData::read_from_file(path, false).map_err(|e| unread(&e))?;
    let size = meta.headers.first().map_or(Vec2(0, 0), |header| header.layer_size);
    if (size.width(), size.height()) != (width as usize, height as usize) {
        return Err(format!(
            "the adapter's image has {}×{} pixels, not {width}×{height}",
            size.width(),
            size.height()
        ));
    }
    let image = read_first_rgba_layer_from_file(
        path,
        |size, _| Pixels { width: size.width(), values: vec![0.0; size.area() * 3] },
        |pixels: &mut Pixels, at, (r, g, b, _): (f32, f32, f32, f32)| {
            let i = 3 * (at.y() * pixels.width + at.x());
            pixels.values[i..i + 3].copy_from_slice(&[r, g, b]);
        },
    )
    .map_err(|e| unread(&e))?;
    let values = image.layer_data.channel_data.pixels.values;
    if values.len() != 3 * width as usize * height as usize {
        return Err("the adapter's image has layers of different sizes".into());
    }
    if let Some(at) = values.iter().position(|v| !v.is_finite()) {
        let (x, y) = (at / 3 % width as usize, at / 3 / width as usize);
        return Err(format!("the adapter's image has {} in pixel ({x}, {y})", values[at]));
    }
    Ok(values)
}

struct Pixels {
    width: usize,
    values: Vec<f32>,
}
