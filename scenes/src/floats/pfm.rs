//! Portable float maps: `PF` (colour) or `Pf` (grey), width and height, a scale whose sign tells
//! the order of bytes, and rows from the bottom upwards.

use super::{FloatImage, check_size};

pub(super) fn decode(bytes: &[u8]) -> Result<FloatImage, String> {
    let mut rest = bytes;
    let kind = word(&mut rest)?;
    let channels: u32 = if kind == "PF" { 3 } else { 1 };
    let [width, height] = [word(&mut rest)?, word(&mut rest)?];
    let size = |text: &str| {
        text.parse::<u32>().map_err(|_| format!("\"{text}\" is no width or height of a PFM file"))
    };
    let (width, height) = (size(width)?, size(height)?);
    check_size(width, height)?;
    let scale = word(&mut rest)?;
    let little = match scale.parse::<f32>() {
        Ok(s) if s.is_finite() && s != 0.0 => s < 0.0,
        _ => return Err(format!("\"{scale}\" is no scale of a PFM file")),
    };
    let row = width as usize * channels as usize * 4;
    let wanted = row * height as usize;
    if rest.len() < wanted {
        return Err(format!("the PFM file has {} bytes of texels instead of {wanted}", rest.len()));
    }
    let number = |b: &[u8]| {
        let four = [b[0], b[1], b[2], b[3]];
        if little { f32::from_le_bytes(four) } else { f32::from_be_bytes(four) }
    };
    let rows = rest[..wanted].chunks_exact(row).rev();
    let values = rows.flat_map(|row| row.chunks_exact(4).map(number)).collect();
    Ok(FloatImage { width, height, channels, values, numbers: Vec::new() })
}

/// The next word and one white space behind it.
fn word<'a>(rest: &mut &'a [u8]) -> Result<&'a str, String> {
    let end = rest.iter().take(64).position(u8::is_ascii_whitespace);
    let Some(end) = end else { return Err("the head of the PFM file is not complete".into()) };
    let (word, more) = rest.split_at(end);
    *rest = &more[1..];
    std::str::from_utf8(word).map_err(|_| "the head of the PFM file is no text".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_from_the_bottom_in_either_order_of_bytes() {
        let values = [1.0f32, 2.0, 3.0, 4.0];
        for little in [true, false] {
            let mut bytes =
                format!("Pf\n2 2\n{}\n", if little { "-1.0" } else { "1.0" }).into_bytes();
            let order = if little { f32::to_le_bytes } else { f32::to_be_bytes };
            bytes.extend(values.into_iter().flat_map(order));
            assert_eq!(decode(&bytes).unwrap().values, [3.0, 4.0, 1.0, 2.0]);
        }
    }

    #[test]
    fn broken_files_are_refused() {
        for (bytes, reason) in [
            (b"PF\n".as_slice(), "the head of the PFM file is not complete"),
            (b"PF\n2 x\n-1\n", "\"x\" is no width or height of a PFM file"),
            (b"PF\n0 2\n-1\n", "0 × 2 texels are no image"),
            (b"PF\n1 1\n0\n", "\"0\" is no scale of a PFM file"),
            (b"PF\n1 1\n-1\n1234", "the PFM file has 4 bytes of texels instead of 12"),
        ] {
            assert_eq!(decode(bytes).unwrap_err(), reason);
        }
    }
}
