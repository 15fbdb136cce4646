//! From cells to results: errors, efficiencies, slopes and verdicts.

mod method;
mod overall;
mod pair;
#[cfg(test)]
mod tests;

use pathspace_core::film::Families;
use pathspace_validation::stats::{CompareConfig, StatsError};

use crate::comparison::{Comparison, IntegratorSummary};
use crate::experiment::{Plan, Setup, Store};
use crate::metrics::Against;
use crate::reference::ReferenceImage;
use crate::results::{Images, MethodResults, PairSummary, Ratio, SceneResults};

pub use overall::overall;

/// What is asked besides.
#[derive(Clone, Debug, Default)]
pub struct Questions {
    /// Name of the integrator that ratios are relative to; the first where it is none of the scene.
    pub baseline: Option<String>,
    /// relMSE whose time is asked for.
    pub target_error: Option<f64>,
    /// Level and limits of the tests.
    pub tests: CompareConfig,
}

/// One scene, analysed.
#[derive(Clone, Debug)]
pub struct Analysed {
    /// As `results.json` has it, without pictures.
    pub results: SceneResults,
    /// As the table has it: the largest budget.
    pub comparison: Comparison,
    /// Who met contributions that were not finite: name, count, how to make the first again.
    pub nonfinite: Vec<(String, u64, Option<String>)>,
    /// What is to be known about other renderers.
    pub notes: Vec<String>,
}

/// Analyses the finished replicates of one scene. Integrators without two replicates at the largest
/// budget are left out.
///
/// # Errors
/// Where no integrator has two replicates, or means are not finite.
pub fn analyse(
    plan: &Plan,
    store: &Store,
    setup: &Setup,
    reference: Option<&ReferenceImage>,
    questions: &Questions,
) -> Result<Analysed, StatsError> {
    let scene = Scene { plan, store, setup, reference };
    let mut methods = Vec::new();
    let mut integrators = Vec::new();
    let mut nonfinite = Vec::new();
    let mut notes = Vec::new();
    let mut taking_part = Vec::new();
    let mut fewest = usize::MAX;
    for index in 0..setup.contestants.len() {
        let finished = scene.cells_of(index).len();
        fewest = fewest.min(finished);
        if finished < 2 {
            continue;
        }
        notes.extend(scene.repeated(index));
        let method = method::analyse(&scene, index, questions.target_error)?;
        if method.summary.nonfinite > 0 {
            let name = method.summary.integrator.clone();
            nonfinite.push((name, method.summary.nonfinite, method.nonfinite_example));
        }
        taking_part.push(index);
        integrators.push(method.summary);
        methods.push(method.results);
    }
    if methods.is_empty() {
        return Err(StatsError::TooFew { what: "replicates", need: 2, got: fewest.min(1) });
    }
    let mut pairs = Vec::new();
    let light = pair::light_of_families(&scene, &taking_part);
    for (n, &i) in taking_part.iter().enumerate() {
        for &j in &taking_part[n + 1..] {
            pairs.push(pair::compare(&scene, i, j, &light, &questions.tests)?);
        }
    }
    let asked = questions.baseline.as_deref();
    let baseline = methods.iter().position(|a| Some(a.integrator.as_str()) == asked).unwrap_or(0);
    relate(&mut methods, &pairs, baseline);
    let crop = setup.scene.film().crop;
    let results = SceneResults {
        name: setup.name.clone(),
        hash: setup.hash.clone(),
        width: crop.width,
        height: crop.height,
        reference: reference.map(ReferenceImage::summary),
        methods,
        pairs: pairs.clone(),
    };
    Ok(Analysed { results, comparison: Comparison { integrators, pairs }, nonfinite, notes })
}

/// Puts the ratios to the baseline into the methods.
fn relate(methods: &mut [MethodResults], pairs: &[PairSummary], baseline: usize) {
    let name = methods[baseline].integrator.clone();
    for method in methods.iter_mut().filter(|a| a.integrator != name) {
        method.ratio = pairs.iter().find_map(|p| {
            let (value, low, high) =
                (p.efficiency_ratio, p.efficiency_ratio_low, p.efficiency_ratio_high);
            let baseline = name.clone();
            if (&p.judgement.a, &p.judgement.b) == (&method.integrator, &name) {
                Some(Ratio { baseline, value, low, high })
            } else if (&p.judgement.b, &p.judgement.a) == (&method.integrator, &name) {
                Some(Ratio { baseline, value: 1.0 / value, low: 1.0 / high, high: 1.0 / low })
            } else {
                None
            }
        });
        // An exact image, or nothing in common.
        method.ratio = method.ratio.take().filter(|r| r.value.is_finite() && r.value > 0.0);
    }
}

/// One scene of an experiment with its finished cells.
struct Scene<'a> {
    plan: &'a Plan,
    store: &'a Store,
    setup: &'a Setup,
    reference: Option<&'a ReferenceImage>,
}

impl Scene<'_> {
    /// The finished replicates of an integrator at the largest budget.
    fn cells_of(&self, index: usize) -> Vec<crate::experiment::Cell> {
        let budget = self.plan.budgets[self.plan.budgets.len() - 1];
        self.plan.cells(self.store, self.setup, &self.setup.contestants[index].0, budget)
    }

    /// A note where another renderer has made one image more than once: its replicates are not
    /// independent.
    fn repeated(&self, index: usize) -> Option<String> {
        let (name, contestant) = &self.setup.contestants[index];
        if !contestant.is_external() {
            return None;
        }
        let cells = self.cells_of(index);
        let hash = |c: &crate::experiment::Cell| {
            let mut hasher = blake3::Hasher::new();
            for value in c.image(Families::ALL, self.setup.pixels()) {
                hasher.update(&value.to_le_bytes());
            }
            hasher.finalize()
        };
        let mut hashes: Vec<[u8; 32]> = cells.iter().map(|c| *hash(c).as_bytes()).collect();
        hashes.sort_unstable();
        hashes.dedup();
        (hashes.len() < cells.len()).then(|| {
            format!(
                "{}: {name}: {} replicates with seeds of their own gave {} different images: it ignores the seed, or the scene has \
                 no noise for it; its variance, its efficiency and verdicts on it are not to be trusted",
                self.setup.name,
                cells.len(),
                hashes.len()
            )
        })
    }

    fn families(&self, index: usize) -> Families {
        self.setup.contestants[index].1.families(&self.setup.scene)
    }
}

/// The part of a reference that both of two can make, as what errors are measured against.
struct ReferenceHalves(Option<[Vec<f32>; 2]>);

impl ReferenceHalves {
    fn of(scene: &Scene<'_>, a: Families, b: Families) -> Self {
        ReferenceHalves(scene.reference.map(|r| r.halves(a, b)))
    }

    fn against(&self) -> Against<'_> {
        match &self.0 {
            Some([one, two]) => Against::Halves(one, two),
            None => Against::Replicates,
        }
    }
}

/// An empty set of pictures, to be filled by [`crate::record`].
fn no_pictures() -> Images {
    Images::default()
}

fn average<T>(items: &[T], f: impl Fn(&T) -> f64) -> f64 {
    items.iter().map(f).sum::<f64>() / items.len() as f64
}

/// What [`method::analyse`] finds.
struct Method {
    results: MethodResults,
    summary: IntegratorSummary,
    nonfinite_example: Option<String>,
}
