//! A results folder as an experiment leaves it, made up within a moment.

use std::path::Path;

use image::{Rgb, RgbImage};
use pathspace_benches::output::{Metadata, NamedLayer, Output, Picture, exposure};
use pathspace_benches::results::{
    BudgetKind, Images, Interval, Machine, MethodResults, Overall, PairSummary, Point, PointBudget,
    Ratio, Reference, Results, SCHEMA, SceneResults, TimeToError,
};
use pathspace_core::description::FilmDescription;
use pathspace_validation::pairs::{Channel, Judgement, LengthSummary, TileSummary, Unseen};
use pathspace_validation::stats::{Reason, Verdict};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

pub const WIDTH: u32 = 96;
pub const HEIGHT: u32 = 72;
const BUDGETS: u32 = 6;

/// Scenes with these names, rendered by `integrators`, of which the first is the baseline. Writes
/// images to `folder`.
pub fn sample(folder: &Path, scenes: &[&str], integrators: &[&str]) -> Results {
    let scenes: Vec<SceneResults> =
        scenes.iter().enumerate().map(|(i, name)| scene(folder, i, name, integrators)).collect();
    let overall = integrators.iter().enumerate().skip(1).map(|(i, name)| Overall {
        integrator: (*name).into(),
        baseline: integrators[0].into(),
        geometric_mean: ratio_of(i).value,
        low: 0.6 * ratio_of(i).value,
        high: 1.7 * ratio_of(i).value,
        scenes: scenes.len(),
    });
    Results {
        schema: SCHEMA,
        version: "0.1.0".into(),
        citation: "@software{pathspace,\n  title = {pathspace},\n}".into(),
        machine: Machine { cpu: "A processor".into(), threads: 2, os: "linux x86_64".into() },
        command: "pathspace compare cornell-caustic -i pt -o out".into(),
        experiment: "scenes = [\"cornell-caustic\"]\nreplicates = 16\n".into(),
        seed: 1,
        complete: true,
        overall: if scenes.len() > 1 { overall.collect() } else { Vec::new() },
        scenes,
        notes: vec!["mitsuba:path is left out: Mitsuba 3 is not installed".into()],
    }
}

fn interval(value: f64, spread: f64) -> Interval {
    Interval { value, low: value / spread, high: value * spread }
}

fn ratio_of(method: usize) -> Interval {
    interval([1.0, 3.4, 0.31, 8.2, 1.2, 0.9, 2.0, 5.0][method % 8], 1.25)
}

fn scene(folder: &Path, index: usize, name: &str, integrators: &[&str]) -> SceneResults {
    let stem = format!("scene-{index}");
    let mut rng = Pcg64Mcg::seed_from_u64(index as u64);
    write_radiance(folder, &format!("{stem}/reference"), 0.001, index, &mut rng);
    let methods = integrators.iter().enumerate().map(|(i, integrator)| {
        let path = format!("{stem}/{i}");
        method(folder, &path, i, index, integrator, integrators[0], &mut rng)
    });
    let methods = methods.collect();
    let mut pairs = Vec::new();
    for i in 0..integrators.len() {
        for j in i + 1..integrators.len() {
            let verdict = match (i + j + index) % 5 {
                3 => Verdict::Inconclusive,
                _ if index == 1 && (i, j) == (0, 1) => Verdict::Differ,
                _ => Verdict::Agree,
            };
            pairs.push(pair(integrators[i], integrators[j], verdict));
        }
    }
    SceneResults {
        name: name.into(),
        hash: "3f1c7a90aa".into(),
        width: WIDTH,
        height: HEIGHT,
        reference: Some(Reference {
            image: format!("{stem}/reference.exr"),
            integrators: vec!["bdpt".into(), "pt".into()],
            relative_error: 0.0021,
        }),
        methods,
        pairs,
    }
}

fn method(
    folder: &Path,
    path: &str,
    index: usize,
    scene: usize,
    name: &str,
    baseline: &str,
    rng: &mut Pcg64Mcg,
) -> MethodResults {
    let cost = 0.02 / ratio_of(index).value;
    let noise = cost.sqrt();
    write_radiance(folder, path, 0.25 * noise, scene, rng);
    let points: Vec<Point> = (0..BUDGETS)
        .map(|j| {
            let spp = f64::from(1 << j);
            let seconds = 0.05 * spp * (1.0 + 0.05 * index as f64);
            let mse = interval(cost / seconds * (1.0 + 0.1 * f64::from(j % 2)), 1.3);
            Point {
                budget: PointBudget { kind: BudgetKind::Spp, value: spp },
                seconds,
                cpu_seconds: 1.9 * seconds,
                startup_seconds: if name.starts_with("mitsuba") { 0.7 } else { 0.0 },
                spp,
                rays: 3e6 * seconds,
                replicates: 16,
                mse,
                relmse: 2.0 * mse.value,
                relmse_trimmed: 1.4 * mse.value,
                flip: (index != 2).then(|| 0.1 * mse.value.sqrt()),
                firefly_index: 1.0 + 0.3 * index as f64,
                nonfinite: u64::from(index == 4),
                per_replicate_mse: vec![mse.value; 16],
            }
        })
        .collect();
    let frames: Vec<String> = (0..BUDGETS).map(|j| format!("{path}/frame-{j}.png")).collect();
    let errors: Vec<String> = (0..BUDGETS).map(|j| format!("{path}/error-{j}.png")).collect();
    for j in 0..BUDGETS as usize {
        let level = noise * 2.0 / f64::from(1 << j).sqrt();
        write_png(folder, &frames[j], |x, y| picture(x, y, scene), level, rng);
        write_png(folder, &errors[j], |_, _| [level.min(1.0); 3], level, rng);
    }
    let lengths: Vec<(u32, String)> =
        (1..=5).map(|k| (k, format!("{path}/length-{k}.png"))).collect();
    for (k, file) in &lengths {
        let dim = 1.0 / f64::from(*k);
        write_png(folder, file, |x, y| picture(x, y, scene).map(|v| v * dim), noise, rng);
    }
    let techniques = name.starts_with("bdpt").then(|| format!("{path}/techniques.png"));
    if let Some(file) = &techniques {
        write_png(folder, file, |x, y| picture(x, y, scene), noise, rng);
    }
    MethodResults {
        integrator: name.into(),
        external: name.starts_with("mitsuba"),
        slope: Some(Interval { value: -1.01, low: -1.08, high: -0.95 }),
        efficiency: interval(1.0 / cost, 1.2),
        ratio: (name != baseline).then(|| {
            let r = ratio_of(index);
            Ratio { baseline: baseline.into(), value: r.value, low: r.low, high: r.high }
        }),
        time_to_error: Some(TimeToError {
            target: 0.01,
            seconds: if index == 2 { f64::NAN } else { 100.0 * cost },
            low: 80.0 * cost,
            high: if index == 2 { f64::NAN } else { 130.0 * cost },
            censored: index == 2,
        }),
        images: Images {
            mean: format!("{path}.exr"),
            png: format!("{path}.png"),
            sigma_png: String::new(),
            techniques,
            lengths,
        },
        frames,
        error_pngs: errors,
        points,
    }
}

fn pair(a: &str, b: &str, verdict: Verdict) -> PairSummary {
    let p = if verdict == Verdict::Differ { 3e-9 } else { 0.42 };
    let reason = match verdict {
        Verdict::Agree => Reason::Resolved,
        Verdict::Differ => Reason::Significant,
        Verdict::Inconclusive => Reason::TooNoisy,
    };
    let test = |length: Option<u32>| LengthSummary {
        length,
        channel: Channel::Luminance,
        verdict,
        reason,
        p_single: p,
        p,
        mdb: 0.012 * f64::from(length.unwrap_or(1)),
        mean_a: 0.312,
        mean_b: 0.311,
    };
    PairSummary {
        judgement: Judgement {
            a: a.into(),
            b: b.into(),
            verdict,
            p,
            mdb: 0.012,
            image: test(None),
            lengths: (1..=6).map(|k| test(Some(k))).collect(),
            channels: Vec::new(),
            place: None,
            common: Vec::new(),
            tiles: Some(TileSummary {
                columns: 16,
                rows: 12,
                groups: 77,
                mdb: 0.2,
                share: 0.9,
                p: 0.3,
                p_largest: 0.2,
                p_spread: 0.15,
                verdict,
            }),
            unseen: vec![Unseen {
                integrator: b.into(),
                of: a.into(),
                fraction: 0.031,
                reason: "mirror images".into(),
            }],
        },
        mse_a: 0.01,
        mse_b: 0.02,
        efficiency_ratio: 0.5,
        efficiency_ratio_low: 0.4,
        efficiency_ratio_high: 0.6,
    }
}

/// A room with a ball and a lamp.
fn picture(x: f64, y: f64, scene: usize) -> [f64; 3] {
    let hue = scene as f64 * 0.7;
    let (u, v) = (x - 0.45, y - 0.62);
    let ball = 0.065 - u * u - v * v;
    if (x - 0.5).abs() < 0.12 && (y - 0.08).abs() < 0.03 {
        return [14.0, 12.0, 9.0];
    }
    if ball > 0.0 {
        let shade = 0.2
            + 3.0 * (ball * (0.6 - v)).max(0.0)
            + 20.0 * (0.004 - u * u - (v + 0.12).powi(2)).max(0.0) * 20.0;
        return [shade * 0.9, shade, shade * (1.0 + 0.3 * hue.sin())];
    }
    let wall = 0.5 / (1.0 + 4.0 * ((x - 0.5).powi(2) + y * y));
    let caustic = 0.9 * (-((x - 0.62).powi(2) * 300.0 + (y - 0.9).powi(2) * 900.0)).exp();
    let side = if x < 0.2 {
        [1.0, 0.35, 0.3]
    } else if x > 0.8 {
        [0.3, 0.9, 0.4]
    } else {
        [1.0; 3]
    };
    [0, 1, 2].map(|c: usize| wall * side[c] + caustic)
}

/// An EXR file with the layer `variance`, and the PNG file beside it.
fn write_radiance(folder: &Path, stem: &str, noise: f64, scene: usize, rng: &mut Pcg64Mcg) {
    let mut pixels = Vec::new();
    let mut variance = Vec::new();
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let true_value =
                picture(f64::from(x) / f64::from(WIDTH), f64::from(y) / f64::from(HEIGHT), scene);
            let sigma = noise * (0.3 + true_value[1]);
            let error = sigma * normal(rng);
            pixels.push(true_value.map(|v| (v + error).max(0.0)));
            variance.push([sigma * sigma; 3]);
        }
    }
    let path = folder.join(format!("{stem}.exr"));
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    let mut film = FilmDescription::default();
    (film.width, film.height) = (WIDTH, HEIGHT);
    film.crop = pathspace_core::description::Crop { x: 0, y: 0, width: WIDTH, height: HEIGHT };
    let layers = [NamedLayer { name: "variance".into(), pixels: variance }];
    let picture = Picture { film, pixels: &pixels, layers: &layers, metadata: Metadata::default() };
    Output::open(&path).unwrap().write(&picture, exposure(&pixels)).unwrap();
}

fn write_png(
    folder: &Path,
    name: &str,
    value: impl Fn(f64, f64) -> [f64; 3],
    noise: f64,
    rng: &mut Pcg64Mcg,
) {
    let image = RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        let v = value(f64::from(x) / f64::from(WIDTH), f64::from(y) / f64::from(HEIGHT));
        let e = noise * normal(rng);
        Rgb(v.map(|v| (255.0 * (v + e * (0.2 + v)).clamp(0.0, 1.0).powf(1.0 / 2.2)) as u8))
    });
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    image.save(path).unwrap();
}

/// Nearly normal: a sum of twelve uniform numbers.
fn normal(rng: &mut Pcg64Mcg) -> f64 {
    (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
}
