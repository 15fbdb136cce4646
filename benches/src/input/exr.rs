//! OpenEXR, by the crate exr.

use std::io::Cursor;

use ::exr::prelude::*;

use super::{InputImage, pixels};

/// The attribute in which our own files hold the seconds of rendering.
const SECONDS: &str = "pathspace.seconds";

pub(super) fn decode(bytes: &[u8]) -> std::result::Result<InputImage, String> {
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| format!("cannot be read as OpenEXR: {e}"))?;
    for layer in &image.layer_data {
        let find = |name: &str| layer.channel_data.list.iter().find(|c| c.name.eq(name));
        let colour = [find("R"), find("G"), find("B")];
        let chosen: Vec<_> = match (colour, find("Y")) {
            ([Some(r), Some(g), Some(b)], _) => vec![r, g, b],
            (_, Some(y)) => vec![y],
            _ => continue,
        };
        let (width, height) = (layer.size.width(), layer.size.height());
        let n = chosen.len();
        let mut values = vec![0.0; n * super::area(width, height, n)? / n];
        for (c, channel) in chosen.iter().enumerate() {
            if channel.sampling != Vec2(1, 1) {
                return Err(format!("channel {} is subsampled", channel.name));
            }
            let samples = channel.sample_data.values_as_f32();
            values.iter_mut().skip(c).step_by(n).zip(samples).for_each(|(v, s)| *v = s);
        }
        let key = Text::new_or_none(SECONDS);
        let seconds = match key.and_then(|key| layer.attributes.other.get(&key)) {
            Some(AttributeValue::F64(s)) => Some(*s),
            _ => None,
        };
        return Ok(InputImage { width, height, pixels: pixels(&values, n), seconds });
    }
    let names: Vec<String> = image
        .layer_data
        .iter()
        .flat_map(|l| l.channel_data.list.iter().map(|c| c.name.to_string()))
        .collect();
    Err(format!("has no channels R, G, B and no Y (it has {})", names.join(", ")))
}
