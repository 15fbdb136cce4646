//! Linear radiance without metadata: PFM and NPY.

use super::Picture;

/// A portable float map: rows from bottom to top, little-endian.
pub(super) fn pfm(picture: &Picture<'_>) -> Vec<u8> {
    let crop = picture.film.crop;
    let mut bytes = format!("PF\n{} {}\n-1.0\n", crop.width, crop.height).into_bytes();
    for row in picture.pixels.chunks(crop.width.max(1) as usize).rev() {
        push(&mut bytes, row);
    }
    bytes
}

/// An array of NumPy, format 1.0: `float32[height, width, 3]`, rows from top to bottom.
pub(super) fn npy(picture: &Picture<'_>) -> Vec<u8> {
    let crop = picture.film.crop;
    let shape = format!("({}, {}, 3)", crop.height, crop.width);
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
    // Magic, version, length of the header and the header, filled up to a multiple of 64 bytes.
    let length = (10 + header.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{header:<width$}\n", width = length - 1).into_bytes());
    push(&mut bytes, picture.pixels);
    bytes
}

fn push(bytes: &mut Vec<u8>, pixels: &[[f64; 3]]) {
    bytes.extend(pixels.iter().flatten().flat_map(|v| (*v as f32).to_le_bytes()));
}

#[cfg(test)]
mod tests {
    use pathspace_core::description::FilmDescription;

    use super::super::Metadata;
    use super::*;

    fn bytes_of(encode: fn(&Picture<'_>) -> Vec<u8>) -> Vec<u8> {
        let pixels = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
        let metadata = Metadata::default();
        encode(&Picture {
            film: FilmDescription::new(1, 2),
            pixels: &pixels,
            layers: &[],
            metadata,
        })
    }

    fn floats(bytes: &[u8]) -> Vec<f32> {
        bytes.chunks(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
    }

    #[test]
    fn a_float_map_begins_with_its_lowest_row() {
        let bytes = bytes_of(pfm);
        let header = b"PF\n1 2\n-1.0\n";
        assert!(bytes.starts_with(header));
        assert_eq!(floats(&bytes[header.len()..]), [4.0, 5.0, 6.0, 1.0, 2.0, 3.0]);
    }

    #[test]
    fn an_array_has_a_header_of_whole_64_bytes() {
        let bytes = bytes_of(npy);
        let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        assert!(bytes.starts_with(b"\x93NUMPY\x01\x00") && (10 + length) % 64 == 0);
        let header = std::str::from_utf8(&bytes[10..10 + length]).unwrap();
        assert!(header.contains("'shape': (2, 1, 3)") && header.ends_with('\n'));
        assert_eq!(floats(&bytes[10 + length..]), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    }
}
