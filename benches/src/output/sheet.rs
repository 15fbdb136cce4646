//! The pyramid of techniques as one labelled picture (Veach 1997, fig. 10.3).
//!
//! A row per path length, its techniques (s, t) from s = 0 on the left to t = 0 on the right. Each
//! row has its own exposure, written at its left, because the contributions fall off by orders of
//! magnitude with the length.

use font8x8::UnicodeFonts;
use image::{Rgb, RgbImage};
use pathspace_core::film::{Film, LayerKey};

use super::png;

/// Rows at most; longer paths are left to the EXR layers.
const MAX_ROWS: u16 = 8;
/// Largest side of a small picture.
const CELL: usize = 192;
const GAP: u32 = 4;
const GLYPH: u32 = 8;
const LABEL: u32 = GLYPH + 4;

/// Which layers a sheet shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weighting {
    /// With MIS weights: the pictures of all rows sum to the image.
    Weighted,
    /// Without: every picture that has full support is the whole image of its length.
    Unweighted,
}

impl Weighting {
    fn key(self, s: u16, t: u16) -> LayerKey {
        match self {
            Weighting::Weighted => LayerKey::Technique { s, t },
            Weighting::Unweighted => LayerKey::Unweighted { s, t },
        }
    }
}

/// Draws the sheet of a film that keeps technique layers; `None` where it keeps none.
pub fn technique_sheet(film: &Film, weighting: Weighting) -> Option<RgbImage> {
    let lengths: Vec<u16> = (1..=MAX_ROWS)
        .filter(|k| (0..=k + 1).any(|s| film.planes().contains_key(&weighting.key(s, k + 1 - s))))
        .collect();
    let longest = *lengths.last()?;
    let factor = film.width().max(film.height()).div_ceil(CELL);
    let (w, h) = (film.width().div_ceil(factor) as u32, film.height().div_ceil(factor) as u32);
    let columns = longest as u32 + 2;
    let (dx, dy) = (w + GAP, h + LABEL + GAP);
    let mut sheet = RgbImage::from_pixel(
        GAP + columns * dx,
        GAP + lengths.len() as u32 * dy,
        Rgb([24, 24, 24]),
    );
    for (row, &k) in lengths.iter().enumerate() {
        let cells: Vec<_> =
            (0..=k + 1).map(|s| (s, film.layer_image(weighting.key(s, k + 1 - s)))).collect();
        let all: Vec<[f64; 3]> =
            cells.iter().filter_map(|(_, image)| image.as_ref()).flatten().copied().collect();
        let exposure = png::exposure(&all);
        let y = GAP + row as u32 * dy;
        // Rows are centred: the picture is a pyramid.
        let left = (columns - (k as u32 + 2)) * dx / 2 + GAP;
        for (s, image) in cells {
            let x = left + s as u32 * dx;
            let label = format!("s={s} t={}", k + 1 - s);
            write(&mut sheet, x, y, &label);
            if s == 0 && w > (label.len() as u32 + 9) * GLYPH {
                write(
                    &mut sheet,
                    x + (label.len() as u32 + 1) * GLYPH,
                    y,
                    &format!("x{exposure:.2}"),
                );
            }
            let Some(image) = image else { continue };
            for py in 0..h {
                for px in 0..w {
                    let mean = block_mean(&image, film.width(), film.height(), px, py, factor);
                    sheet.put_pixel(x + px, y + LABEL + py, Rgb(png::tone_map(mean, exposure)));
                }
            }
        }
    }
    Some(sheet)
}

/// A row of a [`labelled_sheet`]: pictures of one size, each with its label.
pub type SheetRow = Vec<(String, Vec<[f64; 3]>)>;

/// Rows of labelled pictures of `width`×`height` pixels, all at one exposure.
pub fn labelled_sheet(rows: &[SheetRow], width: usize, height: usize, exposure: f64) -> RgbImage {
    let factor = width.max(height).div_ceil(CELL);
    let (w, h) = (width.div_ceil(factor) as u32, height.div_ceil(factor) as u32);
    let (dx, dy) = (w + GAP, h + LABEL + GAP);
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0) as u32;
    let size = (GAP + columns * dx, GAP + rows.len() as u32 * dy);
    let mut sheet = RgbImage::from_pixel(size.0, size.1, Rgb([24, 24, 24]));
    for (row, cells) in rows.iter().enumerate() {
        let y = GAP + row as u32 * dy;
        for (column, (label, image)) in cells.iter().enumerate() {
            let x = GAP + column as u32 * dx;
            let room = (w / GLYPH) as usize;
            write(&mut sheet, x, y, &label.chars().take(room).collect::<String>());
            for (px, py) in (0..h).flat_map(|py| (0..w).map(move |px| (px, py))) {
                let mean = block_mean(image, width, height, px, py, factor);
                sheet.put_pixel(x + px, y + LABEL + py, Rgb(png::tone_map(mean, exposure)));
            }
        }
    }
    sheet
}

/// Mean of a block of `factor`² pixels, clipped at the border.
fn block_mean(
    image: &[[f64; 3]],
    width: usize,
    height: usize,
    px: u32,
    py: u32,
    factor: usize,
) -> [f64; 3] {
    let (x0, y0) = (px as usize * factor, py as usize * factor);
    let mut sum = [0.0; 3];
    let mut n = 0.0;
    for y in y0..(y0 + factor).min(height) {
        for x in x0..(x0 + factor).min(width) {
            for (s, v) in sum.iter_mut().zip(image[y * width + x]) {
                *s += v;
            }
            n += 1.0;
        }
    }
    sum.map(|s| s / n)
}

/// Writes a line of 8×8 glyphs; characters that the font lacks are left out.
fn write(sheet: &mut RgbImage, x: u32, y: u32, text: &str) {
    for (i, c) in text.chars().enumerate() {
        let Some(glyph) = font8x8::BASIC_FONTS.get(c) else { continue };
        for (row, bits) in glyph.iter().enumerate() {
            for column in 0..8 {
                let (px, py) = (x + i as u32 * GLYPH + column, y + 2 + row as u32);
                if bits >> column & 1 == 1 && px < sheet.width() && py < sheet.height() {
                    sheet.put_pixel(px, py, Rgb([230, 230, 230]));
                }
            }
        }
    }
}
