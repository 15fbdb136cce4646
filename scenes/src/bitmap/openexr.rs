//! OpenEXR: the first layer's R, G and B, or its luminance Y, or its only channel.

use std::io::Cursor;

use exr::meta::MetaData;
use exr::prelude::{FlatImage, FlatSamples, ReadChannels, ReadLayers, read};
use pathspace_core::texture::Bitmap;

use super::{check_size, plain};

pub(super) fn decode(bytes: &[u8]) -> Result<Bitmap, String> {
    // The head first: it says how much memory the rest needs.
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|e| plain(&e.to_string()))?;
    for header in &meta.headers {
        let size = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        check_size(size(header.layer_size.0), size(header.layer_size.1))?;
        if header.channels.list.len() > 64 {
            return Err(format!("{} channels are more than 64", header.channels.list.len()));
        }
    }
    let image: FlatImage = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| plain(&e.to_string()))?;
    let Some(layer) = image.layer_data.first() else { return Err("has no layer".into()) };
    let (width, height) = (layer.size.0, layer.size.1);
    let channels = &layer.channel_data.list;
    // Names may have the layer before a dot.
    let named = |wanted: &str| {
        channels.iter().find(|c| {
            let name = c.name.to_string();
            name.rsplit('.').next().is_some_and(|last| last.eq_ignore_ascii_case(wanted))
        })
    };
    let chosen = match (named("R"), named("G"), named("B"), named("Y")) {
        (Some(r), Some(g), Some(b), _) => vec![r, g, b],
        (.., Some(y)) => vec![y],
        _ if channels.len() == 1 => channels.iter().collect(),
        _ => {
            let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
            return Err(plain(&format!("has no channels R, G, B or Y but {}", names.join(", "))));
        }
    };
    if chosen.iter().any(|c| c.sampling.0 != 1 || c.sampling.1 != 1) {
        return Err("has channels of lower resolution, which are not read".into());
    }
    let n = width * height;
    let mut data = vec![0.0; n * chosen.len()];
    for (i, channel) in chosen.iter().enumerate() {
        let slots = data.iter_mut().skip(i).step_by(chosen.len());
        match &channel.sample_data {
            FlatSamples::F32(values) => slots.zip(values).for_each(|(s, v)| *s = *v),
            other => slots.zip(other.values_as_f32()).for_each(|(s, v)| *s = v),
        }
    }
    Bitmap::from_floats(width as u32, height as u32, chosen.len() as u32, data)
        .map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::*;

    fn file(channels: &[(&str, f32)]) -> Vec<u8> {
        let list = channels.iter().map(|(name, base)| {
            let values = (0..6).map(|i| base + i as f32).collect();
            AnyChannel::new(*name, FlatSamples::F32(values))
        });
        let layer = Layer::new(
            (3, 2),
            LayerAttributes::default(),
            Encoding::FAST_LOSSLESS,
            AnyChannels::sort(list.collect()),
        );
        let mut bytes = Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn colours_and_luminance_are_found_by_name() {
        let colour = decode(&file(&[("A", 0.0), ("B", 30.0), ("G", 20.0), ("R", 10.0)])).unwrap();
        assert_eq!(colour.texel(1, 1).to_array(), [14.0, 24.0, 34.0]);
        assert_eq!(decode(&file(&[("Y", 5.0)])).unwrap().texel(2, 0).to_array(), [7.0; 3]);
        let layered = [("v.B", 3.0), ("v.G", 2.0), ("v.R", 1.0)];
        assert_eq!(decode(&file(&layered)).unwrap().texel(0, 0).to_array(), [1.0, 2.0, 3.0]);
        let error = decode(&file(&[("X", 0.0), ("Z", 0.0)])).unwrap_err();
        assert_eq!(error, "has no channels R, G, B or Y but X, Z");
    }
}
