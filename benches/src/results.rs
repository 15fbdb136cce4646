//! What an experiment gave, as `results.json` holds it (docs/json.md).
//!
//! Paths are relative to the folder of the file. A number that is not finite is written as `null`
//! and read as NaN.

use pathspace_validation::json::{number, numbers};
use pathspace_validation::pairs::Judgement;
use pathspace_validation::stats::Estimate;
use serde::{Deserialize, Serialize};

/// Version of the schema: later ones add fields, they rename and remove none.
pub const SCHEMA: u32 = 1;

/// A figure with its 95 % interval.
pub type Interval = Estimate;

/// An experiment and all that came out of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Version of the program.
    pub version: String,
    /// How to cite the program.
    pub citation: String,
    /// Where it ran.
    pub machine: Machine,
    /// The command line.
    pub command: String,
    /// The experiment as TOML; `pathspace compare --experiment` repeats it.
    pub experiment: String,
    /// Seed from which all others are derived.
    pub seed: u64,
    /// False where it was stopped early: replicates are then missing.
    pub complete: bool,
    /// Scene after scene.
    pub scenes: Vec<SceneResults>,
    /// Over all scenes, integrator after integrator; empty with fewer than two scenes.
    pub overall: Vec<Overall>,
    /// What was left out and why, such as renderers that are not installed.
    pub notes: Vec<String>,
}

impl Results {
    /// Integrators of all scenes, in order of first appearance; their index is their colour.
    pub fn integrators(&self) -> Vec<String> {
        let mut seen = std::collections::BTreeSet::new();
        let names = self.scenes.iter().flat_map(|s| &s.methods).map(|a| &a.integrator);
        names.filter(|name| seen.insert(*name)).cloned().collect()
    }
}

/// Where an experiment ran.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Model of the processor; empty where the system does not tell.
    pub cpu: String,
    /// Worker threads of every render.
    pub threads: usize,
    /// Operating system and architecture.
    pub os: String,
}

/// One scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneResults {
    /// Its name; with `#2`, … where another one has the same.
    pub name: String,
    /// BLAKE3 of its content.
    pub hash: String,
    /// Width of the image, pixels.
    pub width: u32,
    /// Height of the image, pixels.
    pub height: u32,
    /// What errors are measured against; without one they are the variance over replicates.
    pub reference: Option<Reference>,
    /// Integrator after integrator.
    #[serde(alias = "arms")]
    pub methods: Vec<MethodResults>,
    /// Every pair of them, at the largest budget.
    pub pairs: Vec<PairSummary>,
}

/// Two integrators compared on the paths that both can make.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairSummary {
    /// Do they agree?
    #[serde(flatten)]
    pub judgement: Judgement,
    /// MSE of the first on what both make.
    #[serde(deserialize_with = "number")]
    pub mse_a: f64,
    /// MSE of the second on what both make.
    #[serde(deserialize_with = "number")]
    pub mse_b: f64,
    /// Efficiency of the first over that of the second on what both make.
    #[serde(deserialize_with = "number")]
    pub efficiency_ratio: f64,
    /// Lower end of its 95 % interval.
    #[serde(deserialize_with = "number")]
    pub efficiency_ratio_low: f64,
    /// Upper end of its 95 % interval.
    #[serde(deserialize_with = "number")]
    pub efficiency_ratio_high: f64,
}

/// A reference image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Image file.
    pub image: String,
    /// The two integrators that agree on it.
    pub integrators: Vec<String>,
    /// Its own error: √relMSE.
    #[serde(deserialize_with = "number")]
    pub relative_error: f64,
}

/// One integrator on one scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodResults {
    /// Its spec; with `#2`, … where the same one was asked for again.
    pub integrator: String,
    /// True for another renderer.
    pub external: bool,
    /// Budget after budget, the smallest first.
    pub points: Vec<Point>,
    /// Slope of ln MSE against ln seconds over the budgets, −1 expected; with three budgets or
    /// more.
    pub slope: Option<Interval>,
    /// 1/(MSE·seconds) at the largest budget.
    pub efficiency: Interval,
    /// Efficiency over that of the baseline, on what both make; `None` for the baseline itself.
    pub ratio: Option<Ratio>,
    /// Seconds to the target error, where one was asked for.
    pub time_to_error: Option<TimeToError>,
    /// Pictures at the largest budget.
    pub images: Images,
    /// PNG of one replicate at each budget, the smallest first.
    pub frames: Vec<String>,
    /// PNG of the relative error of that replicate at each budget, in false colour.
    pub error_pngs: Vec<String>,
}

/// One budget.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// What every replicate was given.
    pub budget: PointBudget,
    /// Wall-clock seconds of a replicate, start-up of the integrator included, on average.
    #[serde(deserialize_with = "number")]
    pub seconds: f64,
    /// Processor seconds of a replicate, on average.
    #[serde(deserialize_with = "number")]
    pub cpu_seconds: f64,
    /// Seconds that another renderer needed besides, in all replicates, to load and compile; 0 for
    /// our own.
    #[serde(deserialize_with = "number")]
    pub startup_seconds: f64,
    /// Samples per pixel of a replicate, on average.
    #[serde(deserialize_with = "number")]
    pub spp: f64,
    /// Rays of a replicate, on average.
    #[serde(deserialize_with = "number")]
    pub rays: f64,
    /// Finished replicates.
    pub replicates: usize,
    /// MSE of a replicate.
    pub mse: Interval,
    /// The same of (A−R)²/(R²+ε).
    #[serde(deserialize_with = "number")]
    pub relmse: f64,
    /// The same without the 0.1 % of the pixels where it is largest.
    #[serde(deserialize_with = "number")]
    pub relmse_trimmed: f64,
    /// Mean LDR-FLIP of a replicate; a figure of what is seen, not of the error.
    pub flip: Option<f64>,
    /// Mean over median of the MSE of the replicates: large where fireflies carry the error.
    #[serde(deserialize_with = "number")]
    pub firefly_index: f64,
    /// Contributions that were not finite, in all replicates.
    pub nonfinite: u64,
    /// MSE of every replicate; may be negative, since each is an unbiased estimate.
    #[serde(deserialize_with = "numbers")]
    pub per_replicate_mse: Vec<f64>,
}

/// A budget of a render.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointBudget {
    /// What is counted.
    pub kind: BudgetKind,
    /// How much of it.
    pub value: f64,
}

/// What a budget counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BudgetKind {
    /// Seconds of rendering.
    Seconds,
    /// Samples per pixel.
    Spp,
}

/// A ratio of efficiencies with its 95 % interval.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ratio {
    /// The integrator that it is relative to.
    pub baseline: String,
    /// Efficiency over that of the baseline.
    #[serde(deserialize_with = "number")]
    pub value: f64,
    /// Lower end.
    #[serde(deserialize_with = "number")]
    pub low: f64,
    /// Upper end.
    #[serde(deserialize_with = "number")]
    pub high: f64,
}

/// How long a replicate takes to a relative error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeToError {
    /// The target, relMSE.
    pub target: f64,
    /// Seconds; NaN where no budget reached the target.
    #[serde(deserialize_with = "number")]
    pub seconds: f64,
    /// Lower end of the 95 % interval.
    #[serde(deserialize_with = "number")]
    pub low: f64,
    /// Upper end of the 95 % interval; NaN where the data do not bound it.
    #[serde(deserialize_with = "number")]
    pub high: f64,
    /// True where the largest budget did not reach the target: `low` is then a bound and there is
    /// no estimate.
    pub censored: bool,
}

/// Pictures of one integrator.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Images {
    /// EXR of the mean over replicates, with the variance of this mean as a layer.
    pub mean: String,
    /// PNG of the mean.
    pub png: String,
    /// PNG of the relative standard deviation of a replicate, in false colour.
    pub sigma_png: String,
    /// PNG with a tile for each technique (s,t).
    pub techniques: Option<String>,
    /// Path length and PNG of the paths of that length.
    pub lengths: Vec<(u32, String)>,
}

/// An integrator against the baseline over all scenes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Overall {
    /// The integrator.
    pub integrator: String,
    /// The integrator that it is relative to.
    pub baseline: String,
    /// Geometric mean over scenes of the ratio of efficiencies.
    #[serde(deserialize_with = "number")]
    pub geometric_mean: f64,
    /// Lower end of its 95 % interval, by bootstrap over scenes.
    #[serde(deserialize_with = "number")]
    pub low: f64,
    /// Upper end.
    #[serde(deserialize_with = "number")]
    pub high: f64,
    /// Scenes where there is a ratio.
    pub scenes: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_survive_json() {
        let interval = Interval { value: 2.0, low: 1.0, high: 4.0 };
        let point = Point {
            budget: PointBudget { kind: BudgetKind::Spp, value: 16.0 },
            seconds: 0.5,
            cpu_seconds: 1.0,
            startup_seconds: 0.0,
            spp: 16.0,
            rays: 1e6,
            replicates: 2,
            mse: interval,
            relmse: 0.1,
            relmse_trimmed: 0.05,
            flip: None,
            firefly_index: 1.0,
            nonfinite: 0,
            per_replicate_mse: vec![1.0, 3.0],
        };
        let method = MethodResults {
            integrator: "pt".into(),
            external: false,
            points: vec![point],
            slope: None,
            efficiency: interval,
            ratio: Some(Ratio { baseline: "bdpt".into(), value: 1.0, low: 0.5, high: 2.0 }),
            time_to_error: None,
            images: Images { lengths: vec![(1, "a.png".into())], ..Images::default() },
            frames: Vec::new(),
            error_pngs: Vec::new(),
        };
        let scene = SceneResults {
            name: "furnace".into(),
            hash: "00".into(),
            width: 8,
            height: 8,
            reference: None,
            methods: vec![method],
            pairs: Vec::new(),
        };
        let results = Results {
            schema: SCHEMA,
            version: "0".into(),
            citation: String::new(),
            machine: Machine { cpu: String::new(), threads: 1, os: "linux".into() },
            command: "pathspace".into(),
            experiment: String::new(),
            seed: u64::MAX,
            complete: true,
            scenes: vec![scene],
            overall: Vec::new(),
            notes: Vec::new(),
        };
        let text = serde_json::to_string(&results).unwrap();
        assert_eq!(serde_json::from_str::<Results>(&text).unwrap(), results);
        assert!(text.contains(r#""budget":{"kind":"spp","value":16.0}"#));
    }
}
