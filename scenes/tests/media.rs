//! Participating media as files give them.

use pathspace_core::Rgb;
use pathspace_core::description::{
    BoundaryDescription, MaterialKind, MediumKind, PhaseKind, SceneDescription,
};
use pathspace_scenes::load_str;
use pathspace_scenes::source::Memory;

fn read_as(version: &str, body: &str) -> Result<SceneDescription, String> {
    let text = format!("<scene version=\"{version}\">{body}</scene>");
    match load_str(&text, "t.xml", &Memory::new(), &[]) {
        Ok(loaded) => Ok(loaded.description),
        Err(e) => Err(e.to_string()),
    }
}

fn read(body: &str) -> SceneDescription {
    read_as("3.0.0", body).unwrap_or_else(|e| panic!("{e}\n{body}"))
}

/// A sphere filled with this medium.
fn filled(medium: &str) -> String {
    format!("<shape type=\"sphere\"><medium name=\"interior\" {medium}</medium></shape>")
}

fn medium(text: &str) -> ([f64; 3], Rgb, PhaseKind) {
    let description = read(&filled(text));
    let medium = &description.media.media[0];
    match medium.kind {
        MediumKind::Homogeneous { extinction, albedo } => {
            (extinction, albedo, medium.phase.clone())
        }
        ref other => panic!("{other:?}"),
    }
}

#[test]
fn defaults_are_those_of_mitsuba() {
    let isotropic = ([1.0; 3], Rgb::grey(0.75), PhaseKind::Isotropic);
    assert_eq!(medium("type=\"homogeneous\">"), isotropic);
    let hg = medium("type=\"homogeneous\"><phase type=\"hg\"/>").2;
    assert_eq!(hg, PhaseKind::HenyeyGreenstein { g: 0.8 });
}

#[test]
fn extinction_is_scaled_and_may_be_a_constant_volume() {
    let (extinction, albedo, _) = medium(
        "type=\"homogeneous\"><float name=\"scale\" value=\"10\"/>\
         <volume name=\"sigma_t\" type=\"constvolume\">\
         <rgb name=\"value\" value=\"0.5, 0.25, 2\"/></volume>\
         <rgb name=\"albedo\" value=\"0.5, 1, 0\"/>",
    );
    assert_eq!(extinction, [5.0, 2.5, 20.0]);
    assert_eq!(albedo, Rgb::new(0.5, 1.0, 0.0));
}

#[test]
fn absorption_and_scattering_apart_make_extinction_and_albedo() {
    let (extinction, albedo, _) = medium(
        "type=\"homogeneous\"><rgb name=\"sigma_a\" value=\"1, 0, 0\"/>\
         <rgb name=\"sigma_s\" value=\"3, 2, 0\"/>",
    );
    assert_eq!(extinction, [4.0, 2.0, 0.0]);
    assert_eq!(albedo, Rgb::new(0.75, 1.0, 0.0));
}

#[test]
fn phase_functions_blend() {
    let phase = medium(
        "type=\"homogeneous\"><phase type=\"blendphase\"><float name=\"weight\" value=\"0.2\"/>\
         <phase type=\"rayleigh\"/><phase type=\"hg\"><float name=\"g\" value=\"-0.3\"/></phase></phase>",
    )
    .2;
    let pair = [PhaseKind::Rayleigh, PhaseKind::HenyeyGreenstein { g: -0.3 }];
    assert_eq!(phase, PhaseKind::Blend { weight: 0.2, pair: Box::new(pair) });
}

#[test]
fn shapes_and_the_sensor_refer_to_one_medium() {
    let fog = "<medium type=\"homogeneous\" id=\"fog\"/>";
    let description = read(&format!(
        "{fog}<sensor type=\"perspective\"><ref id=\"fog\"/></sensor>\
         <shape type=\"sphere\"/>\
         <shape type=\"cube\"><ref name=\"exterior\" id=\"fog\"/></shape>"
    ));
    let media = &description.media;
    assert_eq!((media.media.len(), media.sensor), (1, Some(0)));
    let boundary = BoundaryDescription { shape: 1, interior: None, exterior: Some(0) };
    assert_eq!(media.boundaries, [boundary]);
    assert_eq!(media.media[0].name, "fog");
}

#[test]
fn a_boundary_without_bsdf_is_index_matched_in_old_files_alone() {
    let body = filled("type=\"homogeneous\">");
    let old = read_as("0.6.0", &body).expect("a scene");
    assert_eq!(old.materials[0].kind, MaterialKind::Null);
    assert!(matches!(read(&body).materials[0].kind, MaterialKind::Diffuse { .. }));
}

#[test]
fn what_is_not_understood_is_named() {
    for (text, expected) in [
        (
            filled("type=\"heterogeneous\">"),
            "t.xml:1: medium type \"heterogeneous\" is not understood (there are no grids)",
        ),
        (
            filled("type=\"homogeneous\"><phase type=\"sggx\"/>"),
            "t.xml:1: phase type \"sggx\" is not understood (there are no microflakes)",
        ),
        (
            filled("type=\"homogeneous\"><string name=\"material\" value=\"Skin1\"/>"),
            "t.xml:1: medium \"homogeneous\": property \"material\": media by name are not known",
        ),
        (
            filled(
                "type=\"homogeneous\"><float name=\"sigma_a\" value=\"1\"/>\
                 <float name=\"albedo\" value=\"1\"/>",
            ),
            "t.xml:1: medium \"homogeneous\": has sigma_a or sigma_s beside sigma_t or albedo",
        ),
        (
            filled(
                "type=\"homogeneous\"><phase type=\"hg\"><float name=\"g\" value=\"1\"/></phase>",
            ),
            "t.xml:1: phase \"hg\": property \"g\"",
        ),
    ] {
        let found = read_as("3.0.0", &text).expect_err("an error");
        assert!(found.starts_with(expected), "expected {expected}\nfound    {found}");
    }
}
