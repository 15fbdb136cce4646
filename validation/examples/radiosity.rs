//! Holds integrators to finite elements on a diffuse scene of the library, per path length:
//!
//!     cargo run --release -p pathspace-validation --example radiosity -- cornell-box 0.1 5 0.005 2000 pt bdpt
//!
//! Arguments: scene, edge h of the coarsest elements over the radius of the scene, path lengths,
//! relative bias to be seen, most steps of one sample a pixel for each of 24 replicates of 64 × 64
//! pixels, integrators.

use std::process::ExitCode;
use std::time::Instant;

use pathspace_core::Scene;
use pathspace_integrators::radiosity::{Settings, System};
use pathspace_integrators::{Defaults, Registry};
use pathspace_validation::exact::{self, Plan};
use pathspace_validation::radiosity;
use pathspace_validation::stats::CompareConfig;

fn main() -> ExitCode {
    match run(&std::env::args().skip(1).collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &[String]) -> Result<(), Box<dyn std::error::Error>> {
    let [name, h, lengths, mdb, steps, integrators @ ..] = arguments else {
        return Err("usage: radiosity SCENE H LENGTHS RELATIVE_BIAS STEPS [INTEGRATOR…]".into());
    };
    let (h, lengths, mdb): (f64, u32, f64) = (h.parse()?, lengths.parse()?, mdb.parse()?);
    let steps: u64 = steps.parse()?;
    let settings = Settings { memory: 4096, ..Settings::default() };
    let description = radiosity::of_library(name)?;
    let built = Scene::new(&description)?;
    let coarse = System::new(&built, &Settings { h: Some(h), ..settings })?;
    println!("h = {h}: {} elements, {:?}", coarse.len(), radiosity::defects(&coarse));

    let start = Instant::now();
    let levels = radiosity::Levels::new(&built, lengths, h, &settings)?;
    println!("three levels in {:.1} s", start.elapsed().as_secs_f64());
    let scene = radiosity::scene_of("finite elements", description, &levels);
    println!("length      h         h/2       h/4    extrapolated  uncertainty");
    for (k, e) in scene.expected.iter().enumerate() {
        let [a, b, c] = [0, 1, 2].map(|level: usize| levels.means[level][k]);
        let percent = 100.0 * e.uncertainty / e.mean;
        println!("{:6}  {a:.7} {b:.7} {c:.7}  {:.7}  {percent:.3} %", k + 1, e.mean);
    }
    for spec in integrators {
        let defaults = Defaults { rules: scene.rules };
        let integrator = Registry::builtin().create(&spec.parse()?, &defaults)?;
        let plan = Plan { mdb, most: steps, ..Plan::default() };
        let report = exact::measure(&scene, &*integrator, &plan, &CompareConfig::default())?;
        for cell in report.report.cells {
            let t = &cell.test;
            println!(
                "{spec:8} {:9} {:.7} against {:.7} ({:+.3} %)  p {:.1e}  detectable bias {:.3} %  {:?}",
                cell.name,
                t.mean_a,
                t.mean_b,
                100.0 * (t.mean_a / t.mean_b - 1.0),
                t.p,
                100.0 * t.mdb,
                cell.verdict
            );
        }
    }
    Ok(())
}
