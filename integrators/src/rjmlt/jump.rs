//! The jump from one technique to another.

use pathspace_core::Scene;
use pathspace_core::film::{Contribution, RecordingSink};
use pathspace_core::path::{Path, PathRecord, Technique, Vertex};
use pathspace_core::random::{PrimarySample, RandomStream, Stream};
use pathspace_core::walk::Layout;

use crate::bdpt::Numbers;
use crate::mmlt::Multiplexed;
use crate::primary::{Integrand, Jump, Moving, PrimaryPoint, PrimaryVector, Reading};

/// Distance in the normalised scene (or between directions of emitters at infinity) up to which a
/// vertex counts as the same.
pub const TOLERANCE: f32 = 1e-4;

/// The same as a part of the shorter edge at the vertex: in corners edges are as short as rounding
/// is coarse.
pub const RELATIVE: f32 = 0.01;

/// A path as a technique made it.
struct Made {
    contribution: Contribution,
    record: PathRecord,
}

/// Proposes the numbers `y` of another technique for the path of x.
pub(super) fn jump(
    techniques: &Multiplexed,
    scene: &Scene,
    x: &mut PrimaryPoint,
    y: &mut PrimaryVector,
    u: &mut RandomStream,
) -> Jump {
    let stays = |c: &Contribution| f64::from(c.weight);
    let leaves = u.next() as f64 >= x.contributions.first().map_or(1.0, stays);
    if !leaves {
        return Jump::Stays;
    }
    let here = make(techniques, scene, x.part, &mut Reading::new(&x.vector));
    let Some(here) = here else { return Jump::Lost };
    let weights = techniques.bdpt.weights(scene, &here.record.path);
    let from = here.record.technique;
    let Some(to) = pick(&weights, from, u.next().into()) else { return Jump::Stays };
    let there = transfer(techniques, scene, &here, &mut x.vector, to, y, u);
    let Some(there) = there else { return Jump::Lost };
    // The way back must be open, and is judged by the path that was found.
    let mut again = PrimaryVector::default();
    if transfer(techniques, scene, &there, y, from, &mut again, u).is_none() {
        return Jump::Lost;
    }
    let weights_there = techniques.bdpt.weights(scene, &there.record.path);
    let back = (1.0 - stays(&there.contribution)) * share(&weights_there, to, from);
    let forth = (1.0 - stays(&here.contribution)) * share(&weights, from, to);
    let ln_jacobian = there.record.ln_pdf - here.record.ln_pdf;
    let factor = ln_jacobian.exp() * back / forth;
    if !factor.is_finite() {
        return Jump::Lost;
    }
    Jump::To { contribution: there.contribution, factor }
}

/// w_j/Σ_{l≠i} w_l: the probability of j among all but i.
fn share(weights: &[f64], from: Technique, to: Technique) -> f64 {
    let others = weights.iter().enumerate().filter(|(s, _)| *s != from.s).map(|(_, w)| w);
    // The sum, not 1 − w: it may be small.
    let sum: f64 = others.sum();
    if sum > 0.0 { weights[to.s] / sum } else { 0.0 }
}

/// One of the other techniques; none where no other one makes the path.
fn pick(weights: &[f64], from: Technique, mut u: f64) -> Option<Technique> {
    let k = weights.len() - 2;
    let mut last = None;
    for s in (0..weights.len()).filter(|&s| s != from.s && weights[s] > 0.0) {
        let technique = Technique::new(s, k + 1 - s);
        last = Some(technique);
        u -= share(weights, from, technique);
        if u < 0.0 {
            break;
        }
    }
    last
}

/// Makes the path of `here`, whose numbers are `x`, by technique `to`, and leaves its numbers in
/// `y`.
fn transfer(
    techniques: &Multiplexed,
    scene: &Scene,
    here: &Made,
    x: &mut PrimaryVector,
    to: Technique,
    y: &mut PrimaryVector,
    u: &mut RandomStream,
) -> Option<Made> {
    let (bdpt, path) = (&techniques.bdpt, &here.record.path);
    let mut numbers = Numbers::default();
    let shared = Layout::shared(scene, here.record.technique, to);
    for stream in STREAMS {
        for index in 0..shared[stream as usize] {
            numbers.push(stream, &[x.get(stream, index)?]);
        }
    }
    let k = path.length() as u16;
    let selector = Multiplexed::select(scene, k, to.s, u.next())?;
    numbers.push(Multiplexed::SELECTOR.0, &[selector]);
    bdpt.invert_technique(scene, path, here.contribution.film, to, &mut numbers, u)?;
    // What the technique reads beside those is uniform and new.
    let mut moving = Moving::large(x, y, u);
    for stream in STREAMS {
        for (index, &value) in numbers.stream(stream).iter().enumerate() {
            moving.set(stream, index, value);
        }
    }
    let there = make(techniques, scene, k, &mut moving)?;
    is_near(&there.record.path, path).then_some(there)
}

const STREAMS: [Stream; Stream::COUNT] =
    [Stream::Sensor, Stream::Light, Stream::Lens, Stream::Connection];

/// The path that numbers make.
fn make<U: PrimarySample>(
    techniques: &Multiplexed,
    scene: &Scene,
    k: u16,
    u: &mut U,
) -> Option<Made> {
    let mut sink = RecordingSink::default();
    techniques.evaluate(scene, k, u, &mut sink);
    let (contribution, record) = (sink.contributions.pop()?, sink.records.pop()?);
    Some(Made { contribution, record })
}

/// Whether all vertices of `b` are those of `a` but for rounding.
fn is_near(a: &Path, b: &Path) -> bool {
    let edge = |i: usize| match (a.vertices[i].position(), a.vertices[i + 1].position()) {
        (Some(p), Some(q)) => p.distance(q),
        _ => f32::INFINITY,
    };
    let k = a.length();
    let near = |i: usize| {
        let (v, w) = (&a.vertices[i], &b.vertices[i]);
        let distance = match (v, w) {
            (Vertex::InfiniteEmitter { to: v, .. }, Vertex::InfiniteEmitter { to: w, .. }) => {
                v.distance(*w)
            }
            _ => match (v.position(), w.position()) {
                (Some(v), Some(w)) => v.distance(w),
                _ => return false,
            },
        };
        let before = if i > 0 { edge(i - 1) } else { f32::INFINITY };
        let after = if i < k { edge(i) } else { f32::INFINITY };
        let most = TOLERANCE.min(RELATIVE * before.min(after));
        v.emitter() == w.emitter() && a.events[i] == b.events[i] && distance <= most
    };
    b.length() == k && (0..=k).all(near)
}
