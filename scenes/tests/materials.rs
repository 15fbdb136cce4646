//! Materials of every type: defaults, nesting, textures in place of numbers, what Mitsuba 0.x
//! meant. The expected numbers are those of Mitsuba 3.9.1.

use pathspace_core::Rgb;
use pathspace_core::Scene;
use pathspace_core::description::{MaterialKind, Parameter, ReliefMap};
use pathspace_scenes::source::Memory;
use pathspace_scenes::{LoadedScene, load_str};

fn read(version: &str, body: &str) -> LoadedScene {
    let text = format!(
        "<scene version=\"{version}\"><shape type=\"sphere\"><bsdf {body}</bsdf></shape></scene>"
    );
    load_str(&text, "t.xml", &Memory::new(), &[]).unwrap_or_else(|e| panic!("{e}\n{body}"))
}

fn kind(version: &str, body: &str) -> MaterialKind {
    let loaded = read(version, body);
    // What is read can be built.
    Scene::new(&loaded.description).unwrap_or_else(|e| panic!("{e}\n{body}"));
    loaded.description.materials[0].kind.clone()
}

const CHECKS: &str = "<texture type=\"checkerboard\" name=\"NAME\"><float name=\"color0\" value=\"0.2\"/>\
                      <float name=\"color1\" value=\"0.6\"/></texture>";

fn checks(name: &str) -> String {
    CHECKS.replace("NAME", name)
}

#[test]
fn defaults_are_those_of_mitsuba() {
    let MaterialKind::RoughPlastic { alpha, int_ior, nonlinear, diffuse_reflectance, .. } =
        kind("3.0.0", "type=\"roughplastic\">")
    else {
        panic!()
    };
    assert_eq!((alpha, int_ior, nonlinear), (0.1, 1.49, false));
    assert_eq!(diffuse_reflectance, Rgb::grey(0.5));
    let MaterialKind::RoughDielectric { alpha_u, alpha_v, int_ior, .. } =
        kind("3.0.0", "type=\"roughdielectric\">")
    else {
        panic!()
    };
    assert_eq!((alpha_u, alpha_v, int_ior), (0.1, 0.1, 1.5046));
    let MaterialKind::Principled(principled) = kind("3.0.0", "type=\"principled\">") else {
        panic!()
    };
    assert_eq!((principled.roughness, principled.metallic), (0.5, 0.0));
    // 2/(1 − √0.04) − 1.
    assert!((principled.eta - 1.5).abs() < 1e-6);
    let MaterialKind::PrincipledThin(thin) = kind("3.0.0", "type=\"principledthin\">") else {
        panic!()
    };
    assert_eq!((thin.eta, thin.diff_trans), (1.5, 0.0));
    let MaterialKind::Mask { opacity, .. } =
        kind("3.0.0", "type=\"mask\"><bsdf type=\"diffuse\"/>")
    else {
        panic!()
    };
    assert_eq!(opacity, 0.5);
}

#[test]
fn glass_whose_index_is_one_bends_a_little() {
    for (given, eta) in [("specular\" value=\"0\"", 1.018), ("eta\" value=\"1\"", 1.001)] {
        let body = format!(
            "type=\"principled\"><float name=\"spec_trans\" value=\"0.5\"/><float name=\"{given}/>"
        );
        let MaterialKind::Principled(principled) = kind("3.0.0", &body) else { panic!() };
        assert!((principled.eta - eta).abs() < 2e-4, "{}", principled.eta);
    }
}

#[test]
fn models_nest_and_every_level_keeps_its_texture() {
    let body = format!(
        "type=\"mask\">{}<bsdf type=\"blendbsdf\">{}<bsdf type=\"twosided\">\
         <bsdf type=\"bumpmap\"><texture type=\"checkerboard\"/><float name=\"scale\" value=\"2\"/>\
         <bsdf type=\"principled\">{}</bsdf></bsdf></bsdf><bsdf type=\"dielectric\"/></bsdf>",
        checks("opacity"),
        checks("weight"),
        checks("roughness"),
    );
    let MaterialKind::Textured { model, textures } = kind("3.0.0", &body) else { panic!() };
    assert_eq!(textures[0].0, Parameter::Weight);
    let MaterialKind::Mask { opacity, model } = *model else { panic!() };
    assert!((opacity - 0.4).abs() < 1e-6);
    let MaterialKind::Textured { model, .. } = *model else { panic!() };
    let MaterialKind::Mixture { models } = *model else { panic!() };
    assert!((models[1].0 - 0.4).abs() < 1e-6 && (models[0].0 - 0.6).abs() < 1e-6);
    let MaterialKind::TwoSided { front, back } = &models[0].1 else { panic!() };
    assert_eq!(front, back);
    let MaterialKind::Relief { map: ReliefMap::Heights { scale, .. }, model, .. } = &**front else {
        panic!()
    };
    assert_eq!(*scale, 2.0);
    let MaterialKind::Textured { textures, .. } = &**model else { panic!() };
    assert_eq!(textures[0].0, Parameter::Roughness);
}

#[test]
fn roughness_of_metals_and_glass_may_be_a_texture() {
    let body = format!(
        "type=\"roughconductor\">{}<float name=\"alpha_v\" value=\"0.3\"/>",
        checks("alpha_u")
    );
    let MaterialKind::Textured { model, textures } = kind("3.0.0", &body) else { panic!() };
    assert_eq!(textures[0].0, Parameter::AlphaU);
    let MaterialKind::RoughConductor { alpha_u, alpha_v, .. } = *model else { panic!() };
    assert!((alpha_u - 0.4).abs() < 1e-6 && alpha_v == 0.3);
    // A coat of plastic has one.
    let body = format!("type=\"roughplastic\">{}", checks("alpha"));
    let loaded = read("3.0.0", &body);
    assert!(loaded.notes.iter().any(|n| n.to_string().contains("the mean")));
}

#[test]
fn models_of_old_files_are_what_they_were() {
    let mixture = "type=\"mixturebsdf\"><string name=\"weights\" value=\"0.6, 0.9\"/>\
                   <bsdf type=\"diffuse\"/><bsdf type=\"phong\"/>";
    let MaterialKind::Mixture { models } = kind("0.6.0", mixture) else { panic!() };
    assert!((models[0].0 - 0.4).abs() < 1e-6 && (models[1].0 - 0.6).abs() < 1e-6);
    let MaterialKind::Phong { exponent, .. } = models[1].1 else { panic!() };
    assert_eq!(exponent, 30.0);
    let coat = "type=\"coating\"><float name=\"intIOR\" value=\"1.7\"/><bsdf type=\"diffuse\">\
                <rgb name=\"reflectance\" value=\"0.1, 0.2, 0.3\"/></bsdf>";
    let MaterialKind::Plastic { int_ior, diffuse_reflectance, .. } = kind("0.6.0", coat) else {
        panic!()
    };
    assert_eq!((int_ior, diffuse_reflectance), (1.7, Rgb::new(0.1, 0.2, 0.3)));
    let over_metal = "type=\"roughcoating\"><bsdf type=\"roughconductor\"/>";
    assert!(matches!(kind("0.6.0", over_metal), MaterialKind::RoughConductor { .. }));
    for body in [
        "type=\"ward\"><string name=\"variant\" value=\"ward-duer\"/>",
        "type=\"roughdiffuse\"><float name=\"alpha\" value=\"0.3\"/>",
        "type=\"difftrans\">",
        "type=\"thindielectric\">",
    ] {
        kind("0.6.0", body);
    }
    let relief = "type=\"bumpmap\"><texture type=\"checkerboard\"/><bsdf type=\"diffuse\"/>";
    let guards = |version| match kind(version, relief) {
        MaterialKind::Relief { flip_invalid_normals, use_shadowing, .. } => {
            [flip_invalid_normals, use_shadowing]
        }
        other => panic!("{other:?}"),
    };
    assert_eq!((guards("0.6.0"), guards("3.0.0")), ([false; 2], [true; 2]));
}
