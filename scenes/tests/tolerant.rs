//! What other readers forgive or what makes no difference here: the scene loads, with the notes
//! that say so.

use std::path::Path;

use pathspace_core::description::{MaterialKind, MicrofacetKind, ShapeGeometry};
use pathspace_scenes::source::Memory;
use pathspace_scenes::{LoadOptions, LoadedScene, load_str, load_with};

fn try_read(version: &str, body: &str) -> Result<LoadedScene, String> {
    let text = format!("<scene version=\"{version}\">\n{body}\n</scene>");
    let files = Memory::new()
        .with("flat.obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n".as_slice())
        .with("hill.spd", b"400 0.1\n500 0.5\n600 0.9\n700 0.3\n".as_slice());
    load_str(&text, "t.xml", &files, &[]).map_err(|e| e.to_string())
}

fn read(version: &str, body: &str) -> LoadedScene {
    try_read(version, body).unwrap_or_else(|e| panic!("{body}\n{e}"))
}

fn notes(version: &str, body: &str) -> Vec<String> {
    let loaded = read(version, body);
    let no_sensor = |text: &str| text.contains("no sensor");
    loaded.notes.iter().map(ToString::to_string).filter(|n| !no_sensor(n)).collect()
}

/// A body of a scene and the notes that reading it gives.
type Noted<'a> = (&'a str, &'a str, &'a [&'a str]);

#[test]
fn what_is_passed_over_is_noted() {
    let table: &[Noted<'_>] = &[
        (
            "3.0.0",
            "<boolean name=\"shiny\" value=\"true\"/>",
            &[
                "t.xml:2: property \"shiny\" is not understood by <scene> and ignored; known: <bsdf>, <emitter>, <film>, <integrator>, <medium>, <phase>, <rfilter>, <sampler>, <sensor>, <shape>, <texture>, <volume>, allow_thread_dumping, embree_use_robust_intersections, thread_reordering",
            ],
        ),
        (
            "3.0.0",
            "<boolean name=\"embree_use_robust_intersections\" value=\"true\"/>",
            &[
                "t.xml:2: <scene>: property \"embree_use_robust_intersections\" is ignored: it concerns Mitsuba's ray tracing only",
            ],
        ),
        (
            "3.0.0",
            "<shape type=\"disk\"><float name=\"size\" value=\"1\"/></shape>\n<shape type=\"disk\"><float name=\"size\" value=\"2\"/></shape>",
            &[
                "t.xml:2: property \"size\" is not understood by shape \"disk\" and ignored; known: <bsdf>, <emitter>, flip_normals, to_world (2 times)",
            ],
        ),
        (
            "3.0.0",
            "<integrator type=\"aov\"><string name=\"aovs\" value=\"d:depth\"/>\n<integrator type=\"path\"/></integrator>",
            &["t.xml:2: integrator \"aov\" is not understood: integrator \"path\" in it counts"],
        ),
        (
            "3.0.0",
            "<integrator type=\"sppm\"><integer name=\"photons\" value=\"9\"/></integrator>",
            &["t.xml:2: integrator \"sppm\" is not understood: the default counts"],
        ),
        (
            "3.0.0",
            "<texture type=\"marble\"/>\n<medium type=\"homogeneous\"/>",
            &[
                "t.xml:2: texture \"marble\" is ignored: nothing refers to it",
                "t.xml:3: medium \"homogeneous\" is ignored: nothing refers to it",
            ],
        ),
        (
            "3.0.0",
            "<bsdf type=\"velvet\"/>",
            &["t.xml:2: bsdf \"velvet\" is not understood, and nothing uses it"],
        ),
        (
            "3.0.0",
            "<sensor type=\"perspective\"><film type=\"mfilm\"/><sampler type=\"sobol\"/></sensor>",
            &[
                "t.xml:2: film \"mfilm\" is read as \"hdrfilm\"",
                "t.xml:2: sampler \"sobol\" is read as \"independent\"",
            ],
        ),
        (
            "3.0.0",
            "<sensor type=\"perspective\"><film type=\"hdrfilm\"><rfilter type=\"mitchell\"><float name=\"A\" value=\"1\"/></rfilter></film></sensor>",
            &["t.xml:2: rfilter \"mitchell\" is read as \"gaussian\""],
        ),
        (
            "3.0.0",
            "<shape type=\"obj\"><string name=\"filename\" value=\"flat.obj\"/></shape>",
            &["t.xml:2: mesh \"flat.obj\": all 1 triangles have no area: left out"],
        ),
        (
            "3.0.0",
            "<shape type=\"cube\" id=\"a\" id=\"b\"/>",
            &["t.xml:2: attribute \"id\" of <shape> is given twice: the first counts"],
        ),
        ("4.0.0", "", &["t.xml:1: version \"4.0.0\" is read as version 3"]),
        (
            "0.6.0",
            "<integrator type=\"path\"><boolean name=\"strictNormals\" value=\"true\"/></integrator>",
            &[
                "t.xml:2: property \"strict_normals\" is ignored: shading normals are used as without it",
            ],
        ),
        (
            "0.5.0",
            "<shape type=\"sphere\"><boolean name=\"faceNormals\" value=\"true\"/></shape>",
            &[
                "t.xml:2: property \"face_normals\" is not understood by shape \"sphere\" and ignored; known: <bsdf>, <emitter>, center, flip_normals, radius, to_world",
            ],
        ),
        (
            "0.5.0",
            "<bsdf type=\"roughconductor\"><string name=\"distribution\" value=\"phong\"/></bsdf>",
            &["t.xml:2: distribution \"phong\" is read as \"beckmann\""],
        ),
        (
            "0.6.0",
            "<sensor type=\"perspective\">\n<animation name=\"toWorld\"><transform time=\"1\"><translate x=\"1\"/></transform><transform time=\"0\"><translate x=\"2\"/></transform></animation></sensor>",
            &["t.xml:3: <animation>: nothing moves: its first key (time 0) is used"],
        ),
    ];
    let mut wrong = Vec::new();
    for (version, body, expected) in table {
        let found = notes(version, body);
        if found != *expected {
            wrong.push(format!("{body}\n  expected {expected:#?}\n  found    {found:#?}"));
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn strictness_makes_errors_of_what_is_not_known() {
    let strict = |body: &str| {
        let text = format!("<scene version=\"3.0.0\">\n{body}</scene>");
        let options = LoadOptions { strict: true, ..LoadOptions::default() };
        let files = Memory::new().with("t.xml", text.into_bytes());
        load_with(&files, Path::new("t.xml"), &options).map(|_| ()).map_err(|e| e.to_string())
    };
    let error =
        strict("<shape type=\"disk\"><float name=\"size\" value=\"1\"/></shape>").unwrap_err();
    assert!(error.starts_with("t.xml:2: property \"size\" is not understood by shape \"disk\""));
    assert!(error.ends_with("(an error because of --strict)"), "{error}");
    assert!(strict("<integrator type=\"moment\"/>").is_err());
    // What makes no difference stays a note.
    assert_eq!(strict("<medium type=\"homogeneous\"/>"), Ok(()));
}

#[test]
fn everything_that_is_missing_is_told_at_once() {
    let body = "<shape type=\"cube\"><bsdf type=\"velvet\"><texture name=\"a\" type=\"marble\"/></bsdf></shape>\n\
                <shape type=\"cube\"><bsdf type=\"velvet\"/></shape>\n<emitter type=\"laser\"/>\n<shape type=\"hair\"/>";
    assert_eq!(
        try_read("3.0.0", body).unwrap_err(),
        "t.xml:4: 4 things are not understood: emitter \"laser\" (once, first in line 4); \
         bsdf \"velvet\" (2 times, first in line 2); texture \"marble\" (once, first in line 2); \
         shape \"hair\" (once, first in line 5; there are no curves)"
    );
}

#[test]
fn one_of_several_sensors_is_chosen_by_its_number() {
    let text = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\
                <sensor type=\"perspective\"><float name=\"fov\" value=\"30\"/></sensor></scene>";
    let load = |sensor: usize| {
        let files = Memory::new().with("t.xml", text.as_bytes());
        load_with(&files, Path::new("t.xml"), &LoadOptions { sensor, ..LoadOptions::default() })
    };
    assert_eq!(load(1).unwrap().description.sensor.fov_x_degrees, 30.0);
    assert_ne!(load(1).unwrap().hash, load(0).unwrap().hash);
    let error = load(2).unwrap_err().to_string();
    assert_eq!(error, "t.xml:1: <scene>: has 2 sensors: there is no sensor 2");
}

#[test]
fn a_light_may_stand_apart_from_its_shape() {
    let body = "<emitter type=\"area\" id=\"l\"><rgb name=\"radiance\" value=\"3\"/></emitter>\
                <shape type=\"sphere\"><ref id=\"l\"/></shape>";
    let scene = read("3.0.0", body).description;
    assert_eq!(scene.shapes[0].emission.unwrap().to_array(), [3.0; 3]);
    assert!(scene.emitters.is_empty());
}

/// Radius |M e_x|·r, as Mitsuba 3.9.1 has it for the same files (and 0.6 had it).
#[test]
fn a_stretched_sphere_keeps_the_radius_along_its_x_axis() {
    for (transform, radius) in [
        ("<scale x=\"1.2\"/>", 1.2),
        ("<scale y=\"1.2\"/>", 1.0),
        ("<scale x=\"-2\"/>", 2.0),
        ("<rotate z=\"1\" angle=\"30\"/><scale x=\"1.5\"/>", 1.3919),
    ] {
        let body = format!(
            "<shape type=\"sphere\"><point name=\"center\" value=\"1 0 0\"/><transform name=\"to_world\">{transform}</transform></shape>"
        );
        let shape = &read("3.0.0", &body).description.shapes[0];
        let ShapeGeometry::Sphere { center, radius: own } = shape.geometry else { panic!() };
        let m = shape.to_world.matrix3;
        for axis in [m.x_axis, m.y_axis, m.z_axis] {
            assert!((axis.length() * own - radius).abs() < 1e-4, "{transform}: {axis}");
        }
        let moved = shape.to_world.transform_point3(center).length();
        assert!((moved - radius).abs() < 1e-4, "{transform}: the centre is at {moved}");
    }
}

#[test]
fn an_elliptic_cylinder_is_a_mesh_and_a_stretched_one_is_not() {
    let kind = |scale: &str| {
        let body = format!(
            "<shape type=\"cylinder\"><transform name=\"to_world\"><scale {scale}/></transform></shape>"
        );
        read("3.0.0", &body).description.shapes[0].geometry.clone()
    };
    assert!(matches!(kind("x=\"1.2\""), ShapeGeometry::Mesh(_)));
    assert!(matches!(kind("z=\"1.2\""), ShapeGeometry::Cylinder { .. }));
}

fn material(version: &str, body: &str) -> MaterialKind {
    let body = format!("<shape type=\"cube\"><bsdf type={body}</bsdf></shape>");
    read(version, &body).description.materials[0].kind.clone()
}

#[test]
fn roughness_below_a_ten_thousandth_counts_as_that() {
    for alpha in ["0", "1e-9"] {
        let body = format!("\"roughconductor\"><float name=\"alpha\" value=\"{alpha}\"/>");
        let MaterialKind::RoughConductor { alpha_u, alpha_v, .. } = material("3.0.0", &body) else {
            panic!()
        };
        assert_eq!((alpha_u, alpha_v), (1e-4, 1e-4));
    }
}

#[test]
fn negative_indices_of_metals_count_as_positive() {
    let body = "\"conductor\"><rgb name=\"eta\" value=\"-0.05, 4, 0\"/><rgb name=\"k\" value=\"-0.03, 0.09, 0\"/>";
    let MaterialKind::Conductor { eta, k, .. } = material("3.0.0", body) else { panic!() };
    assert_eq!(eta.to_array(), [0.05, 4.0, 0.0]);
    assert_eq!(k.to_array(), [0.03, 0.09, 1.0]);
}

#[test]
fn metals_of_old_files_are_copper_unless_they_say_otherwise() {
    let eta_of = |version: &str, body: &str| match material(version, body) {
        MaterialKind::Conductor { eta, .. } | MaterialKind::RoughConductor { eta, .. } => eta,
        other => panic!("{other:?}"),
    };
    let copper = [0.201005, 0.92375, 1.10222];
    assert_eq!(eta_of("0.5.0", "\"conductor\">").to_array(), copper);
    assert_eq!(eta_of("3.0.0", "\"conductor\">").to_array(), [0.0; 3]);
    let outside = "\"roughconductor\"><string name=\"material\" value=\"Cu\"/><float name=\"extEta\" value=\"2\"/>";
    assert_eq!(eta_of("0.5.0", outside).to_array(), copper.map(|c| c / 2.0));
    let none = "\"conductor\"><string name=\"material\" value=\"none\"/>";
    assert_eq!(eta_of("0.5.0", none).to_array(), [0.0; 3]);
}

#[test]
fn roughness_of_old_distributions_is_that_of_beckmann() {
    let body = "\"roughconductor\"><string name=\"distribution\" value=\"as\"/><float name=\"alpha\" value=\"0.3\"/>";
    let MaterialKind::RoughConductor { distribution, alpha_u, .. } = material("0.6.0", body) else {
        panic!()
    };
    assert_eq!((distribution, alpha_u), (MicrofacetKind::Beckmann, 0.3));
}

fn radiance(version: &str, spectrum: &str) -> [f32; 3] {
    let body = format!("<shape type=\"cube\"><emitter type=\"area\">{spectrum}</emitter></shape>");
    read(version, &body).description.shapes[0].emission.unwrap().to_array()
}

fn reflectance(version: &str, spectrum: &str) -> [f32; 3] {
    match material(version, &format!("\"diffuse\">{spectrum}")) {
        MaterialKind::Diffuse { reflectance } => reflectance.to_array(),
        other => panic!("{other:?}"),
    }
}

fn assert_colour(found: [f32; 3], expected: [f32; 3], what: &str) {
    for c in 0..3 {
        assert!((found[c] - expected[c]).abs() < 2e-5, "{what}: {found:?} is not {expected:?}");
    }
}

/// The numbers are those that Mitsuba 3.9.1 (`scalar_rgb`) has after loading the same elements,
/// where it loads them.
#[test]
fn spectra_have_the_colours_of_mitsuba() {
    let hill = "value=\"400:0.1, 500:0.5, 600:0.9, 700:0.3\"";
    let typed = |kind: &str, body: &str| {
        format!("<spectrum name=\"NAME\" type=\"{kind}\">{body}</spectrum>")
    };
    let four = "<string name=\"values\" value=\"0.1,0.5,0.9,0.3\"/>";
    let table: &[(String, [f32; 3], [f32; 3])] = &[
        (
            "<spectrum name=\"NAME\" value=\"0.5\"/>".into(),
            [0.602397, 0.474146, 0.454458],
            [0.5, 0.5, 0.5],
        ),
        (
            format!("<spectrum name=\"NAME\" {hill}/>"),
            [0.999234, 0.6597, 0.229444],
            [0.854797, 0.68754, 0.265015],
        ),
        (
            "<spectrum name=\"NAME\" filename=\"hill.spd\"/>".into(),
            [0.999234, 0.6597, 0.229444],
            [0.854797, 0.68754, 0.265015],
        ),
        (typed("d65", "<float name=\"scale\" value=\"0.5\"/>"), [0.5; 3], [0.5; 3]),
        (
            typed("d65", "<rgb name=\"color\" value=\"0.1,0.2,0.9\"/>"),
            [0.1, 0.2, 0.9],
            [0.1, 0.2, 0.9],
        ),
        (typed("uniform", "<float name=\"value\" value=\"0.3\"/>"), [0.3; 3], [0.3; 3]),
        (
            typed("rgb", "<rgb name=\"value\" value=\"0.1,0.2,0.9\"/>"),
            [0.1, 0.2, 0.9],
            [0.1, 0.2, 0.9],
        ),
        (
            typed("srgb", "<rgb name=\"color\" value=\"0.1,0.2,0.9\"/>"),
            [0.1, 0.2, 0.9],
            [0.1, 0.2, 0.9],
        ),
        (
            typed(
                "regular",
                &format!(
                    "<float name=\"wavelength_min\" value=\"400\"/><float name=\"wavelength_max\" value=\"700\"/>{four}"
                ),
            ),
            [0.999234, 0.6597, 0.229444],
            [0.854797, 0.68754, 0.265015],
        ),
        (
            typed(
                "irregular",
                &format!("<string name=\"wavelengths\" value=\"400,500,600,700\"/>{four}"),
            ),
            [0.999234, 0.6597, 0.229444],
            [0.854797, 0.68754, 0.265015],
        ),
        ("<float name=\"NAME\" value=\"0.5\"/>".into(), [0.5; 3], [0.5; 3]),
    ];
    for (xml, light, factor) in table {
        assert_colour(radiance("3.0.0", &xml.replace("NAME", "radiance")), *light, xml);
        assert_colour(reflectance("3.0.0", &xml.replace("NAME", "reflectance")), *factor, xml);
    }
}

#[test]
fn spectra_of_old_files_mean_what_they_meant() {
    assert_eq!(radiance("0.5.0", "<spectrum name=\"radiance\" value=\"1\"/>"), [1.0; 3]);
    let three = "<spectrum name=\"reflectance\" value=\"0.1, 0.4, 0.9\"/>";
    assert_eq!(reflectance("0.5.0", three), [0.1, 0.4, 0.9]);
    // The same list without an illuminant.
    let list = "<spectrum name=\"reflectance\" value=\"400:0.1, 500:0.5, 600:0.9, 700:0.3\"/>";
    assert_colour(reflectance("0.6.0", list), [0.999234, 0.6597, 0.229444], list);
    let new = radiance(
        "3.0.0",
        "<spectrum name=\"radiance\" type=\"blackbody\"><float name=\"temperature\" value=\"5000\"/></spectrum>",
    );
    let old = radiance("0.6.0", "<blackbody name=\"radiance\" temperature=\"5000K\"/>");
    assert_eq!(old, new);
    assert!(new[0] > new[1] && new[1] > new[2]);
}

#[test]
fn text_in_other_encodings_is_read() {
    let text = "<?xml version=\"1.0\"?>\n<scene version=\"3.0.0\"><!-- caf\u{e9} -- --><shape type=\"cube\" id=\"caf\u{e9}\"/></scene>";
    let wide: Vec<u8> =
        std::iter::once(0xfeff_u16).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let latin: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
    for bytes in [text.as_bytes().to_vec(), wide, latin] {
        let files = Memory::new().with("t.xml", bytes);
        let loaded = load_with(&files, Path::new("t.xml"), &LoadOptions::default()).unwrap();
        assert_eq!(loaded.description.shapes[0].name, "caf\u{e9}");
    }
}

/// Time and memory stay within bounds; what is asserted is that reading ends, and how.
#[test]
fn large_and_hostile_files_are_read_or_refused() {
    let attributes: String = (0..200_000).map(|i| format!(" a{i}=\"\"")).collect();
    let text = format!("<scene version=\"3.0.0\"><shape type=\"cube\"{attributes}/></scene>");
    let error = load_str(&text, "t.xml", &Memory::new(), &[]).unwrap_err().to_string();
    assert!(error.starts_with("t.xml:1: unknown attribute \"a0\" in <shape>"), "{error}");

    let floats: String =
        (0..100_000).map(|i| format!("<float name=\"f{i}\" value=\"1\"/>")).collect();
    let loaded = read("3.0.0", &floats);
    assert_eq!(loaded.notes.len(), 1000);

    let leaf = b"<scene version=\"3.0.0\"/>".as_slice();
    let fan = |below: &str| {
        let includes = format!("<include filename=\"{below}\"/>").repeat(10);
        format!("<scene version=\"3.0.0\">{includes}</scene>").into_bytes()
    };
    let mut files = Memory::new().with("l0", leaf);
    for level in 1..8 {
        files.insert(format!("l{level}"), fan(&format!("l{}", level - 1)));
    }
    let error = load_with(&files, Path::new("l7"), &LoadOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "l1:1: <include> of \"l0\": more than 10000 included files");
}
