//! The report as a page for the browser.

use minijinja::Error;
use serde::Serialize;

use super::report::{Check, CheckOutcome, MethodState, PairReport, Report, SceneReport};
use crate::page::{p_value, percent, render};
use crate::pairs::TileMap;
use crate::stats::{Verdict, p_histogram};

/// Bars of a histogram.
const BARS: usize = 20;
/// Path lengths with less of the light than this are left out where they do not differ.
const DIM: f64 = 1e-3;

impl Report {
    /// One HTML file that asks nothing of a network. `replays` holds the command that shows a
    /// failure again, in the order of [`Report::failures`]; it may be empty.
    ///
    /// # Errors
    /// None but those of a mistake in the template.
    pub fn page(&self, replays: &[String]) -> Result<String, Error> {
        render(include_str!("assets/report.html"), View::new(self, replays))
    }
}

/// What the template shows.
#[derive(Serialize)]
struct View<'a> {
    report: &'a Report,
    passed: bool,
    title: String,
    alpha: String,
    level: String,
    tally: Vec<(&'static str, &'static str, usize)>,
    failures: Vec<FailureView>,
    skips: Vec<(&'a str, &'a str, &'a str)>,
    scenes: Vec<SceneView<'a>>,
    checks: Vec<CheckMatrix>,
    histograms: Vec<Histogram>,
}

#[derive(Serialize)]
struct FailureView {
    scene: String,
    message: String,
    replay: Option<String>,
}

#[derive(Serialize)]
struct SceneView<'a> {
    scene: &'a SceneReport,
    id: String,
    rows: Vec<Row>,
    pairs: Vec<PairView<'a>>,
}

#[derive(Serialize)]
struct Row {
    name: String,
    cells: Vec<Cell>,
}

/// A cell of a matrix; without class where there is nothing.
#[derive(Serialize, Default)]
struct Cell {
    class: &'static str,
    word: String,
    detail: String,
    link: Option<String>,
}

#[derive(Serialize)]
struct PairView<'a> {
    pair: &'a PairReport,
    id: String,
    class: &'static str,
    p: Vec<String>,
    lengths: Vec<Bias>,
    maps: Vec<MapView>,
}

/// The bias of one path length: a dot within a band of what would have been seen, on an axis from
/// −1 to 1 in units of `scale`.
#[derive(Serialize)]
struct Bias {
    name: String,
    mean_a: f64,
    mean_b: f64,
    relative: Option<f64>,
    mdb: f64,
    p: f64,
    class: &'static str,
    word: &'static str,
    dot: f64,
    band: f64,
}

#[derive(Serialize)]
struct MapView {
    title: String,
    columns: usize,
    rows: usize,
    tiles: Vec<TileView>,
}

#[derive(Serialize)]
struct TileView {
    x: usize,
    y: usize,
    series: u8,
    opacity: f64,
    sigma: f64,
}

#[derive(Serialize)]
struct CheckMatrix {
    kind: &'static str,
    columns: Vec<String>,
    rows: Vec<Row>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct Histogram {
    title: &'static str,
    count: usize,
    p: String,
    bars: Vec<Bar>,
}

#[derive(Serialize)]
struct Bar {
    count: u64,
    height: f64,
}

impl<'a> View<'a> {
    fn new(report: &'a Report, replays: &[String]) -> Self {
        let failures = report.failures().into_iter().enumerate();
        let failures = failures.map(|(i, f)| FailureView {
            scene: f.scene,
            message: f.message,
            replay: replays.get(i).cloned(),
        });
        let tally = report.tally();
        View {
            report,
            passed: report.passed(),
            title: if report.suite.is_empty() {
                "Validation".into()
            } else {
                format!("Validation: {}", report.suite)
            },
            alpha: p_value(report.config.alpha),
            level: p_value(report.level()),
            tally: vec![
                ("agree", "agree", tally[0]),
                ("differ", "differ", tally[1]),
                ("inconclusive", "tell nothing", tally[2]),
            ],
            failures: failures.collect(),
            skips: report.skips(),
            scenes: report.scenes.iter().enumerate().map(|(i, s)| scene_view(i, s)).collect(),
            checks: ["exact", "chains", "hard", "calibration"]
                .into_iter()
                .filter_map(|kind| check_matrix(kind, &report.checks))
                .collect(),
            histograms: histograms(report),
        }
    }
}

fn class(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Agree => "agree",
        Verdict::Differ => "differ",
        Verdict::Inconclusive => "inconclusive",
    }
}

fn mark(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Agree => "✓ agree",
        Verdict::Differ => "✗ differ",
        Verdict::Inconclusive => "? unsure",
    }
}

fn scene_view(index: usize, scene: &SceneReport) -> SceneView<'_> {
    let methods: Vec<_> =
        scene.integrators.iter().filter(|a| a.state == MethodState::Rendered).collect();
    let id = format!("scene-{index}");
    let find = |a: &str, b: &str| {
        let of =
            |p: &PairReport| (p.last.a == a && p.last.b == b) || (p.last.a == b && p.last.b == a);
        scene.pairs.iter().position(of)
    };
    let cell = |a: &str, b: &str| match find(a, b) {
        None => Cell::default(),
        Some(n) => {
            let pair = &scene.pairs[n];
            Cell {
                class: class(pair.outcome),
                word: mark(pair.outcome).into(),
                detail: percent(pair.last.mdb),
                link: Some(format!("{id}-pair-{n}")),
            }
        }
    };
    let rows = methods.iter().map(|row| Row {
        name: row.integrator.clone(),
        cells: methods.iter().map(|column| cell(&row.integrator, &column.integrator)).collect(),
    });
    let pairs = scene.pairs.iter().enumerate().map(|(n, pair)| PairView {
        pair,
        id: format!("{id}-pair-{n}"),
        class: class(pair.outcome),
        p: pair.rounds.iter().map(|r| p_value(r.p)).collect(),
        lengths: biases(pair),
        maps: pair.maps.iter().map(map_view).collect(),
    });
    SceneView { scene, rows: rows.collect(), pairs: pairs.collect(), id }
}

/// The image, then every length that is bright or differs.
fn biases(pair: &PairReport) -> Vec<Bias> {
    let all = &pair.last.image;
    let bright = |l: &&crate::pairs::LengthSummary| {
        let size = l.mean_a.abs().max(l.mean_b.abs());
        size >= DIM * all.mean_a.abs().max(all.mean_b.abs()) || l.verdict == Verdict::Differ
    };
    std::iter::once(all)
        .chain(pair.last.lengths.iter().filter(bright))
        .map(|l| {
            let mean = 0.5 * (l.mean_a.abs() + l.mean_b.abs());
            let relative = (mean > 0.0).then(|| (l.mean_a - l.mean_b) / mean);
            // The axis is the cube root, so that 0.1 % and 100 % are both to be seen.
            let place = |v: f64| v.clamp(-1.0, 1.0).cbrt();
            Bias {
                name: l.length.map_or("image".into(), |k| format!("length {k}")),
                mean_a: l.mean_a,
                mean_b: l.mean_b,
                relative,
                mdb: l.mdb,
                p: l.p,
                class: class(l.verdict),
                word: mark(l.verdict),
                dot: place(relative.unwrap_or(0.0)),
                band: if l.mdb.is_finite() { place(l.mdb) } else { 1.0 },
            }
        })
        .collect()
}

fn map_view(map: &TileMap) -> MapView {
    let tiles = map.sigma.iter().enumerate().map(|(i, &sigma)| TileView {
        x: i % map.columns,
        y: i / map.columns,
        series: u8::from(sigma > 0.0),
        opacity: (sigma.abs() / 6.0).min(1.0),
        sigma,
    });
    MapView {
        title: map.length.map_or("all lengths".into(), |k| format!("length {k}")),
        columns: map.columns,
        rows: map.rows,
        tiles: tiles.collect(),
    }
}

fn check_matrix(kind: &'static str, checks: &[Check]) -> Option<CheckMatrix> {
    let (mut subjects, mut scenes): (Vec<String>, Vec<&str>) = (Vec::new(), Vec::new());
    let own = || checks.iter().filter(|c| c.kind == kind);
    for check in own() {
        if !subjects.contains(&check.subject) {
            subjects.push(check.subject.clone());
        }
        if !scenes.contains(&check.scene.as_str()) {
            scenes.push(&check.scene);
        }
    }
    let cell = |scene: &str, subject: &str| {
        let found = own().find(|c| c.scene == scene && c.subject == subject);
        found.map_or(Cell::default(), check_cell)
    };
    // The longer list goes down the page.
    let across = subjects.len() <= scenes.len();
    let scenes: Vec<String> = scenes.into_iter().map(str::to_owned).collect();
    let (down, columns) = if across { (scenes, subjects) } else { (subjects, scenes) };
    let row = |name: String| {
        let at = |column: &String| if across { cell(&name, column) } else { cell(column, &name) };
        let cells = columns.iter().map(at).collect();
        Row { name, cells }
    };
    let rows: Vec<Row> = down.into_iter().map(row).collect();
    let note = |c: &Check| Some(format!("{}, {}: {}", c.scene, c.subject, c.reason.as_ref()?));
    let notes = own().filter(|c| c.outcome != CheckOutcome::Skipped).filter_map(note).collect();
    (!rows.is_empty()).then_some(CheckMatrix { kind, rows, columns, notes })
}

fn check_cell(check: &Check) -> Cell {
    let (class, word) = match check.outcome {
        CheckOutcome::Passed => ("agree", "✓ agrees"),
        CheckOutcome::Failed => ("differ", "✗ wrong"),
        CheckOutcome::Inconclusive => ("inconclusive", "? unsure"),
        CheckOutcome::Skipped => ("", "left out"),
    };
    let detail = check.mdb.map_or(String::new(), percent);
    Cell { class, word: word.into(), detail, link: None }
}

/// First rounds only: later ones are of what looked suspicious.
fn histograms(report: &Report) -> Vec<Histogram> {
    let pairs = || report.scenes.iter().flat_map(|s| &s.pairs).filter(|p| p.rounds.len() == 1);
    let single = |p: f64, reason: crate::stats::Reason| {
        // An interval null that covers everything has p = 1 and is no test.
        (reason.is_trusted() && p < 1.0).then_some(p)
    };
    let images = pairs().filter_map(|p| single(p.last.image.p_single, p.last.image.reason));
    let lengths =
        pairs().flat_map(|p| &p.last.lengths).filter_map(|l| single(l.p_single, l.reason));
    let tiles = pairs().filter_map(|p| p.last.tiles.as_ref()).map(|t| t.p_spread);
    [
        ("Means of images", images.collect::<Vec<f64>>()),
        ("Means of path lengths", lengths.collect()),
        ("Spread over tiles", tiles.collect()),
    ]
    .into_iter()
    .filter_map(|(title, p)| {
        let histogram = p_histogram(&p, BARS).ok()?;
        let most = histogram.counts.iter().copied().max().unwrap_or(0).max(1) as f64;
        let bar = |&count: &u64| Bar { count, height: count as f64 / most };
        Some(Histogram {
            title,
            count: p.len(),
            p: p_value(histogram.p),
            bars: histogram.counts.iter().map(bar).collect(),
        })
    })
    .collect()
}
