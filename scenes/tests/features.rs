//! Groups, serialized meshes and environment maps.

use std::io::Write;
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec2};
use pathspace_core::description::{
    EmitterDescription, MaterialKind, MeshData, Parameter, ShapeGeometry,
};
use pathspace_scenes::source::Memory;
use pathspace_scenes::{LoadedScene, load_str};

const OBJ: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn load(body: &str, files: Memory) -> Result<LoadedScene, String> {
    let text = format!("<scene version=\"3.0.0\">\n{body}\n</scene>");
    load_str(&text, "t.xml", &files, &[]).map_err(|e| e.to_string())
}

fn meshes(scene: &LoadedScene) -> Vec<Arc<MeshData>> {
    let mesh = |g: &ShapeGeometry| match g {
        ShapeGeometry::Mesh(mesh) => Some(mesh.clone()),
        _ => None,
    };
    scene.description.shapes.iter().filter_map(|s| mesh(&s.geometry)).collect()
}

#[test]
fn instances_are_copies_of_their_group_in_their_places() {
    let body = "<shape type=\"shapegroup\" id=\"g\">\
                <shape type=\"obj\"><string name=\"filename\" value=\"m.obj\"/>\
                <transform name=\"to_world\"><scale value=\"2\"/></transform></shape>\
                <shape type=\"sphere\"/></shape>\
                <shape type=\"instance\"><ref id=\"g\"/><transform name=\"to_world\"><translate x=\"5\"/></transform></shape>\
                <shape type=\"instance\"><ref id=\"g\"/></shape>";
    let scene = load(body, Memory::new().with("m.obj", OBJ)).unwrap();
    let shapes = &scene.description.shapes;
    assert_eq!(shapes.len(), 4);
    let corner = shapes[0].to_world.transform_point3(DVec3::X);
    assert_eq!(corner, DVec3::new(7.0, 0.0, 0.0));
    assert_eq!(shapes[1].to_world.translation, DVec3::new(5.0, 0.0, 0.0));
    assert_eq!(shapes[2].to_world.transform_point3(DVec3::X), DVec3::new(2.0, 0.0, 0.0));
}

#[test]
fn merged_shapes_are_those_shapes() {
    let body = "<shape type=\"merge\"><shape type=\"cube\"/><shape type=\"disk\"/></shape>";
    assert_eq!(load(body, Memory::new()).unwrap().description.shapes.len(), 2);
}

#[test]
fn broken_groups_are_refused() {
    let error = |body: &str| load(body, Memory::new()).unwrap_err();
    assert_eq!(
        error("<shape type=\"instance\"/>"),
        "t.xml:2: shape \"instance\": needs a shapegroup"
    );
    assert_eq!(
        error("<shape type=\"instance\"><shape type=\"cube\"/></shape>"),
        "t.xml:2: shape \"instance\": needs a shapegroup, not shape \"cube\""
    );
    assert_eq!(
        error("<shape type=\"merge\" id=\"m\"><ref id=\"m\"/></shape>"),
        "t.xml:2: shape \"merge\": groups are nested deeper than 8"
    );
}

/// Two triangles of different size in one file of version 4.
fn serialized() -> Vec<u8> {
    let mut out = Vec::new();
    let mut offsets = Vec::new();
    for size in [1.0f32, 3.0] {
        offsets.push(out.len() as u64);
        let mut body = 0x1000_u32.to_le_bytes().to_vec();
        body.push(0);
        body.extend([3u64, 1].into_iter().flat_map(u64::to_le_bytes));
        let positions = [0.0, 0.0, 0.0, size, 0.0, 0.0, 0.0, size, 0.0];
        body.extend(positions.into_iter().flat_map(f32::to_le_bytes));
        body.extend([0u32, 1, 2].into_iter().flat_map(u32::to_le_bytes));
        let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        packed.write_all(&body).unwrap();
        out.extend([0x1c, 0x04, 4, 0]);
        out.extend(packed.finish().unwrap());
    }
    out.extend(offsets.into_iter().flat_map(u64::to_le_bytes));
    out.extend(2u32.to_le_bytes());
    out
}

#[test]
fn serialized_meshes_are_chosen_by_their_index() {
    let body = "<shape type=\"serialized\"><string name=\"filename\" value=\"m.serialized\"/></shape>\
                <shape type=\"serialized\"><string name=\"filename\" value=\"m.serialized\"/><integer name=\"shape_index\" value=\"1\"/></shape>";
    let scene = load(body, Memory::new().with("m.serialized", serialized())).unwrap();
    let sizes: Vec<f32> = meshes(&scene).iter().map(|m| m.positions[1][0]).collect();
    assert_eq!(sizes, [1.0, 3.0]);
    let third = "<shape type=\"serialized\"><string name=\"filename\" value=\"m.serialized\"/><integer name=\"shape_index\" value=\"2\"/></shape>";
    assert_eq!(
        load(third, Memory::new().with("m.serialized", serialized())).unwrap_err(),
        "m.serialized: mesh 2: the file has 2 meshes: there is no shape_index 2"
    );
}

/// A portable float map of 2 × 2 grey texels.
fn pfm(values: [f32; 4]) -> Vec<u8> {
    let mut bytes = b"Pf\n2 2\n-1\n".to_vec();
    bytes.extend(values.into_iter().flat_map(f32::to_le_bytes));
    bytes
}

#[test]
fn an_environment_has_its_image_its_turn_and_its_scale() {
    let body = "<emitter type=\"envmap\"><string name=\"filename\" value=\"e.pfm\"/><float name=\"scale\" value=\"2\"/>\
                <transform name=\"to_world\"><rotate y=\"1\" angle=\"90\"/><scale x=\"-3\" y=\"3\" z=\"3\"/></transform></emitter>";
    let scene = load(body, Memory::new().with("e.pfm", pfm([1.0, -2.0, 3.0, 4.0]))).unwrap();
    let EmitterDescription::Environment { bitmap, to_world, scale } =
        &scene.description.emitters[0]
    else {
        panic!()
    };
    assert_eq!(*scale, 2.0);
    assert_eq!([bitmap.texel(0, 0).r, bitmap.texel(1, 1).r], [3.0, 0.0]);
    let expected = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0))
        * DMat3::from_rotation_y(std::f64::consts::FRAC_PI_2);
    assert!((*to_world - expected).to_cols_array().iter().all(|v| v.abs() < 1e-9));
    assert!(scene.notes.iter().any(|n| n.text.contains("1 negative values")));
    pathspace_core::Scene::new(&scene.description).unwrap();
}

#[test]
fn broken_environments_are_refused() {
    let error = |inner: &str, bytes: Vec<u8>| {
        let body = format!("<emitter type=\"envmap\">{inner}</emitter>");
        load(&body, Memory::new().with("e.pfm", bytes)).unwrap_err()
    };
    let file = "<string name=\"filename\" value=\"e.pfm\"/>";
    let good = || pfm([1.0; 4]);
    assert_eq!(error("", good()), "t.xml:2: emitter \"envmap\": needs the property \"filename\"");
    assert_eq!(
        error("<string name=\"filename\" value=\"no.exr\"/>", good()),
        "t.xml:2: cannot read \"no.exr\": no such file in memory"
    );
    assert_eq!(
        error(file, b"GIF89a".to_vec()),
        "t.xml:2: image \"e.pfm\" is no image: known are BMP, EXR, HDR, JPEG, PFM, PNG and TGA"
    );
    assert_eq!(
        error(file, pfm([f32::NAN; 4])),
        "t.xml:2: image \"e.pfm\" texel (0, 0) is not finite"
    );
    assert_eq!(
        error(&format!("{file}<float name=\"scale\" value=\"-1\"/>"), good()),
        "t.xml:2: emitter \"envmap\": property \"scale\": \"-1\" is not a number ≥ 0"
    );
    let stretched = "<transform name=\"to_world\"><scale x=\"2\"/></transform>";
    assert_eq!(
        error(&format!("{file}{stretched}"), good()),
        "t.xml:2: emitter \"envmap\": property \"to_world\": an environment can be turned and mirrored, not stretched or sheared"
    );
    let twice = format!("<emitter type=\"constant\"/><emitter type=\"envmap\">{file}</emitter>");
    assert_eq!(
        load(&twice, Memory::new().with("e.pfm", good())).unwrap_err(),
        "t.xml:2: more than one environment emitter"
    );
}

fn reflectance(texture: &str, files: Memory) -> Result<MaterialKind, String> {
    let body = format!("<shape type=\"cube\"><bsdf type=\"diffuse\">{texture}</bsdf></shape>");
    Ok(load(&body, files)?.description.materials[0].kind.clone())
}

#[test]
fn textures_stand_for_reflectances() {
    let board = "<texture type=\"checkerboard\" name=\"reflectance\"><rgb name=\"color0\" value=\"0.8\"/>\
                 <texture name=\"color1\" type=\"bitmap\"><string name=\"filename\" value=\"e.pfm\"/>\
                 <string name=\"filter_type\" value=\"nearest\"/></texture>\
                 <transform name=\"to_uv\"><scale x=\"2\" y=\"2\"/></transform></texture>";
    let files = Memory::new().with("e.pfm", pfm([0.1, 0.2, 0.3, 0.4]));
    let kind = reflectance(board, files).unwrap();
    let MaterialKind::Textured { model, textures } = kind else { panic!("{kind:?}") };
    let [(Parameter::Reflectance, texture)] = textures.as_slice() else { panic!() };
    let at = |u, v| texture.eval(Vec2::new(u, v)).r;
    // The image begins with its upper row, which stands last in the file.
    assert_eq!([at(0.1, 0.1), at(0.3, 0.1), at(0.8, 0.7)], [0.8, 0.3, 0.2]);
    let mean = 0.5 * (0.8 + 0.25);
    let MaterialKind::Diffuse { reflectance } = *model else { panic!() };
    assert!((reflectance.r - mean).abs() < 1e-6);
}

#[test]
fn broken_textures_are_refused() {
    let error = |texture: &str| {
        let files = Memory::new().with("e.pfm", pfm([0.1, 0.2, 0.3, 0.4]));
        reflectance(texture, files).unwrap_err()
    };
    let bitmap = |inner: &str| {
        error(&format!(
            "<texture type=\"bitmap\" name=\"reflectance\"><string name=\"filename\" value=\"e.pfm\"/>{inner}</texture>"
        ))
    };
    assert_eq!(
        bitmap("<string name=\"filter_type\" value=\"cubic\"/>"),
        "t.xml:2: texture \"bitmap\": property \"filter_type\": \"cubic\" is not one of bilinear, nearest"
    );
    assert_eq!(
        bitmap("<string name=\"wrap_mode\" value=\"black\"/>"),
        "t.xml:2: texture \"bitmap\": property \"wrap_mode\": \"black\" is not one of clamp, mirror, repeat"
    );
    assert_eq!(
        error("<texture type=\"scale\" name=\"reflectance\"/>"),
        "t.xml:2: texture \"scale\": needs a nested texture"
    );
    assert_eq!(
        error("<texture type=\"scale\" id=\"s\" name=\"reflectance\"><ref id=\"s\"/></texture>"),
        "t.xml:2: texture \"scale\": textures are nested deeper than 8"
    );
    let light = "<shape type=\"cube\"><emitter type=\"area\"><texture type=\"checkerboard\" name=\"radiance\"/></emitter></shape>";
    // Where a colour is needed, a texture stands for its mean.
    let loaded = load(light, Memory::new()).unwrap();
    assert!(loaded.notes.iter().any(|n| n.to_string().contains("stands for its mean here")));
    assert!(loaded.description.shapes[0].emission.is_some_and(|c| (c.r - 0.3).abs() < 1e-6));
}
