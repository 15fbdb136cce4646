//! L2: integrators against exact answers, per path length.

use pathspace_core::film::Families;
use pathspace_core::random::derive_seed;
use pathspace_integrators::Registry;
use pathspace_validation::exact::{self, ExactScene, Plan};
use pathspace_validation::stats::{CellReport, CompareConfig, holm};

/// Level of each suite as a whole.
const ALPHA: f64 = 1e-5;
/// What geometry in f32 may move a mean by, relative.
const TOLERANCE: f64 = 5e-6;

/// A cell of a scene.
pub type Measured = (String, CellReport);

/// Aims at a detectable bias a little below the one that is held to, with many replicates: the
/// variance that a minimum detectable bias is made of is itself an estimate, known to 18 % from 64.
fn measure(scene: &ExactScene, spec: &str, seed: u64, mdb: f64, cells: &mut Vec<Measured>) {
    let plan =
        Plan { replicates: 64, pilot: 1, most: 750, mdb: 0.84 * mdb, seed, ..Plan::default() };
    measure_as(scene, spec, &plan, cells);
}

/// Measures the cells of a scene by a plan.
pub fn measure_as(scene: &ExactScene, spec: &str, plan: &Plan, cells: &mut Vec<Measured>) {
    let config = CompareConfig { tolerance: TOLERANCE, ..CompareConfig::default() };
    let defaults = pathspace_integrators::Defaults { rules: scene.rules };
    let integrator = Registry::builtin().create(&spec.parse().unwrap(), &defaults).unwrap();
    let report = exact::measure(scene, &*integrator, plan, &config);
    for cell in report.unwrap_or_else(|e| panic!("{}: {e}", scene.name)).report.cells {
        let t = &cell.test;
        println!(
            "{spec} on {}, {}: {:.7} exact {:.7}, p {:.1e}, mdb {:.3} %",
            scene.name,
            cell.name,
            t.mean_a,
            t.mean_b,
            t.p,
            100.0 * t.mdb
        );
        cells.push((format!("{spec} on {}", scene.name), cell));
    }
}

/// Fails where a mean is off or a relative bias of `mdb` could hide.
pub fn judge(cells: &[Measured], mdb: f64) {
    let p = holm(&cells.iter().map(|(_, c)| c.test.p).collect::<Vec<_>>());
    let wrong: Vec<_> = cells
        .iter()
        .zip(&p)
        .filter(|((_, c), p)| **p < ALPHA || c.test.mdb > mdb)
        .map(|((what, c), p)| {
            let t = &c.test;
            let (mean, exact, mdb) = (t.mean_a, t.mean_b, 100.0 * t.mdb);
            format!("{what}, {}: {mean} against {exact}, p {p:.1e}, mdb {mdb:.3} %", c.name)
        })
        .collect();
    assert!(!cells.is_empty() && wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Measures every exact scene with one integrator, but for the caustics of a cup and for media,
/// which have tests of their own.
fn suite(spec: &str, seed: u64, mdb: f64) {
    let apart: Vec<_> = exact::cup::all().into_iter().chain(exact::media::all()).collect();
    let mut scenes = exact::all();
    scenes.retain(|scene| apart.iter().all(|other| other.name != scene.name));
    measure_all(scenes, spec, seed, mdb);
}

fn measure_all(scenes: Vec<ExactScene>, spec: &str, seed: u64, mdb: f64) {
    let mut cells = Vec::new();
    for (index, scene) in scenes.into_iter().enumerate() {
        // Scenes that share numbers would fail together.
        measure(&scene, spec, derive_seed(seed, index as u64), mdb, &mut cells);
    }
    judge(&cells, mdb);
}

#[test]
fn path_tracing_gives_the_exact_answers() {
    suite("pt", 1, 0.005);
}

/// Hitting small lights by chance is slow; the example `exact` measures to any limit.
#[test]
fn path_tracing_without_next_event_gives_the_exact_answers() {
    suite("pt:nee=false", 2, 0.015);
}

#[test]
fn light_tracing_gives_the_exact_answers() {
    suite("lt", 3, 0.02);
}

/// The example `exact` measures to half of that, which takes four times as long.
#[test]
fn bidirectional_path_tracing_gives_the_exact_answers() {
    suite("bdpt", 6, 0.01);
}

/// Measures technique (s, t) alone, which makes all paths of its length where nothing is a delta.
fn single_technique(name: &str, (s, t): (u32, u32), mdb: f64, cells: &mut Vec<Measured>) {
    let mut scenes = exact::all().into_iter();
    let mut scene = scenes.find(|scene| scene.name == name).expect("an exact scene");
    scene.expected.retain(|e| e.length == Some(s + t - 1));
    scene.expected.iter_mut().for_each(|e| e.families = Families::ALL);
    // With the cap at its own length: the last vertex of a walk takes part in the longest paths.
    let spec = format!("bdpt:s={s},t={t},roulette=false,max_depth={}", s + t - 1);
    // Two dozen tests are more than the room for chance is meant for.
    measure(&scene, &spec, derive_seed(7, u64::from(10 * (s + t - 1) + s)), 0.9 * mdb, cells);
}

/// Light that falls into so small a part of the floor is rare; the example `exact` measures to any
/// limit.
#[test]
fn caustics_of_a_cup_have_the_exact_flux() {
    measure_all(exact::cup::all(), "lt", 8, 0.02);
    measure_all(exact::cup::all(), "bdpt", 9, 0.03);
}

/// Where nothing is a delta, every technique alone estimates the whole of its path length.
#[test]
fn each_single_technique_gives_the_exact_answer_of_its_length() {
    let mut cells = Vec::new();
    for name in ["integrating sphere", "concentric spheres"] {
        for k in 2..=4 {
            (0..=k).for_each(|s| single_technique(name, (s, k + 1 - s), 0.01, &mut cells));
        }
    }
    // Both scenes have k + 1 techniques of each length k.
    assert_eq!(cells.len(), 2 * (3 + 4 + 5));
    judge(&cells, 0.01);
}

#[test]
fn light_subpaths_that_hit_the_lens_give_the_exact_answer_of_their_length() {
    let mut cells = Vec::new();
    for k in 1..=3 {
        single_technique("integrating sphere through a lens", (k + 1, 0), 0.02, &mut cells);
    }
    assert_eq!(cells.len(), 3);
    judge(&cells, 0.02);
}

#[test]
fn media_give_the_exact_answers() {
    measure_all(exact::media::all(), "pt", 51, 0.03);
    measure_all(exact::media::all(), "bdpt", 52, 0.03);
    // Connections of points near a sensor that stands in a medium have no finite variance.
    let mut outside = exact::media::all();
    outside.retain(|scene| scene.description.media.sensor.is_none());
    measure_all(outside, "lt", 53, 0.12);
}
