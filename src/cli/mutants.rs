//! `pathspace validate mutants`: would the tests find a bug?

use std::io::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, anyhow, bail};
use pathspace_validation::mutants::{FOLDER, Mutant, Outcome, VARIABLE, catalogue, hunt, plant};
use serde::{Deserialize, Serialize};

use super::args::ValidateArgs;
use super::progress::Progress;
use super::scene::pool;
use super::table::Table;
use super::{Done, interrupt};

/// Name of the suite on the command line.
pub(super) const SUITE: &str = "mutants";

/// What `--json` prints for one mutant; see docs/json.md.
#[derive(Serialize)]
struct Row {
    mutant: String,
    level: &'static str,
    test: String,
    seeds: u64,
    caught: u64,
    false_alarms: u64,
    seconds: f64,
}

/// What `--here --json` prints for the test of one mutant.
#[derive(Serialize, Deserialize)]
struct Run {
    mutant: String,
    seeds: u64,
    failed: u64,
    seconds: f64,
}

/// Hunts every mutant, or those that `--scene` names.
pub(super) fn hunt_all(args: &ValidateArgs, out: &mut dyn Write) -> Result<Done> {
    let source = source(args.source.as_deref())?;
    let all = catalogue(&source)?;
    if let Some(name) = args.scenes.iter().find(|s| all.iter().all(|m| m.name != **s)) {
        let known: Vec<&str> = all.iter().map(|m| m.name.as_str()).collect();
        bail!("'{name}' is no mutant ({})", known.join(", "));
    }
    let wanted = |m: &Mutant| args.scenes.is_empty() || args.scenes.contains(&m.name);
    let chosen: Vec<(usize, &Mutant)> = all.iter().enumerate().filter(|(_, m)| wanted(m)).collect();
    if args.here { here(args, &chosen, out) } else { copy(args, &source, &all, &chosen, out) }
}

/// Runs the tests in this program.
fn here(args: &ValidateArgs, chosen: &[(usize, &Mutant)], out: &mut dyn Write) -> Result<Done> {
    let pool = pool(args.threads)?;
    interrupt::install();
    interrupt::keep();
    let mut watch = || match interrupt::requested() {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    };
    let mut runs = Vec::new();
    for (_, mutant) in chosen {
        let outcome = pool.install(|| hunt(&mutant.test, args.seed, args.seeds, &mut watch))?;
        let Outcome { seeds, failed, seconds } = outcome;
        runs.push(Run { mutant: mutant.name.clone(), seeds, failed, seconds });
    }
    let mut table = Table::new(&["test of mutant", "failed", "seconds a seed"], &[0]);
    for r in &runs {
        let failed = format!("{}/{}", r.failed, r.seeds);
        table.row(vec![r.mutant.clone(), failed, per_seed(r.seconds, r.seeds)]);
    }
    table.write("", out)?;
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&runs)?)?;
    }
    if interrupt::requested() {
        bail!("interrupted: tests are missing");
    }
    Ok(if runs.iter().all(|r| r.failed == 0) { Done::Well } else { Done::Differ })
}

/// Builds a copy of the source tree with all mutants and runs every test in there, with its mutant
/// on and off.
fn copy(
    args: &ValidateArgs,
    source: &Path,
    all: &[Mutant],
    chosen: &[(usize, &Mutant)],
    out: &mut dyn Write,
) -> Result<Done> {
    let folder = source.join("target").join("mutants");
    let tree = folder.join("tree");
    plant(source, &tree, all)?;
    writeln!(out, "building {}", tree.display())?;
    out.flush()?;
    let program = build(&tree, &folder.join("target"))?;
    interrupt::install();
    interrupt::keep();
    let progress = Progress::new();
    let mut rows = Vec::new();
    for (done, (index, mutant)) in chosen.iter().enumerate() {
        progress.set(done as f64 / chosen.len() as f64, || mutant.name.clone());
        let alarms = run(&program, &tree, args, mutant, None)?;
        let caught = run(&program, &tree, args, mutant, Some(*index))?;
        rows.push(Row {
            mutant: mutant.name.clone(),
            level: mutant.test.level(),
            test: mutant.test.subject(),
            seeds: caught.seeds,
            caught: caught.failed,
            false_alarms: alarms.failed,
            seconds: caught.seconds,
        });
        if interrupt::requested() {
            break;
        }
    }
    drop(progress);
    let well = tell(&rows, out)?;
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&rows)?)?;
    }
    Ok(if well && rows.len() == chosen.len() { Done::Well } else { Done::Differ })
}

/// True where 9 of 10 seeds find each mutant and none alarms without it.
fn tell(rows: &[Row], out: &mut dyn Write) -> Result<bool> {
    let heading = ["mutant", "level", "caught", "false alarms", "seconds a seed", "test"];
    let mut table = Table::new(&heading, &[0, 1, 5]);
    for r in rows {
        table.row(vec![
            r.mutant.clone(),
            r.level.into(),
            format!("{}/{}", r.caught, r.seeds),
            format!("{}/{}", r.false_alarms, r.seeds),
            per_seed(r.seconds, r.seeds),
            r.test.clone(),
        ]);
    }
    table.write("", out)?;
    let sum = |of: fn(&Row) -> u64| rows.iter().map(of).sum::<u64>();
    let (caught, alarms) = (sum(|r| r.caught), sum(|r| r.false_alarms));
    let tries = sum(|r| r.seeds);
    writeln!(out, "caught {caught} of {tries}; false alarms without mutant {alarms} of {tries}")?;
    Ok(rows.iter().all(|r| 10 * r.caught >= 9 * r.seeds && r.false_alarms == 0))
}

fn per_seed(seconds: f64, seeds: u64) -> String {
    format!("{:.1}", seconds / seeds.max(1) as f64)
}

/// The source tree: the one named, or the first one around the current directory.
fn source(named: Option<&Path>) -> Result<PathBuf> {
    let start = match named {
        Some(dir) => dir.to_owned(),
        None => std::env::current_dir().context("cannot tell the current directory")?,
    };
    let mut folders: Vec<&Path> = start.ancestors().collect();
    if named.is_some() {
        folders.truncate(1);
    }
    let found = folders.iter().find(|dir| dir.join(FOLDER).is_dir());
    found.map(|dir| (*dir).to_owned()).ok_or_else(|| {
        anyhow!(
            "{}: no source tree of pathspace ({FOLDER} is missing); mutants are planted in a copy \
             of one, which --source names",
            start.display()
        )
    })
}

/// Builds the program of a source tree and says where it is.
fn build(tree: &Path, target: &Path) -> Result<PathBuf> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(&cargo)
        .args(["build", "--quiet", "--profile", "fast", "--bin", "pathspace", "--manifest-path"])
        .arg(tree.join("Cargo.toml"))
        .arg("--target-dir")
        .arg(target)
        .status()
        .with_context(|| format!("cannot run {}", cargo.to_string_lossy()))?;
    if !status.success() {
        bail!("{}: the copy with the mutants does not compile", tree.display());
    }
    Ok(target.join("fast").join(format!("pathspace{}", std::env::consts::EXE_SUFFIX)))
}

/// Runs the test of a mutant in the program of the copy.
fn run(
    program: &Path,
    tree: &Path,
    args: &ValidateArgs,
    mutant: &Mutant,
    on: Option<usize>,
) -> Result<Run> {
    let mut command = Command::new(program);
    command.args(["validate", SUITE, "--here", "--json", "--scene", &mutant.name, "--source"]);
    command.arg(tree).args(["--seed", &args.seed.to_string()]);
    command.args(["--seeds", &args.seeds.to_string()]).env_remove(VARIABLE);
    if let Some(threads) = args.threads {
        command.args(["--threads", &threads.to_string()]);
    }
    if let Some(index) = on {
        command.env(VARIABLE, index.to_string());
    }
    let output = command
        .stderr(Stdio::piped())
        .output()
        .with_context(|| format!("cannot run {}", program.display()))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let last = text.lines().last().unwrap_or_default();
    match serde_json::from_str::<Vec<Run>>(last).ok().and_then(|mut runs| runs.pop()) {
        Some(run) => Ok(run),
        None => {
            let why = String::from_utf8_lossy(&output.stderr);
            bail!("the test of {} did not run: {}", mutant.name, why.trim())
        }
    }
}
