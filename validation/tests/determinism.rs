//! Films are the same to the bit for any number of threads, and for one run or stop and resume.

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::description::{FilmDescription, FilterKind};
use pathspace_core::film::{Film, Layers};
use pathspace_core::integrator::Integrator;
use pathspace_integrators::{Defaults, Registry};

use crate::models;

const LAYERS: Layers =
    Layers { length: true, technique: true, unweighted: true, emitter: true, class: true };

fn scene() -> Arc<Scene> {
    let mut description = models::emitters_and_lens();
    let film = FilmDescription::new(70, 50);
    description.film = FilmDescription { filter: FilterKind::Tent { radius: 1.3 }, ..film };
    Arc::new(models::build(&description))
}

fn integrators() -> Vec<Box<dyn Integrator>> {
    [
        "pt",
        "pt:nee=false",
        "lt",
        "bdpt:max_depth=4",
        "mmlt:bootstrap=3000,chains=200,max_depth=5",
        "rjmlt:bootstrap=3000,chains=90,max_depth=4,jump=0.4",
        "mlt:max_depth=5,chains=40,bootstrap=3000,target=two-stage",
        "erpt:seeds=bdpt,mutations=20",
        "pssmlt:bootstrap=3000,chains=77,stratify=true",
        "pssmlt:over=pt,bootstrap=3000,kernel=gaussian,mis=false,rounds=one,target=two-stage",
    ]
    .map(|spec| Registry::builtin().create(&spec.parse().unwrap(), &Defaults::default()).unwrap())
    .into()
}

fn same(a: &Film, b: &Film) -> bool {
    a.sums() == b.sums()
        && a.planes() == b.planes()
        && a.samples() == b.samples()
        && a.nonfinite() == b.nonfinite()
}

#[test]
fn films_do_not_depend_on_the_number_of_threads() {
    let scene = scene();
    for integrator in integrators() {
        let film = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut film = Film::new(scene.film(), LAYERS);
            let mut run = integrator.start(scene.clone(), 5).unwrap();
            pool.install(|| {
                for _ in 0..3 {
                    run.step(&mut film);
                }
            });
            film
        };
        let one = film(1);
        assert!(one.planes().len() > 10 && one.mean()[0] > 0.0);
        for threads in [2, 7] {
            assert!(same(&one, &film(threads)), "{} on {threads} threads", integrator.spec());
        }
    }
}

#[test]
fn resumed_runs_go_on_to_the_bit() {
    let scene = scene();
    for integrator in integrators() {
        let (mut whole, mut parts) =
            (Film::new(scene.film(), LAYERS), Film::new(scene.film(), LAYERS));
        let mut run = integrator.start(scene.clone(), 9).unwrap();
        for _ in 0..4 {
            run.step(&mut whole);
        }
        let mut run = integrator.start(scene.clone(), 9).unwrap();
        run.step(&mut parts);
        let state = run.save();
        let mut run = integrator.resume(scene.clone(), 9, &state).unwrap();
        for _ in 0..3 {
            run.step(&mut parts);
        }
        assert!(same(&whole, &parts), "{}", integrator.spec());
        assert_eq!(run.save().step, 4);
    }
}

#[test]
fn other_seeds_give_other_films() {
    let scene = scene();
    for integrator in integrators() {
        let film = |seed| {
            let mut film = Film::new(scene.film(), Layers::NONE);
            integrator.start(scene.clone(), seed).unwrap().step(&mut film);
            film
        };
        assert!(film(1).sums() != film(2).sums(), "{}", integrator.spec());
    }
}

#[test]
fn a_step_that_is_sought_is_the_one_that_its_turn_brings() {
    let scene = scene();
    let mut sought = Vec::new();
    for integrator in integrators() {
        let films = || (Film::new(scene.film(), LAYERS), Film::new(scene.film(), LAYERS));
        let ((mut turn, mut earlier), (mut alone, _)) = (films(), films());
        let mut run = integrator.start(scene.clone(), 9).unwrap();
        run.step(&mut earlier);
        run.step(&mut turn);
        let mut run = integrator.start(scene.clone(), 9).unwrap();
        if run.seek(1) {
            run.step(&mut alone);
            assert!(same(&turn, &alone), "{}", integrator.spec());
            sought.push(integrator.name().to_owned());
        }
    }
    assert_eq!(sought, ["pt", "pt", "lt", "bdpt", "erpt"]);
}
