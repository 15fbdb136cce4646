//! Portable float map: `PF` (colour) or `Pf` (grey), width, height, scale, then floats in rows from bottom to top.

use super::{InputImage, area, pixels};

pub(super) fn decode(bytes: &[u8]) -> Result<InputImage, String> {
    let mut rest = bytes;
    let magic = word(&mut rest)?;
    let channels = match magic.as_str() {
        "PF" => 3,
        "Pf" => 1,
        _ => return Err(format!("begins with '{magic}', a PFM file with PF or Pf")),
    };
    let width: usize = number(&mut rest, "width")?;
    let height: usize = number(&mut rest, "height")?;
    // Its sign is the order of bytes; its size has no agreed meaning.
    let scale: f32 = number(&mut rest, "scale")?;
    let count = area(width, height, channels)?;
    if rest.len() != 4 * count {
        let size = format!("{width}×{height}");
        return Err(format!("has {} bytes of pixels, {size} needs {}", rest.len(), 4 * count));
    }
    let float: fn([u8; 4]) -> f32 =
        if scale < 0.0 { f32::from_le_bytes } else { f32::from_be_bytes };
    let (words, _) = rest.as_chunks::<4>();
    let values: Vec<f32> = words.iter().map(|w| float(*w)).collect();
    let mut rows: Vec<_> = pixels(&values, channels).chunks(width).map(<[_]>::to_vec).collect();
    rows.reverse();
    Ok(InputImage { width, height, pixels: rows.concat(), seconds: None })
}

/// The next word of the header, and the one white space after it.
fn word(rest: &mut &[u8]) -> Result<String, String> {
    let end = rest.iter().take(64).position(u8::is_ascii_whitespace);
    let end = end.ok_or("ends in its header, or is no PFM file")?;
    let text = String::from_utf8_lossy(&rest[..end]).into_owned();
    *rest = &rest[end + 1..];
    Ok(text)
}

fn number<T: std::str::FromStr>(rest: &mut &[u8], what: &str) -> Result<T, String> {
    let text = word(rest)?;
    text.parse().map_err(|_| format!("{what} is '{text}'"))
}
