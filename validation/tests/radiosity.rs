//! Finite elements: form factors, solutions, and the integrator that reads them.

use std::sync::Arc;

use glam::DVec3;
use pathspace_core::description::{EmitterDescription, FilmDescription};
use pathspace_core::film::{Families, Film, Layers};
use pathspace_core::path::WalkRules;
use pathspace_core::scene::Chart;
use pathspace_core::{Rgb, Scene};
use pathspace_integrators::radiosity::{
    Settings, Solution, SolveError, System, factors, traced_row,
};
use pathspace_integrators::{Defaults, Registry};
use pathspace_validation::exact::{self, ExactLength, ExactScene, Plan, forms};
use pathspace_validation::radiosity::{defects, of_library, solve_directly};
use pathspace_validation::scene_builder::SceneBuilder;
use pathspace_validation::stats::{CompareConfig, Verdict};

fn coarse(elements: u32) -> Settings {
    Settings { elements, samples: 2, ..Settings::default() }
}

/// Two plates, the first of which emits; the view factor from the first to the second.
fn factor_of_plates(add: impl Fn(&mut SceneBuilder, usize)) -> f64 {
    let mut b = SceneBuilder::new(8);
    let grey = b.diffuse(0.5);
    add(&mut b, grey);
    b.description().shapes[0].emission = Some(Rgb::WHITE);
    b.look_at(DVec3::new(0.3, 0.4, 2.0), DVec3::new(0.5, 0.5, 0.0), DVec3::Y, 40.0);
    let scene = Scene::new(&b.finish()).expect("a scene of two plates");
    let system = System::new(&scene, &coarse(60)).expect("two diffuse plates");
    let shape = |i: usize| scene.charts()[system.mesh.elements[i].chart as usize].shape;
    let all = || 0..system.len();
    let first: f64 =
        all().filter(|i| shape(*i) == 0).map(|i| system.mesh.elements[i].open_area()).sum();
    let pairs = all().flat_map(|i| all().map(move |j| (i, j)));
    let exchanged: f64 = pairs
        .filter(|(i, j)| shape(*i) == 0 && shape(*j) == 1)
        .map(|(i, j)| system.exchange[i * system.len() + j])
        .sum();
    exchanged / first
}

#[test]
fn form_factors_of_plates_are_those_of_the_catalogue() {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let parallel = factor_of_plates(|b, grey| {
        b.rectangle(DVec3::ZERO, x, y, grey);
        b.rectangle(z * 0.6, y, x, grey);
    });
    let exact = forms::parallel_rectangles(1.0, 1.0, 0.6);
    assert!((parallel / exact - 1.0).abs() < 3e-3, "{parallel} against {exact}");
    let perpendicular = factor_of_plates(|b, grey| {
        b.rectangle(DVec3::ZERO, x, y, grey);
        b.rectangle(DVec3::ZERO, y, z, grey);
    });
    let exact = forms::perpendicular_rectangles(1.0, 1.0, 1.0);
    assert!((perpendicular / exact - 1.0).abs() < 5e-3, "{perpendicular} against {exact}");
}

fn built(name: &str) -> Arc<Scene> {
    let description = of_library(name).expect("a scene of the library");
    Arc::new(Scene::new(&description).expect("a scene of the library"))
}

#[test]
fn a_closed_room_keeps_its_light() {
    let system = System::new(&built("concentric-spheres"), &coarse(250)).expect("diffuse spheres");
    let defects = defects(&system);
    assert!(defects.row < 0.02 && defects.reciprocity < 1e-12, "{defects:?}");
}

/// The two orders integrate with the outer integral on the one or the other element.
#[test]
fn form_factors_are_reciprocal_where_each_is_computed_by_itself() {
    let scene = built("cornell-box");
    let system = System::new(&scene, &coarse(300)).expect("a diffuse box");
    let (mut off, mut sum) = (0.0, 0.0);
    for i in 0..system.len() {
        for j in (i + 1..system.len()).step_by(3) {
            let a = factors::exchange(&scene, &system.mesh, i, j);
            let b = factors::exchange(&scene, &system.mesh, j, i);
            off += (a - b).abs();
            sum += a;
        }
    }
    assert!(off < 0.05 * sum, "{off} of {sum}");
}

/// Blocks stand on the floor and a lamp hangs a little below the ceiling. What two surfaces
/// exchange is held to rays; what a wrong visibility lets into the blocks shows as elements that
/// see nothing but each other.
#[test]
fn form_factors_are_those_that_rays_find() {
    let scene = built("cornell-box");
    let settings = Settings { h: Some(0.1), ..Settings::default() };
    let system = System::new(&scene, &settings).expect("a diffuse box");
    let (n, charts) = (system.len(), scene.charts());
    let shape = |i: usize| charts[system.mesh.elements[i].chart as usize].shape as usize;
    let count = scene.shapes().len();
    let mut pairs = vec![[0.0; 2]; count * count];
    let (mut square, mut area) = (0.0, 0.0);
    for i in 0..n {
        let row = &system.exchange[i * n..(i + 1) * n];
        let traced = traced_row(&scene, &system.mesh, i, 8000, 3);
        for (j, (by_rule, by_rays)) in row.iter().zip(&traced).enumerate() {
            let pair = &mut pairs[shape(i).min(shape(j)) * count + shape(i).max(shape(j))];
            pair[0] += by_rule;
            pair[1] += by_rays;
        }
        let open = system.mesh.elements[i].open_area();
        let off = (row.iter().sum::<f64>() - traced.iter().sum::<f64>()) / open;
        square += open * off * off;
        area += open;
    }
    let [by_rule, by_rays] = [0, 1].map(|k: usize| pairs.iter().map(|p| p[k]).sum::<f64>());
    assert!((by_rule / by_rays - 1.0).abs() < 4e-3, "{by_rule} against {by_rays}");
    let root = (square / area).sqrt();
    assert!(root < 0.03, "row sums off by {root}");
    for (k, [by_rule, by_rays]) in pairs.iter().copied().enumerate() {
        // A ray's share of all rays is 10⁻⁶ of what is exchanged.
        let bound = 0.02 * by_rays + 2e-4;
        let (a, b) = (k / count, k % count);
        assert!((by_rule - by_rays).abs() < bound, "{a} and {b}: {by_rule} against {by_rays}");
    }
    // The blocks are convex: what they exchange with themselves is inside.
    for block in [6, 7] {
        assert_eq!(pairs[block * count + block], [0.0; 2], "block {block}");
    }
}

/// With one mesh, to the 1 % that its elements are off by: three meshes are too slow for a test.
#[test]
fn path_tracing_agrees_per_bounce_in_a_box_with_blocks() {
    let mut description = of_library("cornell-box").expect("a scene of the library");
    description.film = FilmDescription::new(32, 32);
    let rules = WalkRules { max_length: Some(5), rr_depth: u32::MAX };
    let create = |spec: &str| {
        let spec = spec.parse().expect("a spec");
        Registry::builtin().create(&spec, &Defaults { rules }).expect("a builtin")
    };
    let scene = Arc::new(Scene::new(&description).expect("a scene of the library"));
    let mut run = create("radiosity:h=0.1").start(scene.clone(), 5).expect("a diffuse scene");
    let mut film = Film::new(scene.film(), Layers { length: true, ..Layers::NONE });
    for _ in 0..500 {
        run.step(&mut film);
    }
    let expected = (2..=5).map(|length| {
        let e = ExactLength::new(length, 0.0, Families::ALL);
        let mean = e.observe(&film);
        ExactLength { mean, uncertainty: 0.01 * mean, ..e }
    });
    let scene =
        ExactScene { name: "box with blocks", description, rules, expected: expected.collect() };
    let plan = Plan { replicates: 16, mdb: 0.03, seed: 11, ..Plan::default() };
    let report = exact::measure(&scene, &*create("pt"), &plan, &CompareConfig::default());
    let report = report.expect("a diffuse scene").report;
    assert_eq!(report.verdict, Verdict::Agree, "{:#?}", report.cells);
}

#[test]
fn series_iteration_and_elimination_have_one_solution() {
    let scene = built("cornell-box");
    let solution = Solution::new(&scene, &coarse(200), None).expect("a diffuse box");
    let system = &solution.system;
    let emission = system.emission(0);
    let direct = solve_directly(system, &emission).expect("a regular matrix");
    let iterated = system.gauss_seidel(&emission, 1e-12).expect("a contraction");
    let largest = direct.iter().flatten().copied().fold(0.0, f64::max);
    for (i, direct) in direct.iter().enumerate() {
        for c in 0..3 {
            let series: f64 = solution.bounces[0].iter().map(|b| b[i][c]).sum();
            assert!((series - direct[c]).abs() < 1e-6 * largest, "{series} and {}", direct[c]);
            assert!((iterated[i][c] - direct[c]).abs() < 1e-9 * largest);
        }
    }
}

#[test]
fn concentric_spheres_have_the_known_radiosities() {
    let solution = Solution::new(&built("concentric-spheres"), &coarse(250), Some(4));
    let solution = solution.expect("diffuse spheres");
    let elements = &solution.system.mesh.elements;
    // B⁽ⁿ⁾ = (ρF)ⁿE with F₁₂ = 1, F₂₁ = ¼, F₂₂ = ¾.
    let mut exact = [1.0, 0.0];
    for terms in &solution.bounces[0] {
        for (inner, exact) in [(true, exact[0]), (false, exact[1])] {
            let of = elements.iter().zip(terms).filter(|(e, _)| e.emission.is_some() == inner);
            let (area, power) = of.fold((0.0, 0.0), |(area, power), (e, b)| {
                (area + e.open_area(), power + e.open_area() * b[0])
            });
            assert!((power / area - exact).abs() < 0.01, "{} against {exact}", power / area);
        }
        exact = [0.3 * exact[1], 0.6 * (0.25 * exact[0] + 0.75 * exact[1])];
    }
}

#[test]
fn the_integrator_gives_the_exact_answers_of_enclosures() {
    let defaults = |rules| Defaults { rules };
    let names = ["concentric spheres", "integrating sphere"];
    for mut scene in exact::all().into_iter().filter(|s| names.contains(&s.name)) {
        for e in &mut scene.expected {
            // What coarse elements are off by.
            e.uncertainty = 0.012 * e.mean;
        }
        let spec = "radiosity:elements=250,samples=2".parse().expect("a spec");
        let integrator =
            Registry::builtin().create(&spec, &defaults(scene.rules)).expect("radiosity");
        // Each replicate solves the system anew: no pilot.
        let plan = Plan { replicates: 16, most: 4, mdb: 0.03, seed: 11, ..Plan::default() };
        let report = exact::measure(&scene, &*integrator, &plan, &CompareConfig::default());
        let report = report.expect("a diffuse scene").report;
        assert_eq!(report.verdict, Verdict::Agree, "{}: {:#?}", scene.name, report.cells);
    }
}

/// Else the mean of a cell of the ceiling would be over what the lamp hides and what it does not.
#[test]
fn no_element_reaches_under_the_outline_of_a_lamp_close_to_it() {
    let scene = built("cornell-box");
    let system = System::new(&scene, &coarse(200)).expect("a diffuse box");
    let (charts, mesh) = (scene.charts(), &system.mesh);
    let lamp = mesh.elements.iter().find(|e| e.emission.is_some()).expect("a lamp").chart;
    let lamp = &charts[lamp as usize];
    let onto = |chart: &Chart, p: DVec3| chart.position(chart.locate(p.as_vec3()));
    let center = lamp.position([0.5; 2]);
    let near = |chart: &&Chart| (1e-4..0.02).contains(&onto(chart, center).distance(center));
    let ceiling = charts.iter().find(near).expect("a ceiling");
    for side in [[0.0, 0.5], [1.0, 0.5], [0.5, 0.0], [0.5, 1.0]] {
        let border = lamp.position(side);
        let [inside, outside] = [0.01, -0.01].map(|step| {
            let at = ceiling.locate((border + (center - border) * step).as_vec3());
            let point = scene.chart_point(ceiling, at);
            mesh.find(&point, (center - onto(ceiling, center)).as_vec3()).expect("an element")
        });
        assert_ne!(inside, outside, "{side:?}");
    }
}

/// Light does not leak into blocks: neither insides nor what a block stands on are elements.
#[test]
fn what_a_block_covers_has_no_element() {
    let mut b = SceneBuilder::new(8);
    let grey = b.diffuse(0.5);
    b.rectangle(DVec3::new(-1.0, -1.0, 0.0), DVec3::X * 2.0, DVec3::Y * 2.0, grey);
    b.sphere(DVec3::ZERO, 0.5, grey).flip_normals = true;
    let light = b.rectangle(DVec3::new(-1.0, -1.0, 2.0), DVec3::Y * 2.0, DVec3::X * 2.0, grey);
    light.emission = Some(Rgb::WHITE);
    b.look_at(DVec3::new(0.0, -3.0, 1.0), DVec3::ZERO, DVec3::Z, 40.0);
    let scene = Scene::new(&b.finish()).expect("a scene");
    let system = System::new(&scene, &coarse(400)).expect("a diffuse scene");
    let charts = scene.charts();
    let shape = |i: usize| charts[system.mesh.elements[i].chart as usize].shape;
    assert!((0..system.len()).all(|i| shape(i) != 1));
    let floor = (0..system.len()).filter(|i| shape(*i) == 0);
    let area: f64 = floor.map(|i| system.mesh.elements[i].open_area()).sum();
    let scale = scene.normalisation().scale;
    let open = (4.0 - std::f64::consts::PI * 0.25) * scale * scale;
    assert!((area / open - 1.0).abs() < 0.03, "{area} against {open}");
}

fn reason(scene: &Scene, settings: Settings) -> String {
    System::new(scene, &settings).err().map(|e| e.to_string()).unwrap_or_default()
}

#[test]
fn what_is_not_diffuse_is_refused_by_name() {
    let glass = reason(&built("glass-egg"), Settings::default());
    assert!(glass.contains("is not diffuse") || glass.contains("shading normals"), "{glass}");
    let mut b = SceneBuilder::new(8);
    let grey = b.diffuse(0.5);
    b.sphere(DVec3::ZERO, 1.0, grey);
    b.emitter(EmitterDescription::Point { position: DVec3::Z * 2.0, intensity: Rgb::WHITE });
    b.look_at(DVec3::new(0.0, -3.0, 0.0), DVec3::ZERO, DVec3::Z, 40.0);
    let scene = Scene::new(&b.finish()).expect("a scene");
    assert!(reason(&scene, Settings::default()).contains("is not a surface"));
}

#[test]
fn a_matrix_that_does_not_fit_is_refused_before_it_is_made() {
    let scene = built("cornell-box");
    let settings = Settings { h: Some(0.01), memory: 64, ..Settings::default() };
    assert!(matches!(System::new(&scene, &settings), Err(SolveError::TooLarge { .. })));
    let message = reason(&scene, settings);
    assert!(message.contains("whose matrix fits"), "{message}");
}
