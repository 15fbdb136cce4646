//! Where to go on from a comparison: the page, the same with more samples, the details.

use std::io::{self, Write};

use super::super::args::CompareArgs;
use super::super::image::Stops;
use super::super::program;
use super::super::words::quoted;

/// How many times the budget a firmer comparison has.
const MORE: f64 = 8.0;

/// The last lines: what to open and what to type next.
pub(super) fn tell(
    args: &CompareArgs,
    verbose: bool,
    complete: bool,
    out: &mut dyn Write,
) -> io::Result<()> {
    writeln!(out)?;
    if let Some(dir) = &args.output {
        writeln!(out, "Open    {}", dir.join(super::PAGE).display())?;
        if !complete {
            return writeln!(out, "Go on   the same command again");
        }
    }
    if let Some(command) = firmer(args) {
        writeln!(out, "Firmer  {command}")?;
    }
    match &args.output {
        _ if verbose => Ok(()),
        Some(dir) => {
            let dir = quoted(&dir.display().to_string());
            writeln!(out, "Details {} report {dir} --verbose", program())
        }
        None => writeln!(out, "Details the same command with --verbose"),
    }
}

/// The same comparison with a larger budget, in a folder of its own; `None` where the budget is a
/// file's or a sweep.
fn firmer(args: &CompareArgs) -> Option<String> {
    if args.experiment.is_some() || args.sweep.is_some() {
        return None;
    }
    let mut words = vec![program(), "compare".into()];
    words.extend(args.scenes.iter().map(|s| quoted(s)));
    let mut option = |name: &str, value: Option<String>| {
        if let Some(value) = value {
            words.extend([name.to_owned(), quoted(&value)]);
        }
    };
    for spec in &args.integrators {
        option("-i", Some(spec.to_string()));
    }
    let scene = &args.scene;
    option("--size", scene.size.map(|(w, h)| format!("{w}x{h}")));
    option("--crop", scene.crop.map(|c| format!("{},{},{},{}", c.x, c.y, c.width, c.height)));
    option("--max-depth", scene.max_depth.map(|d| d.to_string()));
    for (key, value) in &scene.define {
        option("-D", Some(format!("{key}={value}")));
    }
    option("--threads", scene.threads.map(|t| t.to_string()));
    option("--seed", (scene.seed != 1).then(|| scene.seed.to_string()));
    // Whole seconds where there are some: 0.3 becomes 2.
    let seconds = args.seconds.map(|s| if MORE * s >= 2.0 { (MORE * s).floor() } else { MORE * s });
    option("--seconds", seconds.map(|s| s.to_string()));
    option("--spp", args.spp.map(|n| n.saturating_mul(MORE as u64).min(1 << 40).to_string()));
    let replicates = args.replicates.filter(|k| *k != super::REPLICATES);
    option("--replicates", replicates.map(|k| k.to_string()));
    option("--baseline", args.baseline.as_ref().map(ToString::to_string));
    option("--target-error", args.target_error.map(|e| e.to_string()));
    option("--references", args.references.as_ref().map(|p| p.display().to_string()));
    option("--plots", args.plots.as_ref().map(|p| p.display().to_string()));
    let changed = args.exposure != Stops::default();
    option("--exposure", changed.then(|| args.exposure.to_string()));
    option("-o", args.output.as_ref().map(|dir| next(&dir.display().to_string())));
    Some(words.join(" "))
}

/// The folder after this one: `out`, `out2`, `out3`, …
fn next(dir: &str) -> String {
    let dir = dir.trim_end_matches('/');
    let stem = dir.trim_end_matches(|c: char| c.is_ascii_digit());
    let number = dir[stem.len()..].parse::<u64>().map_or(2, |n| n.saturating_add(1));
    format!("{stem}{number}")
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::super::super::args::{Cli, Command};
    use super::*;

    fn parse(words: &[&str]) -> CompareArgs {
        match Cli::try_parse_from(words).unwrap().command {
            Some(Command::Compare(args)) => *args,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_firmer_command_is_one_and_has_more_of_the_budget_only() {
        let asked = [
            "pathspace",
            "compare",
            "a b.xml",
            "cornell-box",
            "-i",
            "pt:nee=false",
            "-i",
            "bdpt",
            "--size",
            "8x4",
            "--crop",
            "0,0,4,4",
            "-D",
            "x=1 2",
            "--spp",
            "3",
            "--seed",
            "7",
            "--max-depth",
            "-1",
            "--replicates",
            "4",
            "--baseline",
            "bdpt",
            "--exposure",
            "-1.5",
            "-o",
            "here/out9",
        ];
        let line = firmer(&parse(&asked)).unwrap();
        assert!(line.contains("compare 'a b.xml' cornell-box -i pt:nee=false"), "{line}");
        // As a shell would cut it: quotes are around whole words here.
        let pieces = line.split('\'').enumerate();
        let words: Vec<&str> = pieces
            .flat_map(|(i, p)| if i % 2 == 0 { p.split_whitespace().collect() } else { vec![p] })
            .collect();
        let mut again = parse(&words);
        let first = parse(&asked);
        assert_eq!((again.spp, again.output.take()), (Some(24), Some("here/out10".into())));
        again.spp = first.spp;
        again.output = first.output.clone();
        assert_eq!(format!("{again:?}"), format!("{first:?}"));
    }

    #[test]
    fn folders_are_counted() {
        assert_eq!(
            (next("out"), next("out2/"), next("a/b9")),
            ("out2".into(), "out3".into(), "a/b10".into())
        );
    }
}
