//! Charts for papers, as SVG and PDF: ratios of efficiencies, and errors at one budget or over
//! several.
//!
//! | Part | Where |
//! | --- | --- |
//! | what a chart shows | this file, `dots`, `curves` |
//! | logarithmic axes with ticks | `axis` |
//! | lines, dots and text, and how they become a file | `drawing`, `svg`, `pdf` |

mod axis;
mod curves;
mod dots;
mod drawing;
mod pdf;
mod svg;

use std::fs;
use std::path::{Path, PathBuf};

use crate::output::write_bytes;
use crate::record::{RecordError, failed, slug};
use crate::results::{MethodResults, Results, SceneResults};
use crate::standing::Standings;
use dots::{Dot, dot_plot};
use drawing::Drawing;

/// A chart of one scene.
#[derive(Clone, Debug)]
pub struct Chart {
    /// What it shows, in a word: `efficiency`, `error`.
    pub name: &'static str,
    /// What it shows, in a sentence.
    pub caption: String,
    drawing: Drawing,
}

impl Chart {
    /// As SVG to stand in a page, whose colours it takes.
    pub fn inline_svg(&self) -> String {
        svg::inline(&self.drawing, &self.caption)
    }

    /// As an SVG file.
    pub fn svg(&self) -> String {
        svg::file(&self.drawing, &self.caption)
    }

    /// As a PDF file.
    pub fn pdf(&self) -> Vec<u8> {
        pdf::file(&self.drawing)
    }
}

/// The charts of a scene that was rendered on this many threads. `integrators` gives the colours.
pub fn charts(scene: &SceneResults, integrators: &[String], threads: usize) -> Vec<Chart> {
    let standings = Standings::of(scene, threads);
    [efficiency(scene, integrators, &standings), error(scene, integrators, &standings)]
        .into_iter()
        .flatten()
        .collect()
}

/// Writes the charts of all scenes as SVG and PDF into a folder. Returns the files.
///
/// # Errors
/// With the system's reason.
pub fn write(results: &Results, folder: &Path) -> Result<Vec<PathBuf>, RecordError> {
    fs::create_dir_all(folder).map_err(|e| failed(folder, "cannot make directory", &e))?;
    let integrators = results.integrators();
    let mut files = Vec::new();
    for scene in &results.scenes {
        for chart in charts(scene, &integrators, results.machine.threads) {
            let stem = format!("{}.{}", slug(&scene.name), chart.name);
            for (end, bytes) in [("svg", chart.svg().into_bytes()), ("pdf", chart.pdf())] {
                let path = folder.join(format!("{stem}.{end}"));
                write_bytes(&path, &bytes).map_err(|e| failed(&path, "cannot write", &e))?;
                files.push(path);
            }
        }
    }
    Ok(files)
}

/// True where every integrator has one budget: there is no curve then.
pub fn is_single(scene: &SceneResults) -> bool {
    scene.methods.iter().all(|a| a.points.len() <= 1)
}

/// Ratios over the baseline, best first; those who see less of the light apart.
fn efficiency(
    scene: &SceneResults,
    integrators: &[String],
    standings: &Standings,
) -> Option<Chart> {
    let rows: Vec<Dot> = (standings.rows.iter())
        .filter(|r| r.ratio.is_finite() && r.ratio > 0.0)
        .map(|r| Dot {
            label: format!("{}{}", r.integrator, if r.whole { "" } else { "*" }),
            series: series(integrators, &r.integrator),
            value: r.ratio,
            low: r.low,
            high: r.high,
            apart: !r.whole,
            hollow: r.heavy,
        })
        .collect();
    let others = rows.len() > 1;
    let axis = format!("efficiency over {} (higher is better)", standings.baseline);
    let part = if standings.any_partial() {
        " Those with * make a part of the image and are measured on it."
    } else {
        ""
    };
    let caption = format!(
        "{}: efficiency 1/(MSE·s) over that of {}, with 95 % intervals.{part} Hollow: rests on rare bright samples.",
        scene.name, standings.baseline
    );
    let drawing = dot_plot(&rows, &axis, Some(1.0)).filter(|_| others)?;
    Some(Chart { name: "efficiency", caption, drawing })
}

/// MSE with one budget, those who make a part of the image apart; or MSE over time with several.
fn error(scene: &SceneResults, integrators: &[String], standings: &Standings) -> Option<Chart> {
    if !is_single(scene) {
        let drawing = curves::curve_plot(scene, |name| series(integrators, name))?;
        let caption =
            format!("{}: MSE over seconds, both logarithmic, with 95 % intervals.", scene.name);
        return Some(Chart { name: "error", caption, drawing });
    }
    let dot = |method: &MethodResults| {
        let mse = method.points.last()?.mse;
        let apart = standings.rows.iter().any(|r| r.integrator == method.integrator && !r.whole);
        (mse.value > 0.0 && mse.value.is_finite()).then(|| Dot {
            label: format!("{}{}", method.integrator, if apart { "*" } else { "" }),
            series: series(integrators, &method.integrator),
            value: mse.value,
            low: mse.low,
            high: mse.high,
            apart,
            hollow: false,
        })
    };
    let mut rows: Vec<Dot> = scene.methods.iter().filter_map(dot).collect();
    rows.sort_by(|a, b| a.apart.cmp(&b.apart).then(a.value.total_cmp(&b.value)));
    let drawing = dot_plot(&rows, "MSE of one render (lower is better)", None)?;
    let caption = format!("{}: MSE of one render, with 95 % intervals.", scene.name);
    Some(Chart { name: "error", caption, drawing })
}

fn series(integrators: &[String], name: &str) -> usize {
    integrators.iter().position(|n| n == name).unwrap_or(0)
}
