//! How far production and oracle are apart: the distribution of relative errors of densities,
//! weights, values and G over the paths of every scene of the library.
//!
//! ```text
//! cargo run --release -p pathspace-validation --example numerics [-- PATHS [SCENE…]]
//! ```
//!
//! Production computes densities and weights step by step while it walks, in `f32` where directions
//! and BSDFs are concerned; the oracle takes the finished path. Both see the same vertices, whose
//! positions are rounded to `f32`.

use glam::DVec3;
use pathspace_core::description::FilterKind;
use pathspace_core::film::RecordingSink;
use pathspace_core::integrator::PathEstimator;
use pathspace_core::mis::Heuristic;
use pathspace_core::path::{self, Path, PathRecord, Technique, Vertex, WalkRules, ln_density};
use pathspace_core::random::{Address, RandomStream};
use pathspace_core::{Scene, measure};
use pathspace_integrators::Defaults;
use pathspace_integrators::bdpt::Bdpt;
use pathspace_scenes::library;

/// What is compared.
const KINDS: [&str; 4] = ["density", "weight", "value", "G"];
/// Quantiles that are printed.
const QUANTILES: [f64; 4] = [0.5, 0.99, 0.9999, 1.0];

/// Relative errors of a path: density, weight, value (f w / p), and the largest of G over its
/// edges.
fn errors(scene: &Scene, bdpt: &Bdpt, record: &PathRecord) -> Option<[f64; 4]> {
    let rules = bdpt.rules();
    let (path, k) = (&record.path, record.path.length());
    let techniques = (0..k + 2).map(|s| Technique::new(s, k + 1 - s));
    let ln: Vec<_> = techniques.map(|t| ln_density(scene, path, t, &rules)).collect();
    let own = record.technique.s;
    let density = ln[own]?;
    let weight = bdpt.heuristic.weight_ln(own, &ln);
    let f = path::contribution(scene, path);
    let largest = f64::from(record.value.max_channel());
    let value = f.iter().zip(record.value.to_array()).map(|(f, v)| {
        let expected = (f.ln() - density).exp() * weight;
        (expected - f64::from(v)).abs() / largest
    });
    let g = path.vertices.windows(2).filter_map(|w| geometry_error(&w[0], &w[1]));
    Some([
        (density - record.ln_pdf).exp_m1().abs(),
        (weight - record.weight).abs() / weight.max(f64::MIN_POSITIVE),
        value.fold(0.0, f64::max),
        g.fold(0.0, f64::max),
    ])
}

/// G of the rounded direction of an edge against G of its exact one.
fn geometry_error(a: &Vertex, b: &Vertex) -> Option<f64> {
    let edge: measure::Edge = a.edge_to(b);
    let (p, q) = (a.surface()?, b.surface()?);
    let d: DVec3 = q.p.as_dvec3() - p.p.as_dvec3();
    let rounded = edge.direction().as_dvec3();
    let cos = |n: glam::Vec3| n.as_dvec3().dot(rounded).abs();
    let g = cos(p.n_g) * cos(q.n_g) / d.length_squared();
    Some((g / edge.geometry_term() - 1.0).abs())
}

fn quantile(sorted: &[f64], q: f64) -> f64 {
    let i = ((sorted.len() as f64 * q).ceil() as usize).clamp(1, sorted.len());
    sorted[i - 1]
}

/// A path in a few words.
fn describe(path: &Path) -> String {
    let lengths = path.vertices.windows(2).map(|w| w[0].edge_to(&w[1]));
    let shortest = lengths.clone().map(|e| e.distance2().sqrt()).fold(f64::INFINITY, f64::min);
    let cosines = lengths.map(|e| e.cos_a().min(e.cos_b()));
    let least = cosines.fold(1.0, f64::min);
    format!("length {}, shortest edge {shortest:.1e}, least cosine {least:.1e}", path.length())
}

fn measure_scene(name: &str, scene: &Scene, bdpt: &Bdpt, paths: usize) {
    let mut all: [Vec<f64>; 4] = Default::default();
    let mut worst: Vec<(f64, String)> = Vec::new();
    let (mut without, mut item, mut taken) = (0_usize, 0_u64, 0_usize);
    while taken < paths && item < 40 * paths as u64 {
        let mut sink = RecordingSink::default();
        let mut u = RandomStream::new(Address { seed: 11, step: 0, item });
        bdpt.estimate(scene, None, &mut u, &mut sink);
        item += 1;
        taken += sink.records.len();
        for record in &sink.records {
            let Some(e) = errors(scene, bdpt, record) else {
                without += 1;
                continue;
            };
            for (list, e) in all.iter_mut().zip(e) {
                list.push(e);
            }
            let largest = e[0].max(e[2]);
            if worst.len() < 10 || worst.last().is_some_and(|w| largest > w.0) {
                let s = record.technique.s;
                worst.push((largest, format!("s = {s}, {}", describe(&record.path))));
                worst.sort_by(|a, b| b.0.total_cmp(&a.0));
                worst.truncate(10);
            }
        }
    }
    for (kind, list) in KINDS.iter().zip(&mut all) {
        list.retain(|e| !e.is_nan());
        list.sort_by(f64::total_cmp);
        if list.is_empty() {
            continue;
        }
        let columns: Vec<String> =
            QUANTILES.iter().map(|q| format!("{:.1e}", quantile(list, *q))).collect();
        println!("| {name} | {kind} | {} | {} |", list.len(), columns.join(" | "));
    }
    println!("  {without} paths without a density; the worst:");
    for (error, what) in worst {
        println!("  {error:.1e}: {what}");
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let paths = arguments.next().map_or(Ok(10_000), |a| a.parse())?;
    let wanted: Vec<String> = arguments.collect();
    let rules = WalkRules { max_length: Some(8), rr_depth: 5 };
    let defaults = Defaults { rules };
    let bdpt = Bdpt::from_spec(&"bdpt:heuristic=power".parse()?, &defaults)?;
    debug_assert_eq!(bdpt.heuristic, Heuristic::Power { beta: 2.0 });
    println!("| scene | of | paths | median | 99 % | 99.99 % | largest |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for entry in library::all() {
        if !wanted.is_empty() && !wanted.iter().any(|w| w == entry.name) {
            continue;
        }
        let mut description = entry.load(&[])?.description;
        description.film.filter = FilterKind::Box;
        measure_scene(entry.name, &Scene::new(&description)?, &bdpt, paths);
    }
    Ok(())
}
