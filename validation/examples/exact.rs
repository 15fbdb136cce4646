//! Measures an integrator on every scene with an exact answer, until a given relative bias would be
//! seen:
//!
//!     cargo run --release -p pathspace-validation --example exact -- lt 0.005
//!
//! A third argument leaves only the scenes whose names contain it; a fourth is the most steps
//! (about one sample a pixel) of each of 64 replicates, 1000 otherwise. The bias that can be seen
//! in the end is an estimate itself: aim a tenth below what has to be shown.

use std::process::ExitCode;

use pathspace_integrators::{Defaults, Registry};
use pathspace_validation::exact::{self, Plan};
use pathspace_validation::stats::CompareConfig;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let (spec, mdb) = (arguments.next(), arguments.next().and_then(|m| m.parse::<f64>().ok()));
    let (Some(Ok(spec)), Some(mdb)) = (spec.map(|s| s.parse()), mdb) else {
        eprintln!(
            "usage: exact INTEGRATOR RELATIVE_BIAS [PART_OF_NAME [MOST_STEPS]], such as: exact lt 0.005"
        );
        return ExitCode::from(2);
    };
    let part = arguments.next().unwrap_or_default();
    let config = CompareConfig { tolerance: 5e-6, ..CompareConfig::default() };
    let most = arguments.next().map_or(Ok(1000), |most| most.parse());
    let Ok(most) = most else {
        eprintln!("error: the fourth argument is a number of steps");
        return ExitCode::from(2);
    };
    let plan = Plan { replicates: 64, pilot: 2, mdb, most, ..Plan::default() };
    for scene in exact::all().into_iter().filter(|scene| scene.name.contains(&part)) {
        let defaults = Defaults { rules: scene.rules };
        let integrator = match Registry::builtin().create(&spec, &defaults) {
            Ok(integrator) => integrator,
            Err(error) => {
                eprintln!("error: {error}");
                return ExitCode::from(2);
            }
        };
        match exact::measure(&scene, &*integrator, &plan, &config) {
            Ok(report) => {
                for cell in report.report.cells {
                    let t = &cell.test;
                    println!(
                        "{:32} {:9} {:.7} exact {:.7}  p {:.1e}  detectable bias {:.3} %",
                        scene.name,
                        cell.name,
                        t.mean_a,
                        t.mean_b,
                        t.p,
                        100.0 * t.mdb
                    );
                }
            }
            Err(error) => println!("{:32} {error}", scene.name),
        }
    }
    ExitCode::SUCCESS
}
