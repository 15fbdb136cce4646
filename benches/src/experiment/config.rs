//! An experiment as a TOML file.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::budget::Budget;

/// Why a description is no experiment.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// Not TOML, or not with these names.
    #[error("{}{}", .0.to_string().trim().replace('\n', " "), meant(.0.message()))]
    Syntax(#[from] toml::de::Error),
    /// A value that makes no sense.
    #[error("{key}: {reason}")]
    Value {
        /// Its name.
        key: &'static str,
        /// What is wrong.
        reason: String,
    },
}

/// An experiment. Everything but the scenes and a budget may be left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// The scenes, as library names or files, or as tables that change something of them.
    pub scenes: Vec<SceneConfig>,
    /// Specs of the integrators; all there are where this is empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub integrators: Vec<String>,
    /// Budget in samples per pixel, or several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spp: Option<Many<u64>>,
    /// Budget in seconds, or several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seconds: Option<Many<f64>>,
    /// `"A..B"`: the one budget times 2^A, …, 2^B, both ends included; of 1 spp where none is
    /// given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sweep: Option<String>,
    /// Replicates of each integrator with each budget.
    #[serde(default = "sixteen")]
    pub replicates: u32,
    /// Seed from which all others are derived.
    #[serde(default = "one")]
    pub seed: u64,
    /// Worker threads; all processors where it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threads: Option<u16>,
    /// Film of all scenes, such as `"128x128"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<String>,
    /// Longest path in edges, −1 unlimited, in all scenes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_depth: Option<i32>,
    /// Integrator that ratios are relative to; the first where it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub baseline: Option<String>,
    /// relMSE whose time is asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_error: Option<f64>,
    /// Folder of references to measure errors against (`pathspace reference`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub references: Option<PathBuf>,
}

/// A scene of an experiment: a name, or a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum SceneConfig {
    /// A library name or a file.
    Name(String),
    /// The same with changes.
    Changed(ChangedScene),
}

/// A scene with changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChangedScene {
    /// A library name or a file.
    pub scene: String,
    /// Film, such as `"128x128"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<String>,
    /// Window of the film, `"x,y,w,h"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crop: Option<String>,
    /// Longest path in edges, −1 unlimited.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_depth: Option<i32>,
    /// Values for `$key` in the file.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub define: BTreeMap<String, String>,
}

/// By hand, because an untagged enum would pass over keys that it does not know.
impl<'de> Deserialize<'de> for SceneConfig {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;

        impl<'de> Visitor<'de> for Either {
            type Value = SceneConfig;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a scene, or a table with a scene")
            }

            fn visit_str<E: de::Error>(self, name: &str) -> Result<SceneConfig, E> {
                Ok(SceneConfig::Name(name.to_owned()))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<SceneConfig, A::Error> {
                ChangedScene::deserialize(MapAccessDeserializer::new(map)).map(SceneConfig::Changed)
            }
        }

        deserializer.deserialize_any(Either)
    }
}

/// One value or several.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number, or a list of numbers")]
pub enum Many<T> {
    /// One.
    One(T),
    /// Several.
    Several(Vec<T>),
}

impl<T: Copy> Many<T> {
    /// All of them.
    pub fn all(&self) -> Vec<T> {
        match self {
            Many::One(v) => vec![*v],
            Many::Several(v) => v.clone(),
        }
    }
}

fn sixteen() -> u32 {
    16
}

fn one() -> u64 {
    1
}

impl Config {
    /// Reads TOML and checks it.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn parse(text: &str) -> Result<Self, ConfigError> {
        let config: Config = toml::from_str(text)?;
        config.check()?;
        Ok(config)
    }

    /// The same as TOML.
    pub fn to_toml(&self) -> String {
        // Tables and strings of a struct can always be written; the error is that of maps with
        // other keys.
        toml::to_string(self).unwrap_or_default()
    }

    /// Checks values that do not depend on scenes or integrators.
    ///
    /// # Errors
    /// [`ConfigError::Value`].
    pub fn check(&self) -> Result<(), ConfigError> {
        let bad = |key, reason: &str| Err(ConfigError::Value { key, reason: reason.into() });
        if self.scenes.is_empty() {
            return bad("scenes", "an experiment needs one at least");
        }
        if !(2..=100_000).contains(&self.replicates) {
            return bad("replicates", "expected a number from 2 to 100000");
        }
        if self.threads.is_some_and(|n| !(1..=1024).contains(&n)) {
            return bad("threads", "expected a number from 1 to 1024");
        }
        if self.target_error.is_some_and(|e| !(e > 0.0 && e.is_finite())) {
            return bad("target_error", "expected a number over 0");
        }
        self.budgets().map(|_| ())
    }

    /// The budgets, the smallest first.
    ///
    /// # Errors
    /// [`ConfigError::Value`] where there are none, two kinds, or values out of range.
    pub fn budgets(&self) -> Result<Vec<Budget>, ConfigError> {
        let bad = |key, reason: &str| Err(ConfigError::Value { key, reason: reason.into() });
        let mut budgets: Vec<Budget> = match (&self.spp, &self.seconds) {
            (Some(_), Some(_)) => return bad("spp", "give spp or seconds, not both"),
            (Some(spp), None) => spp.all().into_iter().map(Budget::Samples).collect(),
            (None, Some(seconds)) => seconds.all().into_iter().map(Budget::Seconds).collect(),
            (None, None) if self.sweep.is_some() => vec![Budget::Samples(1)],
            (None, None) => return bad("spp", "a budget is missing: spp, seconds or sweep"),
        };
        if let Some(sweep) = &self.sweep {
            let Some((low, high)) = powers(sweep) else {
                return bad("sweep", "expected A..B with 0 ≤ A ≤ B ≤ 30, such as 0..6");
            };
            let [unit] = budgets[..] else {
                return bad("sweep", "goes with one budget, which it multiplies");
            };
            budgets = (low..=high).map(|j| unit.times(1 << j)).collect();
        }
        for budget in &budgets {
            match *budget {
                Budget::Samples(n) if !(1..=1 << 40).contains(&n) => {
                    return bad("spp", "expected a number from 1 to 2^40");
                }
                // A century; it also keeps out infinity and NaN.
                Budget::Seconds(s) if !(s > 0.0 && s < 3.2e9) => {
                    return bad("seconds", "expected a number over 0");
                }
                _ => {}
            }
        }
        budgets.sort_by(|a, b| a.amount().total_cmp(&b.amount()));
        budgets.dedup();
        if budgets.is_empty() {
            return bad("spp", "a budget is missing");
        }
        Ok(budgets)
    }
}

/// The known key that is most like the unknown one of a message "unknown field `a`, expected one of
/// `b`, `c`", as a question.
fn meant(message: &str) -> String {
    let Some(rest) = message.strip_prefix("unknown field ") else { return String::new() };
    let mut words = rest.split('`').skip(1).step_by(2);
    let Some(unknown) = words.next() else { return String::new() };
    let best = words.map(|known| (strsim::osa_distance(unknown, known), known)).min();
    let near = best.filter(|(distance, known)| 3 * distance <= known.len().max(unknown.len()));
    near.map_or(String::new(), |(_, known)| format!("; did you mean `{known}`?"))
}

/// Both ends of `A..B`.
fn powers(text: &str) -> Option<(u32, u32)> {
    let (a, b) = text.split_once("..")?;
    let (a, b) = (a.trim().parse().ok()?, b.trim().parse().ok()?);
    (a <= b && b <= 30).then_some((a, b))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = r#"
scenes = ["cornell-box", { scene = "room.xml", size = "64x64", define = { light = "2" } }]
integrators = ["pt", "bdpt:heuristic=balance"]
seconds = 0.1
sweep = "0..2"
replicates = 4
"#;

    #[test]
    fn an_experiment_survives_toml() {
        let config = Config::parse(FILE).unwrap();
        assert_eq!(Config::parse(&config.to_toml()).unwrap(), config);
        assert_eq!((config.seed, config.scenes.len()), (1, 2));
        let seconds = [0.1, 0.2, 0.4].map(Budget::Seconds);
        assert_eq!(config.budgets().unwrap(), seconds);
    }

    #[test]
    fn a_sweep_alone_counts_samples() {
        let config = Config::parse("scenes = ['a']\nsweep = '1..3'").unwrap();
        assert_eq!(config.budgets().unwrap(), [2, 4, 8].map(Budget::Samples));
    }

    #[test]
    fn mistakes_are_named() {
        for (text, word) in [
            ("scenes = []\nspp = 1", "scenes"),
            ("scenes = ['a']", "budget"),
            ("scenes = ['a']\nspp = 1\nseconds = 1.0", "not both"),
            ("scenes = ['a']\nspp = 1\nreplicates = 1", "replicates"),
            ("scenes = ['a']\nspp = [1, 2]\nsweep = '0..2'", "sweep"),
            ("scenes = ['a']\nsweep = '3..2'", "sweep"),
            ("scenes = ['a']\nspp = 1\ncolour = 'red'", "colour"),
            ("scenes = ['a']\nseconds = -1.0", "seconds"),
            ("scenes = ['a'", "TOML"),
            ("scenes = [{ scene = 'a', max_dpeth = 3 }]\nspp = 1", "did you mean `max_depth`?"),
            ("scenes = [{ size = '8x8' }]\nspp = 1", "missing field `scene`"),
            ("scenes = [7]\nspp = 1", "the name of a scene, or a table with a scene"),
            ("scenes = ['a']\nspp = 1\nreplicate = 4", "did you mean `replicates`?"),
            ("scenes = ['a']\nspp = 'many'", "expected a number, or a list of numbers"),
        ] {
            let error = Config::parse(text).unwrap_err().to_string();
            assert!(error.contains(word), "{text}: {error}");
        }
    }
}
