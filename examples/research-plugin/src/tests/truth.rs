//! Images: exact answers, the integrators that come with pathspace, threads and resumption.

use std::sync::Arc;

use pathspace::benches::Budget;
use pathspace::benches::compare::{Contest, compare};
use pathspace::core::Scene;
use pathspace::core::film::{Film, Layers};
use pathspace::core::integrator::Integrator;
use pathspace::integrators::{Defaults, Registry};
use pathspace::validation::exact::{self, Plan};
use pathspace::validation::stats::{CompareConfig, Verdict};

use super::{scene, vcm};
use crate::{NAME, Vcm};

fn registry() -> Registry {
    Registry::builtin()
        .with(NAME, "", |spec, defaults| Ok(Box::new(Vcm::from_spec(spec, defaults)?)))
}

/// On a sphere the disk of a merge has exactly the area πr² and flux is uniform. What is lost are
/// directions below the horizon of the merged vertex but not of the photon's, r²/8 of the light in
/// a unit sphere: 3·10⁻⁴ here.
#[test]
fn merging_in_an_integrating_sphere_gives_the_exact_answer() {
    let scenes = exact::all();
    let sphere = scenes.iter().find(|s| s.name.contains("integrating sphere")).unwrap();
    for spec in ["vcm:connect=false,radius=0.05,alpha=1", "vcm:radius=0.05,alpha=1"] {
        let defaults = Defaults { rules: sphere.rules };
        let vcm = registry().create(&spec.parse().unwrap(), &defaults).unwrap();
        let plan =
            Plan { replicates: 12, pilot: 6, most: 6, mdb: 0.02, seed: 4, ..Plan::default() };
        let config = CompareConfig { tolerance: 5e-4, ..CompareConfig::default() };
        let report = exact::measure(sphere, &*vcm, &plan, &config).unwrap().report;
        for cell in &report.cells {
            let t = &cell.test;
            println!(
                "{spec}, {}: {} exact {}, p {}, mdb {}",
                cell.name, t.mean_a, t.mean_b, t.p, t.mdb
            );
            assert!(
                t.p > 1e-5 && t.mdb < 0.03,
                "{spec}, {}: {} for {}",
                cell.name,
                t.mean_a,
                t.mean_b
            );
        }
        assert!(report.cells.len() >= 3);
    }
}

/// Every pair of the specs on a scene must agree.
fn agree(name: &str, res: u32, specs: &[&str], spp: u64) {
    let scene = scene(name, res);
    let defaults = Defaults::default();
    let integrators: Vec<Box<dyn Integrator>> =
        specs.iter().map(|s| registry().create(&s.parse().unwrap(), &defaults).unwrap()).collect();
    let budget = Budget::Samples(spp);
    let contest = Contest { scene, integrators, budget, replicates: 16, seed: 9 };
    let comparison = compare(contest, &CompareConfig::default()).unwrap();
    for pair in comparison.pairs.iter().map(|p| &p.judgement) {
        println!(
            "{name}: {} and {}: {:?}, p {}, mdb {}",
            pair.a, pair.b, pair.verdict, pair.p, pair.mdb
        );
        assert_ne!(pair.verdict, Verdict::Differ, "{name}: {pair:?}");
        assert!(pair.mdb < 0.12, "{name}: {pair:?}");
    }
}

#[test]
fn without_merges_it_is_bidirectional_path_tracing() {
    let specs = ["vcm:merge=false,max_depth=4", "bdpt:max_depth=4", "pt:max_depth=4"];
    for name in ["env-ball", "smooth-shading", "furnace"] {
        agree(name, 24, &specs, 12);
    }
    // Caustics and small lights are not for path tracing.
    for name in ["cornell-box", "cornell-caustic", "thin-lens"] {
        agree(name, 24, &specs[..2], 12);
    }
}

#[test]
fn films_do_not_depend_on_threads_or_interruption() {
    let scene = scene("cornell-caustic", 40);
    let vcm = vcm("vcm:radius=0.02,max_depth=6", None);
    let layers = Layers { length: true, technique: true, class: true, ..Layers::NONE };
    let film = |threads: usize, parts: [u64; 2], scene: &Arc<Scene>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut film = Film::new(scene.film(), layers);
        let mut state = Default::default();
        for steps in parts {
            let mut run = vcm.resume(scene.clone(), 5, &state).unwrap();
            pool.install(|| {
                for _ in 0..steps {
                    run.step(&mut film);
                }
            });
            state = run.save();
        }
        film
    };
    let one = film(1, [3, 0], &scene);
    assert!(one.mean()[0] > 0.0 && one.nonfinite() == 0);
    for other in [film(2, [3, 0], &scene), film(7, [1, 2], &scene)] {
        assert!(one.sums() == other.sums() && one.planes() == other.planes());
    }
}
