//! Mesh files.

use super::{Case, check, scene};

/// A scene with one OBJ or PLY file.
fn mesh<'a>(name: &'a str, bytes: &'a [u8], expected: &'a str) -> Case<'a> {
    let kind = &name[name.len() - 3..];
    let body =
        format!("<shape type=\"{kind}\"><string name=\"filename\" value=\"{name}\"/></shape>");
    (scene(&body), vec![(name, bytes)], expected)
}

#[test]
fn broken_obj_files() {
    check(&[
        (
            scene("<shape type=\"obj\"/>"),
            vec![],
            "bad.xml:3: shape \"obj\": needs the property \"filename\"",
        ),
        (
            scene("<shape type=\"obj\"><string name=\"filename\" value=\"no.obj\"/></shape>"),
            vec![],
            "bad.xml:3: cannot read \"no.obj\": no such file in memory",
        ),
        mesh("a.obj", b"", "a.obj: the mesh has no faces"),
        mesh("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "a.obj: the mesh has no faces"),
        mesh("a.obj", b"v 0 0\nf 1 1 1\n", "a.obj:1: vertex position has 2 numbers instead of 3"),
        mesh(
            "a.obj",
            b"v 0 0 zero\nf 1 1 1\n",
            "a.obj:1: vertex position: \"zero\" is not a finite number",
        ),
        mesh(
            "a.obj",
            b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            "a.obj:1: vertex position: \"nan\" is not a finite number",
        ),
        mesh(
            "a.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 1 2 4\n",
            "a.obj:5: face refers to vertex 4 of 3",
        ),
        mesh(
            "a.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n",
            "a.obj:4: face refers to vertex 0 of 3",
        ),
        mesh(
            "a.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -4 -2 -1\n",
            "a.obj:4: face refers to vertex -4 of 3",
        ),
        mesh(
            "a.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x\n",
            "a.obj:4: face corner \"x\" is not a list of integers",
        ),
        mesh(
            "a.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/1 3/1\n",
            "a.obj:4: face refers to texture coordinate 1 of 0",
        ),
        mesh(
            "a.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//2 2//1 3//1\n",
            "a.obj:5: face refers to normal 2 of 1",
        ),
        mesh(
            "a.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0\nf 1 2 3\n",
            "a.obj:4: vertex normal has 2 numbers instead of 3",
        ),
        mesh(
            "a.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 0\nf 1//1 2//1 3//1\n",
            "bad.xml:3: mesh \"a.obj\": normal of vertex 0 has no direction: 0 0 0",
        ),
        mesh("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf\n", "a.obj:4: face without corners"),
        mesh("a.obj", b"\xff\xfe\x00\x01v 0 0 0", "a.obj: the mesh has no faces"),
        mesh(
            "a.obj",
            b"v 0 \xff 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            "a.obj:1: vertex position: \"?\" is not a finite number",
        ),
    ]);
}

#[test]
fn broken_ply_files() {
    const VERTICES: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n\
        property float y\nproperty float z\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
    let ply = |tail: &str| format!("{VERTICES}{tail}").into_bytes();
    let (short, range, edge, text) = (ply(""), ply("3 0 1 3\n"), ply("2 0 1\n"), ply("3 0 1 b\n"));
    let negative = ply("3 0 1 -1\n");
    let truncated = ply("3 0 1\n");
    let not_finite = VERTICES.replace("1 0 0", "1 0 inf") + "3 0 1 2\n";
    let no_z = VERTICES.replace("property float z\n", "") + "3 0 1 2\n";
    let no_list = VERTICES.replace("vertex_indices", "corners") + "3 0 1 2\n";
    let huge = VERTICES.replace("vertex 3", "vertex 4000000000") + "3 0 1 2\n";
    let empty = VERTICES.replace("face 1", "face 0");
    let version = VERTICES.replace("ascii 1.0", "braille 1.0");
    let binary = VERTICES.replace("ascii", "binary_little_endian");
    let mut list = VERTICES
        .replace("ascii", "binary_big_endian")
        .replace("vertex 3", "vertex 0")
        .replace("uchar int", "uint int")
        .split("0 0 0\n")
        .next()
        .unwrap()
        .as_bytes()
        .to_vec();
    list.extend([0xff; 12]);
    check(&[
        mesh("a.ply", b"", "a.ply: PLY: Unexpected end of file while reading magic number."),
        mesh("a.ply", b"plx\n", "a.ply:1: PLY: Expected magic number 'ply': 'plx '"),
        mesh(
            "a.ply",
            b"ply\nformat ascii 1.0\n",
            "a.ply:3: PLY: Unexpected end of file while reading header (missing 'end_header').",
        ),
        mesh(
            "a.ply",
            version.as_bytes(),
            "a.ply:2: PLY: Couldn't parse line: 'format braille 1.0 '",
        ),
        mesh("a.ply", &short, "a.ply: the file is too short for 1 of \"face\""),
        mesh("a.ply", &range, "a.ply: face 0 refers to vertex 3 of 3"),
        mesh("a.ply", &negative, "a.ply: face 0 refers to vertex -1 of 3"),
        mesh("a.ply", &edge, "a.ply: face 0 has 2 corners"),
        mesh("a.ply", &text, "a.ply:13: PLY: Couldn't read element line: '3 0 1 b '"),
        mesh("a.ply", &truncated, "a.ply:13: PLY: Couldn't read element line: '3 0 1 '"),
        mesh(
            "a.ply",
            not_finite.as_bytes(),
            "a.ply:11: PLY: Couldn't read element line: '1 0 inf '",
        ),
        mesh("a.ply", no_z.as_bytes(), "a.ply: the element \"vertex\" has no property \"z\""),
        mesh(
            "a.ply",
            no_list.as_bytes(),
            "a.ply: the element \"face\" has no list \"vertex_indices\" or \"vertex_index\"",
        ),
        mesh("a.ply", huge.as_bytes(), "a.ply: the file is too short for 4000000000 of \"vertex\""),
        mesh("a.ply", empty.as_bytes(), "a.ply: the mesh has no faces"),
        mesh("a.ply", binary.as_bytes(), "a.ply: the file is too short for 3 of \"vertex\""),
        mesh(
            "a.ply",
            &list,
            "a.ply: PLY: Unexpected end of file while reading binary element 'face' (expected 1, got 0).",
        ),
    ]);
}
