//! What a render is, and how two of them differ.

use std::fmt;

use pathspace_core::description::{FilmDescription, FilterKind};
use pathspace_core::film::Layers;
use pathspace_core::path::WalkRules;
use serde::{Deserialize, Serialize};

use crate::shard::Shard;

/// All that the film of a render depends on besides its budget.
#[derive(Clone, Debug, PartialEq)]
pub struct Identity {
    /// Version of the program.
    pub version: String,
    /// [`program`](crate::program): another build may use other random numbers.
    pub program: String,
    /// The scene as it was named, for messages.
    pub scene: String,
    /// Hash of the scene's content.
    pub scene_hash: String,
    /// Spec of the integrator.
    pub integrator: String,
    /// Length cap and roulette that the spec does not tell.
    pub rules: WalkRules,
    /// Seed of the whole render.
    pub seed: u64,
    /// Size, window and filter.
    pub film: FilmDescription,
    /// Layers of the film.
    pub layers: Layers,
    /// Which shares of it.
    pub shards: Shards,
}

/// Shares of one render that are in one film.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shards {
    /// Into how many it was shared out.
    pub count: u32,
    /// Those in the film, counted from 0, in the order of their sums.
    pub present: Vec<u32>,
}

impl From<Shard> for Shards {
    fn from(shard: Shard) -> Self {
        Shards { count: shard.count(), present: vec![shard.index()] }
    }
}

impl Shards {
    /// What can not be, in words; `None` where nothing is wrong.
    pub(super) fn problem(&self) -> Option<String> {
        let Shards { count, present } = self;
        let wrong = present.iter().find(|i| Shard::new(**i, *count).is_err());
        let mut sorted = present.clone();
        sorted.sort_unstable();
        let twice = sorted.windows(2).any(|w| w[0] == w[1]);
        match wrong {
            Some(i) => Some(format!("there is no shard {} of {count}", u64::from(*i) + 1)),
            None if present.is_empty() || twice => Some("its shards are none or twice".into()),
            None => None,
        }
    }
}

impl fmt::Display for Shards {
    /// `2/8`, `1,2,5/8`, counted from 1.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let present: Vec<String> = self.present.iter().map(|i| (i + 1).to_string()).collect();
        write!(f, "{}/{}", present.join(","), self.count)
    }
}

impl Identity {
    /// What differs between the render of a file (`self`) and this one, the names of scenes apart;
    /// `None` where nothing does.
    pub fn difference(&self, here: &Identity) -> Option<String> {
        let differences =
            [self.difference_but_shards(here), differs("shard", &self.shards, &here.shards)];
        let list: Vec<String> = differences.into_iter().flatten().collect();
        (!list.is_empty()).then(|| list.join("; "))
    }

    /// [`Identity::difference`], shards apart.
    pub fn difference_but_shards(&self, here: &Identity) -> Option<String> {
        let scene =
            |i: &Identity| format!("{} ({})", i.scene, &i.scene_hash[..12.min(i.scene_hash.len())]);
        let list: Vec<String> = [
            differs("version", &self.version, &here.version),
            (self.program != here.program && self.version == here.version).then(|| {
                let build =
                    |i: &Identity| format!("build {}", i.program.get(..12).unwrap_or("unknown"));
                sentence("program", build(self), build(here))
            }),
            (self.scene_hash != here.scene_hash)
                .then(|| sentence("content of the scene", scene(self), scene(here))),
            differs("integrator", &self.integrator, &here.integrator),
            differs("path length", &rules(&self.rules), &rules(&here.rules)),
            differs("seed", &self.seed, &here.seed),
            differs("size", &size(&self.film), &size(&here.film)),
            differs("window", &window(&self.film), &window(&here.film)),
            differs("filter", &filter(&self.film), &filter(&here.film)),
            differs("set of layers", &layers(self.layers), &layers(here.layers)),
        ]
        .into_iter()
        .flatten()
        .collect();
        (!list.is_empty()).then(|| list.join("; "))
    }
}

fn differs<T: PartialEq + fmt::Display>(what: &str, there: &T, here: &T) -> Option<String> {
    (there != here).then(|| sentence(what, there, here))
}

fn sentence(what: &str, there: impl fmt::Display, here: impl fmt::Display) -> String {
    format!("its {what} is {there}, not {here}")
}

fn rules(rules: &WalkRules) -> String {
    match rules.max_length {
        None => format!("unlimited with roulette from {}", rules.rr_depth),
        Some(n) => format!("up to {n} with roulette from {}", rules.rr_depth),
    }
}

fn size(film: &FilmDescription) -> String {
    format!("{}x{}", film.width, film.height)
}

fn window(film: &FilmDescription) -> String {
    let c = film.crop;
    format!("{},{},{},{}", c.x, c.y, c.width, c.height)
}

/// With all digits, as equality has.
fn filter(film: &FilmDescription) -> String {
    match film.filter {
        FilterKind::Box => "a box".into(),
        FilterKind::Tent { radius } => format!("a tent of radius {radius}"),
        FilterKind::Gaussian { stddev } => format!("a Gaussian of deviation {stddev}"),
    }
}

fn layers(layers: Layers) -> String {
    let names = [
        (layers.length, "length"),
        (layers.technique, "st"),
        (layers.unweighted, "unweighted"),
        (layers.emitter, "emitter"),
        (layers.class, "class"),
    ];
    let on: Vec<&str> = names.iter().filter_map(|(on, name)| on.then_some(*name)).collect();
    if on.is_empty() { "none".into() } else { on.join(",") }
}
