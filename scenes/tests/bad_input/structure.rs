//! XML that is malformed, misplaced or refers to nothing.

use super::{check, scene};

#[test]
fn broken_xml_and_structure() {
    let plain = |body: &str, expected| (body.to_string(), vec![], expected);
    check(&[
        plain("", "bad.xml:1: malformed XML: there is no element"),
        plain(
            "<scene version=\"3.0.0\">\n<shape>\n</scene>",
            "bad.xml:3: malformed XML: expected `</shape>`, but `</scene>` was found",
        ),
        plain(
            "<scene version=\"3.0.0\"><a b=\"1\" b=\"2\"/></scene>",
            "bad.xml:1: element <a> is not understood in <scene>; known: alias, animation, boolean, bsdf, default, emitter, film, float, include, integer, integrator, medium, path, phase, point, ref, rfilter, rgb, sampler, sensor, shape, spectrum, srgb, string, subsurface, texture, transform, vector, volume",
        ),
        plain(
            "<scene>\n</scene>",
            "bad.xml:1: missing attribute \"version\" in <scene>; known: version",
        ),
        plain(
            "<scene version=\"three\"/>",
            "bad.xml:1: <scene> version: \"three\" is not a version such as 3.0.0",
        ),
        plain(
            "<scene\n version=\"4.0.0.0\"/>",
            "bad.xml:1: <scene> version: \"4.0.0.0\" is not a version such as 3.0.0",
        ),
        plain(
            "<bsdf version=\"3.0.0\" type=\"diffuse\"/>",
            "bad.xml:1: element <bsdf> is not understood in a scene file; known: scene",
        ),
        (
            scene("<light/>"),
            vec![],
            "bad.xml:3: element <light> is not understood in <scene>; known: alias, animation, boolean, bsdf, default, emitter, film, float, include, integer, integrator, medium, path, phase, point, ref, rfilter, rgb, sampler, sensor, shape, spectrum, srgb, string, subsurface, texture, transform, vector, volume",
        ),
        (
            scene("<shape/>"),
            vec![],
            "bad.xml:3: missing attribute \"type\" in <shape>; known: id, name, type",
        ),
        (
            scene("<shape type=\"teapot\"/>"),
            vec![],
            "bad.xml:3: shape type \"teapot\" is not understood; known: cube, cylinder, disk, instance, merge, obj, ply, rectangle, serialized, shapegroup, sphere",
        ),
        (
            scene("<shape type=\"cube\" colour=\"red\"/>"),
            vec![],
            "bad.xml:3: unknown attribute \"colour\" in <shape>; known: id, name, type",
        ),
        (
            scene("<translate x=\"1\"/>"),
            vec![],
            "bad.xml:3: element <translate> is not understood in <scene>; known: alias, animation, boolean, bsdf, default, emitter, film, float, include, integer, integrator, medium, path, phase, point, ref, rfilter, rgb, sampler, sensor, shape, spectrum, srgb, string, subsurface, texture, transform, vector, volume",
        ),
        (
            scene("<float name=\"a\" value=\"1\"><b/></float>"),
            vec![],
            "bad.xml:3: element <b> is not understood in <float>; known: nothing",
        ),
        (
            scene("<float value=\"1\"/>"),
            vec![],
            "bad.xml:3: missing attribute \"name\" in <float>; known: name, value",
        ),
        (
            scene("<scene version=\"3.0.0\"/>"),
            vec![],
            "bad.xml:3: element <scene> is not understood in a scene; known: bsdf, emitter, film, integrator, medium, phase, rfilter, sampler, sensor, shape, subsurface, texture, volume",
        ),
        (
            scene("<ref id=\"nobody\"/>"),
            vec![],
            "bad.xml:3: no object has the id \"nobody\"; known ids: none",
        ),
        (
            scene("<bsdf type=\"diffuse\" id=\"a\"/>\n<bsdf type=\"null\" id=\"a\"/>"),
            vec![],
            "bad.xml:4: the id \"a\" is given twice, first at bad.xml:3",
        ),
        (
            scene("<alias id=\"a\" as=\"b\"/>"),
            vec![],
            "bad.xml:3: no object has the id \"a\"; known ids: none",
        ),
        (
            scene("<bsdf type=\"twosided\" id=\"a\"><ref id=\"a\"/></bsdf>"),
            vec![],
            "bad.xml:3: bsdf \"twosided\": refers to itself",
        ),
        (
            scene("<include filename=\"none.xml\"/>"),
            vec![],
            "bad.xml:3: cannot read \"none.xml\": no such file in memory",
        ),
        (
            scene("<include filename=\"in.xml\"/>"),
            vec![("in.xml", b"<scene version=\"3.0.0\">\n\n<shape type=\"tube\"/></scene>")],
            "in.xml:3: shape type \"tube\" is not understood; known: cube, cylinder, disk, instance, merge, obj, ply, rectangle, serialized, shapegroup, sphere",
        ),
        (
            scene("<include filename=\"self.xml\"/>"),
            vec![(
                "self.xml",
                b"<scene version=\"3.0.0\"><include filename=\"self.xml\"/></scene>",
            )],
            "self.xml:1: <include> of \"self.xml\" is nested 15 files deep",
        ),
        (
            scene("<path value=\"nowhere\"/>"),
            vec![],
            "bad.xml:3: <path>: \"nowhere\" is not a folder",
        ),
        (
            scene("<integer name=\"$n\" value=\"1\"/>"),
            vec![],
            "bad.xml:3: parameter \"$n\" is not defined; known: nothing (give it with -D n=… or <default>)",
        ),
        (
            scene(&"<bsdf type=\"twosided\">".repeat(100)),
            vec![],
            "bad.xml:3: elements are nested deeper than 64",
        ),
        (
            scene(&format!("{}{}", "<bsdf type=\"twosided\">".repeat(100), "</bsdf>".repeat(100))),
            vec![],
            "bad.xml:3: elements are nested deeper than 64",
        ),
    ]);
}
