//! Measures an integrator on every scene with an exact answer, until a given relative bias would be seen:
//!
//!     cargo run --release -p pathspace-validation --example exact -- lt 0.005
//!
//! A third argument leaves only the scenes whose names contain it.

use std::process::ExitCode;

use pathspace_integrators::{Defaults, Registry};
use pathspace_validation::exact::{self, Plan};
use pathspace_validation::stats::CompareConfig;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let (spec, mdb) = (arguments.next(), arguments.next().and_then(|m| m.parse::<f64>().ok()));
    let (Some(Ok(spec)), Some(mdb)) = (spec.map(|s| s.parse()), mdb) else {
        eprintln!("usage: exact INTEGRATOR RELATIVE_BIAS [PART_OF_NAME], such as: exact lt 0.005");
        return ExitCode::from(2);
    };
    let part = arguments.next().unwrap_or_default();
    let config = CompareConfig { tolerance: 5e-6, ..CompareConfig::default() };
    let plan = Plan { mdb, ..Plan::default() };
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
                for cell in report.cells {
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
