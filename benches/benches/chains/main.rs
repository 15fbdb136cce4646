//! Mutations per second and rays per mutation of the chains, bootstrap apart.
//!
//! ```text
//! cargo bench -p pathspace-benches --bench chains [-- INTEGRATOR…]
//! ```
//!
//! One thread, 64×64, four library scenes, bootstrap of 20 000 samples. `pt` and `bdpt` stand
//! beside them: there a mutation is a sample. Of five passes the one in the middle counts.

use std::sync::Arc;
use std::time::Instant;

use pathspace_core::Scene;
use pathspace_core::description::FilmDescription;
use pathspace_core::driver::Work;
use pathspace_core::film::{Film, Layers};
use pathspace_core::integrator::Run;
use pathspace_integrators::{Defaults, Registry};
use pathspace_scenes::library;

const SCENES: [&str; 4] = ["cornell-box", "ring-caustic", "glass-egg", "water-pool"];

const INTEGRATORS: [&str; 9] = [
    "pt",
    "bdpt",
    "pssmlt:over=pt,bootstrap=20000",
    "pssmlt:bootstrap=20000",
    "mmlt:bootstrap=20000",
    "rjmlt:bootstrap=20000",
    "mlt:bootstrap=20000",
    "mlt:bootstrap=20000,bidir=0",
    "erpt",
];

const PASSES: usize = 5;
/// Seconds of a pass, at least.
const SECONDS: f64 = 0.4;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let chosen: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let integrators = match &chosen[..] {
        [] => INTEGRATORS.map(str::to_owned).to_vec(),
        _ => chosen,
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    println!("{:<34} {:<14} {:>8} {:>8} {:>10}", "", "", "M/s", "µs", "rays");
    for spec in &integrators {
        for name in SCENES {
            let loaded = library::find(name).ok_or("no such scene")?.load(&[])?;
            let mut description = loaded.description;
            description.film = FilmDescription::new(64, 64);
            let scene = Arc::new(Scene::new(&description)?);
            let integrator = Registry::builtin().create(&spec.parse()?, &Defaults::default())?;
            let mut film = Film::new(scene.film(), Layers::NONE);
            let mut run = integrator.start(scene.clone(), 1)?;
            let (mut rates, mut all) = (Vec::new(), Work::default());
            pool.install(|| {
                run.prepare(&mut film);
                run.step(&mut film);
                for _ in 0..PASSES {
                    let (rate, work) = pass(&mut *run, &mut film);
                    rates.push(rate);
                    all += work;
                }
            });
            rates.sort_by(f64::total_cmp);
            let rate = rates[PASSES / 2];
            let rays = all.rays as f64 / all.samples as f64;
            println!("{spec:<34} {name:<14} {:>8.3} {:>8.2} {rays:>10.2}", rate * 1e-6, 1e6 / rate);
        }
    }
    Ok(())
}

/// Mutations per second of as many steps as fill [`SECONDS`], and what they did.
fn pass(run: &mut dyn Run, film: &mut Film) -> (f64, Work) {
    let (begun, mut work) = (Instant::now(), Work::default());
    while begun.elapsed().as_secs_f64() < SECONDS {
        work += run.step(film);
    }
    (work.samples as f64 / begun.elapsed().as_secs_f64(), work)
}
