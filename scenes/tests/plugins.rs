//! What each plug-in and its defaults become. The expected numbers are those of Mitsuba 3.9.1.

use glam::DVec3;
use pathspace_core::Rgb;
use pathspace_core::description::{
    EmitterDescription, FilterKind, MaterialKind, MicrofacetKind, ShapeGeometry,
};
use pathspace_scenes::source::Memory;
use pathspace_scenes::{LoadedScene, load_str};

fn read(version: &str, body: &str) -> LoadedScene {
    let text = format!("<scene version=\"{version}\">{body}</scene>");
    load_str(&text, "t.xml", &Memory::new(), &[]).unwrap_or_else(|e| panic!("{e}\n{body}"))
}

fn new(body: &str) -> LoadedScene {
    read("3.0.0", body)
}

fn material(body: &str) -> MaterialKind {
    new(&format!("<bsdf {body}</bsdf>")).description.materials[0].kind.clone()
}

fn close(a: Rgb, b: [f32; 3]) -> bool {
    a.to_array().iter().zip(b).all(|(x, y)| (x - y).abs() <= 1e-5 * y.abs())
}

#[test]
fn colours_are_given_in_many_ways() {
    for value in [
        "<rgb name=\"reflectance\" value=\"0.5\"/>",
        "<rgb name=\"reflectance\" value=\"0.5, 0.5, 0.5\"/>",
        "<rgb name=\"reflectance\" value=\"0.5 0.5 0.5\"/>",
        "<float name=\"reflectance\" value=\"0.5\"/>",
        "<spectrum name=\"reflectance\" value=\"0.5\"/>",
        "<srgb name=\"reflectance\" value=\"0.735356983052449\"/>",
        "",
    ] {
        let MaterialKind::Diffuse { reflectance } = material(&format!("type=\"diffuse\">{value}"))
        else {
            panic!("{value}")
        };
        assert!(close(reflectance, [0.5; 3]), "{value}: {reflectance:?}");
    }
}

#[test]
fn a_constant_spectrum_of_light_is_not_white() {
    let light = |value: &str| match new(&format!("<emitter type=\"constant\">{value}</emitter>"))
        .description
        .emitters[0]
    {
        EmitterDescription::Constant { radiance } => radiance,
        ref other => panic!("{other:?}"),
    };
    let spectrum = light("<spectrum name=\"radiance\" value=\"2\"/>");
    assert!(close(spectrum, [2.40959, 1.89658, 1.81783]), "{spectrum:?}");
    assert_eq!(light("<float name=\"radiance\" value=\"1.5\"/>"), Rgb::grey(1.5));
    assert_eq!(light(""), Rgb::WHITE);
}

#[test]
fn dielectrics_know_materials_by_name() {
    let indices = |body: &str| match material(&format!("type=\"dielectric\">{body}")) {
        MaterialKind::Dielectric { int_ior, ext_ior, .. } => (int_ior, ext_ior),
        other => panic!("{other:?}"),
    };
    assert_eq!(indices(""), (1.5046, 1.000277));
    let named = "<string name=\"int_ior\" value=\"Diamond\"/><float name=\"ext_ior\" value=\"1\"/>";
    assert_eq!(indices(named), (2.419, 1.0));
}

#[test]
fn conductors_have_named_materials_and_a_mirror_as_default() {
    let metal = |body: &str| match material(&format!("type=\"conductor\">{body}")) {
        MaterialKind::Conductor { eta, k, .. } => (eta.to_array(), k.to_array()),
        other => panic!("{other:?}"),
    };
    assert_eq!(metal(""), ([0.0; 3], [1.0; 3]));
    let gold = metal("<string name=\"material\" value=\"Au\"/>");
    assert_eq!(gold, ([0.143036, 0.375307, 1.44205], [3.983, 2.38556, 1.60336]));
    assert_eq!(metal("<float name=\"k\" value=\"2\"/>"), ([0.0; 3], [2.0; 3]));
}

#[test]
fn rough_conductors_are_beckmann_with_alpha_0_1_by_default() {
    let rough = |body: &str| match material(&format!("type=\"roughconductor\">{body}")) {
        MaterialKind::RoughConductor { distribution, alpha_u, alpha_v, sample_visible, .. } => {
            (distribution, alpha_u, alpha_v, sample_visible)
        }
        other => panic!("{other:?}"),
    };
    assert_eq!(rough(""), (MicrofacetKind::Beckmann, 0.1, 0.1, true));
    let body = "<string name=\"distribution\" value=\"GGX\"/><float name=\"alpha_u\" value=\"0.2\"/>\
                <float name=\"alpha_v\" value=\"0.3\"/><boolean name=\"sample_visible\" value=\"False\"/>";
    assert_eq!(rough(body), (MicrofacetKind::Ggx, 0.2, 0.3, false));
}

#[test]
fn twosided_takes_one_or_two_models() {
    let sides = |body: &str| match material(&format!("type=\"twosided\">{body}")) {
        MaterialKind::TwoSided { front, back } => (*front, *back),
        other => panic!("{other:?}"),
    };
    let (front, back) = sides("<bsdf type=\"diffuse\"/>");
    assert_eq!(front, back);
    let (front, back) = sides("<bsdf type=\"conductor\"/><bsdf type=\"diffuse\"/>");
    assert!(matches!(front, MaterialKind::Conductor { .. }));
    assert!(matches!(back, MaterialKind::Diffuse { .. }));
}

#[test]
fn shapes_without_bsdf_are_grey_or_black_under_an_emitter() {
    let scene =
        new("<shape type=\"sphere\"/><shape type=\"cube\"><emitter type=\"area\"/></shape>\
                     <shape type=\"disk\"/>")
        .description;
    let kind = |i: usize| scene.materials[scene.shapes[i].material].kind.clone();
    assert_eq!(kind(0), MaterialKind::Diffuse { reflectance: Rgb::grey(0.5) });
    assert_eq!(kind(1), MaterialKind::Diffuse { reflectance: Rgb::BLACK });
    assert_eq!(scene.shapes[0].material, scene.shapes[2].material);
    assert_eq!(scene.shapes[1].emission, Some(Rgb::WHITE));
}

#[test]
fn emitters_take_a_place_or_a_transform() {
    let scene = new("<emitter type=\"point\"><point name=\"position\" value=\"1 2 3\"/>\
                     <rgb name=\"intensity\" value=\"4\"/></emitter>\
                     <emitter type=\"point\"><transform name=\"to_world\"><translate y=\"5\"/></transform></emitter>\
                     <emitter type=\"directional\"><vector name=\"direction\" value=\"0 -2 0\"/></emitter>\
                     <emitter type=\"directional\"><transform name=\"to_world\"><rotate y=\"1\" angle=\"90\"/></transform></emitter>")
    .description;
    let EmitterDescription::Point { position, intensity } = scene.emitters[0] else { panic!() };
    assert_eq!((position, intensity), (DVec3::new(1.0, 2.0, 3.0), Rgb::grey(4.0)));
    let EmitterDescription::Point { position, .. } = scene.emitters[1] else { panic!() };
    assert_eq!(position, DVec3::new(0.0, 5.0, 0.0));
    let EmitterDescription::Directional { direction, .. } = scene.emitters[2] else { panic!() };
    assert_eq!(direction, DVec3::NEG_Y);
    let EmitterDescription::Directional { direction, .. } = scene.emitters[3] else { panic!() };
    assert!((direction - DVec3::X).length() < 1e-12);
}

#[test]
fn spheres_keep_centre_and_radius() {
    let scene = new("<shape type=\"sphere\"><point name=\"center\" x=\"1\" y=\"2\" z=\"3\"/>\
                     <float name=\"radius\" value=\"0.5\"/></shape>")
    .description;
    let ShapeGeometry::Sphere { center, radius } = scene.shapes[0].geometry else { panic!() };
    assert_eq!((center, radius), (DVec3::new(1.0, 2.0, 3.0), 0.5));
}

#[test]
fn cylinders_keep_ends_and_radius() {
    let scene = new("<shape type=\"cylinder\"><point name=\"p0\" x=\"1\" y=\"2\" z=\"3\"/>\
                     <point name=\"p1\" x=\"1\" y=\"2\" z=\"5\"/><float name=\"radius\" value=\"0.5\"/>\
                     </shape><shape type=\"cylinder\"><transform name=\"to_world\"><scale z=\"3\"/></transform></shape>")
    .description;
    let ShapeGeometry::Cylinder { p0, p1, radius } = scene.shapes[0].geometry else { panic!() };
    assert_eq!((p0, p1, radius), (DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.0, 2.0, 5.0), 0.5));
    let ShapeGeometry::Cylinder { p0, p1, radius } = scene.shapes[1].geometry else { panic!() };
    assert_eq!((p0, p1, radius), (DVec3::ZERO, DVec3::Z, 1.0));
}

#[test]
fn a_mirrored_sphere_is_inside_out_and_other_shapes_are_not() {
    let flipped = |kind: &str, flip: bool| {
        let body = format!(
            "<shape type=\"{kind}\"><boolean name=\"flip_normals\" value=\"{flip}\"/>\
             <transform name=\"to_world\"><scale x=\"-1\"/></transform></shape>"
        );
        new(&body).description.shapes[0].flip_normals
    };
    assert!(flipped("sphere", false) && !flipped("sphere", true));
    for kind in ["rectangle", "cube", "disk", "cylinder"] {
        assert!(!flipped(kind, false) && flipped(kind, true), "{kind}");
    }
}

/// Horizontal angle of view for a sensor with this body and film size.
fn fov_x(body: &str, width: u32, height: u32) -> f64 {
    let film = format!(
        "<film type=\"hdrfilm\"><integer name=\"width\" value=\"{width}\"/>\
         <integer name=\"height\" value=\"{height}\"/><integer name=\"crop_width\" value=\"50\"/></film>"
    );
    let text = format!("<sensor type=\"perspective\">{body}{film}</sensor>");
    new(&text).description.sensor.fov_x_degrees
}

#[test]
fn every_fov_axis_gives_the_horizontal_angle() {
    for (axis, wide, tall) in [
        ("x", 40.0, 40.0),
        ("y", 72.1048, 20.6282),
        ("diagonal", 36.0648, 18.4902),
        ("smaller", 72.1048, 40.0),
        ("larger", 40.0, 20.6282),
    ] {
        let body = format!(
            "<float name=\"fov\" value=\"40\"/><string name=\"fov_axis\" value=\"{axis}\"/>"
        );
        assert!((fov_x(&body, 200, 100) - wide).abs() < 1e-4, "{axis}");
        assert!((fov_x(&body, 100, 200) - tall).abs() < 1e-4, "{axis}");
    }
}

#[test]
fn focal_lengths_are_those_of_36_mm_film() {
    let focal = |mm: &str| format!("<string name=\"focal_length\" value=\"{mm}\"/>");
    assert!((fov_x("", 768, 576) - 38.1848).abs() < 1e-4);
    assert!((fov_x(&focal("50mm"), 200, 100) - 42.3117).abs() < 1e-4);
    assert!((fov_x(&focal("35"), 200, 100) - 57.8712).abs() < 1e-4);
}

#[test]
fn film_and_filter_have_mitsubas_defaults() {
    let loaded = new("<sensor type=\"perspective\"/>");
    let film = loaded.description.film;
    assert_eq!((film.width, film.height), (768, 576));
    assert_eq!(film.filter, FilterKind::Gaussian { stddev: 0.5 });
    let filter = |body: &str| {
        let text = format!(
            "<sensor type=\"perspective\"><film type=\"hdrfilm\"><rfilter type={body}</rfilter></film></sensor>"
        );
        new(&text).description.film.filter
    };
    assert_eq!(filter("\"box\">"), FilterKind::Box);
    assert_eq!(filter("\"tent\">"), FilterKind::Tent { radius: 1.0 });
    let wide = "\"gaussian\"><float name=\"stddev\" value=\"2\"/>";
    assert_eq!(filter(wide), FilterKind::Gaussian { stddev: 2.0 });
}

#[test]
fn the_crop_window_is_kept() {
    let film = new("<sensor type=\"perspective\"><film type=\"hdrfilm\">\
                    <integer name=\"width\" value=\"64\"/><integer name=\"height\" value=\"32\"/>\
                    <integer name=\"crop_offset_x\" value=\"8\"/><integer name=\"crop_offset_y\" value=\"4\"/>\
                    <integer name=\"crop_width\" value=\"16\"/><integer name=\"crop_height\" value=\"28\"/>\
                    </film></sensor>")
    .description
    .film;
    let crop = film.crop;
    assert_eq!((crop.x, crop.y, crop.width, crop.height), (8, 4, 16, 28));
}

#[test]
fn a_thin_lens_focuses_on_the_far_plane_by_default() {
    let lens = |body: &str| {
        let radius = "<float name=\"aperture_radius\" value=\"0.25\"/>";
        let sensor = new(&format!("<sensor type=\"thinlens\">{radius}{body}</sensor>"));
        (sensor.description.sensor.aperture_radius, sensor.description.sensor.focus_distance)
    };
    assert_eq!(lens(""), (0.25, 10_000.0));
    assert_eq!(lens("<float name=\"focus_distance\" value=\"3\"/>"), (0.25, 3.0));
}

#[test]
fn integrators_become_pt_and_lt() {
    let defaults = |body: &str| {
        let d = new(&format!("<integrator {body}</integrator>")).defaults;
        (d.integrator.unwrap(), d.max_depth, d.rr_depth)
    };
    let depth = "<integer name=\"max_depth\" value=\"7\"/><integer name=\"rr_depth\" value=\"9\"/>";
    assert_eq!(defaults("type=\"path\">"), ("pt".into(), None, 5));
    assert_eq!(defaults(&format!("type=\"path\">{depth}")), ("pt".into(), Some(7), 9));
    assert_eq!(defaults(&format!("type=\"volpath\">{depth}")), ("pt".into(), Some(7), 9));
    assert_eq!(defaults(&format!("type=\"ptracer\">{depth}")), ("lt".into(), Some(7), 9));
    assert_eq!(defaults("type=\"direct\">"), ("pt".into(), Some(2), 5));
    let unlimited = "type=\"path\"><integer name=\"max_depth\" value=\"-1\"/>";
    assert_eq!(defaults(unlimited), ("pt".into(), None, 5));
}

#[test]
fn technical_properties_are_noted_once() {
    let film = "<film type=\"hdrfilm\"><boolean name=\"banner\" value=\"false\"/>\
                <string name=\"pixel_format\" value=\"rgb\"/></film>";
    let loaded = new(&format!(
        "<sensor type=\"perspective\">{film}</sensor>\n\
                               <sensor type=\"perspective\">{film}</sensor>"
    ));
    let about = |name: &str| loaded.notes.iter().filter(|n| n.text.contains(name)).count();
    assert_eq!((about("banner"), about("pixel_format"), about("2 sensors")), (1, 1, 1));
}

#[test]
fn old_files_are_upgraded() {
    let scene = read(
        "0.6.0",
        "<integrator type=\"path\"><integer name=\"maxDepth\" value=\"4\"/></integrator>\
         <sensor type=\"perspective\"><string name=\"fovAxis\" value=\"x\"/>\
         <float name=\"fov\" value=\"30\"/><transform name=\"toWorld\">\
         <lookAt origin=\"0,0,1\" target=\"0,0,0\" up=\"0,1,0\"/></transform>\
         <film type=\"ldrfilm\"><integer name=\"cropOffsetX\" value=\"0\"/></film></sensor>\
         <bsdf type=\"diffuse\"><rgb name=\"diffuseReflectance\" value=\"0.25\"/></bsdf>\
         <bsdf type=\"dielectric\"><float name=\"intIOR\" value=\"1.3\"/></bsdf>\
         <bsdf type=\"conductor\"><rgb name=\"eta\" value=\"3\"/><rgb name=\"k\" value=\"6\"/>\
         <float name=\"extEta\" value=\"1.5\"/></bsdf>",
    );
    assert_eq!(scene.defaults.max_depth, Some(4));
    let materials = &scene.description.materials;
    assert_eq!(materials[0].kind, MaterialKind::Diffuse { reflectance: Rgb::grey(0.25) });
    assert!(matches!(materials[1].kind, MaterialKind::Dielectric { int_ior: 1.3, .. }));
    let MaterialKind::Conductor { eta, k, .. } = materials[2].kind else { panic!() };
    assert_eq!((eta, k), (Rgb::grey(2.0), Rgb::grey(4.0)));
}
