//! The walk on the manifold: Newton's method on the constraints, every step brought back onto the
//! surfaces by tracing it (Jakob and Marschner 2012, §4.3, with the ends fixed as in Zeltner et al.
//! 2020).

use glam::DVec3;
use pathspace_core::Scene;
use pathspace_core::bsdf::Component;
use pathspace_core::math::Ray;
use pathspace_core::path::Vertex;
use pathspace_core::scene::SurfacePoint;

use super::constraint::{Constraints, tangents};

/// Newton steps at most.
const MAX_STEPS: usize = 20;
/// Shortest part of a Newton step.
const SMALLEST_PART: f64 = 1.0 / 32.0;

/// The chain between `b` and `c` that Newton's method finds from the chain `points`; `None` where
/// it does not converge. A function of its arguments alone.
pub(super) fn walk(
    scene: &Scene,
    b: &SurfacePoint,
    mut points: Vec<SurfacePoint>,
    components: &[Component],
    c: &Vertex,
) -> Option<Vec<SurfacePoint>> {
    // The constraints know the law about n_s; no step leaves the shape, and with it the model.
    let follows = |(p, c): (&SurfacePoint, &Component)| scene.bsdf(p).follows_normal(*c);
    if !points.iter().zip(components).all(follows) {
        return None;
    }
    let mut constraints = Constraints::new(scene, b, &points, components, c);
    let mut traced = false;
    for _ in 0..MAX_STEPS {
        let residual = constraints.residual();
        if !residual.is_finite() {
            return None;
        }
        if residual < 1.0 && traced {
            return Some(points);
        }
        let Constraints { values, jacobian, .. } = constraints;
        let step = jacobian.solve(values.iter().map(|v| -v).collect())?;
        let mut part = 1.0;
        loop {
            if let Some(next) = moved(scene, b, &points, &step, part) {
                let there = Constraints::new(scene, b, &next, components, c);
                // At the accuracy of positions a step may no longer be better.
                if there.residual() < residual || there.residual() < 1.0 {
                    (points, constraints, traced) = (next, there, true);
                    break;
                }
            }
            part *= 0.5;
            if part < SMALLEST_PART {
                return None;
            }
        }
    }
    None
}

/// The points moved along their tangent planes by `part` of `step`, and back onto the same surfaces
/// along the edges of the path.
fn moved(
    scene: &Scene,
    b: &SurfacePoint,
    points: &[SurfacePoint],
    step: &[f64],
    part: f64,
) -> Option<Vec<SurfacePoint>> {
    let mut result: Vec<SurfacePoint> = Vec::with_capacity(points.len());
    for (i, point) in points.iter().enumerate() {
        let [s, t] = tangents(point);
        let to: DVec3 = point.p.as_dvec3() + (s * step[2 * i] + t * step[2 * i + 1]) * part;
        let from = result.last().unwrap_or(b);
        // Aimed from where the ray begins: an offset is not small against the thickness of a glass.
        let o = from.spawn((to - from.p.as_dvec3()).as_vec3()).o;
        let hit =
            scene.intersect(&Ray::new(o, (to - o.as_dvec3()).normalize_or_zero().as_vec3()))?;
        if hit.shape != point.shape {
            return None;
        }
        result.push(hit);
    }
    Some(result)
}
