//! Bytes of a file → text: UTF-8, UTF-16 with or without its mark, and Latin-1 for everything else.

use std::borrow::Cow;

/// The text, and whether it had to be read as Latin-1.
pub(super) fn decode(bytes: &[u8]) -> (Cow<'_, str>, bool) {
    if let Some(text) = utf16(bytes) {
        return (Cow::Owned(text), false);
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => (Cow::Borrowed(text.trim_start_matches('\u{feff}')), false),
        // Every byte is the character of the same number.
        Err(_) => (Cow::Owned(bytes.iter().map(|b| char::from(*b)).collect()), true),
    }
}

/// UTF-16 is told by its mark, or by the zeros of `<`.
fn utf16(bytes: &[u8]) -> Option<String> {
    let little = match bytes.get(..2)? {
        [0xff, 0xfe] | [b'<', 0] => true,
        [0xfe, 0xff] | [0, b'<'] => false,
        _ => return None,
    };
    let units = bytes.chunks_exact(2).map(|b| {
        let pair = [b[0], b[1]];
        if little { u16::from_le_bytes(pair) } else { u16::from_be_bytes(pair) }
    });
    let text: String =
        char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
    Some(text.trim_start_matches('\u{feff}').to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_text_in_every_encoding() {
        let text = "<a b=\"é\"/>";
        let wide = |order: fn(u16) -> [u8; 2], mark: bool| -> Vec<u8> {
            let start = if mark { vec![0xfeff] } else { vec![] };
            start.into_iter().chain(text.encode_utf16()).flat_map(order).collect()
        };
        for mark in [true, false] {
            assert_eq!(decode(&wide(u16::to_le_bytes, mark)).0, text);
            assert_eq!(decode(&wide(u16::to_be_bytes, mark)).0, text);
        }
        assert_eq!(decode(text.as_bytes()).0, text);
        assert_eq!(decode(b"\xef\xbb\xbf<a/>").0, "<a/>");
        let (latin, odd) = decode(b"<a b=\"\xe9\"/>");
        assert_eq!((&*latin, odd), (text, true));
    }
}
