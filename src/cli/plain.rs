//! Names of files and words of files as they are shown: without control characters, which steer
//! terminals, and not too long.

use std::io::{self, Write};

/// Longest line, characters; the middle of a longer one is left out.
const LONGEST: usize = 2000;

/// A line that can be shown.
pub(super) fn plain(line: &str) -> String {
    let mut shown = String::with_capacity(line.len());
    for c in line.chars() {
        if c.is_control() { shown.extend(c.escape_default()) } else { shown.push(c) }
    }
    let count = shown.chars().count();
    if count <= LONGEST {
        return shown;
    }
    let part = LONGEST / 2;
    let head: String = shown.chars().take(part).collect();
    let tail: String = shown.chars().skip(count - part).collect();
    format!("{head} … ({} characters left out) … {tail}", count - 2 * part)
}

/// Writes on, with control characters other than the end of a line escaped.
pub(super) struct Plain<W>(pub(super) W);

impl<W: Write> Write for Plain<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        for part in bytes.split_inclusive(|b| is_control(*b)) {
            match part.split_last() {
                Some((last, before)) if is_control(*last) => {
                    self.0.write_all(before)?;
                    write!(self.0, "\\u{{{last:x}}}")?;
                }
                _ => self.0.write_all(part)?,
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

fn is_control(byte: u8) -> bool {
    byte.is_ascii_control() && byte != b'\n'
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped_and_long_lines_shortened() {
        assert_eq!(plain("a\u{1b}[31m\n\u{9b}ß"), "a\\u{1b}[31m\\n\\u{9b}ß");
        let long = plain(&"é".repeat(10_000));
        assert!(long.contains("(8000 characters left out)") && long.chars().count() < 2100);
        let mut out = Plain(Vec::new());
        write!(out, "wrote a\u{1b}b\nß").unwrap();
        assert_eq!(String::from_utf8(out.0).unwrap(), "wrote a\\u{1b}b\nß");
    }
}
