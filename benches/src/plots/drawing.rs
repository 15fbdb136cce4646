//! Lines, dots and text on a sheet, in points from the upper left.

/// A colour of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ink {
    /// Text.
    Text,
    /// Text and lines of less weight.
    Soft,
    /// Lines of the grid.
    Line,
    /// What is behind.
    Surface,
    /// An integrator, by its index.
    Series(usize),
}

/// Colours of series on white, as pages have them (Okabe and Ito 2008).
const SERIES: [[u8; 3]; 8] = [
    [0x00, 0x72, 0xb2],
    [0xd5, 0x5e, 0x00],
    [0x00, 0x9e, 0x73],
    [0xb8, 0x55, 0x8f],
    [0xc7, 0x85, 0x00],
    [0x4d, 0x9f, 0xd0],
    [0x2b, 0x2f, 0x36],
    [0x9a, 0x8f, 0x00],
];

impl Ink {
    /// Red, green and blue on white paper.
    pub(super) fn rgb(self) -> [u8; 3] {
        match self {
            Ink::Text => [0x18, 0x20, 0x2b],
            Ink::Soft => [0x55, 0x61, 0x6f],
            Ink::Line => [0xd9, 0xde, 0xe5],
            Ink::Surface => [0xff; 3],
            Ink::Series(n) => SERIES[n % SERIES.len()],
        }
    }
}

/// Where a text begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// One thing that is drawn.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Item {
    Line { points: Vec<[f64; 2]>, width: f64, ink: Ink, dashed: bool },
    Dot { at: [f64; 2], radius: f64, ink: Ink, hollow: bool },
    Text { at: [f64; 2], text: String, ink: Ink, anchor: Anchor, bold: bool },
}

/// A sheet.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Drawing {
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) items: Vec<Item>,
}

/// Size of all text.
pub(super) const FONT: f64 = 12.0;

impl Drawing {
    pub(super) fn line(&mut self, points: &[[f64; 2]], width: f64, ink: Ink, dashed: bool) {
        self.items.push(Item::Line { points: points.to_vec(), width, ink, dashed });
    }

    pub(super) fn text(&mut self, at: [f64; 2], text: &str, ink: Ink, anchor: Anchor) {
        self.items.push(Item::Text { at, text: text.into(), ink, anchor, bold: false });
    }
}

/// About how wide a text is; what is beside it must leave that much room.
pub(super) fn width_of(text: &str) -> f64 {
    0.58 * FONT * text.chars().count() as f64
}
