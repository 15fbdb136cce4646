//! Walks the XML in the order of the file and builds the graph of objects.

use roxmltree::{Document, Node};

use super::element::Element;
use super::files::Files;
use super::graph::{Graph, Object, Property};
use super::params::Parameters;
use super::value::{self, Value};
use super::{transform, upgrade};
use crate::error::{Known, Place, Result, SceneFileError};

/// Elements that make an object.
const OBJECTS: [&str; 13] = [
    "scene",
    "bsdf",
    "emitter",
    "film",
    "integrator",
    "medium",
    "phase",
    "rfilter",
    "sampler",
    "sensor",
    "shape",
    "texture",
    "volume",
];

/// Elements that make a property or steer the reading.
const OTHERS: [&str; 16] = [
    "alias",
    "boolean",
    "default",
    "float",
    "include",
    "integer",
    "path",
    "point",
    "ref",
    "rgb",
    "spectrum",
    "srgb",
    "string",
    "transform",
    "vector",
    "lookat",
];

/// Includes within includes, Mitsuba's limit.
const MAX_INCLUDES: usize = 15;

/// Elements within elements: real files have less than 10; the limit protects the stack.
const MAX_NESTING: usize = 64;

/// Files larger than this are not scene descriptions.
const MAX_XML_BYTES: usize = 1 << 30;

/// Reads a whole scene: the text of the main file and everything that it includes.
pub(crate) fn parse_scene(
    text: &[u8],
    file: &str,
    files: &mut Files<'_>,
    params: &mut Parameters,
) -> Result<Graph> {
    let mut reader = Reader { graph: Graph::default(), files, params };
    reader.file(text, file, None, 0)?;
    reader.params.check_used(&Place::file(file))?;
    Ok(reader.graph)
}

struct Reader<'r, 'f> {
    graph: Graph,
    files: &'r mut Files<'f>,
    params: &'r mut Parameters,
}

/// The file that is being read.
struct Context<'a> {
    file: &'a str,
    /// Offsets of the line feeds, so that finding a line does not read the text again.
    newlines: &'a [usize],
    /// Older than version 2.0.
    old: bool,
    includes: usize,
}

impl Context<'_> {
    fn place(&self, node: Node<'_, '_>) -> Place {
        let line = self.newlines.partition_point(|n| *n < node.range().start) + 1;
        Place { file: self.file.into(), line: u32::try_from(line).unwrap_or(u32::MAX) }
    }
}

impl Reader<'_, '_> {
    /// Reads one file; its objects become children of `parent` (none for the main file).
    fn file(
        &mut self,
        bytes: &[u8],
        file: &str,
        parent: Option<usize>,
        depth: usize,
    ) -> Result<()> {
        let xml = |line: u32, reason: String| {
            Err(SceneFileError::Xml { place: Place { file: file.into(), line }, reason })
        };
        if bytes.len() > MAX_XML_BYTES {
            return xml(0, format!("{} bytes are too many", bytes.len()));
        }
        let text = match std::str::from_utf8(bytes) {
            Ok(text) => text.trim_start_matches('\u{feff}'),
            Err(e) => {
                let line = bytes[..e.valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
                return xml(u32::try_from(line).unwrap_or(u32::MAX), "not UTF-8".into());
            }
        };
        let document = match Document::parse(text) {
            Ok(document) => document,
            Err(e) => return xml(e.pos().row, plain_reason(&e)),
        };
        let newlines: Vec<usize> =
            text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(i, _)| i).collect();
        let mut context = Context { file, newlines: &newlines, old: false, includes: depth };
        let root = document.root_element();
        let place = context.place(root);
        let Some(version) = root.attribute("version") else {
            return Err(SceneFileError::Attribute {
                place,
                problem: "missing",
                attribute: "version".into(),
                element: root.tag_name().name().into(),
                known: Known::new(["version"]),
            });
        };
        context.old = major(version, &place)? < 2;
        match parent {
            None if root.tag_name().name() != "scene" => Err(SceneFileError::Element {
                place,
                element: root.tag_name().name().into(),
                within: "a scene file".into(),
                known: Known::new(["scene"]),
            }),
            None => self.node(root, &context, None, 0),
            // An included scene gives its children to the scene that includes it.
            Some(parent) if root.tag_name().name() == "scene" => {
                self.element(root, &context)?;
                self.children(root, &context, parent, 0)
            }
            Some(parent) => self.node(root, &context, Some(parent), 0),
        }
    }

    fn children(
        &mut self,
        node: Node<'_, '_>,
        context: &Context<'_>,
        parent: usize,
        depth: usize,
    ) -> Result<()> {
        node.children()
            .filter(Node::is_element)
            .try_for_each(|child| self.node(child, context, Some(parent), depth + 1))
    }

    /// The element with its parameters put in; also adds it to the hash.
    fn element(&mut self, node: Node<'_, '_>, context: &Context<'_>) -> Result<Element> {
        let place = context.place(node);
        let tag = node.tag_name().name().to_string();
        self.files.hash(tag.as_bytes());
        let mut attributes = Vec::new();
        for attribute in node.attributes() {
            let value = self.params.substitute(attribute.value(), &place)?;
            self.files.hash(attribute.name().as_bytes());
            self.files.hash(value.as_bytes());
            attributes.push((attribute.name().to_string(), value));
        }
        Ok(Element { tag, place, attributes })
    }

    fn node(
        &mut self,
        node: Node<'_, '_>,
        context: &Context<'_>,
        parent: Option<usize>,
        depth: usize,
    ) -> Result<()> {
        let element = self.element(node, context)?;
        if depth > MAX_NESTING {
            let reason = format!("elements are nested deeper than {MAX_NESTING}");
            return Err(SceneFileError::Scene { place: element.place, reason });
        }
        let tag = element.tag.as_str();
        // `<spectrum type="…">` is an object in Mitsuba.
        let typed_spectrum = tag == "spectrum" && element.get("type").is_some();
        let class = OBJECTS.iter().find(|c| **c == tag).copied();
        match (class, parent) {
            (Some(class), _) => self.object(node, &element, class, context, parent, depth),
            (None, Some(parent)) if typed_spectrum => {
                self.object(node, &element, "texture", context, Some(parent), depth)
            }
            (None, Some(parent)) => self.other(node, &element, context, parent),
            // Only the root has no parent, and it is a scene.
            (None, None) => Ok(()),
        }
    }

    fn object(
        &mut self,
        node: Node<'_, '_>,
        element: &Element,
        class: &'static str,
        context: &Context<'_>,
        parent: Option<usize>,
        depth: usize,
    ) -> Result<()> {
        let known: &[&str] = match class {
            "scene" => &["version", "id", "name", "type"],
            // The root of an included file has a version.
            _ if depth == 0 => &["type", "id", "name", "version"],
            _ => &["type", "id", "name"],
        };
        element.only(known)?;
        if class == "scene" && parent.is_some() {
            return Err(SceneFileError::Element {
                place: element.place.clone(),
                element: "scene".into(),
                within: "a scene".into(),
                known: Known::new(OBJECTS.iter().copied().filter(|c| *c != "scene")),
            });
        }
        let plugin = if class == "scene" { "scene" } else { element.need("type", known)? };
        let index = self.graph.objects.len();
        if let Some(id) = element.get("id").filter(|id| !id.is_empty()) {
            self.graph.name(id, index, &element.place)?;
        }
        self.graph.objects.push(Object {
            class,
            plugin: plugin.into(),
            id: element.get("id").map(Into::into),
            place: element.place.clone(),
            old: context.old,
            properties: Vec::new(),
        });
        if let Some(parent) = parent {
            let name = element.get("name").unwrap_or("").into();
            let place = element.place.clone();
            self.add(parent, Property { name, place, value: Value::Object(index) })?;
        }
        self.children(node, context, index, depth)?;
        if context.old {
            upgrade::upgrade(&mut self.graph.objects[index]);
        }
        Ok(())
    }

    fn add(&mut self, parent: usize, property: Property) -> Result<()> {
        let object = &mut self.graph.objects[parent];
        if !property.name.is_empty()
            && let Some(first) = object.properties.iter().find(|p| p.name == property.name)
        {
            let reason = format!(
                "property \"{}\" of {} is given twice, first at {}",
                property.name,
                object.title(),
                first.place
            );
            return Err(SceneFileError::Reference { place: property.place, reason });
        }
        object.properties.push(property);
        Ok(())
    }

    /// Properties, references and the elements that steer the reading.
    fn other(
        &mut self,
        node: Node<'_, '_>,
        element: &Element,
        context: &Context<'_>,
        parent: usize,
    ) -> Result<()> {
        let place = &element.place;
        if element.tag != "transform"
            && let Some(child) = node.children().find(Node::is_element)
        {
            return Err(SceneFileError::Element {
                place: context.place(child),
                element: child.tag_name().name().into(),
                within: format!("<{}>", element.tag),
                known: Known::default(),
            });
        }
        match element.tag.as_str() {
            "default" => {
                element.only(&["name", "value"])?;
                let name = element.need("name", &["name", "value"])?;
                if name.is_empty() {
                    return Err(value::bad(place, "<default> name", "", "a name"));
                }
                self.params.default(name, element.need("value", &["name", "value"])?);
                Ok(())
            }
            "include" => self.include(element, context, parent),
            "path" => {
                element.only(&["value"])?;
                let name = element.need("value", &["value"])?;
                if parent != 0 {
                    let reason = "<path> may only stand directly in <scene>".into();
                    return Err(SceneFileError::Scene { place: place.clone(), reason });
                }
                match self.files.add_folder(name) {
                    true => Ok(()),
                    false => Err(value::bad(place, "<path>", name, "a folder")),
                }
            }
            "alias" => {
                element.only(&["id", "as"])?;
                let id = element.need("id", &["id", "as"])?;
                let name = element.need("as", &["id", "as"])?;
                let reference = Value::Reference(id.into());
                let from = Property { name: String::new(), place: place.clone(), value: reference };
                match self.graph.target(&from)? {
                    Some(index) => self.graph.name(name, index, place),
                    None => Ok(()),
                }
            }
            "ref" => {
                element.only(&["id", "name"])?;
                let id = element.need("id", &["id", "name"])?;
                let name = element.get("name").unwrap_or("").into();
                let value = Value::Reference(id.into());
                self.add(parent, Property { name, place: place.clone(), value })
            }
            _ => self.property(node, element, context, parent),
        }
    }

    fn include(&mut self, element: &Element, context: &Context<'_>, parent: usize) -> Result<()> {
        element.only(&["filename", "name"])?;
        let name = element.need("filename", &["filename"])?;
        if context.includes + 1 >= MAX_INCLUDES {
            let reason = format!("<include> of \"{name}\" is nested {MAX_INCLUDES} files deep");
            return Err(SceneFileError::Scene { place: element.place.clone(), reason });
        }
        let path = self.files.resolve(name);
        let bytes = self.files.read(&path, &element.place)?;
        let before = self.files.enter(&path);
        let file = path.display().to_string();
        let done = self.file(&bytes, &file, Some(parent), context.includes + 1);
        self.files.leave(before);
        done
    }

    fn property(
        &mut self,
        node: Node<'_, '_>,
        element: &Element,
        context: &Context<'_>,
        parent: usize,
    ) -> Result<()> {
        let place = &element.place;
        let tag = element.tag.as_str();
        let title = self.graph.objects[parent].title();
        let spatial = matches!(tag, "point" | "vector");
        let known: &[&str] = match tag {
            "transform" => &["name"],
            "spectrum" => &["name", "value", "filename"],
            _ if spatial => &["name", "value", "x", "y", "z"],
            "boolean" | "float" | "integer" | "rgb" | "srgb" | "string" => &["name", "value"],
            _ => {
                let known = OBJECTS.iter().chain(&OTHERS).copied();
                return Err(SceneFileError::Element {
                    place: place.clone(),
                    element: tag.into(),
                    within: title,
                    known: Known::new(known.filter(|k| !["scene", "lookat"].contains(k))),
                });
            }
        };
        element.only(known)?;
        let name = element.need("name", known)?;
        let what = format!("{title}: property \"{name}\"");
        let value = if tag == "transform" {
            let mut parts = Vec::new();
            for child in node.children().filter(Node::is_element) {
                if let Some(inner) = child.children().find(Node::is_element) {
                    return Err(SceneFileError::Element {
                        place: context.place(inner),
                        element: inner.tag_name().name().into(),
                        within: format!("<{}>", child.tag_name().name()),
                        known: Known::default(),
                    });
                }
                parts.push(self.element(child, context)?);
            }
            Value::Transform(transform::compose(&parts, context.old, place, &mut self.graph.notes)?)
        } else if spatial && element.get("value").is_none() {
            let c =
                |n: &str| value::number(place, &what, element.need(n, &["name", "x", "y", "z"])?);
            Value::Vector(glam::DVec3::new(c("x")?, c("y")?, c("z")?))
        } else if tag == "spectrum" && element.get("filename").is_some() {
            let file = element.get("filename").unwrap_or("");
            return Err(value::bad(place, &what, file, "a constant (spectrum files are not read)"));
        } else {
            let text = element.need("value", known)?;
            if let Some(other) = ["x", "y", "z"].iter().find(|n| element.get(n).is_some()) {
                return Err(value::bad(place, &what, other, "allowed beside \"value\""));
            }
            match tag {
                "boolean" => Value::Boolean(value::boolean(place, &what, text)?),
                "integer" => Value::Integer(value::integer(place, &what, text)?),
                "float" => Value::Float(value::number(place, &what, text)?),
                "rgb" => Value::Rgb(value::rgb(place, &what, text)?),
                "srgb" => Value::Rgb(value::srgb(place, &what, text)?),
                "spectrum" => Value::Spectrum(value::spectrum(place, &what, text)?),
                "string" => Value::String(text.into()),
                _ => Value::Vector(value::one_or_three(place, &what, text)?),
            }
        };
        self.add(parent, Property { name: name.into(), place: place.clone(), value })
    }
}

/// First part of a version such as "0.5.0".
fn major(version: &str, place: &Place) -> Result<u32> {
    let parts: Vec<&str> = version.trim().split('.').collect();
    let numbers: Option<Vec<u32>> = parts.iter().map(|p| p.parse().ok()).collect();
    match numbers {
        // What a later format means nobody here knows.
        Some(numbers) if (1..=3).contains(&numbers.len()) && numbers[0] <= 3 => Ok(numbers[0]),
        _ => Err(value::bad(place, "<scene> version", version, "a version up to 3, such as 3.0.0")),
    }
}

/// The parser's message without its position, which the place already says.
fn plain_reason(e: &roxmltree::Error) -> String {
    let text = e.to_string().replace('\n', " ");
    match text.rsplit_once(" at ") {
        Some((reason, at)) if at.chars().all(|c| c.is_ascii_digit() || c == ':') => reason.into(),
        _ => text,
    }
}
