//! Sweeps an option and plots the efficiency: where roulette should begin.
//!
//! `cargo run --release --example sweep [SCENE [SECONDS]]` writes sweep.svg.

use std::error::Error;
use std::sync::Arc;

use pathspace::benches::Budget;
use pathspace::benches::compare::{Contest, compare};
use pathspace::core::Scene;
use pathspace::core::description::FilmDescription;
use pathspace::integrators::{Defaults, Registry};
use pathspace::scenes::library;
use pathspace::validation::stats::CompareConfig;
use plotters::prelude::*;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap_or("cornell-box".into());
    let seconds = args.next().map_or(Ok(0.2), |s| s.parse())?;
    let mut description = library::find(&name).ok_or("no such scene")?.load(&[])?.description;
    description.film = FilmDescription::new(64, 64);
    let scene = Arc::new(Scene::new(&description)?);

    let depths = [1, 2, 3, 4, 6, 8, 12, 16];
    let registry = Registry::builtin();
    let create = |depth| -> Result<_, Box<dyn Error>> {
        Ok(registry.create(&format!("pt:rr_depth={depth}").parse()?, &Defaults::default())?)
    };
    let integrators = depths.iter().map(create).collect::<Result<Vec<_>, _>>()?;
    let budget = Budget::Seconds(seconds);
    let contest = Contest { scene, integrators, budget, replicates: 8, seed: 1 };
    let result = compare(contest, &CompareConfig::default())?;
    let points: Vec<(f64, f64)> = depths
        .iter()
        .zip(&result.integrators)
        .map(|(d, i)| (f64::from(*d), i.efficiency))
        .collect();

    let root = SVGBackend::new("sweep.svg", (640, 400)).into_drawing_area();
    root.fill(&WHITE)?;
    let top = points.iter().map(|p| p.1).fold(0.0, f64::max) * 1.1;
    let mut chart = ChartBuilder::on(&root)
        .caption(format!("{name}: efficiency 1/(MSE·s) of pt"), ("sans-serif", 18))
        .margin(10)
        .x_label_area_size(40)
        .y_label_area_size(70)
        .build_cartesian_2d(0.0..17.0, 0.0..top)?;
    chart.configure_mesh().x_desc("rr_depth").draw()?;
    chart.draw_series(LineSeries::new(points.clone(), &BLUE))?;
    chart.draw_series(points.iter().map(|p| Circle::new(*p, 4, BLUE.filled())))?;
    root.present()?;
    points.iter().for_each(|(depth, efficiency)| println!("{depth:3} {efficiency:12.1}"));
    Ok(())
}
