//! What a comparison says with `--verbose`: each pair, then speed and error of all, then all
//! verdicts at a glance; and the object of `--json`.

use std::io::Write;

use anyhow::Result;
use pathspace_benches::comparison::Comparison;
use pathspace_benches::results::{Overall, PairSummary, Results, SceneResults};
use pathspace_benches::standing::Standings;
use pathspace_validation::page::{ratio, verdict_words};
use pathspace_validation::pairs::LengthSummary;
use pathspace_validation::stats::{Reason, Rule, Verdict};
use serde::Serialize;

use super::super::table::{Table, figure, p_value, percent};

/// What `--json` prints of a scene; see docs/json.md.
#[derive(Debug, Serialize)]
pub(super) struct Report<'a> {
    pub(super) scene: &'a str,
    pub(super) scene_hash: &'a str,
    pub(super) seed: u64,
    pub(super) threads: usize,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) replicates: usize,
    pub(super) complete: bool,
    #[serde(flatten)]
    pub(super) comparison: &'a Comparison,
    pub(super) version: &'a str,
}

/// The tables of every scene.
pub(in super::super) fn tell_details(results: &Results, out: &mut dyn Write) -> Result<()> {
    for scene in &results.scenes {
        writeln!(out, "\n{}: seed {}", scene.name, results.seed)?;
        for pair in &scene.pairs {
            tell_pair(pair, out)?;
        }
        writeln!(out)?;
        tell_speed(scene, results.machine.threads, out)?;
        tell_verdicts(scene, out)?;
    }
    Ok(())
}

fn tell_speed(scene: &SceneResults, threads: usize, out: &mut dyn Write) -> Result<()> {
    let standings = Standings::of(scene, threads);
    let (wall, cpu) = (format!("× {}", standings.baseline), "per CPU s");
    let heading = [
        "integrator",
        "spp",
        "seconds",
        "CPU s",
        "MSE",
        "relMSE",
        "efficiency",
        &wall,
        cpu,
        "by relMSE",
        "Mrays/s",
    ];
    let mut table = Table::new(&heading, &[0]);
    for row in &standings.rows {
        let method = &scene.methods[row.index];
        let Some(p) = method.points.last() else { continue };
        table.row(vec![
            row.integrator.clone(),
            figure(p.spp),
            figure(p.seconds),
            figure(p.cpu_seconds),
            figure(p.mse.value),
            figure(p.relmse),
            figure(method.efficiency.value),
            ratio(row.ratio),
            ratio(row.cpu_ratio),
            ratio(row.relative_ratio),
            // Other renderers do not tell.
            if p.rays > 0.0 { figure(p.rays / p.seconds / 1e6) } else { "—".into() },
        ]);
    }
    table.write("", out)?;
    let error = if scene.reference.is_some() {
        "the squared error against the reference"
    } else {
        "the variance across replicates"
    };
    writeln!(
        out,
        "Figures of one replicate. MSE is {error}, averaged over the pixels of all that the\n\
         integrator can make; efficiency is 1/(MSE·seconds). Ratios are over {}: by MSE and wall\n\
         clock on the light that both make, by MSE and processor time, by relMSE of whole images.",
        standings.baseline
    )?;
    let slow: Vec<String> = (scene.methods.iter())
        .filter_map(|a| Some((a, a.points.last()?.startup_seconds)))
        .filter(|(_, seconds)| *seconds > 0.0)
        .map(|(a, seconds)| format!("{} {} s", a.integrator, figure(seconds)))
        .collect();
    if !slow.is_empty() {
        writeln!(out, "Loading and compiling, not counted: {}.", slow.join(", "))?;
    }
    Ok(())
}

/// The verdict on every pair with the detectable bias of the image, where there are so many pairs
/// that they are not seen together.
fn tell_verdicts(scene: &SceneResults, out: &mut dyn Write) -> Result<()> {
    let names: Vec<&str> = scene.methods.iter().map(|a| a.integrator.as_str()).collect();
    if names.len() < 3 {
        return Ok(());
    }
    let cell = |a: &str, b: &str| {
        let pair = scene.pairs.iter().map(|p| &p.judgement);
        let mut pair = pair.filter(|p| (p.a == a && p.b == b) || (p.a == b && p.b == a));
        let Some(pair) = pair.next() else { return String::new() };
        let mark = match pair.verdict {
            Verdict::Agree => "=",
            Verdict::Differ => "DIFFERS",
            Verdict::Inconclusive => "?",
        };
        format!("{mark} {}", percent(pair.image.mdb))
    };
    writeln!(
        out,
        "\nVerdicts with the detectable bias of the image: = no difference found, ? needs more\n\
         samples (a bias of more than {} could hide).\n",
        percent(Rule::default().mdb_limit)
    )?;
    let last = names.len() - 1;
    let heading: Vec<&str> = std::iter::once("").chain(names[..last].iter().copied()).collect();
    let mut table = Table::new(&heading, &[0]);
    for (i, row) in names.iter().enumerate().skip(1) {
        let cells = names[..i].iter().map(|column| cell(row, column));
        table.row(std::iter::once((*row).to_owned()).chain(cells).collect());
    }
    table.write("", out)?;
    Ok(())
}

fn tell_pair(summary: &PairSummary, out: &mut dyn Write) -> Result<()> {
    let pair = &summary.judgement;
    let (a, b, verdict) = (&pair.a, &pair.b, pair.verdict);
    writeln!(out, "\n{a} and {b}: {}", verdict_words(verdict).to_uppercase())?;
    for u in &pair.unseen {
        writeln!(
            out,
            "  {} can not make {} of {}'s image ({}): left out here",
            u.integrator,
            percent(u.fraction),
            u.of,
            u.reason
        )?;
    }
    if pair.image.reason == Reason::BothZero && pair.lengths.is_empty() {
        writeln!(out, "  there is no light that both can make and that can be told apart")?;
        return Ok(());
    }
    let mean_a = format!("mean {a}");
    let mean_b = format!("mean {b}");
    let mut table =
        Table::new(&["path length", &mean_a, &mean_b, "p", "detectable bias", "verdict"], &[0, 5]);
    let size = |l: &LengthSummary| l.mean_a.abs().max(l.mean_b.abs());
    let mut dim = Vec::new();
    for l in &pair.lengths {
        let shown = size(l) >= 1e-3 * size(&pair.image);
        if !shown && l.verdict.as_str() != "differ" {
            dim.push(l);
            continue;
        }
        table.row(cells(l));
    }
    table.row(cells(&pair.image));
    table.write("  ", out)?;
    if !dim.is_empty() {
        let share = dim.iter().map(|l| size(l)).sum::<f64>() / size(&pair.image);
        writeln!(
            out,
            "  and {} more with {} of the light, none of which differs",
            dim.len(),
            percent(share)
        )?;
    }
    if let Some(t) = &pair.tiles {
        writeln!(
            out,
            "  {}×{} tiles by kind of path, merged to {} groups: p = {}, {}",
            t.columns,
            t.rows,
            t.groups,
            p_value(t.p),
            verdict_words(t.verdict)
        )?;
    }
    let interval = if summary.efficiency_ratio_low.is_finite() {
        let ends = [summary.efficiency_ratio_low, summary.efficiency_ratio_high];
        format!(" [{}, {}]", ratio(ends[0]), ratio(ends[1]))
    } else {
        String::new()
    };
    writeln!(
        out,
        "  efficiency of {a} over {b} on what both make: {}{interval}",
        ratio(summary.efficiency_ratio)
    )?;
    Ok(())
}

fn cells(l: &LengthSummary) -> Vec<String> {
    let why = match l.reason {
        Reason::BothZero => " (no light)",
        Reason::Resolved | Reason::Significant => "",
        Reason::TooNoisy => " (noise)",
        Reason::NeverSampled => " (one never finds it)",
        Reason::FewContributions => " (too few hits to judge)",
        Reason::HeavyTail => " (infinite variance)",
        Reason::NoVariance => " (seeds were not used: its error is unknown)",
    };
    vec![
        l.length.map_or("image".into(), |k| k.to_string()),
        figure(l.mean_a),
        figure(l.mean_b),
        p_value(l.p),
        percent(l.mdb),
        format!("{}{why}", verdict_words(l.verdict)),
    ]
}

/// Slopes of the curves and times to the target, where there is more than one budget.
pub(in super::super) fn tell_curves(scene: &SceneResults, out: &mut dyn Write) -> Result<()> {
    let timed = scene.methods.iter().any(|a| a.time_to_error.is_some());
    if !timed && scene.methods.iter().all(|a| a.slope.is_none()) {
        return Ok(());
    }
    writeln!(out)?;
    let mut heading = vec!["integrator", "slope of MSE", "95 %"];
    if timed {
        heading.extend(["seconds to target", "95 %"]);
    }
    let mut table = Table::new(&heading, &[0]);
    for method in &scene.methods {
        let (slope, range) = match method.slope {
            Some(s) => (format!("{:.2}", s.value), format!("[{:.2}, {:.2}]", s.low, s.high)),
            None => ("—".into(), String::new()),
        };
        let mut row = vec![method.integrator.clone(), slope, range];
        if let Some(t) = &method.time_to_error {
            row.extend(if t.censored {
                [format!("over {}", figure(t.low)), "censored".into()]
            } else if t.low == 0.0 {
                [format!("below {}", figure(t.high)), String::new()]
            } else {
                [figure(t.seconds), format!("[{}, {}]", figure(t.low), figure(t.high))]
            });
        }
        table.row(row);
    }
    table.write("", out)?;
    Ok(())
}

/// Ratios over all scenes.
pub(in super::super) fn tell_overall(overall: &[Overall], out: &mut dyn Write) -> Result<()> {
    let Some(first) = overall.first() else { return Ok(()) };
    writeln!(
        out,
        "\nOVER ALL SCENES  efficiency over that of {}, geometric mean over scenes:\n",
        first.baseline
    )?;
    let over = format!("× {}", first.baseline);
    let mut table = Table::new(&["", &over, "[95 % over scenes]", "scenes"], &[0, 1, 2]);
    for o in overall {
        // None over fewer than five scenes.
        let interval = match o.low.is_finite() && o.high.is_finite() {
            true => format!("[{}, {}]", ratio(o.low), ratio(o.high)),
            false => String::new(),
        };
        table.row(vec![
            o.integrator.clone(),
            ratio(o.geometric_mean),
            interval,
            o.scenes.to_string(),
        ]);
    }
    table.write("", out)?;
    Ok(())
}
