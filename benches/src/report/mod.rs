//! The report: one HTML file for people who would rather look than read. docs/report.md says how to
//! read it.
//!
//! | Part | Where |
//! | --- | --- |
//! | images as numbers, within a budget of bytes | `read`, `radiance`, `images` |
//! | tables, which stand without scripts | `tables`, `assets/report.html` |
//! | curves, image comparison, animation | `assets/*.js` on uPlot (MIT, `assets/uplot`) |
//!
//! The page asks nothing of a network, and a content security policy sees to that. Its look is that
//! of [`pathspace_validation::page`].

mod images;
mod radiance;
mod read;
mod tables;

use std::io;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use pathspace_validation::page::{render, script_json};
use serde::Serialize;
use thiserror::Error;

use crate::output::write_bytes;
use crate::results::Results;
use images::{Blob, Gallery, SceneImages};
use tables::{OverallRow, SceneTables, overall};

/// Bytes of images in a page unless told otherwise.
pub const IMAGE_BYTES: usize = 8 << 20;

/// Why a report was not written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReportError {
    /// `results.json` can not be read.
    #[error("{}: {reason}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The page can not be made.
    #[error("cannot make the page: {0}")]
    Page(String),
    /// The file can not be written.
    #[error("{}: cannot write: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
}

/// Writes the report of `results`, whose images are in `folder`, to the file `path`, which appears
/// whole or not at all.
///
/// Images that are missing are named on the page.
///
/// # Errors
/// [`ReportError`].
pub fn write(results: &Results, folder: &Path, path: &Path) -> Result<(), ReportError> {
    let page = page(results, folder, IMAGE_BYTES)?;
    write_bytes(path, page.as_bytes())
        .map_err(|source| ReportError::Write { path: path.to_path_buf(), source })
}

/// Reads `results.json` in `folder`.
///
/// # Errors
/// [`ReportError::Read`], where it is not there or is of another schema.
pub fn read(folder: &Path) -> Result<Results, ReportError> {
    let path = folder.join("results.json");
    let wrong = |reason: String| ReportError::Read { path: path.clone(), reason };
    let text = std::fs::read_to_string(&path).map_err(|e| wrong(e.to_string()))?;
    serde_json::from_str(&text).map_err(|e| wrong(e.to_string()))
}

/// Reads `results.json` in `folder` and writes `report.html` beside it, whose path is returned.
///
/// # Errors
/// [`ReportError`], also where `results.json` is not there or is of another schema.
pub fn rebuild(folder: &Path) -> Result<PathBuf, ReportError> {
    let results = read(folder)?;
    let report = folder.join("report.html");
    write(&results, folder, &report)?;
    Ok(report)
}

/// What the template is given.
#[derive(Serialize)]
struct Context<'a> {
    results: &'a Results,
    tables: Vec<SceneTables>,
    overall: Vec<OverallRow>,
    /// Integrators of all scenes, in order of first appearance; their index is their colour.
    integrators: &'a [String],
    notes: Vec<String>,
    blobs: &'a [Blob],
    data: String,
    style: &'static str,
    plot_style: &'static str,
    plot_script: &'static str,
    scripts: [&'static str; 7],
}

/// What the scripts are given.
#[derive(Serialize)]
struct Data<'a> {
    results: &'a Results,
    integrators: &'a [String],
    images: &'a [SceneImages],
    /// Colour maps of 256 entries, base64 of RGB.
    maps: Maps,
}

#[derive(Serialize)]
struct Maps {
    magnitude: String,
    signed: String,
}

/// The report as text, with about `image_bytes` bytes of images.
///
/// # Errors
/// [`ReportError::Page`], where values can not be serialised.
pub fn page(results: &Results, folder: &Path, image_bytes: usize) -> Result<String, ReportError> {
    let gallery = Gallery::collect(results, folder, image_bytes);
    let integrators = results.integrators();
    let data = Data {
        results,
        integrators: &integrators,
        images: &gallery.scenes,
        maps: Maps { magnitude: map(colorous::MAGMA), signed: map(colorous::PURPLE_ORANGE) },
    };
    let context = Context {
        results,
        tables: (results.scenes.iter())
            .map(|scene| SceneTables::of(scene, &integrators, results.machine.threads))
            .collect(),
        overall: overall(results),
        integrators: &integrators,
        notes: results.notes.iter().chain(&gallery.notes).cloned().collect(),
        blobs: &gallery.blobs,
        data: script_json(&data).map_err(|e| ReportError::Page(e.to_string()))?,
        style: include_str!("assets/report.css"),
        plot_style: include_str!("assets/uplot/uPlot.min.css"),
        plot_script: include_str!("assets/uplot/uPlot.iife.min.js"),
        scripts: [
            include_str!("assets/data.js"),
            include_str!("assets/curves.js"),
            include_str!("assets/tone.js"),
            include_str!("assets/viewer.js"),
            include_str!("assets/pictures.js"),
            include_str!("assets/tables.js"),
            include_str!("assets/main.js"),
        ],
    };
    render(include_str!("assets/report.html"), context)
        .map_err(|e| ReportError::Page(format!("{e:#}")))
}

fn map(gradient: colorous::Gradient) -> String {
    let colours = (0..256).map(|i| gradient.eval_rational(i, 256));
    STANDARD.encode(colours.flat_map(|c| [c.r, c.g, c.b]).collect::<Vec<u8>>())
}
