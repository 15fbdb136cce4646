//! `pathspace report`.

use std::io::Write;

use anyhow::Result;
use pathspace_benches::{plots, report};

use super::Done;
use super::args::ReportArgs;
use super::compare::{screen, tell};

/// Writes report.html from the results.json beside it, and says what it says.
pub(super) fn report(args: &ReportArgs, verbose: bool, out: &mut dyn Write) -> Result<Done> {
    let results = report::read(&args.dir)?;
    let path = report::rebuild(&args.dir)?;
    screen::tell(&results, out)?;
    for scene in &results.scenes {
        tell::tell_curves(scene, out)?;
    }
    tell::tell_overall(&results.overall, out)?;
    if verbose {
        tell::tell_details(&results, out)?;
    }
    if let Some(dir) = &args.plots {
        let files = plots::write(&results, dir)?;
        writeln!(out, "\nCharts  {} files in {}", files.len(), dir.display())?;
    }
    writeln!(out, "\nOpen    {}", path.display())?;
    Ok(Done::Well)
}
