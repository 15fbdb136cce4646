//! Shards and `pathspace merge`.

use crate::support::*;

fn render<'a>(more: &[&'a str]) -> Vec<&'a str> {
    let mut args = vec!["render", "cornell-caustic", "--max-depth", "6"];
    for (option, value) in [("--size", "30x20"), ("-i", "bdpt")] {
        if !more.contains(&option) {
            args.extend([option, value]);
        }
    }
    args.extend(more);
    args
}

/// Runs a command that must fail with one line and exit status 2.
fn failure(args: &[&str]) -> String {
    let output = run(args);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
    assert_eq!(message.lines().count(), 1, "{args:?}: {message}");
    message
}

#[test]
fn merged_shards_are_the_image_in_one_piece() {
    let folder = Folder::new();
    let whole = folder.file("whole.exr");
    let own = ["--spp", "8", "--layers", "length,st"];
    let all = json(&render(&[&own[..], &["-o", &whole, "--json"]].concat()));
    let mut samples = 0.0;
    let shards: Vec<String> = (1..=3)
        .map(|i| {
            let (out, shard) = (folder.file(&format!("{i}.exr")), format!("{i}/3"));
            let v = json(&render(&[&own[..], &["--shard", &shard, "-o", &out, "--json"]].concat()));
            assert_eq!(v["shard"], shard.as_str());
            samples += v["samples_per_pixel"].as_f64().unwrap();
            out
        })
        .collect();
    assert_eq!(samples, 8.0);
    let merge = |name: &str, order: [usize; 3]| {
        let out = folder.file(name);
        let mut args = vec!["merge", "-o", &out, "--json"];
        args.extend(order.iter().map(|i| shards[*i].as_str()));
        let v = json(&args);
        assert_eq!((&v["samples_per_pixel"], &v["rays"]), (&8.0.into(), &all["rays"]));
        assert_eq!((&v["merged"], &v["missing"]), (&[1, 2, 3][..].into(), &serde_json::json!([])));
        Exr::read(&out)
    };
    let (a, b) = (merge("a.exr", [0, 1, 2]), merge("b.exr", [2, 0, 1]));
    assert!(a.channels == b.channels);
    assert_eq!(a.attribute("pathspace.integrator"), "bdpt");
    let whole = Exr::read(&whole);
    assert!(whole.channels.len() > 12);
    let mut equal = 0.0;
    for ((name, x), (other, y)) in a.channels.iter().zip(&whole.channels) {
        assert_eq!(name, other);
        // Sums differ by the rounding of f64 in another order: at most the last bit of an f32 shows it.
        assert!(x.iter().zip(y).all(|(x, y)| x.to_bits().abs_diff(y.to_bits()) <= 1), "{name}");
        equal += x.iter().zip(y).filter(|(x, y)| x == y).count() as f64 / x.len() as f64;
    }
    assert!(equal / a.channels.len() as f64 > 0.999);
}

#[test]
fn missing_shards_are_named_and_can_be_added_later() {
    let folder = Folder::new();
    let files = ["1", "2", "3"].map(|i| {
        let (out, shard) = (folder.file(&format!("{i}.exr")), format!("{i}/3"));
        json(&render(&["--spp", "3", "--shard", &shard, "-o", &out, "--json"]));
        out
    });
    let (two, all) = (folder.file("two.exr"), folder.file("all.exr"));
    let output = run(&["merge", &files[0], &files[2], "-o", &two, "--json"]);
    assert_eq!(stderr(&output).trim(), "warning: shards missing of 3: 2");
    assert_eq!(last_line(&output)["missing"], serde_json::json!([2]));
    // Images and sums alike are names of shards.
    let v = json(&["merge", &two, &folder.file("2.film"), "-o", &all, "--json"]);
    assert_eq!((&v["samples_per_pixel"], &v["missing"]), (&3.0.into(), &serde_json::json!([])));
    let again = failure(&["merge", &all, &files[0], "-o", &two]);
    assert!(again.contains("overlap: both hold shard 1/3"), "{again}");
}

#[test]
fn what_does_not_belong_together_is_one_clear_error() {
    let folder = Folder::new();
    let save = |name: &str, more: &[&str]| {
        let out = folder.file(name);
        json(&render(&[&["--spp", "4", "-o", &out, "--json"], more].concat()));
        out
    };
    let a = save("a.exr", &["--shard", "1/2"]);
    let again = save("again.exr", &["--shard", "1/2"]);
    let seed = save("seed.exr", &["--shard", "2/2", "--seed", "9"]);
    let size = save("size.exr", &["--shard", "2/2", "--size", "20x20"]);
    let scene = save("scene.exr", &["--shard", "2/2", "-D", "spp=5"]);
    let spec = save("spec.exr", &["--shard", "2/2", "-i", "bdpt:s=0..1"]);
    let three = save("three.exr", &["--shard", "2/3"]);
    let plain = save("plain.exr", &[]);
    let text = folder.write("text.film", "nothing");
    let out = folder.file("out.exr");
    for (other, expected) in [
        (&again, "overlap: both hold shard 1/2"),
        (&a, "overlap: both hold shard 1/2"),
        (&seed, "its seed is 9, not 1"),
        (&size, "its size is 20x20, not 30x20"),
        (&scene, "its content of the scene is cornell-caustic ("),
        (&spec, "its integrator is bdpt:s=0..1, not bdpt"),
        (&three, "it is a shard of 3, the other one of 2"),
        (&plain, "plain.exr: is no shard: "),
        (&text, "text.film: is not a checkpoint"),
        (&folder.file("none.exr"), "none.film: cannot read: No such file"),
    ] {
        let message = failure(&["merge", &a, other, "-o", &out]);
        assert!(message.contains(expected), "{message}");
    }
    assert!(failure(&["merge", "-o", &out]).contains("FILE"));
    assert!(failure(&["merge", &a]).contains("--output"));
    assert!(failure(&["merge", &a, "-o", "a.png"]).contains("must end in .exr"));
    assert!(!folder.list().iter().any(|f| f.starts_with("out") || f.starts_with('.')));
}

#[test]
fn shards_that_do_not_exist_are_refused() {
    for (shard, expected) in [
        ("0/4", "expected i/n"),
        ("5/4", "expected i/n"),
        ("half", "expected i/n"),
        ("3/3", "nothing is left for shard 3/3"),
    ] {
        let message = failure(&render(&["--spp", "2", "--shard", shard]));
        assert!(message.contains(expected), "{shard}: {message}");
    }
}
