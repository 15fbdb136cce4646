//! Broken files, each with the one line that a user sees.

use pathspace_scenes::load_str;
use pathspace_scenes::source::Memory;

/// A mesh that is fine.
const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn error_of(body: &str, files: &[(&str, &[u8])]) -> String {
    let mut source = Memory::new().with("ok.obj", OBJ.as_bytes());
    for (name, bytes) in files {
        source.insert(name, bytes.to_vec());
    }
    match load_str(body, "bad.xml", &source, &[]) {
        Ok(_) => "no error".into(),
        Err(e) => e.to_string(),
    }
}

/// Compares each case and reports all that differ, so that a table can be mended at once.
fn check(cases: &[(String, Vec<(&str, &[u8])>, &str)]) {
    let mut wrong = Vec::new();
    for (body, files, expected) in cases {
        let found = error_of(body, files);
        assert!(!found.contains('\n'), "more than one line: {found}");
        if found != *expected {
            wrong.push(format!("{body}\n  expected {expected}\n  found    {found}"));
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// A scene whose third line is the body.
fn scene(body: &str) -> String {
    format!("<?xml version=\"1.0\"?>\n<scene version=\"3.0.0\">\n{body}\n</scene>\n")
}

fn shape(body: &str) -> String {
    scene(&format!("<shape type=\"sphere\">\n{body}\n</shape>"))
}

fn bsdf(body: &str) -> String {
    scene(&format!("<bsdf type=\"{body}</bsdf>"))
}

fn sensor(body: &str) -> String {
    scene(&format!("<sensor type=\"perspective\">{body}</sensor>"))
}

fn film(body: &str) -> String {
    sensor(&format!("<film type=\"hdrfilm\">{body}</film>"))
}

#[test]
fn broken_xml_and_structure() {
    let plain = |body: &str, expected| (body.to_string(), vec![], expected);
    check(&[
        plain("", "bad.xml:1: malformed XML: the document does not have a root node"),
        plain(
            "<scene version=\"3.0.0\">\n<shape>\n</scene>",
            "bad.xml:3: malformed XML: expected 'shape' tag, not 'scene'",
        ),
        plain(
            "<scene version=\"3.0.0\"><a b=\"1\" b=\"2\"/></scene>",
            "bad.xml:1: malformed XML: attribute 'b' at 1:33 is already defined",
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
            "<bsdf version=\"3.0.0\" type=\"diffuse\"/>",
            "bad.xml:1: element <bsdf> is not understood in a scene file; known: scene",
        ),
        (
            scene("<light/>"),
            vec![],
            "bad.xml:3: element <light> is not understood in <scene>; known: alias, boolean, bsdf, default, emitter, film, float, include, integer, integrator, medium, path, phase, point, ref, rfilter, rgb, sampler, sensor, shape, spectrum, srgb, string, texture, transform, vector, volume",
        ),
        (
            scene("<shape/>"),
            vec![],
            "bad.xml:3: missing attribute \"type\" in <shape>; known: id, name, type",
        ),
        (
            scene("<shape type=\"teapot\"/>"),
            vec![],
            "bad.xml:3: shape type \"teapot\" is not understood; known: cube, disk, obj, ply, rectangle, sphere",
        ),
        (
            scene("<shape type=\"cube\" colour=\"red\"/>"),
            vec![],
            "bad.xml:3: unknown attribute \"colour\" in <shape>; known: id, name, type",
        ),
        (
            scene("<translate x=\"1\"/>"),
            vec![],
            "bad.xml:3: element <translate> is not understood in <scene>; known: alias, boolean, bsdf, default, emitter, film, float, include, integer, integrator, medium, path, phase, point, ref, rfilter, rgb, sampler, sensor, shape, spectrum, srgb, string, texture, transform, vector, volume",
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
            scene("<float name=\"exposure\" value=\"1\"/>"),
            vec![],
            "bad.xml:3: property \"exposure\" is not understood by <scene>; known: <bsdf>, <emitter>, <integrator>, <sensor>, <shape>",
        ),
        (
            scene("<scene version=\"3.0.0\"/>"),
            vec![],
            "bad.xml:3: element <scene> is not understood in a scene; known: bsdf, emitter, film, integrator, medium, phase, rfilter, sampler, sensor, shape, texture, volume",
        ),
        (
            scene("<medium type=\"homogeneous\"/>"),
            vec![],
            "bad.xml:3: element <medium> is not understood in <scene>; known: <bsdf>, <emitter>, <integrator>, <sensor>, <shape>",
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
            "in.xml:3: shape type \"tube\" is not understood; known: cube, disk, obj, ply, rectangle, sphere",
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
            "bad.xml:4: malformed XML: expected 'bsdf' tag, not 'scene'",
        ),
        (
            scene(&format!("{}{}", "<bsdf type=\"twosided\">".repeat(100), "</bsdf>".repeat(100))),
            vec![],
            "bad.xml:3: elements are nested deeper than 64",
        ),
    ]);
}

#[test]
fn broken_numbers_and_transforms() {
    let transform = |body: &str, expected| {
        let body = shape(&format!("<transform name=\"to_world\">\n{body}</transform>"));
        (body, vec![], expected)
    };
    check(&[
        (
            shape("<float name=\"radius\" value=\"wide\"/>"),
            vec![],
            "bad.xml:4: shape \"sphere\": property \"radius\": \"wide\" is not a number",
        ),
        (
            shape("<float name=\"radius\" value=\"nan\"/>"),
            vec![],
            "bad.xml:4: shape \"sphere\": property \"radius\": \"nan\" is not a finite number",
        ),
        (
            shape("<float name=\"radius\" value=\"1e400\"/>"),
            vec![],
            "bad.xml:4: shape \"sphere\": property \"radius\": \"1e400\" is not a finite number",
        ),
        (
            shape("<float name=\"radius\" value=\"-1\"/>"),
            vec![],
            "bad.xml:4: shape \"sphere\": property \"radius\": \"-1\" is not a number > 0",
        ),
        (
            shape("<float name=\"radius\" value=\"\"/>"),
            vec![],
            "bad.xml:4: shape \"sphere\": property \"radius\": \"\" is not a number",
        ),
        (
            shape("<string name=\"radius\" value=\"1\"/>"),
            vec![],
            "bad.xml:4: shape \"sphere\": property \"radius\": \"<string> 1\" is not a <float>",
        ),
        (
            shape("<point name=\"center\" value=\"1, 2\"/>"),
            vec![],
            "bad.xml:4: shape \"sphere\": property \"center\": \"1, 2\" is not one or three numbers",
        ),
        (
            shape("<point name=\"center\" x=\"1\" y=\"2\"/>"),
            vec![],
            "bad.xml:4: missing attribute \"z\" in <point>; known: name, x, y, z",
        ),
        (
            shape("<boolean name=\"flip_normals\" value=\"yes\"/>"),
            vec![],
            "bad.xml:4: shape \"sphere\": property \"flip_normals\": \"yes\" is not true or false",
        ),
        (
            shape("<float name=\"radius\" value=\"1\"/>\n<float name=\"radius\" value=\"2\"/>"),
            vec![],
            "bad.xml:5: property \"radius\" of shape \"sphere\" is given twice, first at bad.xml:4",
        ),
        (
            shape("<float name=\"size\" value=\"1\"/>"),
            vec![],
            "bad.xml:4: property \"size\" is not understood by shape \"sphere\"; known: <bsdf>, <emitter>, center, flip_normals, radius, to_world",
        ),
        transform(
            "<scale x=\"0\"/>",
            "bad.xml:4: transform is singular: it flattens space and has no inverse",
        ),
        transform(
            "<scale x=\"2\"/>",
            "bad.xml:4: shape \"sphere\": property \"to_world\": a sphere must be scaled alike along all axes",
        ),
        transform(
            "<scale value=\"1 2\"/>",
            "bad.xml:5: <scale> value: \"1 2\" is not one or three numbers",
        ),
        transform(
            "<rotate angle=\"30\"/>",
            "bad.xml:5: <rotate> axis: \"0, 0, 0\" is not a direction",
        ),
        transform(
            "<rotate x=\"1\"/>",
            "bad.xml:5: missing attribute \"angle\" in <rotate>; known: angle, value, x, y, z",
        ),
        transform(
            "<rotate x=\"1\" angle=\"much\"/>",
            "bad.xml:5: <rotate> angle: \"much\" is not a number",
        ),
        transform(
            "<lookat origin=\"0,0,0\" target=\"0,0,0\"/>",
            "bad.xml:5: <lookat> target: \"0,0,0\" is not different from the origin",
        ),
        transform(
            "<lookat origin=\"0,0,0\" target=\"0,1,0\" up=\"0,1,0\"/>",
            "bad.xml:5: <lookat> up: \"0,1,0\" is not a direction other than the view's",
        ),
        transform(
            "<lookAt origin=\"0,0,0\" target=\"0,1,0\"/>",
            "bad.xml:5: element <lookAt> is not understood in <transform>; known: lookat, matrix, rotate, scale, translate",
        ),
        transform(
            "<matrix value=\"1 2 3\"/>",
            "bad.xml:5: <matrix> value: \"3 numbers\" is not 9 or 16 numbers",
        ),
        transform(
            "<matrix value=\"1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1\"/>",
            "bad.xml:5: <matrix> last row: \"0 0 1 1\" is not 0 0 0 1 (affine)",
        ),
        transform(
            "<matrix value=\"1 0 0 0 0 1 0 0 0 0 inf 0 0 0 0 1\"/>",
            "bad.xml:5: <matrix> value: \"inf\" is not a finite number",
        ),
        transform(
            "<shear x=\"1\"/>",
            "bad.xml:5: element <shear> is not understood in <transform>; known: lookat, matrix, rotate, scale, translate",
        ),
        (
            film("<integer name=\"width\" value=\"1000000000\"/>"),
            vec![],
            "bad.xml:3: film \"hdrfilm\": property \"width\": \"1000000000\" is not an integer from 1 to 65536",
        ),
        (
            film("<integer name=\"width\" value=\"0\"/>"),
            vec![],
            "bad.xml:3: film \"hdrfilm\": property \"width\": \"0\" is not an integer from 1 to 65536",
        ),
        (
            film("<integer name=\"width\" value=\"-64\"/>"),
            vec![],
            "bad.xml:3: film \"hdrfilm\": property \"width\": \"-64\" is not an integer from 1 to 65536",
        ),
        (
            film("<integer name=\"width\" value=\"64.5\"/>"),
            vec![],
            "bad.xml:3: film \"hdrfilm\": property \"width\": \"64.5\" is not an integer",
        ),
        (
            film("<integer name=\"width\" value=\"99999999999999999999\"/>"),
            vec![],
            "bad.xml:3: film \"hdrfilm\": property \"width\": \"99999999999999999999\" is not an integer",
        ),
        (
            film(
                "<integer name=\"width\" value=\"65536\"/><integer name=\"height\" value=\"65536\"/>",
            ),
            vec![],
            "bad.xml:3: film \"hdrfilm\": 65536 x 65536 are more than 268435456 pixels",
        ),
        (
            film("<integer name=\"crop_offset_x\" value=\"700\"/>"),
            vec![],
            "bad.xml:3: film \"hdrfilm\": crop window 768x576 at (700, 0) is larger than the film 768x576",
        ),
        (
            film("<rfilter type=\"mitchell\"/>"),
            vec![],
            "bad.xml:3: rfilter type \"mitchell\" is not understood; known: box, gaussian, tent",
        ),
        (
            film("<rfilter type=\"tent\"><float name=\"radius\" value=\"0\"/></rfilter>"),
            vec![],
            "bad.xml:3: rfilter \"tent\": property \"radius\": \"0\" is not a number > 0",
        ),
        (
            film("<rfilter type=\"box\"><float name=\"radius\" value=\"1\"/></rfilter>"),
            vec![],
            "bad.xml:3: property \"radius\" is not understood by rfilter \"box\"; known: nothing",
        ),
        (
            sensor("<float name=\"fov\" value=\"180\"/>"),
            vec![],
            "bad.xml:3: sensor \"perspective\": property \"fov\": \"180\" is not an angle between 0 and 180 degrees",
        ),
        (
            sensor("<string name=\"focal_length\" value=\"long\"/>"),
            vec![],
            "bad.xml:3: sensor \"perspective\": property \"focal_length\": \"long\" is not a length such as 50mm",
        ),
        (
            sensor("<float name=\"fov\" value=\"40\"/><string name=\"fov_axis\" value=\"z\"/>"),
            vec![],
            "bad.xml:3: sensor \"perspective\": property \"fov_axis\": \"z\" is not one of x, y, diagonal, smaller, larger",
        ),
        (
            sensor("<transform name=\"to_world\"><scale value=\"2\"/></transform>"),
            vec![],
            "bad.xml:3: sensor \"perspective\": property \"to_world\": a camera cannot be scaled or sheared (its first axis is × 2)",
        ),
        (
            sensor("<sampler type=\"sobol\"/>"),
            vec![],
            "bad.xml:3: sampler type \"sobol\" is not understood; known: independent, ldsampler, multijitter, orthogonal, stratified",
        ),
        (
            sensor(
                "<sampler type=\"independent\"><integer name=\"sample_count\" value=\"0\"/></sampler>",
            ),
            vec![],
            "bad.xml:3: sampler \"independent\": property \"sample_count\": \"0\" is not an integer from 1 to 4294967295",
        ),
        (
            scene("<sensor type=\"thinlens\"/>"),
            vec![],
            "bad.xml:3: sensor \"thinlens\": needs the property \"aperture_radius\"",
        ),
        (
            scene("<sensor type=\"orthographic\"/>"),
            vec![],
            "bad.xml:3: sensor type \"orthographic\" is not understood; known: perspective, thinlens",
        ),
    ]);
}

#[test]
fn broken_materials_and_lights() {
    check(&[
        (
            bsdf("plastic\">"),
            vec![],
            "bad.xml:3: bsdf type \"plastic\" is not understood; known: conductor, dielectric, diffuse, null, roughconductor, twosided",
        ),
        (
            bsdf("diffuse\"><rgb name=\"reflectance\" value=\"1.5, 0, 0\"/>"),
            vec![],
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"1.5, 0, 0\" is not a colour with components from 0 to 1",
        ),
        (
            bsdf("diffuse\"><rgb name=\"reflectance\" value=\"-0.1\"/>"),
            vec![],
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"-0.1, -0.1, -0.1\" is not a colour with components from 0 to 1",
        ),
        (
            bsdf("diffuse\"><rgb name=\"reflectance\" value=\"#12345\"/>"),
            vec![],
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"#12345\" is not a colour such as #ff8000",
        ),
        (
            bsdf("diffuse\"><rgb name=\"reflectance\" value=\"0.1, 0.2\"/>"),
            vec![],
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"0.1, 0.2\" is not one or three numbers",
        ),
        (
            bsdf("diffuse\"><spectrum name=\"reflectance\" value=\"400:0.1, 700:0.9\"/>"),
            vec![],
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"400:0.1, 700:0.9\" is not a constant spectrum (lists of wavelength:value are not understood; use <rgb>)",
        ),
        (
            bsdf("diffuse\"><texture name=\"reflectance\" type=\"bitmap\"/>"),
            vec![],
            "bad.xml:3: bsdf \"diffuse\": property \"reflectance\": \"texture \"bitmap\"\" is not an <rgb>, <srgb>, <float> or constant <spectrum> (no textures)",
        ),
        (
            bsdf("diffuse\"><rgb name=\"colour\" value=\"1\"/>"),
            vec![],
            "bad.xml:3: property \"colour\" is not understood by bsdf \"diffuse\"; known: reflectance",
        ),
        (
            bsdf("dielectric\"><string name=\"int_ior\" value=\"jelly\"/>"),
            vec![],
            "bad.xml:3: bsdf \"dielectric\": property \"int_ior\": \"jelly\" is not a number or one of vacuum, helium, hydrogen, air, carbon dioxide, water ice, water, acetone, ethanol, fused quartz, carbon tetrachloride, pyrex, glycerol, acrylic glass, polypropylene, benzene, bk7, silicone oil, sodium chloride, amber, pet, bromine, diamond",
        ),
        (
            bsdf("dielectric\"><float name=\"int_ior\" value=\"0\"/>"),
            vec![],
            "bad.xml:3: bsdf \"dielectric\": property \"int_ior\": \"0\" is not a number > 0",
        ),
        (
            bsdf("conductor\"><string name=\"material\" value=\"Xx\"/>"),
            vec![],
            "bad.xml:3: bsdf \"conductor\": property \"material\": \"Xx\" is not one of Ag, Al, AlAs, AlAs_palik, AlSb, AlSb_palik, Au, Be, Be_palik, Cr, CsI, CsI_palik, Cu, Cu2O, Cu2O_palik, CuO, CuO_palik, Cu_palik, Hg, HgTe, HgTe_palik, Hg_palik, Ir, Ir_palik, K, K_palik, Li, Li_palik, MgO, MgO_palik, Mo, Mo_palik, Na_palik, Nb, Nb_palik, Ni_palik, Rh, Rh_palik, Se, Se-e, Se-e_palik, Se_palik, SiC, SiC_palik, SnTe, SnTe_palik, Ta, Ta_palik, Te, Te-e, Te-e_palik, Te_palik, ThF4, ThF4_palik, TiC, TiC_palik, TiN, TiN_palik, TiO2, TiO2-e, TiO2-e_palik, TiO2_palik, VC, VC_palik, VN, VN_palik, V_palik, W, a-C, d-C, d-C_palik, none (or give eta and k)",
        ),
        (
            bsdf(
                "conductor\"><string name=\"material\" value=\"Au\"/><rgb name=\"k\" value=\"1\"/>",
            ),
            vec![],
            "bad.xml:3: bsdf \"conductor\": has \"material\" and \"eta\" or \"k\": give one or the other",
        ),
        (
            bsdf("roughconductor\"><float name=\"alpha\" value=\"0\"/>"),
            vec![],
            "bad.xml:3: bsdf \"roughconductor\": property \"alpha\": \"0\" is not a number > 0",
        ),
        (
            bsdf("roughconductor\"><float name=\"alpha_u\" value=\"0.1\"/>"),
            vec![],
            "bad.xml:3: bsdf \"roughconductor\": has only one of \"alpha_u\" and \"alpha_v\"",
        ),
        (
            bsdf("roughconductor\"><string name=\"distribution\" value=\"phong\"/>"),
            vec![],
            "bad.xml:3: bsdf \"roughconductor\": property \"distribution\": \"phong\" is not one of beckmann, ggx",
        ),
        (
            bsdf("roughconductor\"><float name=\"ext_eta\" value=\"1\"/>"),
            vec![],
            "bad.xml:3: property \"ext_eta\" is not understood by bsdf \"roughconductor\"; known: alpha, alpha_u, alpha_v, distribution, eta, k, material, sample_visible, specular_reflectance",
        ),
        (
            bsdf("twosided\">"),
            vec![],
            "bad.xml:3: bsdf \"twosided\": needs one or two nested <bsdf>, not 0",
        ),
        (
            bsdf("twosided\"><bsdf type=\"dielectric\"/>"),
            vec![],
            "bad.xml:3: bsdf \"dielectric\" lets light through and cannot be twosided",
        ),
        (
            shape("<bsdf type=\"diffuse\"/>\n<bsdf type=\"diffuse\"/>"),
            vec![],
            "bad.xml:5: shape \"sphere\" has more than one <bsdf>",
        ),
        (
            shape("<emitter type=\"point\"/>"),
            vec![],
            "bad.xml:4: emitter type \"point\" is not understood; known: area",
        ),
        (
            shape("<emitter type=\"area\"><rgb name=\"radiance\" value=\"-1\"/></emitter>"),
            vec![],
            "bad.xml:4: emitter \"area\": property \"radiance\": \"-1, -1, -1\" is not a colour without negative components",
        ),
        (
            shape("<emitter type=\"area\"/>\n<emitter type=\"area\"/>"),
            vec![],
            "bad.xml:5: shape \"sphere\" has more than one <emitter>",
        ),
        (
            scene("<emitter type=\"area\"/>"),
            vec![],
            "bad.xml:3: emitter \"area\" must stand in a <shape>",
        ),
        (
            scene("<emitter type=\"envmap\"/>"),
            vec![],
            "bad.xml:3: emitter type \"envmap\" is not understood; known: area, constant, directional, point",
        ),
        (
            scene(
                "<emitter type=\"directional\"><vector name=\"direction\" value=\"0\"/></emitter>",
            ),
            vec![],
            "bad.xml:3: emitter \"directional\": property \"direction\": \"0, 0, 0\" is not a direction other than 0, 0, 0",
        ),
        (
            scene("<emitter type=\"constant\"/>\n<emitter type=\"constant\"/>"),
            vec![],
            "bad.xml:4: more than one environment emitter",
        ),
        (
            scene("<integrator type=\"bdpt\"/>"),
            vec![],
            "bad.xml:3: integrator type \"bdpt\" is not understood; known: direct, path, ptracer, volpath, volpathmis",
        ),
        (
            scene(
                "<integrator type=\"path\"><integer name=\"max_depth\" value=\"-2\"/></integrator>",
            ),
            vec![],
            "bad.xml:3: integrator \"path\": property \"max_depth\": \"-2\" is not -1 (unlimited) or an integer from 0 to 16777216",
        ),
        (
            scene(
                "<integrator type=\"path\"><boolean name=\"hide_emitters\" value=\"true\"/></integrator>",
            ),
            vec![],
            "bad.xml:3: integrator \"path\": property \"hide_emitters\": true is not understood, only false",
        ),
        (
            scene("<integrator type=\"path\"/>\n<integrator type=\"path\"/>"),
            vec![],
            "bad.xml:4: <scene> has more than one <integrator>",
        ),
    ]);
}

/// A scene with one OBJ or PLY file.
fn mesh<'a>(
    name: &'a str,
    bytes: &'a [u8],
    expected: &'a str,
) -> (String, Vec<(&'a str, &'a [u8])>, &'a str) {
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
        mesh(
            "a.obj",
            b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n",
            "bad.xml:3: mesh \"a.obj\": all 1 triangles have no area",
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

#[test]
fn parameters_that_nobody_uses_are_errors() {
    let text = scene("<default name=\"depth\" value=\"3\"/>\n<shape type=\"$kind\"/>");
    let given = [("kind".to_string(), "cube".to_string()), ("spp".to_string(), "4".to_string())];
    let error = load_str(&text, "bad.xml", &Memory::new(), &given).unwrap_err();
    assert_eq!(
        error.to_string(),
        "bad.xml: parameter \"spp=4\" is not used by the scene; known: depth, kind"
    );
}
