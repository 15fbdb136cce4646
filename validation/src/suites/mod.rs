//! Suites: what is validated, with how much work, as values.
//!
//! | Suite | What it holds to what |
//! | --- | --- |
//! | [`Suite::quick`] | every integrator to `bdpt` on a few scenes, and to a few exact answers: for continuous integration |
//! | [`Suite::pairs`] | every integrator to every other one on every scene of the library, per path length and tile |
//! | [`Suite::exact`] | every integrator to every exact answer that it sees |
//! | [`Suite::chains`] | every mutation of the built-in chains to the invariance of its target; random numbers and kernels to their laws |
//! | [`Suite::variants`] | integrators with options that are not the default ones to the default ones and to exact answers |
//! | [`Suite::hard`] | every integrator in other units, far from the origin, and in closed boxes |
//! | [`Suite::all`] | all of the above |
//! | [`Suite::calibration`] | the tests to their levels, by comparisons where nothing is wrong |
//!
//! An integrator takes part by being in the [`Registry`](pathspace_integrators::Registry); nothing
//! here knows one by name.

mod calibration;
mod chains;
mod exact;
mod hard;
mod numbers;
mod run;
mod variants;

pub use calibration::{ALPHA, SLACK};
pub(crate) use exact::check;
pub use hard::{dark_boxes, moved};
pub(crate) use numbers::numbers;
pub use run::{Options, Progress, SuiteError, run};

use crate::validate::Config;

/// A list of things to do, with one level for all of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Suite {
    /// Name on the command line.
    pub name: &'static str,
    /// One sentence.
    pub summary: &'static str,
    /// What it does.
    pub parts: Vec<Part>,
    /// The settings, of which parts set their own budgets.
    pub config: Config,
}

/// One kind of test over many scenes.
#[derive(Clone, Debug, PartialEq)]
pub enum Part {
    /// Pairs of integrators on scenes of the library.
    Pairs {
        /// The integrator, by its name in the registry, that each other one is held to; every one
        /// to every other one where there is none.
        against: Option<&'static str>,
        /// A minimum detectable bias that integrators get no more than a quarter of their rays for
        /// if all are not enough.
        hopeless: Option<f64>,
        /// The scenes; all of the library where empty.
        scenes: &'static [&'static str],
        /// Pixels a side.
        size: u32,
        /// Rays of an integrator on a scene in the first round.
        rays: u64,
        /// Minimum detectable bias of the image that is wished for.
        mdb: f64,
    },
    /// Integrators with options of their own against one integrator, on scenes of the library.
    Variants {
        /// The scenes.
        scenes: &'static [&'static str],
        /// Pixels a side.
        size: u32,
        /// The integrators.
        specs: &'static [&'static str],
        /// What each of them is held to.
        against: &'static str,
        /// Rays of an integrator on a scene in the first round.
        rays: u64,
        /// Minimum detectable bias of the image that is wished for.
        mdb: f64,
    },
    /// Random numbers and kernels.
    Numbers,
    /// Integrators against exact answers.
    Exact {
        /// Names of exact scenes; all where empty.
        scenes: &'static [&'static str],
        /// The integrators; those of the registry where empty.
        specs: &'static [&'static str],
        /// Rays of an integrator on a scene in the first round.
        rays: u64,
        /// Minimum detectable bias that is wished for in every cell.
        mdb: f64,
    },
    /// Mutations of Markov chains.
    Chains {
        /// Scenes of the library.
        scenes: &'static [&'static str],
        /// Bootstrap samples that each test starts from.
        starts: u64,
    },
    /// The rate of false alarms.
    Calibration {
        /// Comparisons of each pair.
        runs: u64,
    },
    /// Scenes in other units, far from the origin, closed boxes.
    Hard {
        /// Rays of an integrator on a scene in the first round.
        rays: u64,
    },
}

impl Suite {
    /// Every suite.
    pub fn list() -> Vec<Suite> {
        vec![
            Suite::quick(),
            Suite::pairs(),
            Suite::exact(),
            Suite::chains(),
            Suite::variants(),
            Suite::hard(),
            Suite::all(),
            Suite::calibration(),
        ]
    }

    /// The suite of this name.
    pub fn find(name: &str) -> Option<Suite> {
        Suite::list().into_iter().find(|s| s.name == name)
    }

    /// The same with `effort` times the work.
    pub fn with_effort(mut self, effort: f64) -> Suite {
        for part in &mut self.parts {
            let (Part::Pairs { rays: work, .. }
            | Part::Variants { rays: work, .. }
            | Part::Exact { rays: work, .. }
            | Part::Hard { rays: work }
            | Part::Chains { starts: work, .. }
            | Part::Calibration { runs: work }) = part
            else {
                continue;
            };
            // `as` saturates.
            *work = (*work as f64 * effort).max(1.0) as u64;
        }
        self
    }

    /// A few scenes that need every part of transport, within three minutes on two processors.
    pub fn quick() -> Suite {
        const SCENES: &[&str] = &["cornell-caustic", "mis-plates", "smooth-shading", "thin-lens"];
        const EXACT: &[&str] = &[
            "concentric spheres",
            "refractive plane",
            "perpendicular rectangles",
            "white corner in a furnace",
            "integrating sphere with both lights",
        ];
        Suite {
            name: "quick",
            summary: "a few scenes and exact answers, for continuous integration",
            parts: vec![
                Part::Pairs {
                    scenes: SCENES,
                    size: 32,
                    rays: 10_000_000,
                    mdb: 0.045,
                    against: Some("bdpt"),
                    hopeless: Some(0.08),
                },
                Part::Exact { scenes: EXACT, specs: &[], rays: 5_000_000, mdb: 0.03 },
                variants::roulette(1_000_000),
                variants::lens(1_000_000),
                Part::Numbers,
            ],
            config: Config::default(),
        }
    }

    /// Every integrator × every scene of the library.
    pub fn pairs() -> Suite {
        Suite {
            name: "pairs",
            summary: "every integrator against every other one on every scene of the library",
            parts: vec![Part::Pairs {
                scenes: &[],
                size: 32,
                rays: 5_000_000,
                mdb: 0.005,
                against: None,
                hopeless: None,
            }],
            config: Config::default(),
        }
    }

    /// Every integrator × every exact scene.
    pub fn exact() -> Suite {
        Suite {
            name: "exact",
            summary: "every integrator against every exact answer that it sees",
            parts: vec![
                Part::Exact { scenes: &[], specs: &[], rays: 5_000_000, mdb: 0.005 },
                variants::roulette(2_000_000),
            ],
            config: Config::default(),
        }
    }

    /// Every mutation, on scenes with glass, with gloss and with a lens.
    pub fn chains() -> Suite {
        const SCENES: &[&str] = &["cornell-caustic", "mis-plates", "thin-lens"];
        Suite {
            name: "chains",
            summary: "every mutation of the built-in Markov chains against the invariance of its target",
            parts: vec![Part::Chains { scenes: SCENES, starts: 100_000 }, Part::Numbers],
            config: Config::default(),
        }
    }

    /// Options that are not the default ones.
    pub fn variants() -> Suite {
        Suite {
            name: "variants",
            summary: "integrators with options of their own against bdpt and exact answers",
            parts: variants::all(1_000_000),
            config: Config::default(),
        }
    }

    /// Units, places and closed boxes.
    pub fn hard() -> Suite {
        Suite {
            name: "hard",
            summary: "every integrator in other units, far from the origin, in closed boxes",
            parts: vec![Part::Hard { rays: 1_000_000 }],
            config: Config::default(),
        }
    }

    /// The tests themselves: false alarms of the first three integrators, each against itself and
    /// the others. A test that alarms just at its level would fail by chance in one of ten cases of
    /// 1000 runs, in one of 300 of 2000.
    pub fn calibration() -> Suite {
        Suite {
            name: "calibration",
            summary: "the rate of false alarms, by comparisons where nothing is wrong",
            parts: vec![Part::Calibration { runs: 2000 }],
            config: Config::default(),
        }
    }

    /// All of the others at their own budgets.
    pub fn all() -> Suite {
        let parts =
            [Suite::pairs(), Suite::exact(), Suite::chains(), Suite::variants(), Suite::hard()];
        let parts = parts.map(|s| s.parts).concat();
        Suite { name: "all", summary: "all of it", parts, config: Config::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::validate::CheckOutcome;
    use pathspace_integrators::Registry;
    use std::ops::ControlFlow;

    #[test]
    fn every_suite_is_found_by_its_name() {
        for suite in ["quick", "pairs", "exact", "chains", "variants", "hard", "all", "calibration"]
        {
            assert!(Suite::find(suite).is_some(), "{suite}");
        }
    }

    /// One case alone, named by the integrators and the scene of a failure, comes out as it does
    /// among the others.
    #[test]
    fn a_calibration_is_replayed_by_the_integrators_it_names() {
        let alarms = |integrators: &[String], scenes: &[&str]| {
            let options = Options {
                integrators: integrators.iter().map(|i| i.parse().unwrap()).collect(),
                scenes: scenes.iter().map(|s| (*s).to_owned()).collect(),
                level: None,
            };
            let suite = Suite::calibration().with_effort(0.001);
            let watch = &mut |_: &Progress<'_>| ControlFlow::Continue(());
            run(&suite, &Registry::builtin(), &options, watch).unwrap().checks
        };
        let both = ["pt".to_owned(), "lt".to_owned()];
        for check in alarms(&both, &["thin-lens"]) {
            let again = alarms(&check.integrators, &["thin-lens"]);
            let same = again.iter().find(|c| c.subject == check.subject).unwrap();
            assert_eq!((&same.reason, same.outcome), (&check.reason, CheckOutcome::Inconclusive));
        }
    }
}
