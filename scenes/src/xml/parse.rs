//! Walks the XML in the order of the file and builds the graph of objects.

use std::collections::HashSet;

use super::dom::{self, Node};
use super::element::Element;
use super::encoding;
use super::files::Files;
use super::graph::{Graph, Object, Property};
use super::params::Parameters;
use super::value::{self, Value};
use super::{transform, upgrade};
use crate::error::{Known, Place, Result, SceneFileError};
use crate::note::NoteKind;
use crate::spectrum::Sampled;

/// Elements that make an object.
const OBJECTS: [&str; 14] = [
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
    "subsurface",
    "texture",
    "volume",
];

/// Elements that make a property or steer the reading.
const OTHERS: [&str; 17] = [
    "alias",
    "animation",
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

/// Included files of one scene: a tree of includes would be read for ever.
const MAX_FILES: usize = 10_000;

/// Files larger than this are not scene descriptions.
const MAX_XML_BYTES: usize = 1 << 30;

/// Reads a whole scene: the text of the main file and everything that it includes.
pub(crate) fn parse_scene(
    text: &[u8],
    file: &str,
    files: &mut Files<'_>,
    params: &mut Parameters,
) -> Result<Graph> {
    let (named, included) = (HashSet::new(), 0);
    let mut reader = Reader { graph: Graph::default(), files, params, named, included };
    reader.file(text, file, None, 0)?;
    reader.params.check_used(&Place::file(file))?;
    Ok(reader.graph)
}

struct Reader<'r, 'f> {
    graph: Graph,
    files: &'r mut Files<'f>,
    params: &'r mut Parameters,
    /// Named properties so far: object and name.
    named: HashSet<(usize, String)>,
    /// Included files so far.
    included: usize,
}

/// The file that is being read.
struct Context<'a> {
    file: &'a str,
    /// Older than version 2.0.
    old: bool,
    includes: usize,
}

impl Context<'_> {
    fn place(&self, node: &Node) -> Place {
        Place { file: self.file.into(), line: node.line }
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
        if bytes.len() > MAX_XML_BYTES {
            let reason = format!("{} bytes are more than {MAX_XML_BYTES}", bytes.len());
            return Err(SceneFileError::Xml { place: Place::file(file), reason });
        }
        let (text, latin) = encoding::decode(bytes);
        if latin {
            let text = "the file is not UTF-8: read as Latin-1";
            self.graph.notes.add(NoteKind::Mended, text, &Place::file(file));
        }
        let (root, notes) = dom::parse(&text, file)?;
        for (line, text) in notes {
            let place = Place { file: file.into(), line };
            self.graph.notes.add(NoteKind::Unknown, text, &place);
        }
        let mut context = Context { file, old: false, includes: depth };
        let place = context.place(&root);
        let Some(version) = root.attribute("version") else {
            return Err(SceneFileError::Attribute {
                place,
                problem: "missing",
                attribute: "version".into(),
                element: root.tag,
                known: Known::new(["version"]),
            });
        };
        let major = major(version, &place)?;
        if major > 3 {
            let text = format!("version \"{version}\" is read as version 3");
            self.graph.notes.add(NoteKind::Unknown, text, &place);
        }
        context.old = major < 2;
        match parent {
            None if root.tag != "scene" => Err(SceneFileError::Element {
                place,
                element: root.tag,
                within: "a scene file".into(),
                known: Known::new(["scene"]),
            }),
            None => self.node(&root, &context, None, 0),
            // An included scene gives its children to the scene that includes it.
            Some(parent) if root.tag == "scene" => {
                self.element(&root, &context)?;
                self.children(&root, &context, parent, 0)
            }
            Some(parent) => self.node(&root, &context, Some(parent), 0),
        }
    }

    fn children(
        &mut self,
        node: &Node,
        context: &Context<'_>,
        parent: usize,
        depth: usize,
    ) -> Result<()> {
        node.children
            .iter()
            .try_for_each(|child| self.node(child, context, Some(parent), depth + 1))
    }

    /// The element with its parameters put in; also adds it to the hash.
    fn element(&mut self, node: &Node, context: &Context<'_>) -> Result<Element> {
        let place = context.place(node);
        let tag = upgrade::tag(&node.tag, context.old).to_string();
        self.files.hash(tag.as_bytes());
        let mut attributes = Vec::with_capacity(node.attributes.len());
        for (name, value) in &node.attributes {
            let value = self.params.substitute(value, &place)?;
            self.files.hash(name.as_bytes());
            self.files.hash(value.as_bytes());
            attributes.push((name.clone(), value));
        }
        Ok(Element { tag, place, attributes })
    }

    fn node(
        &mut self,
        node: &Node,
        context: &Context<'_>,
        parent: Option<usize>,
        depth: usize,
    ) -> Result<()> {
        let element = self.element(node, context)?;
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
        node: &Node,
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
            && !self.named.insert((parent, property.name.clone()))
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
        node: &Node,
        element: &Element,
        context: &Context<'_>,
        parent: usize,
    ) -> Result<()> {
        let place = &element.place;
        if !matches!(element.tag.as_str(), "transform" | "animation")
            && let Some(child) = node.children.first()
        {
            return Err(SceneFileError::Element {
                place: context.place(child),
                element: child.tag.clone(),
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
        self.included += 1;
        if self.included > MAX_FILES {
            let reason = format!("<include> of \"{name}\": more than {MAX_FILES} included files");
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
        node: &Node,
        element: &Element,
        context: &Context<'_>,
        parent: usize,
    ) -> Result<()> {
        let place = &element.place;
        let tag = element.tag.as_str();
        let title = self.graph.objects[parent].title();
        let spatial = matches!(tag, "point" | "vector");
        let known: &[&str] = match tag {
            "transform" if context.old => &["name", "time"],
            "transform" | "animation" => &["name"],
            "blackbody" if context.old => &["name", "temperature", "scale"],
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
            Value::Transform(self.transform(node, context)?)
        } else if tag == "animation" {
            Value::Transform(self.first_key(node, context)?)
        } else if tag == "blackbody" {
            let text = element.need("temperature", known)?.trim_end_matches(['K', ' ']);
            let kelvin = value::number(place, &what, text)?;
            if !(kelvin > 0.0) {
                return Err(value::bad(place, &what, text, "a temperature > 0"));
            }
            let scale = value::number(place, &what, element.get("scale").unwrap_or("1"))?;
            Value::Sampled(Sampled::black_body(kelvin).scaled(scale))
        } else if spatial && element.get("value").is_none() {
            let c =
                |n: &str| value::number(place, &what, element.need(n, &["name", "x", "y", "z"])?);
            Value::Vector(glam::DVec3::new(c("x")?, c("y")?, c("z")?))
        } else if tag == "spectrum" && element.get("filename").is_some() {
            if element.get("value").is_some() {
                return Err(value::bad(place, &what, "value", "allowed beside \"filename\""));
            }
            let path = self.files.resolve(element.get("filename").unwrap_or(""));
            let bytes = self.files.read(&path, place)?;
            self.files.hash(&bytes);
            Value::Sampled(Sampled::from_file(&bytes, &path.display().to_string())?)
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
                "spectrum" => value::spectrum(place, &what, text, context.old)?,
                "string" => Value::String(text.into()),
                _ => Value::Vector(value::one_or_three(place, &what, text)?),
            }
        };
        self.add(parent, Property { name: name.into(), place: place.clone(), value })
    }

    /// Product of the elements of a `<transform>`.
    fn transform(&mut self, node: &Node, context: &Context<'_>) -> Result<glam::DAffine3> {
        let mut parts = Vec::new();
        for child in &node.children {
            if let Some(inner) = child.children.first() {
                return Err(SceneFileError::Element {
                    place: context.place(inner),
                    element: inner.tag.clone(),
                    within: format!("<{}>", child.tag),
                    known: Known::default(),
                });
            }
            parts.push(self.element(child, context)?);
        }
        transform::compose(&parts, context.old, &context.place(node), &mut self.graph.notes)
    }

    /// The transform of an `<animation>` at its first time: nothing moves here.
    fn first_key(&mut self, node: &Node, context: &Context<'_>) -> Result<glam::DAffine3> {
        let place = context.place(node);
        let mut first: Option<(f64, glam::DAffine3)> = None;
        for child in &node.children {
            let key = self.element(child, context)?;
            if key.tag != "transform" {
                return Err(SceneFileError::Element {
                    place: key.place,
                    element: key.tag,
                    within: "<animation>".into(),
                    known: Known::new(["transform"]),
                });
            }
            key.only(&["time", "name"])?;
            let time =
                value::number(&key.place, "<transform> time", key.get("time").unwrap_or("0"))?;
            let transform = self.transform(child, context)?;
            if first.is_none_or(|(earliest, _)| time < earliest) {
                first = Some((time, transform));
            }
        }
        let Some((time, transform)) = first else {
            let reason = "<animation> needs a <transform>".into();
            return Err(SceneFileError::Scene { place, reason });
        };
        let text = format!("<animation>: nothing moves: its first key (time {time}) is used");
        self.graph.notes.add(NoteKind::Differs, text, &place);
        Ok(transform)
    }
}

/// First part of a version such as "0.5.0".
fn major(version: &str, place: &Place) -> Result<u32> {
    let parts: Vec<&str> = version.trim().split('.').collect();
    let numbers: Option<Vec<u32>> = parts.iter().map(|p| p.parse().ok()).collect();
    match numbers {
        Some(numbers) if (1..=3).contains(&numbers.len()) => Ok(numbers[0]),
        _ => Err(value::bad(place, "<scene> version", version, "a version such as 3.0.0")),
    }
}
