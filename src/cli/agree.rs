//! `pathspace agree`.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Result, anyhow, bail};
use clap::Args;
use pathspace_benches::input::{InputImage, read_all};
use pathspace_benches::output::{FULL_SIGMA, sigma_picture, write_png};
use pathspace_validation::agree::{self, AgreeConfig, Agreement, FEWEST, Ground, ImageSet};
use pathspace_validation::stats::{Estimate, Verdict};

use super::Done;
use super::args::{positive, probability};
use super::table::{Table, figure, p_value, percent};

#[derive(Clone, Debug, Args)]
pub(super) struct AgreeArgs {
    /// Images of one renderer: .exr, .pfm or .npy, of one size, each with a seed of its own.
    #[arg(required = true, value_name = "A")]
    pub(super) a: Vec<PathBuf>,
    /// Images of the other one; their number may differ.
    #[arg(long, required = true, value_name = "B", num_args = 1..)]
    pub(super) against: Vec<PathBuf>,
    /// Probability of the answer 'differ' where there is no difference.
    #[arg(long, value_name = "P", value_parser = probability, default_value_t = 1e-4)]
    pub(super) alpha: f64,
    /// Largest bias, as a share of the mean luminance, that an agreement may have missed.
    #[arg(long, value_name = "F", value_parser = probability, default_value_t = 0.05)]
    pub(super) limit: f64,
    /// Seconds of one image of A and of one of B, for the ratio of efficiencies; those that the
    /// files name unless given.
    #[arg(long, num_args = 2, value_names = ["A", "B"], value_parser = positive)]
    pub(super) seconds: Option<Vec<f64>>,
    /// Picture of the differences in σ to write: red where A has more light, blue where it has
    /// less.
    #[arg(long, value_name = "FILE.png")]
    pub(super) map: Option<PathBuf>,
    /// Print one JSON object as the last line.
    #[arg(long)]
    pub(super) json: bool,
}

/// Tests whether two sets of images show the same expectation.
pub(super) fn agree(args: &AgreeArgs, out: &mut dyn Write) -> Result<Done> {
    if let Some(map) = &args.map
        && !map.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"))
    {
        bail!("{}: the name of a map must end in .png", map.display());
    }
    let (a, b) = (read_all(&args.a)?, read_all(&args.against)?);
    let size = |images: &[InputImage]| images.first().map_or((0, 0), |i| (i.width, i.height));
    let (width, height) = size(&a);
    if size(&b) != (width, height) {
        let (w, h) = size(&b);
        let (one, two) = (args.a[0].display(), args.against[0].display());
        bail!("{two}: has {w}×{h} pixels, but {one} has {width}×{height}");
    }
    let given = |i: usize| args.seconds.as_ref().and_then(|s| s.get(i)).copied();
    let seconds = [seconds(&a, given(0)), seconds(&b, given(1))];
    let [a, b] = [a, b].map(|set| set.into_iter().map(|i| i.pixels).collect::<Vec<_>>());
    let config = AgreeConfig { alpha: args.alpha, limit: args.limit, ..AgreeConfig::default() };
    let found = agree::agree(
        width,
        height,
        ImageSet { images: &a, seconds: &seconds[0] },
        ImageSet { images: &b, seconds: &seconds[1] },
        &config,
    )
    .map_err(|e| anyhow!("{e}"))?;
    tell(&found, args, out)?;
    if let Some(path) = &args.map {
        write_png(path, &sigma_picture(found.map.columns, &found.map.sigma))?;
        writeln!(out, "wrote {} (full colour at ±{FULL_SIGMA} σ)", path.display())?;
    }
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&found)?)?;
    }
    Ok(if found.verdict == Verdict::Differ { Done::Differ } else { Done::Well })
}

/// Seconds of every image: as given, or as the files say if all of them do.
fn seconds(images: &[InputImage], given: Option<f64>) -> Vec<f64> {
    match given {
        Some(s) => vec![s; images.len()],
        None => images.iter().map(|i| i.seconds).collect::<Option<_>>().unwrap_or_default(),
    }
}

fn tell(found: &Agreement, args: &AgreeArgs, out: &mut dyn Write) -> Result<()> {
    writeln!(out, "{}: {}", found.verdict, reason(found, args))?;
    let tested = if found.tiles.is_some() { "image and tiles" } else { "the image" };
    let (p, alpha) = (p_value(found.p), found.alpha);
    writeln!(out, "  p = {p} over {tested}; 'differ' is below {alpha}")?;
    let signed = |v: f64| format!("{:+.3} %", 100.0 * v);
    let Estimate { value, low, high } = found.difference;
    if value.is_finite() {
        let (value, low, high) = (signed(value), signed(low), signed(high));
        writeln!(out, "  luminance of A over B: {value} [{low}, {high}] (95 %)")?;
    }
    let mut table = Table::new(&["", "images", "red", "green", "blue", "relMSE", "s/image"], &[0]);
    for (name, side) in ["A", "B"].into_iter().zip(&found.sides) {
        let mut row = vec![name.to_owned(), side.images.to_string()];
        row.extend(side.mean.map(figure));
        row.push(figure(side.noise.relmse));
        row.push(side.seconds.map_or("—".into(), figure));
        table.row(row);
    }
    table.write("  ", out)?;
    for (name, ratio) in
        [("", found.efficiency), (", of relative errors", found.efficiency_relative)]
    {
        if let Some(r) = ratio {
            let (value, low, high) = (figure(r.value), figure(r.low), figure(r.high));
            writeln!(out, "  efficiency of A over B{name}: {value} [{low}, {high}] (95 %)")?;
        }
    }
    Ok(())
}

/// The verdict in a sentence.
fn reason(found: &Agreement, args: &AgreeArgs) -> String {
    let bias = percent(found.mdb);
    match found.ground {
        Ground::Resolved => {
            let tile = match found.tile_mdb {
                Some(t) if t.is_finite() => format!(" (in a single tile: {})", percent(t)),
                _ => String::new(),
            };
            format!("no difference found; a bias of {bias} of the image would have been seen{tile}")
        }
        Ground::Image => "the mean over the image differs".into(),
        Ground::Tiles => "the light lies in other places".into(),
        Ground::Black => "all images are black".into(),
        Ground::TooNoisy => {
            let limit = percent(found.limit);
            format!(
                "only a bias of {bias} would have been seen, above the limit of {limit}; more images or samples are needed"
            )
        }
        Ground::TooFewImages => {
            format!("fewer than {FEWEST} images on a side; their variance is hardly known")
        }
        Ground::Repeated => match found.repeated {
            Some((side, [i, j])) => {
                let paths = if side == 0 { &args.a } else { &args.against };
                let (one, two) = (paths[i].display(), paths[j].display());
                format!(
                    "{one} and {two} are the same to the bit; every image needs a seed of its own"
                )
            }
            None => "images of a side are the same to the bit".into(),
        },
        Ground::HeavyTail => "rare bright pixels rule the images; no t-test can be trusted".into(),
        Ground::OneBlack => "one side is black".into(),
    }
}
