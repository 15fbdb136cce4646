//! The harness on an integrator whose error is known: a furnace of radiance 1 with exponential
//! noise, whose variance is 1.

use std::ops::ControlFlow;
use std::sync::Arc;

use pathspace_core::Scene as CoreScene;
use pathspace_core::film::{Contribution, Sink};
use pathspace_core::integrator::{
    Integrator, IntegratorError, MonteCarlo, PathEstimator, Run, State,
};
use pathspace_core::random::PrimarySample;
use pathspace_validation::exact;
use pathspace_validation::stats::{Verdict, binomial_interval};

use super::*;
use crate::budget::Budget;
use crate::experiment::{Contestant, Key};
use crate::results::Point;

const SIZE: u32 = 8;

/// Every sample is −ln u + `bias` in its pixel, times a rare 1/`rarity` where that is not 1.
struct Noise {
    bias: f32,
    rarity: f32,
}

impl PathEstimator for Noise {
    fn estimate<U: PrimarySample, S: Sink>(
        &self,
        scene: &CoreScene,
        pixel: Option<[u32; 2]>,
        u: &mut U,
        sink: &mut S,
    ) {
        let crop = scene.film().crop;
        let [x, y] = pixel.unwrap_or([crop.x, crop.y]);
        let hit = u.next() < self.rarity;
        let value = -(1.0 - u.next()).ln() + self.bias;
        sink.add(Contribution {
            film: glam::Vec2::new(x as f32 + 0.5, y as f32 + 0.5),
            value: pathspace_core::color::Rgb::grey(if hit { value / self.rarity } else { 0.0 }),
            weight: 1.0,
            s: 0,
            t: 2,
            emitter: 0,
            families: Families::S0,
        });
    }
}

struct Known {
    bias: f32,
    rarity: f32,
}

impl Integrator for Known {
    fn name(&self) -> &str {
        "known"
    }

    fn families(&self, _: &CoreScene) -> Families {
        Families::ALL
    }

    fn resume(
        &self,
        scene: Arc<CoreScene>,
        seed: u64,
        state: &State,
    ) -> Result<Box<dyn Run>, IntegratorError> {
        let noise = Noise { bias: self.bias, rarity: self.rarity };
        Ok(Box::new(MonteCarlo::new(Arc::new(noise), scene, seed, state.step)))
    }
}

fn known(bias: f32, rarity: f32) -> Contestant {
    Contestant::Own(Box::new(Known { bias, rarity }))
}

fn plan(contestants: Vec<Contestant>, budgets: Vec<Budget>, replicates: u32, seed: u64) -> Plan {
    let mut description = exact::enclosures::furnace("furnace", 1.0).description;
    description.film = pathspace_core::description::FilmDescription::new(SIZE, SIZE);
    let scene = Arc::new(CoreScene::new(&description).unwrap());
    let contestants: Vec<_> =
        contestants.into_iter().enumerate().map(|(i, c)| (format!("known#{i}"), c)).collect();
    let name = "furnace".to_owned();
    let (hash, key) = (String::new(), String::new());
    let setups = vec![Setup { name, hash, key, scene, contestants }];
    Plan { setups, budgets, replicates, seed, threads: 1, failures: Vec::new() }
}

/// Runs a plan and analyses its scene, with a second a sample, because seconds of the clock are as
/// many as other programs let them be.
fn results(plan: &mut Plan, questions: &Questions) -> SceneResults {
    let store = Store::temporary().unwrap();
    assert!(plan.run(&store, &mut |_| ControlFlow::Continue(())).unwrap());
    for budget in &plan.budgets {
        for (name, _) in &plan.setups[0].contestants {
            for replicate in 0..plan.replicates {
                let (seed, threads) = (plan.seed, plan.threads);
                let budget = &budget.words();
                let key = Key { scene: "", integrator: name, budget, replicate, seed, threads };
                let mut cell = store.get(&key).unwrap();
                cell.seconds = cell.spp;
                store.put(&key, &cell).unwrap();
            }
        }
    }
    analyse(plan, &store, &plan.setups[0], None, questions).unwrap().results
}

#[test]
fn known_variance_gives_slope_minus_one_and_the_known_error() {
    let budgets: Vec<Budget> = (0..6).map(|j| Budget::Samples(1 << j)).collect();
    let mut plan = plan(vec![known(0.0, 1.0)], budgets, 24, 1);
    let questions = Questions { target_error: Some(0.1), ..Questions::default() };
    let results = results(&mut plan, &questions);
    let method = &results.methods[0];
    let slope = method.slope.unwrap();
    assert!(slope.low <= -1.0 && -1.0 <= slope.high, "{slope:?}");
    assert!(slope.high - slope.low < 0.1, "{slope:?}");
    for p in &method.points {
        let mse = 1.0 / p.budget.value;
        assert!(p.mse.low <= mse && mse <= p.mse.high, "{p:?}");
        // At 1 spp the error of a pixel has variance 8, so exp(2·2.07·√(8/64/24)) = 1.35 is
        // expected, and less at more.
        assert!(p.mse.high / p.mse.low < 1.8, "{p:?}");
    }
    // MSE·seconds is 1 at every budget, and relMSE is MSE over 1.01.
    let e = method.efficiency;
    assert!(e.low <= 1.0 && 1.0 <= e.high, "{e:?}");
    let t = method.time_to_error.unwrap();
    let exact = 1.0 / 1.01 / 0.1;
    assert!(t.low <= exact && exact <= t.high && t.high / t.low < 1.4, "{t:?}");
}

#[test]
fn the_same_against_itself_has_ratio_one_inside_its_interval() {
    let runs = 100;
    let mut covered = 0;
    for seed in 0..runs {
        let mut plan =
            plan(vec![known(0.0, 1.0), known(0.0, 1.0)], vec![Budget::Samples(2)], 8, seed);
        let ratio = results(&mut plan, &Questions::default()).methods[1].ratio.clone().unwrap();
        covered += u64::from(ratio.low <= 1.0 && 1.0 <= ratio.high);
    }
    assert!(covered >= 93, "{covered} of {runs}");
    // And not because the interval is too wide.
    let (low, _) = binomial_interval(covered, runs, 0.999).unwrap();
    assert!(low <= 0.95, "{covered} of {runs}");
}

#[test]
fn a_noisier_integrator_has_a_smaller_ratio() {
    // Value −ln u at half of the samples, doubled: variance 3 where the other has 1.
    let contestants = vec![known(0.0, 1.0), known(0.0, 0.5)];
    let mut plan = plan(contestants, vec![Budget::Samples(128)], 16, 5);
    let results = results(&mut plan, &Questions::default());
    let ratio = results.methods[1].ratio.clone().unwrap();
    assert!(ratio.low <= 1.0 / 3.0 && 1.0 / 3.0 <= ratio.high, "{ratio:?}");
    assert!(ratio.high < 0.5 && results.methods[0].ratio.is_none());
    assert_eq!(results.pairs[0].judgement.verdict, Verdict::Agree);
}

#[test]
fn a_biased_integrator_differs() {
    let contestants = vec![known(0.0, 1.0), known(0.1, 1.0)];
    let mut plan = plan(contestants, vec![Budget::Samples(64)], 16, 6);
    let judgement = results(&mut plan, &Questions::default()).pairs[0].judgement.clone();
    assert_eq!(judgement.verdict, Verdict::Differ, "{judgement:?}");
}

#[test]
fn fireflies_are_told_from_noise() {
    let index = |rarity: f32| -> Point {
        let mut plan = plan(vec![known(0.0, rarity)], vec![Budget::Samples(4)], 16, 7);
        results(&mut plan, &Questions::default()).methods[0].points[0].clone()
    };
    let (noise, fireflies) = (index(1.0), index(2e-4));
    assert!((noise.firefly_index - 1.0).abs() < 0.2, "{noise:?}");
    assert!(fireflies.firefly_index > 2.0, "{fireflies:?}");
}

#[cfg(unix)]
mod peers {
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::peers::{Peer, Place};

    /// Another renderer that hands out images of noise about `mean`, made beforehand: one for each
    /// replicate.
    fn peer(folder: &std::path::Path, mean: f32, techniques: &str) -> Contestant {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(9);
        let n = SIZE as usize;
        for replicate in 0..16 {
            let values: Vec<f32> =
                (0..n * n).map(|_| mean + random.random_range(-0.1..0.1)).collect();
            let image = folder.join(format!("{replicate}.exr"));
            let grey = |x, y| (values[y * n + x], values[y * n + x], values[y * n + x]);
            exr::prelude::write_rgb_file(&image, n, n, grey).unwrap();
        }
        let script = folder.join("adapter.sh");
        let text = format!(
            r#"#!/bin/sh
while read -r line; do
    case "$line" in
    *'"ask":"describe"'*) echo '{{"version": "noise", "techniques": {techniques}}}' ;;
    *)
        replicate=$(echo "$line" | sed 's/.*"replicate":\([0-9]*\).*/\1/')
        cp "{folder}/$replicate.exr" "$(echo "$line" | sed 's/.*"output":"\([^"]*\)".*/\1/')"
        echo '{{"seconds": 0.001, "spp": 4, "startup_seconds": 3}}' ;;
    esac
done
"#,
            folder = folder.display()
        );
        fs::write(&script, text).unwrap();
        fs::set_permissions(&script, fs::Permissions::from_mode(0o755)).unwrap();
        let place = Place {
            file: "scene.xml".into(),
            define: Default::default(),
            width: SIZE,
            height: SIZE,
            max_depth: None,
        };
        let options = [("command", script.to_str().unwrap())];
        Contestant::Peer(Box::new(Peer::open("external", &options, place).unwrap()))
    }

    fn verdict(mean: f32, techniques: &str) -> (Verdict, SceneResults) {
        let folder = tempfile::tempdir().unwrap();
        let contestants = vec![known(0.0, 1.0), peer(folder.path(), mean, techniques)];
        let mut plan = plan(contestants, vec![Budget::Samples(64)], 16, 8);
        let results = results(&mut plan, &Questions::default());
        (results.pairs[0].judgement.verdict, results)
    }

    #[test]
    fn another_renderer_that_makes_the_same_image_agrees() {
        let (verdict, results) = verdict(1.0, r#"["s0", "s1"]"#);
        assert_eq!(verdict, Verdict::Agree, "{:?}", results.pairs[0]);
        let method = &results.methods[1];
        assert!(method.external && method.points[0].startup_seconds == 48.0);
        // Its variance is 0.04/12, the other's 1/64.
        assert!((method.points[0].mse.value / (0.04 / 12.0) - 1.0).abs() < 0.2);
        assert!(method.ratio.is_some() && results.pairs[0].judgement.lengths.is_empty());
    }

    #[test]
    fn another_renderer_that_makes_another_image_differs() {
        let (verdict, results) = verdict(1.05, r#"["s0"]"#);
        assert_eq!(verdict, Verdict::Differ);
        assert!(results.pairs[0].judgement.p < 1e-4);
    }

    #[test]
    fn one_that_can_not_make_the_light_is_not_accused() {
        // All light is of paths that only s = 0 makes.
        let (verdict, results) = verdict(0.5, r#"["t1"]"#);
        assert_eq!(verdict, Verdict::Inconclusive, "{:?}", results.pairs[0]);
    }
}
