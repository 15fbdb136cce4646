//! Normals, sides and formats of mesh files. The expected numbers are those of Mitsuba 3.9.1.

use glam::{DVec3, Vec3};
use pathspace_core::description::{MeshData, ShapeDescription, ShapeGeometry};
use pathspace_scenes::source::Memory;
use pathspace_scenes::{LoadedScene, load_str};

/// Five vertices without any symmetry.
const IRREGULAR: &str = "v 0 0 0\nv 2 0 0.3\nv 1.5 1.7 -0.2\nv -0.4 1.1 0.9\nv 0.7 0.6 2.0\n\
                         f 1 2 3\nf 1 3 4\nf 1 5 2\nf 2 5 3\n";

/// A square towards +z, without vertex normals.
const SQUARE: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n";

/// The same with slanted ones.
const SLANTED: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvn 0.3 0 1\nf 1//1 2//1 3//1 4//1\n";

fn load(name: &str, bytes: &[u8], inside: &str) -> LoadedScene {
    let kind = &name[name.len() - 3..];
    let text = format!(
        "<scene version=\"3.0.0\"><shape type=\"{kind}\">\
         <string name=\"filename\" value=\"{name}\"/>{inside}</shape></scene>"
    );
    let files = Memory::new().with(name, bytes.to_vec());
    load_str(&text, "t.xml", &files, &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn mesh(shape: &ShapeDescription) -> &MeshData {
    match &shape.geometry {
        ShapeGeometry::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

fn transform(inside: &str) -> String {
    format!("<transform name=\"to_world\">{inside}</transform>")
}

/// Vertex normals in the world, as the core transforms them.
fn world_normals(shape: &ShapeDescription) -> Vec<DVec3> {
    let m = shape.to_world.matrix3.inverse().transpose();
    let to_world = |n: &[f32; 3]| (m * Vec3::from(*n).as_dvec3()).normalize();
    mesh(shape).normals.iter().map(to_world).collect()
}

fn assert_world_normals(inside: &str, expected: [[f64; 3]; 5]) {
    let loaded = load("m.obj", IRREGULAR.as_bytes(), inside);
    let normals = world_normals(&loaded.description.shapes[0]);
    for (found, expected) in normals.iter().zip(expected) {
        let expected = DVec3::from(expected);
        assert!((*found - expected).length() < 1e-5, "{inside}: {found} is not {expected}");
    }
}

#[test]
fn missing_normals_are_weighted_by_angle() {
    assert_world_normals(
        "",
        [
            [0.351900, 0.445381, 0.823288],
            [-0.819033, 0.553261, 0.151944],
            [-0.481303, -0.330634, 0.811806],
            [0.550535, -0.399531, 0.732998],
            [-0.536690, 0.578239, -0.614494],
        ],
    );
}

#[test]
fn missing_normals_are_computed_in_the_world() {
    assert_world_normals(
        &transform("<scale x=\"2\" y=\"0.5\"/><rotate x=\"1\" angle=\"30\"/>"),
        [
            [0.303936, -0.705668, 0.640044],
            [-0.960701, 0.215071, 0.175493],
            [-0.461710, -0.688802, 0.558907],
            [0.246053, -0.946168, 0.210295],
            [-0.131228, 0.980484, 0.146391],
        ],
    );
}

#[test]
fn missing_normals_of_a_mirrored_mesh_follow_the_mirrored_winding() {
    assert_world_normals(
        &transform("<scale x=\"-1\"/>"),
        [
            [0.351900, -0.445381, -0.823288],
            [-0.819033, -0.553261, -0.151944],
            [-0.481303, 0.330634, -0.811806],
            [0.550535, 0.399531, -0.732998],
            [-0.536690, -0.578239, 0.614494],
        ],
    );
}

/// z component of the geometric normal in the world: the core's rule for the transformed winding.
fn side(obj: &str, inside: &str) -> f64 {
    let loaded = load("m.obj", obj.as_bytes(), inside);
    let shape = &loaded.description.shapes[0];
    let mesh = mesh(shape);
    let sign = if shape.flip_normals { -1.0 } else { 1.0 };
    let normals: Vec<f64> = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| {
                let p = Vec3::from(mesh.positions[i as usize]).as_dvec3();
                shape.to_world.transform_point3(p)
            });
            (b - a).cross(c - a).normalize().z * sign
        })
        .collect();
    for n in world_normals(shape) {
        assert!(n.z * sign * normals[0] > 0.0, "{inside}: shading normal on the other side");
    }
    assert_eq!(normals[0], normals[1]);
    normals[0]
}

#[test]
fn sides_of_mirrored_and_flipped_meshes_are_mitsubas() {
    let mirror = transform("<scale x=\"-1\"/>");
    let faces = "<boolean name=\"face_normals\" value=\"true\"/>".to_string();
    let flip = "<boolean name=\"flip_normals\" value=\"true\"/>".to_string();
    for (obj, inside, expected) in [
        (SQUARE, String::new(), 1.0),
        (SQUARE, mirror.clone(), -1.0),
        (SQUARE, faces.clone(), 1.0),
        (SQUARE, mirror.clone() + &faces, -1.0),
        (SLANTED, String::new(), 1.0),
        // Vertex normals of the file decide, and they are transformed as normals.
        (SLANTED, mirror.clone(), 1.0),
        (SLANTED, faces.clone(), 1.0),
        (SLANTED, mirror + &faces, -1.0),
    ] {
        assert_eq!(side(obj, &inside), expected, "{obj}{inside}");
        assert_eq!(side(obj, &(inside.clone() + &flip)), -expected, "{obj}{inside} flipped");
    }
}

#[test]
fn triangles_against_their_normals_are_turned_with_a_note() {
    let text = SLANTED.to_string() + "f 1//1 3//1 2//1\n";
    let loaded = load("m.obj", text.as_bytes(), "");
    let mesh = mesh(&loaded.description.shapes[0]);
    assert_eq!(mesh.triangles.len(), 3);
    assert_eq!(mesh.triangles[2], [2, 0, 1]);
    assert_eq!(loaded.notes.iter().filter(|n| n.text.contains("1 of 3 triangles")).count(), 1);
}

#[test]
fn triangles_without_area_are_dropped_with_their_count() {
    let text = SQUARE.to_string() + "v 3 -1 0\nf 1 2 5\nf 1 1 2\n";
    let loaded = load("m.obj", text.as_bytes(), "");
    assert_eq!(mesh(&loaded.description.shapes[0]).triangles.len(), 2);
    let note = "2 of 4 triangles have no area: dropped";
    assert!(loaded.notes.iter().any(|n| n.text.contains(note)), "{:?}", loaded.notes);
}

#[test]
fn face_normals_discard_vertex_normals() {
    let faces = "<boolean name=\"face_normals\" value=\"true\"/>";
    let loaded = load("m.obj", SLANTED.as_bytes(), faces);
    assert!(mesh(&loaded.description.shapes[0]).normals.is_empty());
}

#[test]
fn obj_texture_coordinates_are_turned_upside_down_by_default() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.2 0.3\nf 1/1 2/1 3/1\n";
    let uv =
        |inside: &str| mesh(&load("m.obj", text.as_bytes(), inside).description.shapes[0]).uvs[0];
    assert_eq!(uv(""), [0.2, 0.7]);
    assert_eq!(uv("<boolean name=\"flip_tex_coords\" value=\"false\"/>"), [0.2, 0.3]);
}

/// A square with normals, texture coordinates and things to skip, in one of the three encodings.
fn ply(encoding: &str) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat {encoding} 1.0\ncomment made by hand\nelement vertex 4\nproperty double x\n\
         property float y\nproperty float z\nproperty float nx\nproperty float ny\n\
         property float nz\nproperty uchar red\nproperty float s\nproperty float t\n\
         element note 1\nproperty short n\nelement face 2\n\
         property list uchar uint vertex_index\nproperty int tag\nend_header\n"
    )
    .into_bytes();
    let little = encoding.contains("little");
    let vertices: [[f32; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    macro_rules! put {
        ($value:expr) => {
            out.extend(if little {
                $value.to_le_bytes().to_vec()
            } else {
                $value.to_be_bytes().to_vec()
            })
        };
    }
    if encoding == "ascii" {
        for [x, y] in vertices {
            out.extend(format!("{x} {y} 0 0 0 2 255 0.25 0.5\n").into_bytes());
        }
        out.extend(b"-7\n3 0 1 2 1\n3 0 2 3 1\n");
        return out;
    }
    for [x, y] in vertices {
        put!(f64::from(x));
        for value in [y, 0.0, 0.0, 0.0, 2.0] {
            put!(value);
        }
        out.push(255);
        put!(0.25f32);
        put!(0.5f32);
    }
    put!(-7i16);
    for face in [[0u32, 1, 2], [0, 2, 3]] {
        out.push(3);
        for index in face {
            put!(index);
        }
        put!(1i32);
    }
    out
}

#[test]
fn ply_files_of_all_encodings_give_the_same_mesh() {
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let loaded = load("m.ply", &ply(encoding), "");
        let mesh = mesh(&loaded.description.shapes[0]);
        let corners = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
        assert_eq!(mesh.positions, corners, "{encoding}");
        assert_eq!(mesh.normals, [[0.0, 0.0, 1.0]; 4], "{encoding}");
        assert_eq!(mesh.uvs, [[0.25, 0.5]; 4], "{encoding}");
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]], "{encoding}");
    }
}

#[test]
fn ply_quads_become_two_triangles() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
                end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
    let loaded = load("m.ply", text.as_bytes(), "");
    assert_eq!(mesh(&loaded.description.shapes[0]).triangles, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn ply_numbers_may_lack_a_digit_beside_the_point() {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float32 x\nproperty float32 y\n\
                property float32 z\nelement face 1\nproperty list uint8 int32 vertex_indices\n\
                end_header\n-.5 0. 0\n1.e0 .25 0\r\n 0  1.5  0 \n3 0 1 2\n";
    let loaded = load("m.ply", text.as_bytes(), "");
    let corners = [[-0.5, 0.0, 0.0], [1.0, 0.25, 0.0], [0.0, 1.5, 0.0]];
    assert_eq!(mesh(&loaded.description.shapes[0]).positions, corners);
}
