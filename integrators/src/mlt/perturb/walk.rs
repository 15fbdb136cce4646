//! Walks of perturbations: along the specular components that the unperturbed path took.

use glam::Vec3;
use pathspace_core::Scene;
use pathspace_core::bsdf::{Component, Event, TransportMode};
use pathspace_core::math::Ray;
use pathspace_core::scene::SurfacePoint;

use super::super::path::MltPath;

/// The ray that goes on from `point`, reached from direction `from`, by a specular event; `None`
/// where the surface has no such component there.
pub(super) fn follow(
    scene: &Scene,
    point: &SurfacePoint,
    from: Vec3,
    event: Event,
    mode: TransportMode,
) -> Option<Ray> {
    let Event::Specular(component) = event else { return None };
    let sample = scene.bsdf(point).specular(point.frame.to_local(from), component, mode)?;
    Some(point.spawn(point.frame.to_world(sample.wi)))
}

/// Density per solid angle of the direction `to` of a specular component that is taken for sure,
/// relative to the common delta function: n_to² |ω_to·n_c|, n_c the normal that the component is
/// about.
pub(super) fn sure_density(
    scene: &Scene,
    point: &SurfacePoint,
    to: Vec3,
    component: Component,
) -> f64 {
    let local = point.frame.to_local(to);
    let law = scene.bsdf(point).specular_law(local, component);
    let n = f64::from(law.n);
    n * n * f64::from(law.cos)
}

/// True where the paths have the same length and the same kinds of vertices, specular components
/// included, between x_first and x_last.
pub(in crate::mlt) fn same_kind(x: &MltPath, y: &MltPath, first: usize, last: usize) -> bool {
    x.length() == y.length()
        && (first..=last).all(|i| x.is_specular(i) == y.is_specular(i) && x.event(i) == y.event(i))
}

/// Where a walk hits a surface on which the event of x_i can happen, as far as the side alone
/// tells.
pub(super) fn hit_like(scene: &Scene, ray: &Ray, x: &MltPath, i: usize) -> Option<SurfacePoint> {
    let point = scene.intersect(ray)?;
    let possible = match x.event(i) {
        Event::NonSpecular => scene.is_connectible(&point, -ray.d),
        // Whoever follows the component finds out; f is 0 where it is not there.
        Event::Specular(_) => true,
    };
    possible.then_some(point)
}
