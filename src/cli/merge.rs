//! `pathspace merge`.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Result, bail};
use pathspace_benches::checkpoint::{self, Checkpoint, Merged, Part, sums_of};
use pathspace_benches::output::{Format, Metadata, Output, is_same_file};
use serde::Serialize;

use super::args::MergeArgs;
use super::image::Stops;
use super::render::tell_nonfinite;
use super::{Done, image, say};

/// What `--json` prints; see docs/json.md.
#[derive(Debug, Serialize)]
struct Report<'a> {
    scene: &'a str,
    scene_hash: &'a str,
    integrator: &'a str,
    seed: u64,
    width: u32,
    height: u32,
    shards: u32,
    merged: Vec<u32>,
    missing: Vec<u32>,
    /// Files that have not reached what they were to reach.
    short: Vec<String>,
    complete: bool,
    samples_per_pixel: f64,
    samples: u64,
    seconds: f64,
    cpu_seconds: f64,
    rays: u64,
    nonfinite: u64,
    mean: [f64; 3],
    output: String,
    version: &'a str,
}

/// Puts shards together.
pub(super) fn merge(args: &MergeArgs, out: &mut dyn Write) -> Result<Done> {
    let output = Output::open(&args.output)?;
    if output.format() != Format::Exr {
        bail!("{}: the name of merged shards must end in .exr", args.output.display());
    }
    let sums = sums_of(output.path());
    checkpoint::probe(&sums)?;
    let paths: Vec<PathBuf> = args.shards.iter().map(|path| sums_of(path)).collect();
    for (image, path) in args.shards.iter().zip(&paths) {
        if image != path && image.exists() && !path.exists() {
            bail!("{}: is no shard: {} is not beside it", image.display(), path.display());
        }
    }
    for path in args.shards.iter().chain(&paths) {
        let own =
            output.overwrites(path).or_else(|| is_same_file(&sums, path).then(|| sums.clone()));
        if let Some(own) = own {
            let (path, own) = (path.display(), own.display());
            bail!("{path}: is to be merged, and {own} would be written over it");
        }
    }
    let Merged { checkpoint, parts, missing } = checkpoint::merge(&paths)?;
    let short: Vec<String> = parts.iter().filter_map(lacks).collect();
    let lacking = lacking(&missing, checkpoint.identity.shards.count, &short);
    if let (Some(lacking), false) = (&lacking, args.partial) {
        bail!("{lacking}; --partial merges what is there");
    }
    let Checkpoint { identity, progress, film } = &checkpoint;
    checkpoint::write(&sums, identity, progress, film)?;
    let metadata = Metadata {
        scene: identity.scene.clone(),
        scene_hash: identity.scene_hash.clone(),
        integrator: identity.integrator.clone(),
        seed: identity.seed,
        samples_per_pixel: film.samples_per_pixel(),
        replicates: 1,
        seconds: progress.spent.seconds,
        version: identity.version.clone(),
    };
    let written = image::write(&output, film, metadata, Stops::default())?;
    tell_nonfinite(&identity.integrator, film.nonfinite(), film.nonfinite_examples());
    if let Some(lacking) = &lacking {
        say(&format!("warning: {lacking}"));
    }
    let from_one = |shards: &[u32]| shards.iter().map(|i| i + 1).collect();
    let crop = film.description().crop;
    let report = Report {
        scene: &identity.scene,
        scene_hash: &identity.scene_hash,
        integrator: &identity.integrator,
        seed: identity.seed,
        width: crop.width,
        height: crop.height,
        shards: identity.shards.count,
        merged: from_one(&identity.shards.present),
        missing: from_one(&missing),
        short,
        complete: lacking.is_none(),
        samples_per_pixel: film.samples_per_pixel(),
        samples: film.samples(),
        seconds: progress.spent.seconds,
        cpu_seconds: progress.spent.cpu_seconds,
        rays: progress.work.rays,
        nonfinite: film.nonfinite(),
        mean: film.mean(),
        output: output.path().display().to_string(),
        version: env!("CARGO_PKG_VERSION"),
    };
    for part in &parts {
        let (path, shards) = (part.path.display(), &part.identity.shards);
        writeln!(out, "{path}: shard {shards}, {} samples per pixel", part.samples_per_pixel)?;
    }
    writeln!(
        out,
        "{} by {}: {}×{}, {} samples per pixel, seed {}\nwrote {}",
        report.scene,
        report.integrator,
        report.width,
        report.height,
        report.samples_per_pixel,
        report.seed,
        written.names()
    )?;
    if let Some(note) = &written.note {
        writeln!(out, "{note}")?;
    }
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&report)?)?;
    }
    Ok(Done::Well)
}

/// What a file has not reached, with its name.
fn lacks(part: &Part) -> Option<String> {
    part.short.map(|short| format!("{} ({short})", part.path.display()))
}

/// What is missing of the whole, in words.
fn lacking(missing: &[u32], count: u32, short: &[String]) -> Option<String> {
    let mut words = Vec::new();
    if !missing.is_empty() {
        let list: Vec<String> = missing.iter().map(|i| (i + 1).to_string()).collect();
        words.push(format!("shards missing of {count}: {}", first(&list)));
    }
    if !short.is_empty() {
        words.push(format!("not finished: {}", first(short)));
    }
    (!words.is_empty()).then(|| words.join("; "))
}

/// The first items of a list, with the number of the others.
fn first(list: &[String]) -> String {
    const SHOWN: usize = 12;
    let (shown, rest) = list.split_at(list.len().min(SHOWN));
    let more = if rest.is_empty() { String::new() } else { format!(" and {} more", rest.len()) };
    format!("{}{more}", shown.join(", "))
}
