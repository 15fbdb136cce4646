//! `pathspace report`.

use std::io::Write;

use anyhow::Result;
use pathspace_benches::report;

use super::Done;
use super::args::ReportArgs;

/// Writes report.html from the results.json beside it.
pub(super) fn report(args: &ReportArgs, out: &mut dyn Write) -> Result<Done> {
    let path = report::rebuild(&args.dir)?;
    writeln!(out, "{}", path.display())?;
    Ok(Done::Well)
}
