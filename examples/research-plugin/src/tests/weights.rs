//! Weights of every technique of given paths by the code that renders, against the slow form; their
//! sum is 1.

use pathspace::core::Scene;
use pathspace::core::film::RecordingSink;
use pathspace::core::glam::Vec2;
use pathspace::core::path::{self, Path, PathRecord};
use pathspace::core::random::{Address, RandomStream};
use pathspace::core::scene::DirectSample;
use pathspace::core::walk::{Walk, WalkVertex};

use super::slow::{self, RULES, Way};
use super::{scene, vcm};
use crate::Vcm;
use crate::merge::Merger;
use crate::photons::PhotonGrid;
use crate::run::At;

/// Light subpaths that are merged with.
const N: u64 = 1500;
const RADIUS: f64 = 0.02;
const SCENES: [&str; 9] = [
    "cornell-caustic",
    "glass-egg",
    "glass-lamp",
    "water-pool",
    "ring-caustic",
    "env-ball",
    "smooth-shading",
    "thin-lens",
    "ajar-door",
];

/// What one step makes, whole.
fn paths(scene: &Scene, vcm: &Vcm, sensors: u64) -> (Vec<PathRecord>, RecordingSink) {
    let at = At::new(vcm, scene, N, RADIUS);
    let mut sink = RecordingSink::default();
    let stream = |seed, item| RandomStream::new(Address { seed, step: 0, item });
    let light: Vec<_> = (0..N).map(|item| at.light(&mut stream(3, item), &mut sink)).collect();
    let photons = vcm.merge.then(|| PhotonGrid::new(&light, RADIUS as f32));
    for item in 0..sensors {
        let own = &light[item as usize];
        let all = (light.as_slice(), photons.as_ref());
        at.sensor(None, own, all, &mut stream(4, item), &mut sink);
    }
    (sink.records.clone(), sink)
}

/// Weights of all ways to make a path by production code.
fn production(scene: &Scene, at: &At<'_>, path: &Path) -> Vec<(Way, f64)> {
    let (walks, k, v) = (&at.walks, path.length(), &path.vertices);
    let emitter = v[0].emitter().unwrap();
    let delta = scene.emitters().get(emitter).is_delta();
    let light = Walk { weights: walks.light.weights.for_emitter(delta), ..walks.light };
    let (light, sensor) = (light.lay(scene, path), walks.sensor.lay(scene, path));
    let ends = |side: &[WalkVertex]| side.last().is_none_or(WalkVertex::ends);
    let mut made = Vec::new();
    for s in 0..=k {
        let t = k + 1 - s;
        if light.len() < s || sensor.len() < t || (s == 0 && delta) {
            continue;
        }
        let (mut y, mut z) = (&light[..s], &sensor[..t]);
        if s > 0 && !(ends(y) && ends(z)) {
            continue;
        }
        let (x0, lens);
        if s == 1 && t >= 2 {
            let radiance = scene.emitted_from(&v[0], v[0].edge_to(&v[1]).direction());
            let pdf = scene.pdf_direct(v[1].position().unwrap(), &v[0]);
            let direct = DirectSample { vertex: v[0], emitter, radiance, pdf };
            x0 = [WalkVertex::next_event(scene, &direct)];
            y = &x0;
        }
        if t == 1 {
            lens = [WalkVertex::on_lens(v[k], scene.sensor().pdf_vertex())];
            z = &lens;
        }
        let connection = walks.connect(scene, y, z).filter(|c| c.is_visible(scene));
        made.extend(connection.map(|c| (Way::Connect { s }, c.weight(scene, walks))));
    }
    let mut sink = RecordingSink::default();
    let merger = Merger { scene, walks, eta: at.eta, film: Vec2::ZERO };
    for i in 1..k {
        let t = k + 1 - i;
        if light.len() <= i || sensor.len() < t || !sensor[t - 1].ends() || !(at.eta > 0.0) {
            continue;
        }
        let before = sink.records.len();
        merger.merge_one(&light[..=i], &sensor[..t], &mut sink);
        if sink.records.len() > before {
            made.push((Way::Merge { i }, sink.records[before].weight));
        }
    }
    made
}

/// How far rounding of positions may move a weight: a direction errs by 2⁻²⁴ over the length of its
/// edge, more at grazing angles.
fn tolerance(path: &Path) -> f64 {
    let edges = path.vertices.windows(2).map(|w| w[0].edge_to(&w[1]));
    let shortest = edges.map(|e| e.distance2().sqrt() * e.cos_a().min(e.cos_b()));
    1e-4 + 64.0 / 16_777_216.0 / shortest.fold(1.0, f64::min)
}

fn check(spec: &str, beta: f64, scenes: &[&str]) {
    let vcm = vcm(spec, Some(9));
    let mut merged = 0;
    for name in scenes {
        let scene = scene(name, 32);
        let pinhole = scene.sensor().is_pinhole();
        let at = At::new(&vcm, &scene, N, RADIUS);
        // Paths with exact vertices: those of merges have one of two.
        let every = super::vcm("vcm:merge=false", Some(9));
        let (mut records, _) = paths(&scene, &every, 120);
        records.truncate(600);
        let (mut weights, mut sums, mut off, mut blocked) = (0, 0, 0, 0);
        for record in &records {
            let path = &record.path;
            let ways = slow::ln_densities(&scene, &vcm, at.eta, path);
            let expected = slow::weights(&ways, beta);
            let made = production(&scene, &at, path);
            let tolerance = tolerance(path);
            for (way, weight) in &made {
                let oracle = expected.iter().find(|(w, _)| w == way).map_or(0.0, |(_, w)| *w);
                off += usize::from(!((weight - oracle).abs() <= tolerance));
                weights += 1;
                merged += usize::from(matches!(way, Way::Merge { .. }));
            }
            // Edges seen from one side only, and lenses, whose point t = 1 samples anew, leave ways
            // out.
            if made.len() == ways.len() && pinhole {
                let sum: f64 = made.iter().map(|(_, w)| w).sum();
                off += usize::from(!((sum - 1.0).abs() <= tolerance));
                sums += 1;
            } else {
                blocked += 1;
            }
        }
        println!(
            "{spec}, {name}: {} paths, {weights} weights, {sums} sums, {off} off, {blocked} not whole",
            records.len()
        );
        assert!(weights > 0 && off * 1000 <= weights + sums, "{spec}, {name}: {off} of {weights}");
        assert!(!pinhole || blocked * 50 <= sums, "{spec}, {name}: {blocked} not whole");
    }
    assert!(merged > 1000 || !vcm.merge, "{merged}");
}

#[test]
fn weights_of_connections_and_merges_equal_the_slow_form_and_sum_to_one() {
    check("vcm", 1.0, &SCENES);
}

#[test]
fn weights_by_the_power_heuristic_equal_the_slow_form_and_sum_to_one() {
    check("vcm:heuristic=power", 2.0, &SCENES[..3]);
}

#[test]
fn weights_without_connections_equal_the_slow_form_and_sum_to_one() {
    check("vcm:connect=false", 1.0, &SCENES[..3]);
}

#[test]
fn weights_without_merges_equal_the_slow_form_and_sum_to_one() {
    check("vcm:merge=false", 1.0, &SCENES[..3]);
}

#[test]
fn contributions_are_the_weighted_measurement_over_the_density() {
    for name in ["cornell-caustic", "smooth-shading", "env-ball", "thin-lens"] {
        let vcm = vcm("vcm:merge=false", Some(7));
        let scene = scene(name, 32);
        let (records, sink) = paths(&scene, &vcm, 300);
        let (mut checked, mut off) = (0, 0);
        for (record, contribution) in records.iter().zip(&sink.contributions) {
            let path = &record.path;
            assert_eq!(contribution.length() as usize, path.length());
            assert_eq!(contribution.families, path::families(&scene, path, &RULES));
            let tolerance = tolerance(path);
            let ways = slow::ln_densities(&scene, &vcm, 0.0, path);
            let own = Way::Connect { s: record.technique.s };
            let Some((_, ln)) = ways.iter().find(|(way, _)| *way == own) else {
                off += 1;
                continue;
            };
            let weights = slow::weights(&ways, 1.0);
            let weight = weights.iter().find(|(way, _)| *way == own).map_or(0.0, |(_, w)| *w);
            let f = path::contribution(&scene, path);
            let expected = f.map(|f| f * record.weight * (-record.ln_pdf).exp());
            let largest = expected.iter().copied().fold(0.0, f64::max);
            let value = record.value.to_array();
            let errors = [
                (ln - record.ln_pdf).abs(),
                (weight - record.weight).abs(),
                (0..3).map(|c| (expected[c] - value[c] as f64).abs() / largest).fold(0.0, f64::max),
            ];
            off += usize::from(errors.iter().any(|e| !(*e <= 10.0 * tolerance)));
            checked += 1;
        }
        println!("{name}: {checked} paths, {off} off");
        assert!(checked > 150, "{name}: {checked}");
        assert!(off * 200 <= checked, "{name}: {off} of {checked}");
    }
}

#[test]
fn merged_paths_have_the_length_and_the_families_of_their_vertices() {
    for name in ["cornell-caustic", "glass-lamp"] {
        let scene = scene(name, 32);
        let made = |spec| paths(&scene, &vcm(spec, Some(7)), 200);
        let (records, sink) = made("vcm");
        let (connected, _) = made("vcm:merge=false");
        assert!(records.len() > connected.len() + 100, "{name}: {}", records.len());
        for (record, contribution) in records.iter().zip(&sink.contributions) {
            assert_eq!(contribution.length() as usize, record.path.length());
            assert_eq!(contribution.families, path::families(&scene, &record.path, &RULES));
        }
    }
}
