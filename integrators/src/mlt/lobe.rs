//! Delta lobes at vertices whose edges are as short as rounding.
//!
//! Core tells a delta lobe by its two directions. Where the next vertex is so near that the offset of the ray's origin turns the edge
//! by more than the tolerance, they no longer fit; the path was made by that lobe all the same. Then the lobe's own direction
//! stands for that of the edge. Whoever joins two subpaths must see to it that no delta vertex is at the joint.

use glam::Vec3;
use pathspace_core::Scene;
use pathspace_core::bsdf::{ScatterEvent, TransportMode};
use pathspace_core::color::Rgb;
use pathspace_core::measure::{Density, SolidAngle};
use pathspace_core::scene::SurfacePoint;

/// The largest number of a [`pathspace_core::random::PrimarySample`].
const ALMOST_ONE: f32 = 1.0 - 1.0 / 16_777_216.0;

/// The direction of the delta lobe that takes `from` to the other side of the surface or back; `None` where there is no such lobe (total
/// reflection, a surface that spreads).
pub(super) fn direction(
    scene: &Scene,
    point: &SurfacePoint,
    from: Vec3,
    wanted: ScatterEvent,
    mode: TransportMode,
) -> Option<Vec3> {
    let lobe = match wanted {
        ScatterEvent::Reflection => 0.0,
        ScatterEvent::Transmission => ALMOST_ONE,
    };
    let wo = point.frame.to_local(from);
    let sample = scene.bsdf(point).sample(wo, lobe, [0.0; 2], mode)?;
    let taken = sample.is_delta() && sample.event == wanted;
    taken.then(|| point.frame.to_world(sample.wi))
}

/// The direction of the lobe that leads from `from` to the side of `to`.
fn nearest(
    scene: &Scene,
    point: &SurfacePoint,
    from: Vec3,
    to: Vec3,
    mode: TransportMode,
) -> Option<Vec3> {
    let n = point.frame.n;
    let same = (n.dot(from) > 0.0) == (n.dot(to) > 0.0);
    let event = if same { ScatterEvent::Reflection } else { ScatterEvent::Transmission };
    direction(scene, point, from, event, mode)
}

/// f̄ of a vertex of a path that is known to scatter there.
pub(super) fn value(scene: &Scene, point: &SurfacePoint, to_light: Vec3, to_sensor: Vec3) -> Rgb {
    let value = scene.scatter_value(point, to_light, to_sensor);
    if !value.is_black() || !scene.is_delta_at(point, to_sensor) {
        return value;
    }
    match nearest(scene, point, to_sensor, to_light, TransportMode::Radiance) {
        Some(lobe) => scene.scatter_value(point, lobe, to_sensor),
        None => value,
    }
}

/// Density of the step from `from` to `to` of a path that is known to go that way.
pub(super) fn density(
    scene: &Scene,
    point: &SurfacePoint,
    from: Vec3,
    to: Vec3,
    mode: TransportMode,
) -> Option<Density<SolidAngle>> {
    if let Some((pdf, _)) = scene.scatter_event(point, from, to, mode) {
        return Some(pdf);
    }
    if !scene.is_delta_at(point, from) {
        return None;
    }
    let lobe = nearest(scene, point, from, to, mode)?;
    scene.scatter_event(point, from, lobe, mode).map(|(pdf, _)| pdf)
}
