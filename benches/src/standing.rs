//! Who stands where on a scene: what a person wants to know first, for the terminal, the page and
//! `results.csv` alike.
//!
//! Everything here is worked out from [`SceneResults`], so that a stored comparison reads as it did
//! when it was made.

use pathspace_validation::page::ratio;
use pathspace_validation::stats::{Rule, Verdict};
use serde::Serialize;

use crate::results::{BudgetKind, MethodResults, Point, SceneResults};

/// A share of the image from which on nothing is missing that would show.
const WHOLE: f64 = 0.9995;
/// A comparison that would not have seen a bias of this size rests on rare bright samples.
const HEAVY: f64 = 0.1;
/// Below this share of the processors' time somebody else was at work, or nobody.
const BUSY: f64 = 0.8;
/// A render that takes this many times its budget was held up.
const OVERRUN: f64 = 1.25;

/// One integrator beside the baseline, at the largest budget.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Standing {
    /// Its spec.
    pub integrator: String,
    /// Index among the methods of the scene.
    pub index: usize,
    /// True for the baseline itself.
    pub is_baseline: bool,
    /// Efficiency 1/(MSE·s) over that of the baseline, on the light that both make; 1 for the
    /// baseline, NaN where there is none.
    pub ratio: f64,
    /// Lower end of its 95 % interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// The same ratio per second of processor time.
    pub cpu_ratio: f64,
    /// Ratio of 1/(relMSE·s) on the whole image; NaN where one of both does not make the whole
    /// image.
    pub relative_ratio: f64,
    /// relMSE of a replicate.
    pub relmse: f64,
    /// Share of the image that it can make.
    pub seen: f64,
    /// False where a part of the image is missing that shows.
    pub whole: bool,
    /// True where the comparison with the baseline would not have seen a bias of 10 %: the ratio is
    /// that of the samples that came.
    pub heavy: bool,
    /// True where it, or the baseline, did not have the processors for itself.
    pub busy: bool,
}

/// How many pairs there are of each verdict.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// All of them.
    pub pairs: usize,
    /// No difference found, and any larger bias excluded.
    pub agree: usize,
    /// Different.
    pub differ: usize,
    /// Neither is shown.
    pub inconclusive: usize,
}

/// All integrators of a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Standings {
    /// What ratios are relative to.
    pub baseline: String,
    /// Those that make the whole image, best first; then the others, best first.
    pub rows: Vec<Standing>,
    /// Verdicts.
    pub tally: Tally,
    /// Are they right? One sentence.
    pub right: String,
    /// Which is best? One sentence.
    pub best: String,
    /// Share of the processors' time that the renders had, where it was too small.
    pub busy: Option<f64>,
}

impl Standings {
    /// Ranks the methods of a scene that was rendered on this many threads.
    pub fn of(scene: &SceneResults, threads: usize) -> Standings {
        let named = scene.methods.iter().find_map(|a| a.ratio.as_ref().map(|r| r.baseline.clone()));
        let first = || scene.methods.first().map(|a| a.integrator.clone());
        let baseline = named.or_else(first).unwrap_or_default();
        let base = scene.methods.iter().find(|a| a.integrator == baseline);
        let mut rows: Vec<Standing> = (scene.methods.iter().enumerate())
            .map(|(index, method)| standing(scene, index, method, base, threads))
            .collect();
        let size = |s: &Standing| if s.ratio.is_finite() { s.ratio } else { 0.0 };
        rows.sort_by(|a, b| b.whole.cmp(&a.whole).then(size(b).total_cmp(&size(a))));
        let tally = tally(scene);
        let best = best(scene, &baseline, &rows, tally);
        let idle = scene.methods.iter().filter_map(|a| utilisation(a, threads));
        let busy = idle.filter(|u| *u < BUSY).reduce(f64::min);
        Standings { right: right(scene, tally), best, tally, baseline, rows, busy }
    }

    /// True where an integrator does not make the whole image.
    pub fn any_partial(&self) -> bool {
        self.rows.iter().any(|r| !r.whole)
    }
}

fn standing(
    scene: &SceneResults,
    index: usize,
    method: &MethodResults,
    base: Option<&MethodResults>,
    threads: usize,
) -> Standing {
    let is_baseline = base.is_some_and(|b| b.integrator == method.integrator);
    let [ratio, low, high] = match (&method.ratio, is_baseline) {
        (Some(r), _) => [r.value, r.low, r.high],
        (None, true) => [1.0; 3],
        (None, false) => [f64::NAN; 3],
    };
    let seen = seen(scene, &method.integrator);
    let (mine, theirs) = (method.points.last(), base.and_then(|b| b.points.last()));
    let both = mine.zip(theirs);
    let base_whole = base.is_some_and(|b| self::seen(scene, &b.integrator) >= WHOLE);
    let whole = seen >= WHOLE;
    let cost = |p: &Point| p.relmse * p.seconds;
    let pair = base.and_then(|b| mdb_of(scene, &method.integrator, &b.integrator));
    Standing {
        integrator: method.integrator.clone(),
        index,
        is_baseline,
        ratio,
        low,
        high,
        cpu_ratio: both.map_or(f64::NAN, |(m, t)| {
            ratio * (m.seconds / m.cpu_seconds) * (t.cpu_seconds / t.seconds)
        }),
        relative_ratio: both
            .filter(|_| whole && base_whole)
            .map_or(f64::NAN, |(m, t)| cost(t) / cost(m)),
        relmse: mine.map_or(f64::NAN, |p| p.relmse),
        seen,
        whole,
        heavy: !is_baseline && pair.is_some_and(|mdb| !(mdb <= HEAVY)),
        busy: is_busy(method, threads) || base.is_some_and(|b| is_busy(b, threads)),
    }
}

/// Share of the image that an integrator can make: what is missing from the image of any other one
/// is missing.
pub fn seen(scene: &SceneResults, integrator: &str) -> f64 {
    let missing = scene.pairs.iter().flat_map(|p| &p.judgement.unseen);
    let missing = missing.filter(|u| u.integrator == integrator && u.fraction.is_finite());
    1.0 - missing.map(|u| u.fraction).fold(0.0, f64::max)
}

/// Minimum detectable bias of the image in the comparison of two.
fn mdb_of(scene: &SceneResults, a: &str, b: &str) -> Option<f64> {
    let mut judgements = scene.pairs.iter().map(|p| &p.judgement);
    judgements.find(|j| (j.a == a && j.b == b) || (j.a == b && j.b == a)).map(|j| j.mdb)
}

/// Processor time over wall clock times threads, at the largest budget; `None` for other renderers
/// and where the system does not tell.
fn utilisation(method: &MethodResults, threads: usize) -> Option<f64> {
    let p = method.points.last().filter(|_| !method.external)?;
    let share = p.cpu_seconds / (p.seconds * threads.max(1) as f64);
    (share.is_finite() && share > 0.0).then_some(share)
}

fn is_busy(method: &MethodResults, threads: usize) -> bool {
    let overrun = method.points.last().is_some_and(|p| {
        p.budget.kind == BudgetKind::Seconds && p.seconds > OVERRUN * p.budget.value
    });
    utilisation(method, threads).is_some_and(|u| u < BUSY) || (overrun && !method.external)
}

fn tally(scene: &SceneResults) -> Tally {
    let count = |v| scene.pairs.iter().filter(|p| p.judgement.verdict == v).count();
    Tally {
        pairs: scene.pairs.len(),
        agree: count(Verdict::Agree),
        differ: count(Verdict::Differ),
        inconclusive: count(Verdict::Inconclusive),
    }
}

/// The verdicts of all pairs in one sentence.
fn right(scene: &SceneResults, tally: Tally) -> String {
    let Tally { pairs, agree, differ, inconclusive } = tally;
    let limit = format!("{} %", 100.0 * Rule::default().mdb_limit);
    let plural = |n: usize| if n == 1 { "" } else { "s" };
    if pairs == 0 {
        return "Not tested: there is one integrator only.".into();
    }
    if differ > 0 {
        let named = scene.pairs.iter().filter(|p| p.judgement.verdict == Verdict::Differ);
        let mut names: Vec<String> =
            named.map(|p| format!("{} and {}", p.judgement.a, p.judgement.b)).collect();
        let more = names.len().saturating_sub(3);
        names.truncate(3);
        let rest = if more > 0 { format!(", and {more} more") } else { String::new() };
        let verb = if differ == 1 { "differs" } else { "differ" };
        return format!(
            "No: {differ} of {pairs} pair{} {verb}: {}{rest}.",
            plural(pairs),
            names.join("; ")
        );
    }
    let excludes = if agree == 1 { "excludes" } else { "exclude" };
    let needs = if inconclusive == 1 { "needs" } else { "need" };
    let detail = match (agree, inconclusive) {
        (_, 0) if pairs == 1 => format!("it excludes a bias above {limit}"),
        (_, 0) => format!("all exclude a bias above {limit}"),
        (0, _) if pairs == 1 => "it needs more samples".into(),
        (0, _) => "all need more samples".into(),
        _ => {
            format!("{agree} {excludes} a bias above {limit}, {inconclusive} {needs} more samples")
        }
    };
    format!("No difference found in {pairs} pair{}: {detail}.", plural(pairs))
}

/// The best of those that make the whole image, in one sentence.
fn best(scene: &SceneResults, baseline: &str, rows: &[Standing], tally: Tally) -> String {
    if tally.differ > 0 {
        return "Not to be said while integrators differ: one of them is wrong.".into();
    }
    let partial = rows.iter().any(|r| !r.whole);
    let among = if partial { ", among those that make the whole image" } else { "" };
    let able: Vec<&Standing> = rows.iter().filter(|r| r.whole && r.ratio.is_finite()).collect();
    let Some(top) = able.first().filter(|_| rows.len() > 1) else {
        return "Not to be said: there is nothing to compare it with.".into();
    };
    let rivals: Vec<&str> = able[1..]
        .iter()
        .filter(|r| !faster(scene, &top.integrator, &r.integrator))
        .map(|r| r.integrator.as_str())
        .collect();
    let doubt = match rivals.as_slice() {
        [] => String::new(),
        [one] => format!(" {one} may be as good."),
        [one, two] => format!(" {one} and {two} may be as good."),
        [one, two, rest @ ..] => {
            format!(" {one}, {two} and {} more may be as good.", rest.len())
        }
    };
    if top.is_baseline {
        return format!("{baseline}, the baseline{among}.{doubt}");
    }
    let interval = if top.low.is_finite() && top.high.is_finite() {
        format!(" [{}, {}]", ratio(top.low), ratio(top.high))
    } else {
        String::new()
    };
    format!("{}: {} × {baseline}{interval}{among}.{doubt}", top.integrator, ratio(top.ratio))
}

/// True where the interval of the ratio of two lies above 1.
fn faster(scene: &SceneResults, a: &str, b: &str) -> bool {
    scene.pairs.iter().any(|p| {
        let j = &p.judgement;
        (j.a == a && j.b == b && p.efficiency_ratio_low > 1.0)
            || (j.b == a && j.a == b && p.efficiency_ratio_high < 1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::{Images, Interval, PointBudget, Ratio};

    /// An method with a ratio to pt and a share of the processors of two threads.
    fn method(name: &str, value: Option<f64>, cpu: f64) -> MethodResults {
        let interval = Interval { value: 1.0, low: 0.5, high: 2.0 };
        let budget = PointBudget { kind: BudgetKind::Seconds, value: 1.0 };
        MethodResults {
            integrator: name.into(),
            external: false,
            points: vec![Point {
                budget,
                seconds: 1.0,
                cpu_seconds: cpu,
                startup_seconds: 0.0,
                spp: 1.0,
                rays: 1.0,
                replicates: 16,
                mse: interval,
                relmse: 0.1,
                relmse_trimmed: 0.1,
                flip: None,
                firefly_index: 1.0,
                nonfinite: 0,
                per_replicate_mse: Vec::new(),
            }],
            slope: None,
            efficiency: interval,
            ratio: value.map(|value| Ratio {
                baseline: "pt".into(),
                value,
                low: 0.8 * value,
                high: 1.2 * value,
            }),
            time_to_error: None,
            images: Images::default(),
            frames: Vec::new(),
            error_pngs: Vec::new(),
        }
    }

    fn scene(methods: Vec<MethodResults>) -> SceneResults {
        SceneResults {
            name: "a".into(),
            hash: String::new(),
            width: 4,
            height: 4,
            reference: None,
            methods,
            pairs: Vec::new(),
        }
    }

    #[test]
    fn the_best_comes_first_and_the_baseline_has_one() {
        let s = scene(vec![
            method("pt", None, 2.0),
            method("bdpt", Some(3.0), 2.0),
            method("mlt", Some(0.5), 2.0),
        ]);
        let found = Standings::of(&s, 2);
        let names: Vec<&str> = found.rows.iter().map(|r| r.integrator.as_str()).collect();
        assert_eq!((names, found.rows[1].ratio), (vec!["bdpt", "pt", "mlt"], 1.0));
        assert!(found.best.starts_with("bdpt: 3.0 × pt [2.4, 3.6]"), "{}", found.best);
        assert_eq!(found.busy, None);
    }

    #[test]
    fn a_busy_machine_is_told() {
        let s = scene(vec![method("pt", None, 2.0), method("bdpt", Some(3.0), 1.0)]);
        let found = Standings::of(&s, 2);
        assert_eq!(found.busy, Some(0.5));
        assert!(found.rows[0].busy && !found.rows[1].busy);
        // Per second of processor time bdpt is twice as good as by the clock.
        assert!((found.rows[0].cpu_ratio - 6.0).abs() < 1e-12);
    }
}
