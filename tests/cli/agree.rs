//! `pathspace agree`: images of any renderer.

use std::process::Output;

use crate::support::*;

/// A grey 16×16 PFM file of mean `mean` with noise that `seed` decides.
fn image(folder: &Folder, name: &str, seed: u32, mean: f32) -> String {
    let mut bytes = b"Pf\n16 16\n-1.0\n".to_vec();
    let mut state = seed.wrapping_mul(0x9e37_79b9) | 1;
    for _ in 0..256 {
        // Marsaglia's xorshift: no two files are alike, and that is all it is for.
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        let noise = 0.9 + 0.2 * (state >> 8) as f32 / (1 << 24) as f32;
        bytes.extend((mean * noise).to_le_bytes());
    }
    folder.write(name, bytes)
}

/// Runs `agree` on six images of mean 1 against five of mean `mean`.
fn agree(folder: &Folder, mean: f32, more: &[&str]) -> Output {
    let a: Vec<String> = (0..6).map(|i| image(folder, &format!("a{i}.pfm"), i, 1.0)).collect();
    let b: Vec<String> =
        (0..5).map(|i| image(folder, &format!("b{i}.pfm"), 100 + i, mean)).collect();
    let mut args = vec!["agree"];
    args.extend(a.iter().map(String::as_str));
    args.push("--against");
    args.extend(b.iter().map(String::as_str));
    args.extend(more);
    run_in(folder.path(), &args)
}

#[test]
fn images_of_one_expectation_agree() {
    let folder = Folder::new();
    let output = agree(&folder, 1.0, &["--json", "--seconds", "1", "2"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let text = stdout(&output);
    assert!(text.starts_with("agree: no difference found; a bias of "), "{text}");
    assert!(text.contains("efficiency of A over B: "), "{text}");
    let found = last_line(&output);
    assert_eq!(found["verdict"], "agree");
    assert!(found["mdb"].as_f64().unwrap() < 0.05);
    assert_eq!(found["sides"][1]["images"], 5);
}

#[test]
fn more_light_differs_and_the_map_shows_it() {
    let folder = Folder::new();
    let output = agree(&folder, 1.1, &["--map", "map.png"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let text = stdout(&output);
    assert!(text.starts_with("differ: the mean over the image differs"), "{text}");
    assert!(text.contains("wrote map.png"), "{text}");
    let picture = image::open(folder.path().join("map.png")).unwrap().to_rgb8();
    // B has more light everywhere: blue.
    let [mut red, mut blue] = [0_u64; 2];
    picture.pixels().for_each(|p| {
        red += u64::from(p.0[0]);
        blue += u64::from(p.0[2]);
    });
    assert!(blue > red, "{red} {blue}");
}

#[test]
fn our_own_renders_by_two_integrators_agree_and_bring_their_seconds() {
    let folder = Folder::new();
    let mut args = vec!["agree".to_owned()];
    for (i, integrator) in ["pt", "bdpt"].iter().enumerate() {
        if i == 1 {
            args.push("--against".into());
        }
        for seed in 1..=5 {
            let file = folder.file(&format!("{integrator}-{seed}.exr"));
            let seed = seed.to_string();
            json(&words(&format!(
                "render furnace --size 16x16 --max-depth 4 -i {integrator} --spp 16 \
                 --seed {seed} -o {file} --json"
            )));
            args.push(file);
        }
    }
    args.push("--json".into());
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let found = json(&args);
    assert_ne!(found["verdict"], "differ");
    assert!(found["sides"][0]["seconds"].as_f64().unwrap() > 0.0);
}

#[test]
fn what_cannot_be_compared_is_one_line() {
    let folder = Folder::new();
    let one = image(&folder, "one.pfm", 1, 1.0);
    let small = folder.write("small.pfm", b"Pf\n1 1\n-1\n\0\0\x80\x3f");
    for (args, word) in [
        (vec!["agree", &one], "--against"),
        (vec!["agree", &one, "--against", &one, &one], "at least 2"),
        (vec!["agree", &one, &one, "--against", &small, &small], "1×1"),
        (vec!["agree", &one, &small, "--against", &one, &one], "small.pfm"),
        (vec!["agree", "gone.exr", "--against", &one], "gone.exr"),
        (vec!["agree", &one, &one, "--against", &one, &one, "--map", "map.jpg"], ".png"),
        (vec!["agree", &one, &one, "--against", &one, &one, "--alpha", "2"], "(0, 1)"),
    ] {
        let output = run_in(folder.path(), &args);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
        assert!(message.starts_with("error: ") && message.contains(word), "{args:?}: {message}");
        assert_eq!(message.lines().count(), 1, "{args:?}: {message}");
    }
}
