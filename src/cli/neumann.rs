//! `pathspace neumann`: the image as the Neumann series L = L_e + KL_e + K²L_e + …
//!
//! Paths of k edges carry Kᵏ⁻¹L_e to the sensor, so that the terms are the layers by path length of
//! any integrator. Where a scene is diffuse and lit by surfaces, finite elements give the same
//! terms without noise, and stand beside them.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::PathBuf;

use anyhow::{Result, bail};
use pathspace_benches::output::{
    Format, Metadata, NamedLayer, Output, Picture, SheetRow, exposure, labelled_sheet,
};
use pathspace_benches::{Budget, Exposure, Plan, Session, Shard};
use pathspace_core::color::luminance;
use pathspace_core::film::{LayerKey, Layers};
use pathspace_core::integrator::Integrator;
use pathspace_integrators::{Defaults, Registry, radiosity};

use super::args::NeumannArgs;
use super::progress::Progress;
use super::scene::{Prepared, pool, prepare};
use super::table::{Table, figure, percent};
use super::{Done, interrupt};

/// Samples per pixel of the camera rays that read finite elements.
const READ: u64 = 16;

/// A series of images by one integrator.
struct Series {
    name: String,
    terms: Vec<Vec<[f64; 3]>>,
    sums: Vec<Vec<[f64; 3]>>,
}

/// Renders the terms of the series.
pub(super) fn neumann(
    registry: &Registry,
    args: &NeumannArgs,
    verbose: bool,
    out: &mut dyn Write,
) -> Result<Done> {
    let mut prepared = prepare(&args.scene, verbose)?;
    let asked = args.scene.max_depth.is_some();
    let longest = u32::from(args.terms);
    let rules = &mut prepared.defaults.rules;
    // Longer paths belong to no term that is shown.
    rules.max_length =
        Some(if asked { rules.max_length.unwrap_or(longest).min(longest) } else { longest });
    let integrator = prepared.integrator(registry, args.integrator.as_ref())?;
    let name = format!("{}.neumann.exr", prepared.name);
    let output = Output::open(&args.output.clone().unwrap_or_else(|| PathBuf::from(name)))?;
    if output.format() != Format::Exr {
        bail!("{}: layers need an EXR file", output.path().display());
    }
    if !args.force {
        output.keep_foreign(args.output.as_deref())?;
    }
    let mut goal = args.goal.goal();
    if goal.budget.is_none() && goal.error.is_none() {
        goal.budget = Some(Budget::Samples(prepared.spp.map_or(64, u64::from)));
    }
    interrupt::install();
    let pool = pool(args.scene.threads)?;
    let exposed = pool.install(|| expose(&*integrator, &prepared, args.scene.seed, goal))?;
    let ours = Series::of(integrator.spec(), &exposed, args.terms);
    let exact = pool.install(|| finite_elements(&prepared, args))?;
    let series: Vec<&Series> = std::iter::once(&ours).chain(exact.as_ref().ok()).collect();
    table(&series, out)?;
    if let Err(reason) = &exact {
        writeln!(out, "no radiosity beside it: {reason}")?;
    }

    let film = *exposed.film.description();
    let crop = film.crop;
    let whole = &ours.sums[ours.sums.len() - 1];
    let light = args.exposure.factor().unwrap_or_else(|| exposure(whole));
    let rows: Vec<SheetRow> = series.iter().flat_map(|s| s.rows()).collect();
    let sheet = labelled_sheet(&rows, crop.width as usize, crop.height as usize, light);
    let layers: Vec<NamedLayer> =
        series.iter().enumerate().flat_map(|(n, s)| s.layers(n > 0)).collect();
    let metadata = Metadata {
        scene: args.scene.scene.clone(),
        scene_hash: prepared.hash.clone(),
        integrator: integrator.spec(),
        seed: args.scene.seed,
        samples_per_pixel: exposed.film.samples_per_pixel(),
        replicates: 1,
        seconds: exposed.spent.seconds,
        version: env!("CARGO_PKG_VERSION").into(),
    };
    output.write(&Picture { film, pixels: whole, layers: &layers, metadata }, light)?;
    let mut files = output.files();
    files.push(output.write_beside("sheet.png", &sheet)?);
    let names: Vec<String> = files.iter().map(|p| p.display().to_string()).collect();
    writeln!(out, "wrote {}; exposure {:+.1} EV", names.join(", "), light.log2())?;
    Ok(if exposed.complete || !interrupt::requested() { Done::Well } else { Done::Interrupted })
}

fn expose(
    integrator: &dyn Integrator,
    prepared: &Prepared,
    seed: u64,
    goal: pathspace_benches::Goal,
) -> Result<Exposure> {
    let layers = Layers { length: true, ..Layers::NONE };
    let plan = Plan { integrator, scene: &prepared.scene, layers, seed, shard: Shard::WHOLE };
    let progress = Progress::new();
    let mut session = Session::start(plan)?;
    session.run(goal, &mut |_, status| {
        interrupt::keep();
        progress.set(status.used, || format!("{} spp", status.samples_per_pixel));
        if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    Ok(session.finish())
}

/// The same terms by radiosity, or why there are none.
fn finite_elements(prepared: &Prepared, args: &NeumannArgs) -> Result<Result<Series, String>> {
    let defaults = Defaults { rules: prepared.defaults.rules };
    let integrator = Registry::builtin().create(&radiosity::NAME.parse()?, &defaults)?;
    if args.integrator.as_ref().is_some_and(|i| i.name == radiosity::NAME) {
        return Ok(Err("it was the integrator".into()));
    }
    let goal = Budget::Samples(READ).into();
    match expose(&*integrator, prepared, args.scene.seed, goal) {
        Ok(exposed) => Ok(Ok(Series::of(integrator.spec(), &exposed, args.terms))),
        // It says what in the scene is not diffuse.
        Err(e) => Ok(Err(format!("{e:#}"))),
    }
}

impl Series {
    fn of(name: String, exposed: &Exposure, terms: u16) -> Series {
        let black = || vec![[0.0; 3]; exposed.film.pixels() as usize];
        let term = |k| exposed.film.layer_image(LayerKey::Length(k)).unwrap_or_else(black);
        let terms: Vec<_> = (1..=terms).map(term).collect();
        let mut sum = black();
        let sums = terms.iter().map(|term| {
            for (s, t) in sum.iter_mut().flatten().zip(term.iter().flatten()) {
                *s += t;
            }
            sum.clone()
        });
        Series { name, sums: sums.collect(), terms }
    }

    fn rows(&self) -> [SheetRow; 2] {
        let terms = (self.terms.iter().enumerate())
            .map(|(n, image)| (format!("{} {}", term(n), self.name), image.clone()));
        let sums = (self.sums.iter().enumerate()).map(|(n, image)| {
            // A picture of 96 pixels has room for 12 letters.
            let label = if n == 0 { "S0=L".into() } else { format!("S{n}=S{}+{}", n - 1, term(n)) };
            (label, image.clone())
        });
        [terms.collect(), sums.collect()]
    }

    /// Layers `term.00`, `sum.00`, …; those of radiosity with its name before them.
    fn layers(&self, beside: bool) -> Vec<NamedLayer> {
        let before = if beside { format!("{}.", self.name) } else { String::new() };
        let named = |kind: &str, images: &[Vec<[f64; 3]>]| -> Vec<NamedLayer> {
            let layer = |(n, pixels): (usize, &Vec<[f64; 3]>)| NamedLayer {
                name: format!("{before}{kind}.{n:02}"),
                pixels: pixels.clone(),
            };
            images.iter().enumerate().map(layer).collect()
        };
        [named("term", &self.terms), named("sum", &self.sums)].concat()
    }
}

/// `L`, `KL`, `K2L`: KⁿL_e in the letters that the sheet has.
fn term(n: usize) -> String {
    match n {
        0 => "L".into(),
        1 => "KL".into(),
        n => format!("K^{n}L"),
    }
}

/// Mean luminance of every term, its share of the sum, and its ratio to the one before.
fn table(series: &[&Series], out: &mut dyn Write) -> Result<()> {
    let mean =
        |image: &[[f64; 3]]| image.iter().map(luminance).sum::<f64>() / image.len().max(1) as f64;
    let first = series[0];
    let total = mean(&first.sums[first.sums.len() - 1]);
    let mut heading = vec!["term", first.name.as_str(), "share", "over the one before"];
    if let Some(beside) = series.get(1) {
        heading.extend([beside.name.as_str(), "difference"]);
    }
    let mut table = Table::new(&heading, &[0]);
    let mut before = f64::NAN;
    for (n, image) in first.terms.iter().enumerate() {
        let value = mean(image);
        let label = if n == 0 { "L_e".into() } else { format!("K^{n} L_e").replace("K^1", "K") };
        let mut row = vec![label, figure(value), percent(value / total), figure(value / before)];
        if let Some(beside) = series.get(1) {
            let theirs = mean(&beside.terms[n]);
            row.extend([figure(theirs), percent((value - theirs) / theirs)]);
        }
        table.row(row);
        before = value;
    }
    table.write("", out)?;
    Ok(())
}
