//! NumPy's array file: a magic number, a header that is a Python dictionary of three keys, then the
//! values.
//!
//! Read here because a crate that does it brings a parser of all Python literals along.

use half::f16;

use super::{InputImage, area, pixels};

pub(super) fn decode(bytes: &[u8]) -> Result<InputImage, String> {
    let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or("is no NPY file")?;
    // Versions differ in the width of the header's length.
    let (length, rest) = match rest {
        [1, _, a, b, rest @ ..] => (usize::from(u16::from_le_bytes([*a, *b])), rest),
        [2 | 3, _, a, b, c, d, rest @ ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, rest),
        _ => return Err("has an unknown version of NPY".into()),
    };
    let header = rest.get(..length).ok_or("ends in its header")?;
    let (header, data) = (String::from_utf8_lossy(header), &rest[length..]);
    let dtype = value(&header, "descr").unwrap_or("").trim_matches(['\'', '"']);
    let shape = value(&header, "shape").unwrap_or("");
    let sizes: Option<Vec<usize>> =
        shape.split(',').map(str::trim).filter(|s| !s.is_empty()).map(|s| s.parse().ok()).collect();
    let (height, width, channels) = match sizes.as_deref() {
        Some(&[h, w]) => (h, w, 1),
        Some(&[h, w, c @ (1 | 3 | 4)]) => (h, w, c),
        _ => return Err(format!("has shape ({shape}), not (height, width, 3)")),
    };
    let count = area(width, height, channels)?;
    let mut values = floats(dtype, data)?;
    if values.len() != count {
        return Err(format!("holds {} values, its shape {count}", values.len()));
    }
    if value(&header, "fortran_order") == Some("True") {
        // The first index runs fastest.
        let place = |i: usize| {
            let (c, x, y) = (i % channels, i / channels % width, i / channels / width);
            y + height * (x + width * c)
        };
        values = (0..count).map(|i| values[place(i)]).collect();
    }
    Ok(InputImage { width, height, pixels: pixels(&values, channels), seconds: None })
}

/// What stands after a key of the dictionary; of a tuple what is in it.
fn value<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let after = header.split_once(&format!("'{key}':"))?.1.trim_start();
    match after.strip_prefix('(') {
        Some(tuple) => tuple.split(')').next(),
        None => after.split([',', '}']).next().map(str::trim),
    }
}

fn floats(dtype: &str, data: &[u8]) -> Result<Vec<f32>, String> {
    fn each<const N: usize>(data: &[u8], float: impl Fn([u8; N]) -> f32) -> Vec<f32> {
        data.as_chunks::<N>().0.iter().map(|w| float(*w)).collect()
    }
    Ok(match dtype {
        "<f2" => each(data, |w| f16::from_le_bytes(w).to_f32()),
        "<f4" => each(data, f32::from_le_bytes),
        ">f4" => each(data, f32::from_be_bytes),
        "<f8" => each(data, |w| f64::from_le_bytes(w) as f32),
        ">f8" => each(data, |w| f64::from_be_bytes(w) as f32),
        _ => {
            return Err(format!(
                "holds values of type '{dtype}' (known: floats of 16, 32, 64 bits)"
            ));
        }
    })
}
