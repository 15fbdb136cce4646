//! Spectra and what the tolerant reader still refuses.

use super::{bsdf, check, scene, shape};

#[test]
fn broken_spectra() {
    let reflectance =
        |spectrum: &str, expected| (bsdf(&format!("diffuse\">{spectrum}")), vec![], expected);
    check(&[
        reflectance(
            "<spectrum name=\"reflectance\" value=\"\"/>",
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"\" is not a number or a list of wavelength:value",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" value=\"0.1, 0.2, 0.3\"/>",
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"0.1, 0.2, 0.3\" is not a number or a list of wavelength:value",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" value=\"500:0.1\"/>",
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"1 samples\" is not a spectrum of 2 to 65536 samples",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" value=\"500:0.1 600\"/>",
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"600\" is not a pair wavelength:value",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" value=\"500:0.1 600:x\"/>",
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"x\" is not a number",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" value=\"500:0.1 500:0.2\"/>",
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"500, 500\" is not a list of rising wavelengths",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" value=\"1.5\"/>",
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"1.5\" is not a colour with components from 0 to 1",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" filename=\"no.spd\"/>",
            "bad.xml:3: cannot read \"no.spd\": no such file in memory",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" filename=\"a\" value=\"1\"/>",
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"value\" is not allowed beside \"filename\"",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" type=\"uniform\"><string name=\"value\" value=\"1\"/></spectrum>",
            "bad.xml:3: texture \"uniform\": property \"value\": \"<string> 1\" is not a <float>",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" type=\"rainbow\"/>",
            "bad.xml:3: texture type \"rainbow\" is not understood; known: bitmap, blackbody, checkerboard, d65, irregular, mesh_attribute, rawconstant, regular, rgb, scale, srgb, uniform",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" type=\"blackbody\"/>",
            "bad.xml:3: texture \"blackbody\": needs the property \"temperature\"",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" type=\"blackbody\"><float name=\"temperature\" value=\"-3\"/></spectrum>",
            "bad.xml:3: texture \"blackbody\": property \"temperature\": \"-3\" is not a number > 0",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" type=\"regular\"><string name=\"values\" value=\"1 2\"/></spectrum>",
            "bad.xml:3: texture \"regular\": needs the property \"wavelength_min\"",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" type=\"regular\"><float name=\"wavelength_min\" value=\"400\"/><float name=\"wavelength_max\" value=\"300\"/><string name=\"values\" value=\"1 2\"/></spectrum>",
            "bad.xml:3: texture \"regular\": property \"values\": \"400, 300\" is not a list of rising wavelengths",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" type=\"irregular\"><string name=\"wavelengths\" value=\"400 500\"/><string name=\"values\" value=\"1\"/></spectrum>",
            "bad.xml:3: texture \"irregular\": has 2 wavelengths and 1 values",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" type=\"irregular\"><string name=\"wavelengths\" value=\"400 x\"/><string name=\"values\" value=\"1 1\"/></spectrum>",
            "bad.xml:3: texture \"irregular\": property \"wavelengths\": \"x\" is not a number",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" type=\"rgb\"/>",
            "bad.xml:3: texture \"rgb\": needs the property \"value\"",
        ),
        reflectance(
            "<spectrum name=\"reflectance\" type=\"d65\"><float name=\"scale\" value=\"2\"/></spectrum>",
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"a nested object\" is not a colour with components from 0 to 1",
        ),
        reflectance(
            "<bsdf type=\"diffuse\" name=\"reflectance\"/>",
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"bsdf \"diffuse\"\" is not an <rgb>, <srgb>, <float> or <spectrum>",
        ),
        reflectance(
            "<string name=\"reflectance\" value=\"red\"/>",
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"<string> red\" is not an <rgb>, <srgb>, <float> or <spectrum>",
        ),
        (
            shape("<emitter type=\"area\"><spectrum name=\"radiance\" value=\"-1\"/></emitter>"),
            vec![],
            "bad.xml:4: emitter \"area\": property \"radiance\": \"-1\" is not a colour without negative components",
        ),
    ]);
}

#[test]
fn broken_spectrum_files() {
    let body = bsdf("diffuse\"><spectrum name=\"reflectance\" filename=\"a.spd\"/>");
    let file = |bytes: &'static [u8], expected| (body.clone(), vec![("a.spd", bytes)], expected);
    check(&[
        file(b"", "a.spd: spectrum: \"0 samples\" is not a spectrum of 2 to 65536 samples"),
        file(b"400 1\n", "a.spd: spectrum: \"1 samples\" is not a spectrum of 2 to 65536 samples"),
        file(b"400\n", "a.spd:1: spectrum: \"400\" is not a wavelength and a value"),
        file(b"400 1 2\n", "a.spd:1: spectrum: \"400 1 2\" is not a wavelength and a value"),
        file(b"400 1\nx 2\n", "a.spd:2: wavelength: \"x\" is not a number"),
        file(b"400 1\n500 nan\n", "a.spd:2: spectral value: \"nan\" is not a finite number"),
        file(
            b"400 1\n300 2\n",
            "a.spd: spectrum: \"400, 300\" is not a list of rising wavelengths",
        ),
    ]);
}

#[test]
fn media_and_refused_plug_ins_are_told_with_the_reason() {
    let plain = |body: &str, expected| (scene(body), vec![], expected);
    check(&[
        plain(
            "<shape type=\"cube\">\n<medium name=\"interior\" type=\"milk\"/></shape>",
            "bad.xml:4: medium type \"milk\" is not understood; known: homogeneous",
        ),
        plain(
            "<shape type=\"cube\"><subsurface type=\"dipole\"/></shape>",
            "bad.xml:3: subsurface type \"dipole\" is not understood; known: nothing",
        ),
        plain(
            "<shape type=\"linearcurve\"/>",
            "bad.xml:3: shape type \"linearcurve\" is not understood (there are no curves); known: cube, cylinder, disk, instance, merge, obj, ply, rectangle, serialized, shapegroup, sphere",
        ),
        plain(
            "<shape type=\"cube\"><bsdf type=\"polarizer\"/></shape>",
            "bad.xml:3: bsdf type \"polarizer\" is not understood (light is not polarised here); known: blendbsdf, bumpmap, coating, conductor, dielectric, difftrans, diffuse, mask, mixturebsdf, normalmap, null, phong, plastic, principled, principledthin, roughcoating, roughconductor, roughdielectric, roughdiffuse, roughplastic, thindielectric, twosided, ward",
        ),
        plain(
            "<shape type=\"hair\"/><shape type=\"hair\"/>",
            "bad.xml:3: 1 things are not understood: shape \"hair\" (2 times, first in line 3; there are no curves)",
        ),
        plain(
            "<sensor type=\"perspective\"><transform name=\"to_world\"><matrix value=\"1 0.1 0 0 1 0 0 0 1\"/></transform></sensor>",
            "bad.xml:3: sensor \"perspective\": property \"to_world\": a camera cannot be scaled or sheared (its axes are × 1.0000, 1.0050, 1.0000, and up to 5.71° from right angles)",
        ),
        plain(
            "<sensor type=\"perspective\"><animation name=\"to_world\"/></sensor>",
            "bad.xml:3: <animation> needs a <transform>",
        ),
        plain(
            "<sensor type=\"perspective\"><animation name=\"to_world\"><scale x=\"1\"/></animation></sensor>",
            "bad.xml:3: element <scale> is not understood in <animation>; known: transform",
        ),
        plain(
            "<shape type=\"cube\"><bsdf type=\"roughconductor\"><float name=\"alpha\" value=\"1e20\"/></bsdf></shape>",
            "bad.xml:3: bsdf \"roughconductor\": property \"alpha\": \"1e20\" is not a number up to 10000",
        ),
        plain(
            "<blackbody name=\"radiance\" temperature=\"5000\"/>",
            "bad.xml:3: element <blackbody> is not understood in <scene>; known: alias, animation, boolean, bsdf, default, emitter, film, float, include, integer, integrator, medium, path, phase, point, ref, rfilter, rgb, sampler, sensor, shape, spectrum, srgb, string, subsurface, texture, transform, vector, volume",
        ),
        plain(
            "<luminaire type=\"point\"/>",
            "bad.xml:3: element <luminaire> is not understood in <scene>; known: alias, animation, boolean, bsdf, default, emitter, film, float, include, integer, integrator, medium, path, phase, point, ref, rfilter, rgb, sampler, sensor, shape, spectrum, srgb, string, subsurface, texture, transform, vector, volume",
        ),
    ]);
}

#[test]
fn broken_text() {
    let plain = |body: &str, expected| (body.to_string(), vec![], expected);
    let long = "x".repeat(300);
    check(&[
        plain("<", "bad.xml:1: malformed XML: tag not closed: `>` not found before end of input"),
        plain("<a>", "bad.xml:1: malformed XML: the element <a> is not closed"),
        plain("<a>\n<b>\n<c/>", "bad.xml:2: malformed XML: the element <b> is not closed"),
        plain("</a>", "bad.xml:1: malformed XML: close tag `</a>` does not match any open tag"),
        plain("just text", "bad.xml:1: malformed XML: there is no element"),
        plain(
            "<!-- never closed",
            "bad.xml:1: malformed XML: comment not closed: `-->` not found before end of input",
        ),
        plain(
            "<scene version=3.0.0/>",
            "bad.xml:1: malformed XML: attributes of <scene>: position 14: attribute value must be enclosed in `\"` or `'`",
        ),
        plain(
            "<scene version/>",
            "bad.xml:1: malformed XML: attributes of <scene>: position 13: attribute key must be directly followed by `=` or space",
        ),
        plain(
            "<scene version=\"3.0.0\" a=\"&#1;\"/>",
            "bad.xml:1: malformed XML: control character 1 in attribute \"a\"",
        ),
        plain(
            &format!("<{long}/>"),
            &format!("bad.xml:1: malformed XML: \"{}\" is no name of an element", &long[..40]),
        ),
        plain(
            &format!("<scene {long}=\"\"/>"),
            &format!("bad.xml:1: malformed XML: \"{}\" is no name of an attribute", &long[..40]),
        ),
    ]);
}
