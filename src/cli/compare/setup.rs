//! The scenes of an experiment with those who render them.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use pathspace_benches::experiment::{ChangedScene, Config, Contestant, SceneConfig, Setup};
use pathspace_benches::peers::{Peer, PeerError, Place, is_peer};
use pathspace_benches::{TemporaryFolder, temporary_folder};
use pathspace_integrators::{Registry, Spec};
use pathspace_scenes::library;
use pathspace_validation::pairs::unique_name;

use super::super::args::{SceneArgs, SceneOptions, crop, size};
use super::super::say;
use super::super::scene::{Prepared, prepare_with};

/// All scenes.
pub(super) struct Scenes {
    pub(super) setups: Vec<Setup>,
    /// As they were asked for.
    pub(super) asked: Vec<String>,
    /// Who was left out, and why.
    pub(super) notes: Vec<String>,
    /// Library scenes as files, while others read them.
    _exports: Vec<TemporaryFolder>,
}

impl Scenes {
    /// Reads scenes, makes integrators, starts other renderers. One that is absent or refuses is
    /// left out with a note.
    pub(super) fn open(registry: &Registry, config: &Config, verbose: bool) -> Result<Self> {
        let mut specs = Vec::new();
        for text in &config.integrators {
            specs.push(text.parse::<Spec>()?);
        }
        if specs.is_empty() {
            for (name, _) in registry.list() {
                specs.push(name.parse()?);
            }
        }
        let peers = specs.iter().any(|s| is_peer(&s.name));
        let mut scenes = Scenes {
            setups: Vec::new(),
            asked: Vec::new(),
            notes: Vec::new(),
            _exports: Vec::new(),
        };
        for scene in &config.scenes {
            let args = arguments(scene, config)?;
            let prepared = prepare_with(&args, verbose, peers)?;
            if peers && args.crop.is_some() {
                bail!("{}: other renderers have no crop window here", args.scene);
            }
            scenes.add(registry, &specs, &args, prepared)?;
        }
        let all = scenes.setups.iter().flat_map(|s| s.contestants.iter().map(|(name, _)| name));
        let known: Vec<&str> = all.map(String::as_str).collect();
        if let Some(baseline) = config.baseline.as_deref().filter(|b| !known.contains(b)) {
            bail!("the baseline {baseline} is none of {}", known.join(", "));
        }
        Ok(scenes)
    }

    fn add(
        &mut self,
        registry: &Registry,
        specs: &[Spec],
        args: &SceneArgs,
        prepared: Prepared,
    ) -> Result<()> {
        let name = unique_name(prepared.name.clone(), |n| self.setups.iter().any(|s| s.name == n));
        let mut contestants: Vec<(String, Contestant)> = Vec::new();
        let mut file = None;
        for spec in specs {
            let contestant = if is_peer(&spec.name) {
                let file = match &file {
                    Some(file) => file,
                    None => file.insert(self.file(args)?),
                };
                match open_peer(spec, args, &prepared, file) {
                    Ok(peer) => Contestant::Peer(Box::new(peer)),
                    Err(e) => {
                        let note = format!("{name}: left out: {e}");
                        say(&note);
                        self.notes.push(note);
                        continue;
                    }
                }
            } else {
                Contestant::Own(prepared.integrator(registry, Some(spec))?)
            };
            let own = match &contestant {
                Contestant::Own(integrator) => integrator.spec(),
                Contestant::Peer(peer) => peer.spec().to_owned(),
            };
            contestants
                .push((unique_name(own, |n| contestants.iter().any(|c| c.0 == n)), contestant));
        }
        if contestants.is_empty() {
            bail!("{name}: nobody is left to render it");
        }
        let Prepared { scene, hash, key, .. } = prepared;
        self.asked.push(args.scene.clone());
        self.setups.push(Setup { name, hash, key, scene, contestants });
        Ok(())
    }

    /// The scene as a file that other renderers can read.
    fn file(&mut self, args: &SceneArgs) -> Result<PathBuf> {
        let Some(scene) = library::find(&args.scene) else {
            return Path::new(&args.scene)
                .canonicalize()
                .with_context(|| format!("{}: no such file", args.scene));
        };
        let folder = temporary_folder("pathspace-scene-")?;
        let files = scene.export(&folder.path().join(&args.scene))?;
        self._exports.push(folder);
        let xml = files.into_iter().find(|f| f.extension().is_some_and(|e| e == "xml"));
        xml.ok_or_else(|| anyhow!("{}: no scene file in the export", args.scene))
    }
}

fn open_peer(
    spec: &Spec,
    args: &SceneArgs,
    prepared: &Prepared,
    file: &Path,
) -> Result<Peer, PeerError> {
    let film = prepared.scene.film();
    let place = Place {
        file: file.to_path_buf(),
        define: args.define.iter().cloned().collect(),
        width: film.width,
        height: film.height,
        max_depth: prepared.defaults.rules.max_length,
    };
    Peer::open(&spec.name, &spec.pairs().collect::<Vec<_>>(), place)
}

/// A scene with its own changes, and those of the experiment where it has none.
fn arguments(scene: &SceneConfig, config: &Config) -> Result<SceneArgs> {
    let (name, own_size, own_crop, own_depth, define) = match scene {
        SceneConfig::Name(name) => (name, None, None, None, Vec::new()),
        SceneConfig::Changed(ChangedScene { scene, size, crop, max_depth, define }) => {
            let define = define.clone().into_iter().collect();
            (scene, size.as_deref(), crop.as_deref(), *max_depth, define)
        }
    };
    let bad = |key: &'static str| move |e: String| anyhow!("{key}: {e}");
    let max_depth = own_depth.or(config.max_depth);
    if max_depth.is_some_and(|d| !(-1..=16383).contains(&d)) {
        bail!("max_depth: expected a number from -1 to 16383");
    }
    let film = own_size.or(config.size.as_deref());
    Ok(SceneArgs {
        strict: false,
        sensor: 0,
        scene: name.clone(),
        options: SceneOptions {
            size: film.map(size).transpose().map_err(bad("size"))?,
            crop: own_crop.map(crop).transpose().map_err(bad("crop"))?,
            max_depth,
            define,
            threads: config.threads,
            seed: config.seed,
        },
    })
}
