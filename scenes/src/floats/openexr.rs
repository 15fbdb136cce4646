//! OpenEXR, by the crate exr.

use std::io::Cursor;

use exr::meta::MetaData;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, FlatImage, FlatSamples, Layer, ReadChannels,
    ReadLayers, read,
};

use super::{FloatImage, check_size, plain};

/// Most values of all channels of a part: 16 GiB of single precision.
const MAX_VALUES: u64 = 1 << 32;

type Part = Layer<AnyChannels<FlatSamples>>;

pub(super) fn decode(bytes: &[u8]) -> Result<FloatImage, String> {
    let unreadable = |e: exr::error::Error| plain(&format!("cannot be read as OpenEXR: {e}"));
    // The head first: it says how much memory the rest needs.
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(unreadable)?;
    for header in &meta.headers {
        let size = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let (width, height) = (size(header.layer_size.0), size(header.layer_size.1));
        check_size(width, height)?;
        let channels = header.channels.list.len();
        if channels as u64 * u64::from(width) * u64::from(height) > MAX_VALUES {
            return Err(format!("{channels} channels of {width} × {height} texels are too many"));
        }
    }
    let image: FlatImage = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(unreadable)?;
    let found = image.layer_data.iter().find_map(|part| Some((part, colours(part)?)));
    let Some((part, chosen)) = found else {
        let names = image.layer_data.iter().flat_map(|part| &part.channel_data.list);
        let names: Vec<String> = names.map(|c| c.name.to_string()).collect();
        return Err(plain(&format!("has no channels R, G, B or Y but {}", names.join(", "))));
    };
    if chosen.iter().any(|c| c.sampling.0 != 1 || c.sampling.1 != 1) {
        return Err("has channels of lower resolution, which are not read".into());
    }
    let (width, height) = (part.size.0, part.size.1);
    let mut values = vec![0.0; width * height * chosen.len()];
    for (i, channel) in chosen.iter().enumerate() {
        let slots = values.iter_mut().skip(i).step_by(chosen.len());
        match &channel.sample_data {
            FlatSamples::F32(samples) => slots.zip(samples).for_each(|(s, v)| *s = *v),
            other => slots.zip(other.values_as_f32()).for_each(|(s, v)| *s = v),
        }
    }
    let numbers = part.attributes.other.iter().filter_map(|(name, value)| match value {
        AttributeValue::F64(number) => Some((name.to_string(), *number)),
        _ => None,
    });
    let (width, height, channels) = (width as u32, height as u32, chosen.len() as u32);
    Ok(FloatImage { width, height, channels, values, numbers: numbers.collect() })
}

/// The channels that are an image.
fn colours(part: &Part) -> Option<Vec<&AnyChannel<FlatSamples>>> {
    let channels = &part.channel_data.list;
    let named = |wanted: &str| {
        let is = |name: &str| name.eq_ignore_ascii_case(wanted);
        let plain = channels.iter().find(|c| is(&c.name.to_string()));
        // Names may have the layer before a dot.
        let last = |name: &str| name.rsplit('.').next().is_some_and(is);
        plain.or_else(|| channels.iter().find(|c| last(&c.name.to_string())))
    };
    match (named("R"), named("G"), named("B"), named("Y")) {
        (Some(r), Some(g), Some(b), _) => Some(vec![r, g, b]),
        (.., Some(y)) => Some(vec![y]),
        _ if channels.len() == 1 => Some(channels.iter().collect()),
        _ => None,
    }
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
        assert_eq!((colour.width, colour.height, colour.channels), (3, 2, 3));
        assert_eq!(colour.values[12..15], [14.0, 24.0, 34.0]);
        assert_eq!(decode(&file(&[("Y", 5.0)])).unwrap().values, [5.0, 6.0, 7.0, 8.0, 9.0, 10.0]);
        let layered = [("v.B", 3.0), ("v.G", 2.0), ("v.R", 1.0)];
        assert_eq!(decode(&file(&layered)).unwrap().values[..3], [1.0, 2.0, 3.0]);
        // Channels without a layer come before those with one, whatever their order.
        let both = [("B", 3.0), ("G", 2.0), ("L.B", 6.0), ("L.G", 5.0), ("L.R", 4.0), ("R", 1.0)];
        assert_eq!(decode(&file(&both)).unwrap().values[..3], [1.0, 2.0, 3.0]);
        let error = decode(&file(&[("X", 0.0), ("Z", 0.0)])).unwrap_err();
        assert_eq!(error, "has no channels R, G, B or Y but X, Z");
    }
}
