//! Wavefront OBJ, read by tobj.
//!
//! Before tobj sees the text, lines that do not concern the geometry are blanked: groups and
//! materials would split the mesh (Mitsuba reads one mesh from a file, so that computed normals
//! are smooth across groups), and a fourth number of a vertex would divide it (Mitsuba ignores
//! it). When tobj refuses the text, a plain second look finds the line.

use super::RawMesh;
use crate::error::{Place, Result, SceneFileError};

/// Indices are 32 bits wide, and a corner of a face takes at least two bytes.
const MAX_BYTES: usize = 1 << 32;

/// Numbers of elements so far.
#[derive(Clone, Copy, Default)]
struct Counts {
    positions: i64,
    uvs: i64,
    normals: i64,
}

/// Reads an OBJ file; `file` is its name for messages.
pub(crate) fn read_obj(bytes: Vec<u8>, file: &str) -> Result<RawMesh> {
    let fail = |line: u32, reason: String| {
        let place = Place { file: file.into(), line };
        Err(SceneFileError::Mesh { place, reason })
    };
    if bytes.len() > MAX_BYTES {
        return fail(0, format!("{} bytes are too many for an OBJ file", bytes.len()));
    }
    let mut bytes = join_continued(bytes);
    let mut unknown = Unknown::default();
    if let Some((line, reason)) = clean(&mut bytes, &mut unknown) {
        return fail(line, reason);
    }
    let options = tobj::LoadOptions {
        single_index: true,
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
    };
    let loaded = tobj::load_obj_buf(&mut bytes.as_slice(), &options, |_| {
        Ok((Vec::new(), Default::default()))
    });
    let mesh = match loaded {
        Ok((mut models, _)) => models.pop().map(|m| m.mesh).unwrap_or_default(),
        Err(error) => {
            let found = find_error(&bytes);
            let (line, reason) = found.unwrap_or((0, error.to_string()));
            return fail(line, reason);
        }
    };
    match drop_short_attributes(mesh, &bytes) {
        Ok(mut mesh) => {
            mesh.notes.extend(unknown.note());
            Ok(mesh)
        }
        Err((line, reason)) => fail(line, reason),
    }
}

/// First words of lines without geometry, or with curves and points, which have no surface.
const IGNORED: [&[u8]; 19] = [
    b"g",
    b"o",
    b"s",
    b"mtllib",
    b"usemtl",
    b"maplib",
    b"usemap",
    b"mg",
    b"lod",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"shadow_obj",
    b"trace_obj",
    b"l",
    b"p",
    b"vp",
    b"call",
    b"csh",
];

/// Lines that begin with words which OBJ does not have, or which have surfaces that are not read.
#[derive(Default)]
struct Unknown {
    count: usize,
    first: String,
    line: u32,
}

impl Unknown {
    fn see(&mut self, word: &[u8], number: usize) {
        if word.is_empty() || word.starts_with(b"#") || IGNORED.contains(&word) {
            return;
        }
        if self.count == 0 {
            self.first = String::from_utf8_lossy(&word[..word.len().min(20)]).into_owned();
            self.line = line_number(number);
        }
        self.count += 1;
    }

    fn note(self) -> Option<String> {
        let Unknown { count, first, line } = self;
        let what = match count {
            0 => return None,
            1 => format!("line {line} begins with \"{first}\", which is not read: it is left out"),
            _ => format!(
                "{count} lines begin with words that are not read, the first of them line {line} with \"{first}\": they are left out"
            ),
        };
        Some(what)
    }
}

/// Puts lines that end in `\` together with the next one; empty lines after them keep the numbers
/// of the others. A byte-order mark at the beginning becomes spaces: it would hide the first word.
fn join_continued(mut bytes: Vec<u8>) -> Vec<u8> {
    if bytes.starts_with(b"\xef\xbb\xbf") {
        bytes[..3].fill(b' ');
    }
    let continued = |line: &[u8]| line.trim_ascii_end().ends_with(b"\\");
    if !bytes.split(|b| *b == b'\n').any(continued) {
        return bytes;
    }
    let mut joined = Vec::with_capacity(bytes.len());
    let mut owed = 0;
    for line in bytes.split_inclusive(|b| *b == b'\n') {
        match line.trim_ascii_end().strip_suffix(b"\\") {
            // A comment ends with its line.
            Some(part) if !part.contains(&b'#') && line.ends_with(b"\n") => {
                joined.extend_from_slice(part);
                joined.push(b' ');
                owed += 1;
            }
            _ => {
                joined.extend_from_slice(line);
                joined.resize(joined.len() + owed, b'\n');
                owed = 0;
            }
        }
    }
    joined
}

/// tobj's flat arrays as a mesh.
fn drop_short_attributes(
    mesh: tobj::Mesh,
    bytes: &[u8],
) -> std::result::Result<RawMesh, (u32, String)> {
    let mut raw = RawMesh {
        positions: mesh.positions.as_chunks::<3>().0.to_vec(),
        normals: mesh.normals.as_chunks::<3>().0.to_vec(),
        uvs: mesh.texcoords.as_chunks::<2>().0.to_vec(),
        triangles: mesh.indices.as_chunks::<3>().0.to_vec(),
        face_normals: false,
        notes: Vec::new(),
    };
    if raw.triangles.is_empty() {
        return Err((0, "the mesh has no faces".into()));
    }
    let finite = |v: &f32| v.is_finite();
    if !mesh.positions.iter().all(finite) || !mesh.normals.iter().all(finite) {
        return Err(find_error(bytes).unwrap_or((0, "a number is not finite".into())));
    }
    // Faces with and without normals in one file: Mitsuba leaves garbage where they are missing.
    if !raw.normals.is_empty() && raw.normals.len() != raw.positions.len() {
        raw.notes.push("some faces have no vertex normals: all are computed".into());
        raw.normals.clear();
    }
    let uvs_are_finite = mesh.texcoords.iter().all(finite);
    if !raw.uvs.is_empty() && (raw.uvs.len() != raw.positions.len() || !uvs_are_finite) {
        raw.notes.push("some texture coordinates are missing or not finite: none are used".into());
        raw.uvs.clear();
    }
    Ok(raw)
}

/// Blanks what tobj should not see. Returns the line of an index that tobj cannot handle or would
/// overlook.
fn clean(bytes: &mut [u8], unknown: &mut Unknown) -> Option<(u32, String)> {
    let mut counts = Counts::default();
    // Whether faces refer to texture coordinates and normals; tobj accepts that where there are
    // none.
    let (mut uvs, mut normals) = (false, false);
    for (number, line) in bytes.split_mut(|b| *b == b'\n').enumerate() {
        let start = line.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(line.len());
        // A comment at the end of a line.
        if let Some(comment) = line.iter().position(|b| *b == b'#') {
            line[comment..].fill(b' ');
        }
        let length = token_length(&line[start..]);
        let (head, rest) = line[start..].split_at_mut(length);
        match &*head {
            b"v" => {
                counts.positions += 1;
                blank_after(rest, 3);
            }
            b"vt" => counts.uvs += 1,
            b"vn" => counts.normals += 1,
            b"f" => {
                // tobj's index arithmetic is safe for plain numbers of up to nine digits only.
                let suspicious = rest.contains(&b'-') || longest_run_of_digits(rest) > 9;
                if suspicious && let Some(reason) = check_face(rest, &counts, None) {
                    return Some((line_number(number), reason));
                }
                note_references(rest, &mut uvs, &mut normals);
            }
            word => {
                unknown.see(word, number);
                line.fill(b' ');
            }
        }
        // What is left must be text; a stray byte makes it an unreadable number.
        for byte in line.iter_mut().filter(|b| !b.is_ascii()) {
            *byte = b'?';
        }
    }
    if (uvs && counts.uvs == 0) || (normals && counts.normals == 0) {
        return find_error(bytes);
    }
    None
}

/// Notes which indices the corners `v/vt/vn` of a face have.
fn note_references(rest: &[u8], uvs: &mut bool, normals: &mut bool) {
    let mut slashes = 0;
    for byte in rest {
        match byte {
            b'/' => slashes += 1,
            b'1'..=b'9' => {
                *uvs |= slashes == 1;
                *normals |= slashes == 2;
            }
            b if b.is_ascii_whitespace() => slashes = 0,
            _ => {}
        }
    }
}

fn line_number(index: usize) -> u32 {
    u32::try_from(index + 1).unwrap_or(u32::MAX)
}

fn token_length(bytes: &[u8]) -> usize {
    bytes.iter().position(u8::is_ascii_whitespace).unwrap_or(bytes.len())
}

/// Blanks everything after the first `keep` tokens.
fn blank_after(bytes: &mut [u8], keep: usize) {
    let mut tokens = 0;
    let mut inside = false;
    for byte in bytes {
        let space = byte.is_ascii_whitespace();
        tokens += usize::from(!space && !inside);
        inside = !space;
        if tokens > keep && !space {
            *byte = b' ';
            // The blanked token goes on until the next space.
            inside = true;
        }
    }
}

fn longest_run_of_digits(bytes: &[u8]) -> usize {
    bytes.split(|b| !b.is_ascii_digit()).map(<[u8]>::len).max().unwrap_or(0)
}

/// What is wrong with a face's corners. `total` has the numbers of elements in the whole file;
/// without it, only negative and huge indices are checked.
fn check_face(rest: &[u8], sofar: &Counts, total: Option<&Counts>) -> Option<String> {
    let text = String::from_utf8_lossy(rest);
    let mut corners = 0;
    for corner in text.split_whitespace() {
        corners += 1;
        let parts: Vec<&str> = corner.split('/').collect();
        if parts.len() > 3 || parts[0].is_empty() {
            return Some(format!("face corner \"{corner}\" is not v, v/vt, v//vn or v/vt/vn"));
        }
        for (kind, part) in parts.iter().enumerate().filter(|(_, p)| !p.is_empty()) {
            let what = ["vertex", "texture coordinate", "normal"][kind];
            let pick = |c: &Counts| [c.positions, c.uvs, c.normals][kind];
            let Ok(index) = part.parse::<i64>() else {
                return Some(format!("face corner \"{corner}\" is not a list of integers"));
            };
            let limit = total.map_or(999_999_999, pick);
            let fine = if index < 0 { index >= -pick(sofar) } else { index <= limit };
            // An index of 0 means "none" for the optional parts, as in Mitsuba.
            if !fine || (index == 0 && kind == 0) {
                let count = total.map_or(pick(sofar), pick);
                return Some(format!("face refers to {what} {index} of {count}"));
            }
        }
    }
    (corners == 0).then(|| "face without corners".into())
}

/// First line that cannot be read, after [`clean`].
fn find_error(bytes: &[u8]) -> Option<(u32, String)> {
    let lines = || bytes.split(|b| *b == b'\n').enumerate();
    let word = |line: &[u8]| {
        let text = String::from_utf8_lossy(line).into_owned();
        let mut words = text.split_whitespace().map(str::to_string);
        (words.next().unwrap_or_default(), words.collect::<Vec<String>>())
    };
    let mut total = Counts::default();
    for (_, line) in lines() {
        match word(line).0.as_str() {
            "v" => total.positions += 1,
            "vt" => total.uvs += 1,
            "vn" => total.normals += 1,
            _ => {}
        }
    }
    let mut sofar = Counts::default();
    for (number, line) in lines() {
        let (head, rest) = word(line);
        let problem = match head.as_str() {
            "v" => {
                sofar.positions += 1;
                check_numbers("vertex position", &rest, 3)
            }
            "vt" => {
                sofar.uvs += 1;
                check_numbers("texture coordinate", &rest, 2)
            }
            "vn" => {
                sofar.normals += 1;
                check_numbers("vertex normal", &rest, 3)
            }
            "f" => check_face(rest.join(" ").as_bytes(), &sofar, Some(&total)),
            _ => None,
        };
        if let Some(reason) = problem {
            return Some((line_number(number), reason));
        }
    }
    None
}

fn check_numbers(what: &str, words: &[String], count: usize) -> Option<String> {
    if words.len() < count {
        return Some(format!("{what} has {} numbers instead of {count}", words.len()));
    }
    let bad = words[..count].iter().find(|w| !w.parse::<f32>().is_ok_and(f32::is_finite))?;
    Some(format!("{what}: \"{bad}\" is not a finite number"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<RawMesh> {
        read_obj(text.as_bytes().to_vec(), "m.obj")
    }

    #[test]
    fn polygons_become_fans() {
        let mesh = read("v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\nf 1 2 3 4 5\n").unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    }

    #[test]
    fn groups_and_materials_do_not_split_the_mesh() {
        let text = "mtllib missing.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\no a\nf 1 2 3\n\
                    g b\nusemtl x\nf 2 4 3\n";
        let mesh = read(text).unwrap();
        assert_eq!(mesh.positions.len(), 4);
        assert_eq!(mesh.triangles, [[0, 1, 2], [1, 3, 2]]);
    }

    #[test]
    fn corners_with_different_uv_are_different_vertices() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 1\n\
                    f 1/1 2/1 3/1\nf 2/2 4/1 3/1\n";
        let mesh = read(text).unwrap();
        assert_eq!(mesh.positions.len(), 5);
        assert_eq!(mesh.uvs.len(), 5);
    }

    #[test]
    fn a_fourth_coordinate_is_ignored_as_in_mitsuba() {
        let mesh = read("v 2 0 0 2\nv 1 0 0\nv 0 1 0 1 1 1\nf 1 2 3\n").unwrap();
        assert_eq!(mesh.positions[0], [2.0, 0.0, 0.0]);
    }

    #[test]
    fn relative_indices_count_backwards() {
        let mesh = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n").unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
    }

    #[test]
    fn comments_end_lines_and_lines_go_on_after_a_backslash() {
        let text = "v 0 0 0 # first\nv 1 \\\n 0 0\nv 0 1 0\nf 1 2 \\\r\n3 # a face \\\nf 1 2 9\n";
        let error = read(text).unwrap_err().to_string();
        assert!(error.starts_with("m.obj:7: face refers to vertex 9 of 3"), "{error}");
        let mesh = read(&text.replace('9', "3")).unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (3, 2));
        assert!(mesh.notes.is_empty());
    }

    #[test]
    fn a_byte_order_mark_hides_no_vertex() {
        let mesh = read("\u{feff}v 5 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        assert_eq!(mesh.positions[0], [5.0, 0.0, 0.0]);
    }

    #[test]
    fn words_that_are_not_read_are_noted() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nface 1 2 3\nl 1 2\nf 1 2 3\nsurf 0 1\n";
        let notes = read(text).unwrap().notes;
        assert_eq!(notes.len(), 1);
        assert!(notes[0].starts_with("2 lines begin") && notes[0].contains("line 4 with \"face\""));
    }

    #[test]
    fn a_polygon_of_many_corners_is_a_fan() {
        let n = 20_000;
        let mut text = String::new();
        for i in 0..n {
            let angle = f64::from(i) / f64::from(n) * std::f64::consts::TAU;
            text += &format!("v {} {} 0\n", angle.cos(), angle.sin());
        }
        let corners: Vec<String> = (1..=n).map(|i| i.to_string()).collect();
        let mesh = read(&(text + "f " + &corners.join(" ") + "\n")).unwrap();
        assert_eq!(mesh.triangles.len(), n as usize - 2);
    }

    #[test]
    fn huge_indices_are_errors_with_their_line() {
        for index in ["99999999999999999999", "9223372036854775807", "-9223372036854775808", "7"] {
            let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/{index} 3/1\n");
            let error = read(&text).unwrap_err().to_string();
            assert!(error.starts_with("m.obj:5: face"), "{error}");
        }
    }
}
