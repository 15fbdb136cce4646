//! `pathspace render`.

use crate::support::*;

/// Arguments of a small render, with more after them.
fn small<'a>(scene: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let mut args = vec!["render", scene, "--size", "32x24", "--max-depth", "6"];
    args.extend(more);
    args
}

#[test]
fn the_json_object_has_every_promised_field() {
    let folder = Folder::new();
    let out = folder.file("a.exr");
    let v = json(&small("cornell-box", &["--spp", "3", "--seed", "7", "-o", &out, "--json"]));
    assert_eq!(v["scene"], "cornell-box");
    assert_eq!(v["integrator"], "pt");
    assert_eq!(v["seed"], 7);
    assert!(v["threads"].as_u64().unwrap() >= 1);
    assert_eq!((v["width"].as_u64(), v["height"].as_u64()), (Some(32), Some(24)));
    assert_eq!(v["samples_per_pixel"], 3.0);
    assert!(v["seconds"].as_f64().unwrap() > 0.0);
    assert!(v["cpu_seconds"].as_f64().unwrap() > 0.0);
    assert!(v["rays"].as_u64().unwrap() > 32 * 24 * 3);
    assert_eq!(v["nonfinite"], 0);
    assert_eq!(v["output"], out.as_str());
    let exr = Exr::read(&out);
    for (c, name) in ["R", "G", "B"].iter().enumerate() {
        let told = v["mean"][c].as_f64().unwrap();
        assert!(told > 0.0 && (mean(exr.channel(name)) / told - 1.0).abs() < 1e-5, "{name}");
    }
}

#[test]
fn the_file_says_how_it_was_made() {
    let folder = Folder::new();
    let out = folder.file("a.exr");
    let args = ["-i", "pt:nee=false", "--spp", "2", "--seed", "18446744073709551615", "-o", &out];
    assert_eq!(run(&small("cornell-box", &args)).status.code(), Some(0));
    let exr = Exr::read(&out);
    assert_eq!(exr.attribute("pathspace.integrator"), "pt:nee=false");
    assert_eq!(exr.attribute("pathspace.seed"), "18446744073709551615");
    assert_eq!(exr.attribute("pathspace.samples_per_pixel"), "2");
    assert_eq!(exr.attribute("pathspace.version"), env!("CARGO_PKG_VERSION"));
    assert_eq!(exr.attribute("pathspace.scene_hash").len(), 64);
    assert!(exr.attribute("pathspace.seconds").parse::<f64>().unwrap() > 0.0);
}

#[test]
fn the_image_is_the_same_to_the_bit_for_any_number_of_threads() {
    let folder = Folder::new();
    for integrator in ["pt", "lt"] {
        let channels = ["1", "2", "7"].map(|threads| {
            let out = folder.file(&format!("{integrator}{threads}.exr"));
            // More than one chunk of 1024 items each.
            let line = format!(
                "render cornell-caustic --size 72x50 -i {integrator} --spp 2 \
                 --threads {threads} --layers length -o {out}"
            );
            let args = words(&line);
            assert_eq!(run(&args).status.code(), Some(0));
            Exr::read(&out).channels
        });
        assert!(channels[0].len() > 3 && channels[0] == channels[1] && channels[0] == channels[2]);
    }
}

#[test]
fn another_seed_gives_another_image() {
    let folder = Folder::new();
    let image = |seed: &str| {
        let out = folder.file(&format!("{seed}.exr"));
        run(&small("cornell-box", &["--spp", "1", "--seed", seed, "-o", &out]));
        Exr::read(&out).channels
    };
    assert!(image("1") != image("2"));
}

#[test]
fn layers_add_up_to_the_image() {
    let folder = Folder::new();
    let out = folder.file("a.exr");
    let args = ["--spp", "2", "--layers", "length,st,unweighted,emitter", "-o", &out];
    assert_eq!(run(&small("cornell-box", &args)).status.code(), Some(0));
    let exr = Exr::read(&out);
    for family in ["length.", "technique.", "emitter."] {
        let image = exr.channel("G");
        let mut sum = vec![0.0; image.len()];
        for (name, values) in &exr.channels {
            if name.starts_with(family) && name.ends_with(".G") {
                sum.iter_mut().zip(values).for_each(|(s, v)| *s += v);
            }
        }
        assert!(sum.iter().zip(image).all(|(s, v)| (s - v).abs() <= 1e-4 * v.abs()), "{family}");
    }
    assert!(exr.channels.iter().any(|(name, _)| name.starts_with("unweighted.s01.")));
}

#[test]
fn a_window_has_its_place_in_the_film() {
    let folder = Folder::new();
    let out = folder.file("a.exr");
    let args = ["--spp", "1", "--crop", "8,4,12,10", "-o", &out, "--json"];
    let v = json(&small("cornell-box", &args));
    assert_eq!((v["width"].as_u64(), v["height"].as_u64()), (Some(12), Some(10)));
    let exr = Exr::read(&out);
    assert_eq!((exr.size, exr.position, exr.display), ((12, 10), (8, 4), (32, 24)));
}

/// Random numbers belong to items of the window, so that its pixels have other noise and the same
/// mean.
#[test]
fn a_window_shows_that_part_of_the_image() {
    let folder = Folder::new();
    for integrator in ["pt", "lt"] {
        let (whole, part) = (folder.file("whole.exr"), folder.file("part.exr"));
        let more = ["-i", integrator, "--spp", "256"];
        run(&small("cornell-box", &[&more[..], &["-o", &whole]].concat()));
        run(&small("cornell-box", &[&more[..], &["--crop", "4,6,12,10", "-o", &part]].concat()));
        let (whole, part) = (Exr::read(&whole), Exr::read(&part));
        let rows = whole.channel("G").chunks(32).skip(6).take(10);
        let window: Vec<f32> = rows.flat_map(|row| &row[4..16]).copied().collect();
        let (a, b) = (mean(&window), mean(part.channel("G")));
        assert!((a / b - 1.0).abs() < 0.05, "{integrator}: {a} and {b}");
    }
}

#[test]
fn the_png_beside_it_has_the_size_of_the_image() {
    let folder = Folder::new();
    let out = folder.file("picture.exr");
    assert_eq!(run(&small("furnace", &["--spp", "1", "-o", &out])).status.code(), Some(0));
    assert_eq!(folder.list(), ["picture.exr", "picture.png"]);
    let png = image::open(folder.file("picture.png")).unwrap().to_rgb8();
    assert_eq!(png.dimensions(), (32, 24));
    // The background of 1 is the brightest there is: bright, but not white.
    let brightest = png.pixels().map(|p| p.0[1]).max().unwrap();
    assert!((200..255).contains(&brightest), "{brightest}");
}

/// Which step is the last is a rule of the budget, which is tested there without a clock.
#[test]
fn a_budget_of_seconds_ends_the_render() {
    let v = json(&small("cornell-box", &words("--seconds 0.5 --no-image --json")));
    assert!(v["samples_per_pixel"].as_f64().unwrap() >= 1.0);
    assert_eq!((&v["output"], &v["complete"]), (&serde_json::Value::Null, &true.into()));
}

/// Without `-o` the image is called as the scene, and stands where the command was called.
#[test]
fn the_image_is_kept_unless_somebody_else_needs_the_name() {
    let folder = Folder::new();
    let args = small("furnace", &["--spp", "1"]);
    let output = run_in(folder.path(), &args);
    assert!(stdout(&output).contains("wrote furnace.exr, furnace.png"), "{}", stdout(&output));
    assert_eq!(folder.list(), ["furnace.exr", "furnace.png"]);
    // What it wrote itself it may write again.
    assert_eq!(run_in(folder.path(), &args).status.code(), Some(0));
    for name in ["furnace.png", "furnace.exr"] {
        folder.write(name, "mine");
        let output = run_in(folder.path(), &args);
        assert_eq!(output.status.code(), Some(2));
        let message = stderr(&output);
        assert!(message.contains(&format!("{name}: is there already")), "{message}");
        assert_eq!(std::fs::read_to_string(folder.file(name)).unwrap(), "mine");
        let forced = run_in(folder.path(), &[&args[..], &["--force"]].concat());
        assert_eq!(forced.status.code(), Some(0), "{}", stderr(&forced));
    }
    // A name that was given is meant.
    folder.write("b.exr", "old");
    assert_eq!(
        run_in(folder.path(), &[&args[..], &["-o", "b.exr"]].concat()).status.code(),
        Some(0)
    );
}

#[test]
fn samples_per_pixel_are_those_of_the_file() {
    let folder = Folder::new();
    let scene = folder.write(
        "a.xml",
        r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm">
            <integer name="width" value="4"/><integer name="height" value="4"/><rfilter type="box"/></film>
            <sampler type="independent"><integer name="sample_count" value="7"/></sampler></sensor>
            <emitter type="constant"/></scene>"#,
    );
    let v = last_line(&run_in(folder.path(), &["render", &scene, "--json"]));
    assert_eq!(v["samples_per_pixel"], 7.0);
    assert_eq!(v["files"], serde_json::json!(["a.exr", "a.png"]));
}

#[test]
fn an_image_is_what_its_name_says() {
    let folder = Folder::new();
    let of = |name: &str| {
        let out = folder.file(name);
        json(&small("cornell-box", &["--spp", "1", "-o", &out, "--json"]));
        std::fs::read(out).unwrap()
    };
    let exr = Exr::read(&{
        of("a.exr");
        folder.file("a.exr")
    });
    let (pfm, npy) = (of("b.pfm"), of("c.npy"));
    let float = |bytes: &[u8], at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    // The last pixel of an array is the last of the image, that of a float map the right end of its
    // first row.
    assert_eq!(float(&npy, npy.len() - 4), *exr.channel("B").last().unwrap());
    assert_eq!(float(&pfm, pfm.len() - 4), exr.channel("B")[31]);
    assert!(of("d.png").starts_with(b"\x89PNG"));
    assert_eq!(folder.list(), ["a.exr", "a.png", "b.pfm", "c.npy", "d.png"]);
}

#[test]
fn exposure_is_in_stops() {
    let folder = Folder::new();
    let level = |stops: &str| {
        let out = folder.file("a.png");
        // The background is 1 everywhere.
        let line =
            format!("render furnace --size 8x8 --spp 1 --max-depth 1 --exposure {stops} -o {out}");
        let args = words(&line);
        assert_eq!(run(&args).status.code(), Some(0));
        image::open(&out).unwrap().to_rgb8().get_pixel(0, 0).0[1]
    };
    // sRGB of ½ and ¼.
    assert_eq!((level("-1"), level("-2")), (188, 137));
    assert!(level("0") > 230 && level("auto") > 200);
}

#[test]
fn integrators_answer_to_their_names_in_mitsuba() {
    for (alias, name) in [
        ("path", "pt"),
        ("ptracer", "lt"),
        ("volpath:rr_depth=3", "pt:rr_depth=3"),
        ("direct", "pt:max_depth=2"),
    ] {
        let v = json(&small("cornell-box", &["-i", alias, "--spp", "1", "--no-image", "--json"]));
        assert_eq!(v["integrator"], name);
    }
}

#[test]
fn parameters_reach_the_scene() {
    let args =
        ["render", "cornell-box", "--spp", "1", "-D", "res=20", "-D", "max_depth=1", "--json"];
    let v = json(&args);
    assert_eq!(v["width"], 20);
    // Emission only: the camera ray and nothing else.
    assert_eq!(v["rays"], 400);
    let deeper = json(&[&args[..], &["--max-depth", "2"]].concat());
    assert!(deeper["rays"].as_u64().unwrap() > 400);
}

#[test]
fn the_integrator_of_the_scene_is_the_default() {
    let args = ["render", "cornell-box", "--spp", "1", "--size", "8x8", "-D", "integrator=ptracer"];
    assert_eq!(json(&[&args[..], &["--json"]].concat())["integrator"], "lt");
}

#[test]
fn notes_of_the_reader_are_told_once_and_harmless_ones_where_asked_for() {
    let folder = Folder::new();
    let scene = folder.write(
        "a.xml",
        r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm">
            <integer name="width" value="4"/><integer name="height" value="4"/>
            <boolean name="banner" value="false"/><rfilter type="box"/></film></sensor>
            <shape type="sphere"><point name="center" x="0" y="0" z="-9"/></shape>
            <emitter type="constant"><rgb name="radiance" value="0.5"/></emitter></scene>"#,
    );
    let output = run(&["render", &scene, "--spp", "1", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(stderr(&output), "");
    assert!((last_line(&output)["mean"][0].as_f64().unwrap() - 0.5).abs() < 1e-6);
    let notes = stderr(&run(&["render", &scene, "--spp", "1", "--verbose"]));
    assert!(notes.starts_with("note: ") && notes.contains("a.xml"), "{notes}");
    assert_eq!((notes.lines().count(), notes.matches("banner").count()), (1, 1), "{notes}");
}

#[cfg(unix)]
mod signals {
    use super::*;
    use std::process::Stdio;

    #[test]
    fn ctrl_c_keeps_what_is_rendered() {
        for number in [libc::SIGINT, libc::SIGTERM] {
            let folder = Folder::new();
            let (out, save) = (folder.file("a.exr"), folder.file("save.film"));
            let line = format!(
                "--spp 100000000 -o {out} --checkpoint {save} --checkpoint-every 0.05 --json"
            );
            let child = command()
                .args(small("cornell-box", &words(&line)))
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            // A checkpoint says that the first step is done: there is an image to keep.
            wait_for_change(&save, &None);
            signal(&child, number);
            let output = child.wait_with_output().unwrap();
            assert_eq!(output.status.code(), Some(128 + number), "{}", stderr(&output));
            let v = last_line(&output);
            assert_eq!(v["complete"], false);
            let samples = v["samples_per_pixel"].as_f64().unwrap();
            assert!((1.0..1e8).contains(&samples));
            assert!(stdout(&output).contains(&format!("{samples} samples per pixel")));
            let exr = Exr::read(&out);
            assert!((mean(exr.channel("R")) / v["mean"][0].as_f64().unwrap() - 1.0).abs() < 1e-5);
        }
    }

    /// A disk that is full at the end of a long rendering: files may not grow beyond 1 kB here.
    #[test]
    fn a_full_disk_is_one_clear_error_and_leaves_no_fragments() {
        let folder = Folder::new();
        let script = format!(
            "trap '' XFSZ; ulimit -f 1; exec {} render cornell-box --size 64x64 --spp 1 -o {}",
            env!("CARGO_BIN_EXE_pathspace"),
            folder.file("a.exr")
        );
        let output = std::process::Command::new("sh").args(["-c", &script]).output().unwrap();
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains("a.exr: cannot write: File too large"), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        assert_eq!(folder.list(), Vec::<String>::new());
    }
}
