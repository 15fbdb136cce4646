//! Stanford PLY (ASCII, binary of both byte orders), read by ply-rs-bw.
//!
//! Vertices: `x y z`, optionally `nx ny nz` and `u v` (or `s t`). Faces: the list `vertex_indices`
//! or `vertex_index`. Everything else is skipped. Mitsuba 3.9.1 takes triangles only; polygons are
//! read here as fans.

use std::borrow::Cow;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType,
    ScalarType,
};

use super::RawMesh;
use crate::error::{Place, Result, SceneFileError};

/// Fails with a reason at a line (0: none).
type Read<T> = std::result::Result<T, (u32, String)>;

/// Reads a PLY file; `file` is its name for messages.
pub(crate) fn read_ply(bytes: &[u8], file: &str) -> Result<RawMesh> {
    read(bytes).map_err(|(line, reason)| {
        let place = Place { file: file.into(), line };
        SceneFileError::Mesh { place, reason }
    })
}

/// One vertex; missing components stay NaN.
struct Vertex {
    position: [f32; 3],
    normal: [f32; 3],
    uv: [f32; 2],
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Vertex { position: [f32::NAN; 3], normal: [f32::NAN; 3], uv: [f32::NAN; 2] }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let target = match name {
            "x" => &mut self.position[0],
            "y" => &mut self.position[1],
            "z" => &mut self.position[2],
            "nx" => &mut self.normal[0],
            "ny" => &mut self.normal[1],
            "nz" => &mut self.normal[2],
            "u" | "s" => &mut self.uv[0],
            "v" | "t" => &mut self.uv[1],
            _ => return PropertyAccessResult::Ignored,
        };
        match property.to_f32_lossy() {
            Some(value) => {
                *target = value;
                PropertyAccessResult::Set
            }
            None => PropertyAccessResult::UnsupportedType,
        }
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set_property(name, Property::Float(value))
    }
}

/// One face; most are triangles and need no memory of their own.
struct Face {
    first: [i64; 3],
    count: usize,
    rest: Vec<i64>,
}

impl Face {
    fn fill<T: Copy + Into<i64>>(&mut self, name: &str, list: &[T]) -> PropertyAccessResult {
        if name != "vertex_indices" && name != "vertex_index" {
            return PropertyAccessResult::Ignored;
        }
        self.count = list.len();
        for (to, from) in self.first.iter_mut().zip(list) {
            *to = (*from).into();
        }
        self.rest = list.iter().skip(3).map(|v| (*v).into()).collect();
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Face { first: [0; 3], count: 0, rest: Vec::new() }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match property {
            Property::ListChar(list) => self.fill(name, &list),
            Property::ListUChar(list) => self.fill(name, &list),
            Property::ListShort(list) => self.fill(name, &list),
            Property::ListUShort(list) => self.fill(name, &list),
            Property::ListInt(list) => self.fill(name, &list),
            Property::ListUInt(list) => self.fill(name, &list),
            _ => match name {
                "vertex_indices" | "vertex_index" => PropertyAccessResult::UnsupportedType,
                _ => PropertyAccessResult::Ignored,
            },
        }
    }
}

/// An element that is skipped.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Skipped
    }
}

/// Gives numbers such as `.5` and `2.` the digit that the parser insists on.
fn mend_numbers(bytes: &[u8]) -> Cow<'_, [u8]> {
    let find = |text: &[u8]| bytes.windows(text.len()).take(1 << 16).position(|w| w == text);
    let (Some(_), Some(body)) = (find(b"format ascii"), find(b"end_header")) else {
        return Cow::Borrowed(bytes);
    };
    let digit = |at: Option<&u8>| at.is_some_and(u8::is_ascii_digit);
    let bare = |at: usize| {
        let last = at.checked_sub(1).and_then(|i| bytes.get(i));
        let (before, after) = (digit(last), digit(bytes.get(at + 1)));
        (bytes[at] == b'.' && before != after).then_some(before)
    };
    if !(body..bytes.len()).any(|at| bare(at).is_some()) {
        return Cow::Borrowed(bytes);
    }
    let mut out = Vec::with_capacity(bytes.len() + bytes.len() / 8);
    out.extend_from_slice(&bytes[..body]);
    for (at, byte) in bytes.iter().enumerate().skip(body) {
        match bare(at) {
            Some(true) => out.extend_from_slice(b".0"),
            Some(false) => out.extend_from_slice(b"0."),
            None => out.push(*byte),
        }
    }
    Cow::Owned(out)
}

fn read(bytes: &[u8]) -> Read<RawMesh> {
    let mended = mend_numbers(bytes);
    let mut reader = Reader::new(&*mended);
    let header = Parser::<Skipped>::new().read_header(&mut reader).map_err(|e| plain(&e))?;
    let has = |element: &str, names: &[&str]| {
        let element = header.elements.get(element);
        element.is_some_and(|e| names.iter().any(|n| e.properties.contains_key(*n)))
    };
    for name in ["x", "y", "z"] {
        if !has("vertex", &[name]) {
            return Err((0, format!("the element \"vertex\" has no property \"{name}\"")));
        }
    }
    if !has("face", &["vertex_indices", "vertex_index"]) {
        let reason = "the element \"face\" has no list \"vertex_indices\" or \"vertex_index\"";
        return Err((0, reason.into()));
    }
    let mut vertices: Vec<Vertex> = Vec::new();
    let mut faces: Vec<Face> = Vec::new();
    for definition in header.elements.values() {
        check_size(definition, &header, reader.get_ref().len())?;
        match definition.name.as_str() {
            "vertex" => vertices = payload(&mut reader, definition, &header)?,
            "face" => faces = payload(&mut reader, definition, &header)?,
            _ => drop(payload::<Skipped>(&mut reader, definition, &header)?),
        }
    }
    let mut mesh = RawMesh {
        positions: vertices.iter().map(|v| v.position).collect(),
        triangles: triangulate(&faces, vertices.len())?,
        ..RawMesh::default()
    };
    let broken = mesh.positions.iter().position(|p| !p.iter().all(|v| v.is_finite()));
    if let Some(at) = broken {
        let [x, y, z] = mesh.positions[at];
        return Err((0, format!("position of vertex {at} is not finite: {x} {y} {z}")));
    }
    if has("vertex", &["nx"]) && has("vertex", &["ny"]) && has("vertex", &["nz"]) {
        mesh.normals = vertices.iter().map(|v| v.normal).collect();
    }
    if has("vertex", &["u", "s"]) && has("vertex", &["v", "t"]) {
        mesh.uvs = vertices.iter().map(|v| v.uv).collect();
        if mesh.uvs.iter().flatten().any(|v| !v.is_finite()) {
            mesh.notes.push("texture coordinates are not finite: none are used".into());
            mesh.uvs.clear();
        }
    }
    Ok(mesh)
}

/// Counts that the rest of the file cannot hold are refused before anything is made for them.
fn check_size(definition: &ElementDef, header: &Header, left: usize) -> Read<()> {
    let scalar = |t: &ScalarType| match t {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    };
    let each: usize = match header.encoding {
        // A digit and a space or line feed for each number.
        Encoding::Ascii => 2 * definition.properties.len(),
        _ => definition
            .properties
            .values()
            .map(|p| match &p.data_type {
                PropertyType::Scalar(t) | PropertyType::List(t, _) => scalar(t),
            })
            .sum(),
    };
    let name = &definition.name;
    let count = definition.count;
    if each == 0 && count > 0 {
        return Err((0, format!("the element \"{name}\" has no properties")));
    }
    // The last line may lack its line feed.
    if count.saturating_mul(each) > left.saturating_add(1) || count > u32::MAX as usize {
        return Err((0, format!("the file is too short for {count} of \"{name}\"")));
    }
    Ok(())
}

fn payload<E: PropertyAccess>(
    reader: &mut Reader<&[u8]>,
    definition: &ElementDef,
    header: &Header,
) -> Read<Vec<E>> {
    let binary = header.encoding != Encoding::Ascii;
    Parser::<E>::new().read_payload_for_element(reader, definition, header).map_err(|e| {
        let (line, reason) = plain(&e);
        // What the parser counts as lines in binary data are elements.
        if binary { (0, reason) } else { (line, reason) }
    })
}

/// The parser's message in one line.
fn plain(e: &ply_rs_bw::parser::ParseError) -> (u32, String) {
    let text = e.to_string();
    let text = match text.split_once(": ") {
        Some((line, rest)) if line.starts_with("Line ") => rest,
        _ => &text,
    };
    let words: Vec<&str> = text.split_whitespace().collect();
    let words = words.join(" ");
    // What follows is the grammar's list of everything that it would have liked.
    let first = words.split(" Error: ").next().unwrap_or(&words).replace(". String: ", ": ");
    let mut reason: String = first.chars().take(160).collect();
    if reason.is_empty() {
        reason = "unreadable".into();
    }
    (e.line().and_then(|l| u32::try_from(l).ok()).unwrap_or(0), format!("PLY: {reason}"))
}

/// Fans around the first corner, with every index checked.
fn triangulate(faces: &[Face], vertices: usize) -> Read<Vec<[u32; 3]>> {
    let mut triangles = Vec::with_capacity(faces.len());
    for (number, face) in faces.iter().enumerate() {
        let index = |i: i64| match u32::try_from(i) {
            Ok(index) if (index as usize) < vertices => Ok(index),
            _ => Err((0, format!("face {number} refers to vertex {i} of {vertices}"))),
        };
        if face.count < 3 {
            return Err((0, format!("face {number} has {} corners", face.count)));
        }
        let [a, mut b, c] = face.first;
        for next in std::iter::once(&c).chain(&face.rest) {
            triangles.push([index(a)?, index(b)?, index(*next)?]);
            b = *next;
        }
    }
    match triangles.is_empty() {
        true => Err((0, "the mesh has no faces".into())),
        false => Ok(triangles),
    }
}
