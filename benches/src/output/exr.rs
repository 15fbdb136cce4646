//! EXR: one part with 32-bit floats; the image as R, G, B, layers as dotted channels
//! (`length.03.R`), which also tools show that read one part only.

use std::io::{self, Cursor};

use ::exr::prelude::*;

use super::Picture;

/// The file as bytes.
pub(super) fn encode(picture: &Picture<'_>) -> io::Result<Vec<u8>> {
    let mut channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = SmallVec::new();
    add(&mut channels, "", picture.pixels);
    for layer in picture.layers {
        add(&mut channels, &format!("{}.", layer.name), &layer.pixels);
    }
    let crop = picture.film.crop;
    let m = &picture.metadata;
    let mut attributes = LayerAttributes {
        layer_position: Vec2(crop.x as i32, crop.y as i32),
        software_name: Some(text("pathspace")),
        ..LayerAttributes::default()
    };
    let mut set = |key: &str, value: AttributeValue| {
        attributes.other.insert(text(&format!("pathspace.{key}")), value);
    };
    set("scene", AttributeValue::Text(text(&m.scene)));
    set("scene_hash", AttributeValue::Text(text(&m.scene_hash)));
    set("integrator", AttributeValue::Text(text(&m.integrator)));
    // As text: attributes have no integer of 64 bits.
    set("seed", AttributeValue::Text(text(&m.seed.to_string())));
    set("samples_per_pixel", AttributeValue::F64(m.samples_per_pixel));
    set("replicates", AttributeValue::Text(text(&m.replicates.to_string())));
    set("seconds", AttributeValue::F64(m.seconds));
    set("version", AttributeValue::Text(text(&m.version)));

    let size = (crop.width as usize, crop.height as usize);
    let encoding = Encoding { compression: Compression::ZIP16, ..Encoding::default() };
    let layer = Layer::new(size, attributes, encoding, AnyChannels::sort(channels));
    let whole = (picture.film.width as usize, picture.film.height as usize);
    let display = ImageAttributes::new(IntegerBounds::from_dimensions(whole));
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layers(display, smallvec_of(layer))
        .write()
        .to_buffered(&mut bytes)
        .map_err(|e| io::Error::other(e.to_string()))?;
    Ok(bytes.into_inner())
}

/// Characters that an EXR file can not hold are replaced.
fn text(s: &str) -> Text {
    Text::new_or_none(s).unwrap_or_else(|| {
        let plain: String = s.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect();
        Text::new_or_none(&plain).unwrap_or_default()
    })
}

fn smallvec_of(layer: Layer<AnyChannels<FlatSamples>>) -> Layers<AnyChannels<FlatSamples>> {
    let mut layers = Layers::new();
    layers.push(layer);
    layers
}

fn add(channels: &mut SmallVec<[AnyChannel<FlatSamples>; 4]>, prefix: &str, pixels: &[[f64; 3]]) {
    for (c, name) in ["R", "G", "B"].iter().enumerate() {
        let samples = pixels.iter().map(|p| p[c] as f32).collect();
        let name = text(&format!("{prefix}{name}"));
        channels.push(AnyChannel::new(name, FlatSamples::F32(samples)));
    }
}
