//! Walks of perturbations: along the delta lobes that the unperturbed path took.

use glam::Vec3;
use pathspace_core::Scene;
use pathspace_core::bsdf::{ScatterEvent, TransportMode};
use pathspace_core::math::Ray;
use pathspace_core::scene::SurfacePoint;

use super::super::lobe;
use super::super::path::MltPath;

/// The ray that goes on from `point`, reached from direction `from`, by the delta lobe of `event`; `None` where there is no such lobe.
pub(super) fn follow(
    scene: &Scene,
    point: &SurfacePoint,
    from: Vec3,
    event: ScatterEvent,
    mode: TransportMode,
) -> Option<Ray> {
    lobe::direction(scene, point, from, event, mode).map(|d| point.spawn(d))
}

/// Density per solid angle of the direction `to` of a delta lobe that is taken for sure, relative to the common delta function:
/// n_to² |ω_to·n_s|.
pub(super) fn sure_lobe_density(scene: &Scene, point: &SurfacePoint, to: Vec3) -> f64 {
    let local = point.frame.to_local(to);
    let n = f64::from(scene.bsdf(point).relative_ior(local));
    n * n * f64::from(local.z.abs())
}

/// True where the paths have the same length and the same kinds of vertices, delta lobes included, between x_first and x_last.
pub(in crate::mlt) fn same_kind(x: &MltPath, y: &MltPath, first: usize, last: usize) -> bool {
    x.length() == y.length()
        && (first..=last).all(|i| {
            let inner = i > 0 && i < x.length();
            x.is_delta(i) == y.is_delta(i)
                && (!inner || !x.is_delta(i) || x.delta_event(i) == y.delta_event(i))
        })
}

/// Where a walk hits a surface of the kind of x_i: a delta vertex or one that spreads.
pub(super) fn hit_like(scene: &Scene, ray: &Ray, x: &MltPath, i: usize) -> Option<SurfacePoint> {
    let point = scene.intersect(ray)?;
    (scene.is_delta_at(&point, -ray.d) == x.is_delta(i)).then_some(point)
}
