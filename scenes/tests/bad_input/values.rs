//! Numbers, transforms, films and sensors.

use super::{check, film, scene, sensor, shape};

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
        transform(
            "<scale x=\"0\"/>",
            "bad.xml:4: transform is singular: it flattens space and has no inverse",
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
            film("<rfilter type=\"tent\"><float name=\"radius\" value=\"0\"/></rfilter>"),
            vec![],
            "bad.xml:3: rfilter \"tent\": property \"radius\": \"0\" is not a number > 0",
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
            "bad.xml:3: sensor \"perspective\": property \"to_world\": a camera cannot be scaled or sheared (its axes are × 2.0000, 2.0000, 2.0000, and up to 0.00° from right angles)",
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
            scene("<sensor type=\"fisheye\"/>"),
            vec![],
            "bad.xml:3: sensor type \"fisheye\" is not understood; known: distant, irradiancemeter, orthographic, perspective, radiancemeter, thinlens",
        ),
    ]);
}
