//! `pathspace validate mutants`: would the tests find a bug?

use std::io::Write;

use anyhow::{Result, bail};
use pathspace_validation::mutants::{Hunt, Mutant, Outcome, hunt, hunts};
use serde::Serialize;

use super::args::ValidateArgs;
use super::progress::Progress;
use super::scene::pool;
use super::table::Table;
use super::{Done, interrupt};

/// Name of the suite on the command line.
pub(super) const SUITE: &str = "mutants";

/// What `--json` prints for one mutant; see docs/json.md.
#[derive(Serialize)]
struct Told {
    mutant: &'static str,
    level: &'static str,
    test: String,
    seeds: u64,
    caught: u64,
    false_alarms: u64,
    seconds: f64,
}

/// Hunts every mutant, or those that `--scene` names.
pub(super) fn hunt_all(args: &ValidateArgs, out: &mut dyn Write) -> Result<Done> {
    let wanted =
        |h: &Hunt| args.scenes.is_empty() || args.scenes.iter().any(|s| s == h.mutant.name());
    if let Some(name) = args.scenes.iter().find(|s| Mutant::ALL.iter().all(|m| m.name() != **s)) {
        let known: Vec<&str> = Mutant::ALL.iter().map(|m| m.name()).collect();
        bail!("'{name}' is no mutant ({})", known.join(", "));
    }
    let hunts: Vec<Hunt> = hunts().into_iter().filter(wanted).collect();
    let pool = pool(args.threads)?;
    interrupt::install();
    interrupt::keep();
    let progress = Progress::new();
    let mut told = Vec::new();
    for (done, one) in hunts.iter().enumerate() {
        progress.set(done as f64 / hunts.len() as f64, || one.mutant.name().to_owned());
        let outcome = pool.install(|| hunt(one, args.seed, args.seeds))?;
        told.push(tell(one, &outcome));
        if interrupt::requested() {
            break;
        }
    }
    drop(progress);
    let heading = ["mutant", "level", "caught", "false alarms", "seconds a seed", "test"];
    let mut table = Table::new(&heading, &[0, 1, 5]);
    for t in &told {
        table.row(vec![
            t.mutant.into(),
            t.level.into(),
            format!("{}/{}", t.caught, t.seeds),
            format!("{}/{}", t.false_alarms, t.seeds),
            format!("{:.1}", t.seconds / t.seeds as f64),
            t.test.clone(),
        ]);
    }
    table.write("", out)?;
    let sum = |of: fn(&Told) -> u64| told.iter().map(of).sum::<u64>();
    let (caught, alarms) = (sum(|t| t.caught), sum(|t| t.false_alarms));
    let tries = sum(|t| t.seeds);
    writeln!(out, "caught {caught} of {tries}; false alarms without mutant {alarms} of {tries}")?;
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&told)?)?;
    }
    let well = told.iter().all(|t| 10 * t.caught >= 9 * t.seeds && t.false_alarms == 0);
    Ok(if well && told.len() == hunts.len() { Done::Well } else { Done::Differ })
}

fn tell(hunt: &Hunt, outcome: &Outcome) -> Told {
    Told {
        mutant: hunt.mutant.name(),
        level: hunt.level.name(),
        test: hunt.level.subject(),
        seeds: outcome.seeds,
        caught: outcome.caught,
        false_alarms: outcome.false_alarms,
        seconds: outcome.seconds,
    }
}
