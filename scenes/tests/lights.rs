//! Spot lights, projectors, sun and sky, meters and parallel cameras.

use pathspace_core::Scene;
use pathspace_core::description::EmitterDescription;
use pathspace_scenes::source::Memory;
use pathspace_scenes::{LoadedScene, load_str};

fn read(version: &str, body: &str) -> Result<LoadedScene, String> {
    let text = format!("<scene version=\"{version}\"><shape type=\"sphere\"/>{body}</scene>");
    let loaded = load_str(&text, "t.xml", &Memory::new(), &[]).map_err(|e| e.to_string())?;
    // What is read can be built.
    Scene::new(&loaded.description).map_err(|e| e.to_string())?;
    Ok(loaded)
}

fn emitters(version: &str, body: &str) -> Vec<EmitterDescription> {
    read(version, body).unwrap_or_else(|e| panic!("{e}\n{body}")).description.emitters
}

#[test]
fn a_spot_light_has_the_cone_of_mitsuba() {
    let found = emitters("3.0.0", "<emitter type=\"spot\"/>");
    let [EmitterDescription::Spot { shape, .. }] = &found[..] else { panic!("{found:?}") };
    assert_eq!((shape.cutoff_degrees, shape.beam_degrees), (20.0, 15.0));
    let old = "<emitter type=\"spot\"><float name=\"cutoffAngle\" value=\"40\"/>\
               <float name=\"beamWidth\" value=\"10\"/></emitter>";
    let found = emitters("0.6.0", old);
    let [EmitterDescription::Spot { shape, .. }] = &found[..] else { panic!("{found:?}") };
    assert_eq!((shape.cutoff_degrees, shape.beam_degrees), (40.0, 10.0));
    let wide = "<emitter type=\"spot\"><float name=\"cutoff_angle\" value=\"90\"/></emitter>";
    assert_eq!(
        read("3.0.0", wide).err().as_deref(),
        Some(
            "t.xml:1: emitter \"spot\": property \"cutoff_angle\": \"90\" is not an angle between 0 and 90 degrees"
        )
    );
}

#[test]
fn a_projector_spans_its_angle_of_view() {
    let body = "<emitter type=\"projector\"><float name=\"fov\" value=\"40\"/>\
                <float name=\"scale\" value=\"3\"/></emitter>";
    let found = emitters("3.0.0", body);
    let [EmitterDescription::Projector { shape, .. }] = &found[..] else { panic!("{found:?}") };
    assert_eq!((shape.fov_x_degrees, shape.scale, shape.aspect), (40.0, 3.0, 1.0));
}

#[test]
fn sun_and_sky_are_two_emitters() {
    let found = emitters("3.0.0", "<emitter type=\"sunsky\"/>");
    let [EmitterDescription::Environment { .. }, EmitterDescription::Directional { direction, .. }] =
        &found[..]
    else {
        panic!("{found:?}")
    };
    // Tokyo, 10 July 2010, 15:00: the sun stands in the west, 46° high (Mitsuba 3.9.1).
    assert!((direction.z + 0.7203).abs() < 0.02, "{direction}");
    let only = |scale: &str| {
        let body =
            format!("<emitter type=\"sunsky\"><float name=\"{scale}\" value=\"0\"/></emitter>");
        emitters("3.0.0", &body).len()
    };
    assert_eq!((only("sun_scale"), only("sky_scale")), (1, 1));
    assert_eq!(emitters("0.6.0", "<emitter type=\"sky\"/><emitter type=\"sun\"/>").len(), 2);
}

#[test]
fn a_meter_gives_way_to_a_camera() {
    let camera = "<sensor type=\"perspective\"><float name=\"fov\" value=\"33\"/>\
                  <float name=\"fov_axis_is_x\" value=\"0\"/></sensor>";
    let body = format!("<sensor type=\"radiancemeter\"/>{camera}");
    let loaded = read("3.0.0", &body).unwrap();
    assert!((loaded.description.sensor.fov_x_degrees - 33.0).abs() < 1e-9);
    let alone = read("3.0.0", "<sensor type=\"distant\"/>").err().unwrap_or_default();
    assert!(alone.contains("makes no image, and the file has no other sensor"), "{alone}");
}

#[test]
fn a_parallel_camera_spans_its_square() {
    let body = "<sensor type=\"orthographic\"><transform name=\"to_world\"><scale x=\"3\" y=\"3\"/>\
                </transform></sensor>";
    let sensor = read("3.0.0", body).unwrap().description.sensor;
    let half =
        sensor.to_world.translation.length() * (0.5 * sensor.fov_x_degrees.to_radians()).tan();
    assert!((half - 3.0).abs() < 1e-9, "{half}");
}
