//! Starts: one path out of a sample of bidirectional path tracing.

use glam::Vec2;
use pathspace_core::Scene;
use pathspace_core::color::Rgb;
use pathspace_core::film::{Contribution, Families, RecordingSink};
use pathspace_core::integrator::{Integrator, PathEstimator};
use pathspace_core::random::{PrimarySample, RandomStream};

use super::path::MltPath;
use crate::bdpt::Bdpt;
use crate::chain::ImageWeight;
use crate::pt::PathTracer;

/// Who makes the starts.
#[derive(Clone, Debug)]
pub enum Seeds {
    /// Bidirectional path tracing: every path of the scene.
    Bdpt(Bdpt),
    /// Path tracing: the paths that end on an emitter or by next-event estimation.
    Pt(PathTracer),
}

impl Seeds {
    /// Families of techniques that make starts. Chains stay on the paths that these can make, else
    /// starts would be missing where chains come to.
    pub(crate) fn families(&self, scene: &Scene) -> Families {
        match self {
            Seeds::Bdpt(bdpt) => bdpt.families(scene),
            Seeds::Pt(pt) => pt.families(scene),
        }
    }

    /// Longest path in edges.
    pub(crate) fn max_length(&self) -> Option<u32> {
        match self {
            Seeds::Bdpt(bdpt) => bdpt.max_length,
            Seeds::Pt(pt) => pt.rules.max_length,
        }
    }

    fn estimate(&self, scene: &Scene, u: &mut RandomStream, sink: &mut RecordingSink) {
        match self {
            Seeds::Bdpt(bdpt) => bdpt.estimate(scene, None, u, sink),
            Seeds::Pt(pt) => pt.estimate(scene, None, u, sink),
        }
    }
}

/// One bootstrap sample: of all paths of a sample of `seeds` one, picked in proportion to the
/// target c_i of its weighted contribution w f/p (luminance times the weight of its place in the
/// image), and W = Σc_i. Then E[W h(x̄)] = E[Σ c_i h(x̄_i)] = ∫ f* h.
///
/// `None` where nothing contributes. A W that is no finite number comes with a path that holds the
/// contribution.
pub(super) fn start(
    scene: &Scene,
    seeds: &Seeds,
    image: &ImageWeight,
    u: &mut RandomStream,
) -> Option<(MltPath, f64)> {
    let mut sink = RecordingSink::default();
    seeds.estimate(scene, u, &mut sink);
    let share = |c: &Contribution| ImageWeight::luminance(c) * image.at(c.film);
    let total: f64 = sink.contributions.iter().map(share).sum();
    let mut x = f64::from(u.next()) * total;
    let mut picked = None;
    for (contribution, record) in sink.contributions.iter().zip(sink.records) {
        let share = share(contribution);
        if share != 0.0 {
            picked = Some(record.path);
            if x < share {
                break;
            }
        }
        x -= share;
    }
    // A path whose own edges deny its specular components (they are as short as rounding) has f =
    // 0: it is none of the space.
    Some((MltPath::new(scene, picked?)?, total))
}

/// f(x̄) as a contribution; `value` per channel.
pub(super) fn contribution(x: &MltPath, value: [f64; 3]) -> Contribution {
    let [r, g, b] = value.map(|v| v as f32);
    Contribution {
        film: x.film(),
        value: Rgb::new(r, g, b),
        weight: 1.0,
        // A state has no technique; it is filed under hitting the emitter, for its length.
        s: 0,
        t: (x.length() + 1) as u16,
        emitter: x.vertices()[0].emitter().unwrap_or(0),
        families: x.families(),
    }
}

/// Stands for f(x̄) where it is no finite number.
pub(crate) fn not_finite(x: &MltPath) -> Contribution {
    Contribution { film: Vec2::ZERO, families: Families::NONE, ..contribution(x, [f64::NAN; 3]) }
}
