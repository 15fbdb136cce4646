//! Bad use and bad input: one line on stderr, exit status 2, never a panic.

use crate::support::*;

/// A scene of one line per element, in which one line is replaced by `line`.
fn scene_with(element: &str, line: &str) -> String {
    let lines = [
        (
            "integrator",
            r#"<integrator type="path"><integer name="max_depth" value="3"/></integrator>"#,
        ),
        ("sensor", r#"<sensor type="perspective"><float name="fov" value="45"/></sensor>"#),
        ("bsdf", r#"<bsdf type="diffuse" id="grey"><rgb name="reflectance" value="0.5"/></bsdf>"#),
        ("shape", r#"<shape type="sphere"><ref id="grey"/></shape>"#),
        ("emitter", r#"<emitter type="constant"><rgb name="radiance" value="1"/></emitter>"#),
    ];
    let mut text = String::from("<scene version=\"3.0.0\">\n");
    for (name, standard) in lines {
        text += if name == element { line } else { standard };
        text.push('\n');
    }
    text + "</scene>\n"
}

/// The one line of a command that must fail.
fn failure(folder: &Folder, args: &[&str]) -> String {
    let output = run_in(folder.path(), args);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
    assert!(message.starts_with("error: "), "{args:?}: {message}");
    assert_eq!(message.lines().count(), 1, "{args:?}: {message}");
    assert!(!message.contains("panicked"), "{args:?}: {message}");
    assert!(output.stdout.is_empty(), "{args:?}: {}", stdout(&output));
    message
}

#[test]
fn bad_use_is_one_line() {
    let folder = Folder::new();
    folder.write("file", "");
    std::fs::create_dir(folder.path().join("dir.exr")).unwrap();
    let render = ["render", "cornell-box", "--size", "8x8", "--spp", "1"];
    let table: &[(&[&str], &str)] = &[
        (&["paint"], "paint"),
        (&["render"], "SCENE"),
        (&["render", "cornell-box", "--sp", "1"], "did you mean '--spp'?"),
        (&["render", "cornell-box", "--sp", "1"], "render --help')"),
        (&["rendr", "cornell-box"], "did you mean 'render'?"),
        (&["render", "cornell-box", "--spp", "1", "--seconds", "1"], "--seconds"),
        (&["render", "cornell-box", "--spp", "0"], "--spp"),
        (&["render", "cornell-box", "--spp", "-4"], "-4"),
        (&["render", "cornell-box", "--spp", "many"], "many"),
        (&["render", "cornell-box", "--spp", "1.5"], "1.5"),
        (&["render", "cornell-box", "--seconds", "0"], "--seconds"),
        (&["render", "cornell-box", "--seconds", "nan"], "nan"),
        (&["render", "cornell-box", "--seconds", "inf"], "inf"),
        (&["render", "cornell-bax", "--spp", "1"], "cornell-bax: no such file"),
        (&["render", "cornell-bax", "--spp", "1"], "did you mean 'cornell-box'?"),
        (&["render", "missing/scene.xml", "--spp", "1"], "missing/scene.xml: no such file"),
        (&["render", ".", "--spp", "1"], ".: is a directory"),
        (&["render", "cornell-box", "--spp", "1", "--size", "8"], "expected WxH"),
        (&["render", "cornell-box", "--spp", "1", "--size", "0x8"], "expected WxH"),
        (&["render", "cornell-box", "--spp", "1", "--size", "99999x99999"], "pixels"),
        (&["render", "cornell-box", "--spp", "1", "--crop", "0,0,9"], "expected x,y,w,h"),
        (&["render", "cornell-box", "--spp", "1", "--crop", "0,0,9999,1"], "crop window"),
        (&["render", "cornell-box", "--spp", "1", "--crop", "4294967295,0,1,1"], "crop window"),
        (&["render", "cornell-box", "--spp", "1", "--threads", "0"], "--threads"),
        (&["render", "cornell-box", "--spp", "1", "--seed", "-1"], "-1"),
        (&["render", "cornell-box", "--spp", "1", "--seed", "18446744073709551616"], "--seed"),
        (&["render", "cornell-box", "--spp", "1", "--max-depth", "-2"], "--max-depth"),
        (&["render", "cornell-box", "--spp", "1", "-D", "res"], "expected key=value"),
        (&["render", "cornell-box", "--spp", "1", "-D", "nobody=1"], "nobody"),
        (&["render", "cornell-box", "--spp", "1", "-D", "res=wide"], "cornell-box/scene.xml:"),
        (&["render", "cornell-box", "--spp", "1", "-i", "magic"], "unknown integrator 'magic'"),
        (&["render", "cornell-box", "--spp", "1", "-i", "bpdt"], "did you mean 'bdpt'?"),
        (
            &["render", "cornell-box", "--spp", "1", "-i", "bdpt:heurstic=power"],
            "did you mean 'heuristic'?",
        ),
        (&["render", "cornell-box", "--spp", "1", "--exposure", "bright"], "or auto"),
        (
            &["render", "cornell-box", "--spp", "1", "--layers", "st", "-o", "a.npy"],
            "layers need an EXR file",
        ),
        (&["validate", "quik"], "did you mean 'quick'?"),
        (&["scenes", "export", "furnance", "x"], "did you mean 'furnace'?"),
        (&["render", "cornell-box", "--spp", "1", "-i", "pt:"], "NAME[:key=value"),
        (&["render", "cornell-box", "--spp", "1", "-i", "pt:colour=red"], "no option 'colour'"),
        (&["render", "cornell-box", "--spp", "1", "-i", "pt:nee=maybe"], "true or false"),
        (
            &["render", "cornell-box", "--spp", "1", "-i", "bdpt:roulette=false,max_depth=-1"],
            "roulette=false",
        ),
        (&["render", "cornell-box", "--spp", "1", "--layers", "depth"], "unknown layer 'depth'"),
        (
            &["render", "cornell-box", "--spp", "1", "--layers", "st", "--no-image"],
            "--no-image asks for none",
        ),
        (&["render", "/dev/zero", "--spp", "1"], "/dev/zero: is no regular file"),
        (
            &["compare", "--experiment", "/dev/zero"],
            "/dev/zero: cannot read: it is no regular file",
        ),
        (&["compare", "cornell-box", "--spp", "1", "--replicates", "1"], "--replicates"),
        (&["compare", "cornell-box", "--spp", "1", "-i", "magic"], "unknown integrator 'magic'"),
        (&["compare", "cornell-box"], "--spp"),
        (&["compare", "cornell-box", "--spp", "1", "-o", "file/out"], "file/out: cannot make"),
        (&["scenes", "export", "nowhere", "x"], "no scene 'nowhere'"),
        (&["scenes", "export", "furnace"], "DIR"),
        (&["scenes", "export", "furnace", "file/x"], "file/x"),
        (&["scenes", "burn"], "burn"),
    ];
    for (args, expected) in table {
        let message = failure(&folder, args);
        assert!(message.contains(expected), "{args:?}: {message}");
    }
    // Places where no image can be written are found before the rendering, whatever its length.
    for (out, expected) in [
        ("a.jpg", "must end in .exr, .png, .pfm or .npy"),
        ("a", "must end in .exr, .png, .pfm or .npy"),
        (".exr", "must end in .exr, .png, .pfm or .npy"),
        ("", "a value is required"),
        ("missing/a.exr", "missing/a.exr: cannot write: No such file"),
        ("file/a.exr", "file/a.exr: cannot write: Not a directory"),
        ("dir.exr", "dir.exr: cannot write: it is a directory"),
        ("/proc/a.exr", "/proc/a.exr: cannot write"),
    ] {
        let mut args = render.to_vec();
        args[5] = "1000000000";
        args.extend(["-o", out]);
        let message = failure(&folder, &args);
        assert!(message.contains(expected), "{out}: {message}");
    }
    assert_eq!(folder.list(), ["dir.exr", "file"]);
}

#[test]
fn broken_scenes_are_named_with_file_and_line() {
    let folder = Folder::new();
    folder.write("cut.obj", "v 0 0 0\nv 1 0\nf 1 2 3\n");
    folder.write("far.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n");
    folder.write("empty.obj", "");
    folder.write("cut.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n");
    folder.write("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.write("noise.ply", [0x80, 0xff, 0x00, 0x12]);
    let table = [
        (
            "integrator",
            r#"<integrator type="path"><integer name="max_depth" value="deep"/></integrator>"#,
            2,
        ),
        (
            "integrator",
            r#"<integrator type="path"><integer name="max_depth" value="-7"/></integrator>"#,
            2,
        ),
        ("sensor", r#"<sensor type="fisheye"/>"#, 3),
        ("sensor", r#"<sensor type="perspective"><float name="fov" value="wide"/></sensor>"#, 3),
        ("sensor", r#"<sensor type="perspective"><float name="fov" value="200"/></sensor>"#, 3),
        (
            "sensor",
            r#"<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="-3"/></film></sensor>"#,
            3,
        ),
        ("bsdf", r#"<bsdf type="velvet" id="grey"/>"#, 4),
        (
            "bsdf",
            r#"<bsdf type="diffuse" id="grey"><rgb name="reflectance" value="1, 2"/></bsdf>"#,
            4,
        ),
        ("bsdf", r#"<bsdf type="diffuse" id="gray"/>"#, 5),
        ("bsdf", r#"<bsdf type="diffuse" id="grey"/><bsdf type="diffuse" id="grey"/>"#, 4),
        ("bsdf", r#"<material type="diffuse" id="grey"/>"#, 4),
        ("bsdf", r#"<bsdf id="grey"/>"#, 4),
        ("shape", r#"<shape type="torus"><ref id="grey"/></shape>"#, 5),
        ("shape", r#"<shape type="sphere"><float name="radius" value="$r"/></shape>"#, 5),
        (
            "shape",
            r#"<shape type="sphere"><transform name="to_world"><scale value="a"/></transform></shape>"#,
            5,
        ),
        (
            "shape",
            r#"<shape type="sphere"><transform name="to_world"><matrix value="1 0 0"/></transform></shape>"#,
            5,
        ),
        ("shape", r#"<shape type="obj"/>"#, 5),
        ("emitter", r#"<emitter type="volumelight"/>"#, 6),
        (
            "emitter",
            r#"<emitter type="constant"><spectrum name="radiance" value="400:1, 700"/></emitter>"#,
            6,
        ),
        ("emitter", r#"<emitter type="constant"></shape>"#, 6),
        ("emitter", r#"<include filename="missing.xml"/>"#, 6),
    ];
    for (number, (element, line, at)) in table.iter().enumerate() {
        let name = format!("{number}.xml");
        folder.write(&name, scene_with(element, line));
        let message = failure(&folder, &["render", &name, "--size", "4x4", "--spp", "1"]);
        let place = format!("error: {name}:{at}: ");
        assert!(message.starts_with(&place), "{line}: expected {place}, got {message}");
    }
    // What is not known is passed over with a warning, or refused where that is asked for.
    for (element, line, at) in [
        ("integrator", r#"<integrator type="magic"/>"#, 2),
        ("bsdf", r#"<bsdf type="diffuse" id="grey"><rgb name="colour" value="1"/></bsdf>"#, 4),
    ] {
        folder.write("odd.xml", scene_with(element, line));
        let args = ["render", "odd.xml", "--size", "4x4", "--spp", "1", "--no-image"];
        let output = run_in(folder.path(), &args);
        assert_eq!(output.status.code(), Some(0), "{line}: {}", stderr(&output));
        assert!(stderr(&output).starts_with(&format!("warning: odd.xml:{at}: ")), "{line}");
        let message = failure(&folder, &[&args[..], &["--strict"]].concat());
        assert!(message.starts_with(&format!("error: odd.xml:{at}: ")), "{message}");
    }
    for mesh in ["missing.obj", "cut.obj", "far.obj", "empty.obj", "nan.obj"] {
        let line = format!(r#"<shape type="obj"><string name="filename" value="{mesh}"/></shape>"#);
        folder.write("mesh.xml", scene_with("shape", &line));
        let message = failure(&folder, &["render", "mesh.xml", "--size", "4x4", "--spp", "1"]);
        assert!(message.contains(mesh), "{mesh}: {message}");
    }
    for mesh in ["missing.ply", "cut.ply", "noise.ply"] {
        let line = format!(r#"<shape type="ply"><string name="filename" value="{mesh}"/></shape>"#);
        folder.write("mesh.xml", scene_with("shape", &line));
        let message = failure(&folder, &["render", "mesh.xml", "--size", "4x4", "--spp", "1"]);
        assert!(message.contains(mesh), "{mesh}: {message}");
    }
    for (content, expected) in [
        (&b""[..], "whole.xml:1: "),
        (b"\x89PNG\r\n\x1a\n\0\0", "whole.xml"),
        (b"<scene version=\"3.0.0\">", "whole.xml:1: "),
        (b"<scene version=\"new\"/>", "whole.xml:1: "),
        (b"<mesh/>", "whole.xml:1: "),
    ] {
        folder.write("whole.xml", content);
        let message = failure(&folder, &["render", "whole.xml", "--size", "4x4", "--spp", "1"]);
        assert!(message.contains(expected), "{content:?}: {message}");
    }
}

#[test]
fn help_and_version_are_no_errors() {
    for args in [&["--help"][..], &["--version"], &["render", "--help"], &["compare", "-h"]] {
        let output = run(args);
        assert_eq!(output.status.code(), Some(0), "{args:?}");
        assert!(!output.stdout.is_empty() && output.stderr.is_empty(), "{args:?}");
    }
}
