//! A sink of one's own: how many paths of each length an estimator makes, and how much light they
//! bring.
//!
//! `cargo run --release --example length_histogram [SCENE]`

use std::collections::BTreeMap;
use std::error::Error;

use pathspace::core::Scene;
use pathspace::core::color::luminance;
use pathspace::core::film::{Contribution, Sink};
use pathspace::core::integrator::PathEstimator;
use pathspace::core::random::{Address, RandomStream};
use pathspace::integrators::Defaults;
use pathspace::integrators::pt::PathTracer;
use pathspace::scenes::library;

/// Paths and luminance by length.
#[derive(Default)]
struct LengthHistogram(BTreeMap<u16, (u64, f64)>);

impl Sink for LengthHistogram {
    fn add(&mut self, c: Contribution) {
        let (paths, light) = self.0.entry(c.length()).or_default();
        *paths += 1;
        *light += luminance(&c.value.to_array().map(f64::from));
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let name = std::env::args().nth(1).unwrap_or("cornell-box".into());
    let loaded = library::find(&name).ok_or("no such scene")?.load(&[])?;
    let scene = Scene::new(&loaded.description)?;
    let pt = PathTracer::from_spec(&"pt".parse()?, &Defaults::default())?;

    let samples = 100_000;
    let mut histogram = LengthHistogram::default();
    for item in 0..samples {
        let mut u = RandomStream::new(Address { seed: 1, step: 0, item });
        // Any pixel of the window: W_e is normalised so that the mean over samples is the mean of
        // the image.
        pt.estimate(&scene, None, &mut u, &mut histogram);
    }
    let total: f64 = histogram.0.values().map(|(_, light)| light).sum();
    println!("{name}: mean luminance {:.5}", total / samples as f64);
    println!("length  paths per sample  share of the light");
    for (length, (paths, light)) in &histogram.0 {
        println!(
            "{length:6}  {:16.4}  {:7.3} %",
            *paths as f64 / samples as f64,
            100.0 * light / total
        );
    }
    Ok(())
}
