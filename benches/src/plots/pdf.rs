//! A drawing as PDF, in Helvetica, which every reader has.

use pdf_writer::{Content, Finish, Name, Pdf, Rect, Ref, Str};

use super::drawing::{Anchor, Drawing, FONT, Ink, Item};

const REGULAR: Name<'static> = Name(b"F1");
const BOLD: Name<'static> = Name(b"F2");
/// A quarter of a circle as a cubic: 4/3·(√2 − 1).
const KAPPA: f32 = 0.552_284_8;

/// The file.
pub(super) fn file(drawing: &Drawing) -> Vec<u8> {
    let [catalog, pages, page_id, regular, bold, stream] = [1, 2, 3, 4, 5, 6].map(Ref::new);
    let mut pdf = Pdf::new();
    pdf.catalog(catalog).pages(pages);
    pdf.pages(pages).kids([page_id]).count(1);
    let mut page = pdf.page(page_id);
    page.media_box(Rect::new(0.0, 0.0, drawing.width as f32, drawing.height as f32));
    page.parent(pages).contents(stream);
    let mut resources = page.resources();
    resources.fonts().pair(REGULAR, regular).pair(BOLD, bold);
    resources.finish();
    page.finish();
    for (id, name) in [(regular, Name(b"Helvetica")), (bold, Name(b"Helvetica-Bold"))] {
        pdf.type1_font(id).base_font(name).encoding_predefined(Name(b"WinAnsiEncoding"));
    }
    let mut content = Content::new();
    for item in &drawing.items {
        draw(item, drawing.height as f32, &mut content);
    }
    let bytes = content.finish();
    pdf.stream(stream, &bytes);
    pdf.finish()
}

fn draw(item: &Item, height: f32, content: &mut Content) {
    let place = |[x, y]: [f64; 2]| (x as f32, height - y as f32);
    match item {
        Item::Line { points, width, ink, dashed } => {
            let Some((first, rest)) = points.split_first() else { return };
            stroke(content, *ink, *width as f32);
            let dash: &[f32] = if *dashed { &[4.0, 3.0] } else { &[] };
            content.set_dash_pattern(dash.iter().copied(), 0.0);
            let (x, y) = place(*first);
            content.move_to(x, y);
            for p in rest {
                let (x, y) = place(*p);
                content.line_to(x, y);
            }
            content.stroke();
        }
        Item::Dot { at, radius, ink, hollow } => {
            stroke(content, *ink, 2.0);
            content.set_dash_pattern([], 0.0);
            fill(content, if *hollow { Ink::Surface } else { *ink });
            let ((x, y), r) = (place(*at), *radius as f32);
            let k = KAPPA * r;
            content.move_to(x + r, y);
            content.cubic_to(x + r, y + k, x + k, y + r, x, y + r);
            content.cubic_to(x - k, y + r, x - r, y + k, x - r, y);
            content.cubic_to(x - r, y - k, x - k, y - r, x, y - r);
            content.cubic_to(x + k, y - r, x + r, y - k, x + r, y);
            content.close_path().fill_nonzero_and_stroke();
        }
        Item::Text { at, text, ink, anchor, bold } => {
            let bytes: Vec<u8> = text.chars().map(latin).collect();
            let wide = bytes.iter().map(|b| advance(*b)).sum::<f32>() * FONT as f32;
            let (x, y) = place(*at);
            let before = match anchor {
                Anchor::Start => 0.0,
                Anchor::Middle => 0.5 * wide,
                Anchor::End => wide,
            };
            fill(content, *ink);
            content.begin_text();
            content.set_font(if *bold { BOLD } else { REGULAR }, FONT as f32);
            content.next_line(x - before, y).show(Str(&bytes));
            content.end_text();
        }
    }
}

fn stroke(content: &mut Content, ink: Ink, width: f32) {
    let [r, g, b] = ink.rgb().map(|c| f32::from(c) / 255.0);
    content.set_stroke_rgb(r, g, b).set_line_width(width);
}

fn fill(content: &mut Content, ink: Ink) {
    let [r, g, b] = ink.rgb().map(|c| f32::from(c) / 255.0);
    content.set_fill_rgb(r, g, b);
}

/// The character in Latin-1, which WinAnsi has at the same places.
fn latin(c: char) -> u8 {
    u8::try_from(u32::from(c)).unwrap_or(b'?')
}

/// About the width of a character of Helvetica, in ems.
fn advance(byte: u8) -> f32 {
    match byte {
        b'i' | b'j' | b'l' | b'.' | b',' | b':' | b'|' | b'\'' => 0.25,
        b' ' | b'f' | b't' | b'(' | b')' | b'/' | b'-' | b'r' => 0.3,
        b'm' | b'w' | b'M' | b'W' => 0.8,
        b'A'..=b'Z' => 0.68,
        _ => 0.556,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_its_text_and_its_end() {
        let mut drawing = Drawing { width: 10.0, height: 10.0, items: Vec::new() };
        drawing.text([1.0, 2.0], "bdpt (pt)", Ink::Text, Anchor::Start);
        drawing.items.push(Item::Dot { at: [1.0; 2], radius: 1.0, ink: Ink::Soft, hollow: true });
        let bytes = file(&drawing);
        assert!(bytes.starts_with(b"%PDF-") && bytes.trim_ascii_end().ends_with(b"%%EOF"));
        assert!(bytes.windows(5).any(|w| w == b"bdpt "));
        assert_eq!((latin('·'), latin('π')), (0xb7, b'?'));
    }
}
