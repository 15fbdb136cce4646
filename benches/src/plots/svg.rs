//! A drawing as SVG.

use std::fmt::Write;

use super::drawing::{Anchor, Drawing, FONT, Ink, Item};

/// With the colours of the page around it.
pub(super) fn inline(drawing: &Drawing, title: &str) -> String {
    let colour = |ink: Ink| match ink {
        Ink::Text => "var(--ink)".into(),
        Ink::Soft => "var(--soft)".into(),
        Ink::Line => "var(--line)".into(),
        Ink::Surface => "var(--surface)".into(),
        Ink::Series(n) => format!("var(--series-{})", n % 8),
    };
    let size = format!("role=\"img\" aria-label=\"{}\"", escape(title));
    svg(drawing, title, &size, &colour)
}

/// With colours for white paper.
pub(super) fn file(drawing: &Drawing, title: &str) -> String {
    let colour = |ink: Ink| {
        let [r, g, b] = ink.rgb();
        format!("#{r:02x}{g:02x}{b:02x}")
    };
    let size = format!(
        "xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\"",
        drawing.width, drawing.height
    );
    svg(drawing, title, &size, &colour)
}

fn svg(drawing: &Drawing, title: &str, attributes: &str, colour: &dyn Fn(Ink) -> String) -> String {
    let Drawing { width, height, items } = drawing;
    let mut text = format!(
        "<svg {attributes} viewBox=\"0 0 {width} {height}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"{FONT}\">\n<title>{}</title>\n",
        escape(title)
    );
    for item in items {
        // Writing to a string does not fail.
        let _ = match item {
            Item::Line { points, width, ink, dashed } => {
                let list: Vec<String> =
                    points.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect();
                let dash = if *dashed { " stroke-dasharray=\"4 3\"" } else { "" };
                writeln!(
                    text,
                    "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\"{dash}/>",
                    list.join(" "),
                    colour(*ink)
                )
            }
            Item::Dot { at: [x, y], radius, ink, hollow } => {
                let fill = colour(if *hollow { Ink::Surface } else { *ink });
                writeln!(
                    text,
                    "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius}\" fill=\"{fill}\" stroke=\"{}\" stroke-width=\"2\"/>",
                    colour(*ink)
                )
            }
            Item::Text { at: [x, y], text: words, ink, anchor, bold } => {
                let anchor = match anchor {
                    Anchor::Start => "start",
                    Anchor::Middle => "middle",
                    Anchor::End => "end",
                };
                let weight = if *bold { " font-weight=\"600\"" } else { "" };
                writeln!(
                    text,
                    "<text x=\"{x:.2}\" y=\"{y:.2}\" text-anchor=\"{anchor}\" fill=\"{}\"{weight}>{}</text>",
                    colour(*ink),
                    escape(words)
                )
            }
        };
    }
    text + "</svg>\n"
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_can_not_leave_their_element() {
        let mut drawing = Drawing { width: 10.0, height: 10.0, items: Vec::new() };
        drawing.text([1.0, 2.0], "<script>&\"", Ink::Text, Anchor::End);
        let text = file(&drawing, "\"><b>");
        assert!(
            text.contains("&lt;script&gt;&amp;&quot;</text>") && !text.contains("<b>"),
            "{text}"
        );
        assert!(inline(&drawing, "a").contains("fill=\"var(--ink)\""));
    }
}
