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
        // Sums differ by the rounding of f64 in another order: at most the last bit of an f32 shows
        // it.
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
    let message = failure(&["merge", &files[0], &files[2], "-o", &two]);
    let lacking = "shards missing of 3: 2";
    assert_eq!(message.trim(), format!("error: {lacking}; --partial merges what is there"));
    assert!(!std::path::Path::new(&two).exists());
    let output = run(&["merge", &files[0], &files[2], "-o", &two, "--json", "--partial"]);
    assert_eq!(stderr(&output).trim(), format!("warning: {lacking}"));
    let v = last_line(&output);
    assert_eq!((&v["missing"], &v["complete"]), (&serde_json::json!([2]), &false.into()));
    // Images and sums alike are names of shards.
    let v = json(&["merge", &two, &folder.file("2.film"), "-o", &all, "--json"]);
    assert_eq!((&v["samples_per_pixel"], &v["missing"]), (&3.0.into(), &serde_json::json!([])));
    let again = failure(&["merge", &all, &files[0], "-o", &two]);
    assert!(again.contains("overlap: both hold shard 1/3"), "{again}");
}

#[cfg(unix)]
#[test]
fn shards_that_were_stopped_are_not_taken_for_whole_ones() {
    let folder = Folder::new();
    let (a, b, out) = (folder.file("a.exr"), folder.file("b.film"), folder.file("out.exr"));
    json(&render(&["--spp", "4", "--shard", "1/2", "-o", &a, "--json"]));
    let more = ["--shard", "2/2", "--checkpoint", &b, "--checkpoint-every", "0.01"];
    let child = command()
        .args(render(&[&["--spp", "20000000"][..], &more].concat()))
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    wait_for_change(&b, &None);
    signal(&child, libc::SIGTERM);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(143), "{}", stderr(&output));
    let message = failure(&["merge", &b, "-o", &out]);
    let words: Vec<&str> = message.split("not finished: ").collect();
    assert!(words[1].contains("b.film (") && words[1].contains(" of 10000000 spp)"), "{message}");
    // Measured against the most that was asked for, the first one is short too.
    let message = failure(&["merge", &a, &b, "-o", &out]);
    assert!(message.contains("a.film (2 of 10000000 spp), "), "{message}");
    let v = json(&["merge", &a, &b, "-o", &out, "--partial", "--json"]);
    assert_eq!((&v["complete"], v["short"].as_array().unwrap().len()), (&false.into(), 2));
}

#[test]
fn what_is_merged_is_not_written_over() {
    let folder = Folder::new();
    let files = ["1", "2"].map(|i| {
        let (out, shard) = (folder.file(&format!("{i}.exr")), format!("{i}/2"));
        json(&render(&["--spp", "2", "--shard", &shard, "-o", &out, "--json"]));
        out
    });
    let sums = folder.file("1.film");
    let before = std::fs::read(&sums).unwrap();
    for inputs in [[&files[0], &files[1]], [&sums, &files[1]]] {
        let message = failure(&["merge", inputs[0], inputs[1], "-o", &files[0]]);
        assert!(message.contains("is to be merged, and ") && message.contains("written over it"));
    }
    assert_eq!(std::fs::read(&sums).unwrap(), before);
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
