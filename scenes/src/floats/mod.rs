//! Images of floats from files, as textures and renders are kept: OpenEXR and PFM.

mod openexr;
mod pfm;

/// Largest width and height.
pub(crate) const MAX_SIZE: u32 = 1 << 15;

/// Most texels: 2²⁸ colours of single precision are 3 GiB.
const MAX_TEXELS: u64 = 1 << 28;

/// What is in the file, as it is: linear, and finite or not.
#[derive(Clone, Debug, PartialEq)]
pub struct FloatImage {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// 1 is grey, 3 is colour.
    pub channels: u32,
    /// The channels of each texel, in rows from top to bottom.
    pub values: Vec<f32>,
    /// Attributes of an OpenEXR file that are one number of double precision.
    pub numbers: Vec<(String, f64)>,
}

/// Reads an image that begins as an OpenEXR or PFM file; `None` where it begins otherwise.
///
/// OpenEXR: R, G and B, or Y alone, or the only channel, of the first part that has them. A name
/// may have its layer before a dot; channels without a layer come first. The data window counts,
/// alpha does not. PFM: colour or grey.
///
/// # Errors
/// What is wrong, without the name of the file.
pub fn decode(bytes: &[u8]) -> Option<Result<FloatImage, String>> {
    match bytes {
        [0x76, 0x2f, 0x31, 0x01, ..] => Some(openexr::decode(bytes)),
        [b'P', b'F' | b'f', space, ..] if space.is_ascii_whitespace() => Some(pfm::decode(bytes)),
        _ => None,
    }
}

/// Refuses images that are empty or too large.
pub(crate) fn check_size(width: u32, height: u32) -> Result<(), String> {
    let texels = u64::from(width) * u64::from(height);
    if texels == 0 {
        return Err(format!("{width} × {height} texels are no image"));
    }
    if width > MAX_SIZE || height > MAX_SIZE || texels > MAX_TEXELS {
        return Err(format!(
            "{width} × {height} texels are more than {MAX_SIZE} × {MAX_SIZE} or {MAX_TEXELS}"
        ));
    }
    Ok(())
}

/// A message of a decoder on one line.
pub(crate) fn plain(text: &str) -> String {
    text.chars().take(200).map(|c| if c.is_control() { ' ' } else { c }).collect()
}
