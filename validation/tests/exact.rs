//! L2: integrators against exact answers, per path length.

use std::time::Instant;

use pathspace_core::random::derive_seed;
use pathspace_integrators::Registry;
use pathspace_validation::exact::{self, Plan};
use pathspace_validation::stats::{CellReport, CompareConfig, holm};

/// Level of each suite as a whole.
const ALPHA: f64 = 1e-5;
/// What geometry in f32 may move a mean by, relative.
const TOLERANCE: f64 = 5e-6;

/// Measures every exact scene with one integrator and fails where a mean is off or a relative bias of `mdb` could hide.
fn suite(spec: &str, seed: u64, mdb: f64) {
    let config = CompareConfig { tolerance: TOLERANCE, ..CompareConfig::default() };
    let mut cells: Vec<(&str, CellReport)> = Vec::new();
    for (index, scene) in exact::all().into_iter().enumerate() {
        // Scenes that share numbers would fail together.
        let plan = Plan { seed: derive_seed(seed, index as u64), mdb, ..Plan::default() };
        let defaults = pathspace_integrators::Defaults { rules: scene.rules };
        let integrator = Registry::builtin().create(&spec.parse().unwrap(), &defaults).unwrap();
        let start = Instant::now();
        let report = exact::measure(&scene, &*integrator, &plan, &config);
        let report = report.unwrap_or_else(|e| panic!("{}: {e}", scene.name));
        if !report.cells.is_empty() {
            println!("{spec} on {}: {:.2} s", scene.name, start.elapsed().as_secs_f64());
        }
        for cell in report.cells {
            let t = &cell.test;
            println!(
                "    {:9} {:.7} exact {:.7}, p {:.1e}, mdb {:.3} %",
                cell.name,
                t.mean_a,
                t.mean_b,
                t.p,
                100.0 * t.mdb
            );
            cells.push((scene.name, cell));
        }
    }
    let p = holm(&cells.iter().map(|(_, c)| c.test.p).collect::<Vec<_>>());
    let wrong: Vec<_> = cells
        .iter()
        .zip(&p)
        .filter(|((_, c), p)| **p < ALPHA || c.test.mdb > mdb)
        .map(|((scene, c), p)| {
            let t = &c.test;
            let (mean, exact, mdb) = (t.mean_a, t.mean_b, 100.0 * t.mdb);
            format!("{scene}, {}: {mean} against {exact}, p {p:.1e}, mdb {mdb:.3} %", c.name)
        })
        .collect();
    assert!(wrong.is_empty(), "{spec}:\n{}", wrong.join("\n"));
}

#[test]
fn path_tracing_gives_the_exact_answers() {
    suite("pt", 1, 0.005);
}

/// Hitting small lights by chance is slow: the sharp tests of this and of light tracing take minutes.
#[test]
fn path_tracing_without_next_event_gives_the_exact_answers() {
    suite("pt:nee=false", 2, 0.015);
}

#[test]
fn light_tracing_gives_the_exact_answers() {
    suite("lt", 3, 0.02);
}

#[test]
#[ignore = "minutes"]
fn path_tracing_without_next_event_gives_the_exact_answers_to_half_a_percent() {
    suite("pt:nee=false", 4, 0.005);
}

#[test]
#[ignore = "minutes"]
fn light_tracing_gives_the_exact_answers_to_half_a_percent() {
    suite("lt", 5, 0.005);
}
