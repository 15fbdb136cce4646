//! The text of a file as a tree of elements, read as leniently as Mitsuba's own parser reads it:
//! `--` in comments, a document type, text between elements, an attribute given twice (the first
//! one counts), a lone `&`, and anything after the root.

use std::collections::HashSet;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use crate::error::{Place, Result, SceneFileError};

/// One element. The depth is bounded by [`MAX_NESTING`].
#[derive(Debug)]
pub(super) struct Node {
    pub(super) tag: String,
    pub(super) line: u32,
    pub(super) attributes: Vec<(String, String)>,
    pub(super) children: Vec<Node>,
}

impl Node {
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, v)| v.as_str())
    }
}

/// Elements within elements: real files have less than 10; the limit protects the stack.
const MAX_NESTING: usize = 64;

/// Names of elements and attributes: longer ones are no names.
const MAX_NAME: usize = 100;

/// The root element, and what was odd about the text.
pub(super) fn parse(text: &str, file: &str) -> Result<(Node, Vec<(u32, String)>)> {
    let mut lines = Lines { text, at: 0, line: 1 };
    let mut notes = Vec::new();
    let mut reader = Reader::from_str(text);
    // Its own check of end tags needs no help: a mismatch is an error with both names.
    reader.config_mut().check_end_names = true;
    reader.config_mut().allow_dangling_amp = true;
    let mut open: Vec<Node> = Vec::new();
    loop {
        let start = reader.buffer_position();
        let event = reader.read_event().map_err(|e| {
            let place = Place { file: file.into(), line: lines.of(reader.error_position()) };
            SceneFileError::Xml { place, reason: plain_reason(&e) }
        })?;
        let (closed, line) = match event {
            Event::Start(tag) => {
                let line = lines.of(start);
                let place = Place { file: file.into(), line };
                if open.len() >= MAX_NESTING {
                    let reason = format!("elements are nested deeper than {MAX_NESTING}");
                    return Err(SceneFileError::Scene { place, reason });
                }
                open.push(element(&tag, &place, &mut notes)?);
                continue;
            }
            Event::Empty(tag) => {
                let line = lines.of(start);
                (Some(element(&tag, &Place { file: file.into(), line }, &mut notes)?), line)
            }
            Event::End(_) => (open.pop(), 0),
            Event::Eof => break,
            // Text, comments, declarations and document types say nothing.
            _ => continue,
        };
        let Some(node) = closed else { continue };
        match open.last_mut() {
            Some(parent) => parent.children.push(node),
            None => {
                let rest = text.get(reader.buffer_position() as usize..).unwrap_or("");
                if has_element(rest) {
                    let line = line.max(lines.of(reader.buffer_position()));
                    notes.push((line, "what follows the root element is ignored".into()));
                }
                return Ok((node, notes));
            }
        }
    }
    let (line, reason) = match open.last() {
        Some(node) => (node.line, format!("the element <{}> is not closed", node.tag)),
        None => (1, "there is no element".into()),
    };
    Err(SceneFileError::Xml { place: Place { file: file.into(), line }, reason })
}

fn element(tag: &BytesStart<'_>, place: &Place, notes: &mut Vec<(u32, String)>) -> Result<Node> {
    let malformed = |reason: String| Err(SceneFileError::Xml { place: place.clone(), reason });
    let name = tag.name().0.to_string();
    if !is_name(&name) {
        return malformed(format!("\"{}\" is no name of an element", shown(&name)));
    }
    let mut seen = HashSet::new();
    let mut attributes = Vec::new();
    for attribute in tag.attributes().with_checks(false) {
        let attribute = match attribute {
            Ok(attribute) => attribute,
            Err(e) => return malformed(format!("attributes of <{name}>: {e}")),
        };
        let key = attribute.key.0;
        if !is_name(key) {
            return malformed(format!("\"{}\" is no name of an attribute", shown(key)));
        }
        if !seen.insert(key.to_string()) {
            let text = format!("attribute \"{key}\" of <{name}> is given twice: the first counts");
            notes.push((place.line, text));
            continue;
        }
        let value = unescape(&attribute.value);
        if let Some(c) = value.chars().find(|c| c.is_control()) {
            let code = u32::from(c);
            return malformed(format!("control character {code} in attribute \"{key}\""));
        }
        attributes.push((key.to_string(), value));
    }
    Ok(Node { tag: name, line: place.line, attributes, children: Vec::new() })
}

fn is_name(name: &str) -> bool {
    !name.is_empty() && name.len() <= MAX_NAME && !name.chars().any(|c| c.is_control())
}

fn shown(name: &str) -> String {
    let start: String = name.chars().take(40).collect();
    start.chars().map(|c| if c.is_control() { '?' } else { c }).collect()
}

/// The parser's message on one line.
fn plain_reason(e: &quick_xml::Error) -> String {
    let text = e.to_string();
    let text =
        text.trim_start_matches("ill-formed document: ").trim_start_matches("syntax error: ");
    text.chars().take(200).map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// True where a tag begins in `text`, comments and the like aside.
fn has_element(text: &str) -> bool {
    text.match_indices('<').any(|(at, _)| text[at + 1..].starts_with(|c: char| c.is_alphabetic()))
}

/// Puts in the five entities of XML and character references; white space becomes spaces, and other
/// `&` stay as they are.
fn unescape(raw: &str) -> String {
    let mut out = String::with_capacity(raw.len());
    let mut rest = raw;
    while let Some(at) = rest.find('&') {
        out.push_str(&rest[..at]);
        rest = &rest[at..];
        // No reference is longer than this, so that the search is short.
        let end = rest.bytes().take(12).position(|b| b == b';');
        match end.and_then(|end| Some((character(&rest[1..end])?, end))) {
            Some((c, end)) => {
                out.push(c);
                rest = &rest[end + 1..];
            }
            None => {
                out.push('&');
                rest = &rest[1..];
            }
        }
    }
    out.push_str(rest);
    out.replace(['\n', '\r', '\t'], " ")
}

fn character(name: &str) -> Option<char> {
    match name {
        "amp" => Some('&'),
        "lt" => Some('<'),
        "gt" => Some('>'),
        "quot" => Some('"'),
        "apos" => Some('\''),
        _ => {
            let number = name.strip_prefix('#')?;
            let code = match number.strip_prefix(['x', 'X']) {
                Some(hex) => u32::from_str_radix(hex, 16).ok()?,
                None => number.parse().ok()?,
            };
            char::from_u32(code)
        }
    }
}

/// Line of an offset; offsets must not fall, so that the text is read once.
struct Lines<'a> {
    text: &'a str,
    at: usize,
    line: u32,
}

impl Lines<'_> {
    fn of(&mut self, offset: u64) -> u32 {
        let offset = usize::try_from(offset).unwrap_or(usize::MAX).min(self.text.len());
        if offset > self.at {
            let feeds = self.text.as_bytes()[self.at..offset].iter().filter(|b| **b == b'\n');
            self.line = self.line.saturating_add(u32::try_from(feeds.count()).unwrap_or(u32::MAX));
            self.at = offset;
        }
        self.line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn root(text: &str) -> Node {
        parse(text, "t").unwrap().0
    }

    #[test]
    fn what_mitsuba_passes_over_is_passed_over() {
        let text = "\n <?xml version=\"1.0\"?><!DOCTYPE a [ <!ENTITY r \"0.5\"> ]>\
                    <a x=\"1\" x=\"2\"><!-- a -- b -->stray & text<b/></a>\n<c/>";
        let (node, notes) = parse(text, "t").unwrap();
        assert_eq!((node.tag.as_str(), node.children.len()), ("a", 1));
        assert_eq!(node.attribute("x"), Some("1"));
        assert_eq!(notes.len(), 2);
    }

    #[test]
    fn attributes_may_hold_what_xml_forbids_there() {
        let node = root("<a b=\"1 & 2 &lt; 3 <4> &#65;&#x42; &r; &\"/>");
        assert_eq!(node.attribute("b"), Some("1 & 2 < 3 <4> AB &r; &"));
    }

    #[test]
    fn lines_are_those_of_the_tags() {
        let node = root("\n<a\n b=\"1\">\n\n<c/>\n</a>");
        assert_eq!((node.line, node.children[0].line), (2, 5));
    }
}
