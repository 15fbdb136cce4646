//! Starts: one path out of a sample of bidirectional path tracing.

use glam::Vec2;
use pathspace_core::Scene;
use pathspace_core::color::{Rgb, luminance};
use pathspace_core::film::{Contribution, Families, RecordingSink};
use pathspace_core::integrator::PathEstimator;
use pathspace_core::random::{PrimarySample, RandomStream};

use super::path::MltPath;
use crate::bdpt::Bdpt;

/// One bootstrap sample: of all paths of a sample of `bdpt` one, picked in proportion to the luminance c_i of its weighted contribution
/// w f/p, and W = Σc_i. Then E[W h(x̄)] = E[Σ c_i h(x̄_i)] = ∫ f* h.
///
/// `None` where nothing contributes. A W that is no finite number comes with a path that holds the contribution.
pub(super) fn start(scene: &Scene, bdpt: &Bdpt, u: &mut RandomStream) -> Option<(MltPath, f64)> {
    let mut sink = RecordingSink::default();
    bdpt.estimate(scene, None, u, &mut sink);
    let share = |c: &Contribution| luminance(&c.value.to_array().map(f64::from));
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
    // A path whose own edges deny its delta lobes (they are as short as rounding) has f = 0: it is none of the space.
    Some((MltPath::new(scene, picked?.vertices)?, total))
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
pub(super) fn not_finite(x: &MltPath) -> Contribution {
    Contribution { film: Vec2::ZERO, families: Families::NONE, ..contribution(x, [f64::NAN; 3]) }
}
