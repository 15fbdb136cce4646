//! The laws of reflection and refraction as constraints, and their Jacobian.

use glam::DVec3;
use pathspace_core::Scene;
use pathspace_core::bsdf::Component;
use pathspace_core::math::Frame;
use pathspace_core::path::Vertex;
use pathspace_core::scene::SurfacePoint;

use super::linear::Matrix;

/// C = 0 for a chain of specular vertices between two ends (Jakob and Marschner 2012, §4.1): per
/// vertex the projection of n_c ω_c + n_l ω_l on the shading plane.
pub(super) struct Constraints {
    /// C₁ … C_n, two numbers each.
    pub values: Vec<f64>,
    /// ∂C_i/∂x_j, steps x_j in orthonormal coordinates of the tangent planes ([`tangents`]).
    pub jacobian: Matrix,
    /// Per vertex, how well `f32` positions and normals can obey the laws.
    rounding: Vec<f64>,
}

/// Accuracy of directions by that of normals.
const NORMALS: f64 = 1e-5;
/// Accuracy of positions in the normalised scene; over the distance to the next vertex it is that
/// of a direction.
const POSITIONS: f64 = 3e-7;

/// Orthonormal tangents of the surface.
pub(super) fn tangents(point: &SurfacePoint) -> [DVec3; 2] {
    let frame = Frame::from_normal(point.n_g);
    [frame.s.as_dvec3(), frame.t.as_dvec3()]
}

/// A direction ω towards a neighbour at `p` and how it turns where the neighbour or the point
/// itself moves.
struct Ray {
    w: DVec3,
    /// 1/distance; 0 at infinity.
    inverse: f64,
}

impl Ray {
    fn new(from: &SurfacePoint, to: Option<DVec3>, direction: DVec3) -> Self {
        match to {
            Some(to) => {
                let d = to - from.p.as_dvec3();
                let length = d.length();
                Ray { w: d / length, inverse: 1.0 / length }
            }
            None => Ray { w: direction, inverse: 0.0 },
        }
    }

    /// dω where the neighbour moves by `d`.
    fn turn(&self, d: DVec3) -> DVec3 {
        (d - self.w * self.w.dot(d)) * self.inverse
    }
}

impl Constraints {
    /// For the chain `points`, from x_b's side, between `b` and `c`.
    pub(super) fn new(
        scene: &Scene,
        b: &SurfacePoint,
        points: &[SurfacePoint],
        components: &[Component],
        c: &Vertex,
    ) -> Constraints {
        let n = points.len();
        let mut values = Vec::with_capacity(2 * n);
        let mut rounding = Vec::with_capacity(n);
        let mut jacobian = Matrix::zero(2 * n);
        let far = match c {
            Vertex::InfiniteEmitter { to, .. } => to.as_dvec3(),
            _ => DVec3::ZERO,
        };
        for (i, (point, &component)) in points.iter().zip(components).enumerate() {
            let before = if i == 0 { b } else { &points[i - 1] };
            let after = match points.get(i + 1) {
                Some(next) => Some(next.p.as_dvec3()),
                None => c.position().map(|p| p.as_dvec3()),
            };
            let to_sensor = Ray::new(point, Some(before.p.as_dvec3()), DVec3::ZERO);
            let to_light = Ray::new(point, after, far);
            let index = |w: DVec3| {
                let local = point.frame.to_local(w.as_vec3());
                f64::from(scene.bsdf(point).relative_ior(local, component))
            };
            let (n_c, n_l) = (index(to_sensor.w), index(to_light.w));
            let half = to_sensor.w * n_c + to_light.w * n_l;
            let plane = [point.frame.s.as_dvec3(), point.frame.t.as_dvec3()];
            let along = half.dot(point.frame.n.as_dvec3());
            rounding.push(NORMALS + POSITIONS * to_sensor.inverse.max(to_light.inverse));
            values.extend(plane.map(|t| t.dot(half)));
            let mut set = |j: usize, column: usize, change: DVec3, tilt: DVec3| {
                for (row, t) in plane.iter().enumerate() {
                    // A tilting plane changes the projection of what stands on it.
                    let value = t.dot(change) - along * t.dot(tilt);
                    jacobian.set(2 * i + row, 2 * j + column, value);
                }
            };
            for (column, d) in tangents(point).into_iter().enumerate() {
                let change = -(to_sensor.turn(d) * n_c + to_light.turn(d) * n_l);
                set(i, column, change, scene.normal_change(point, d));
            }
            if i > 0 {
                for (column, d) in tangents(before).into_iter().enumerate() {
                    set(i - 1, column, to_sensor.turn(d) * n_c, DVec3::ZERO);
                }
            }
            if let Some(next) = points.get(i + 1) {
                for (column, d) in tangents(next).into_iter().enumerate() {
                    set(i + 1, column, to_light.turn(d) * n_l, DVec3::ZERO);
                }
            }
        }
        Constraints { values, jacobian, rounding }
    }

    /// Largest violation, in units of what the rounding of positions and normals may be: 1 where
    /// the laws hold.
    pub(super) fn residual(&self) -> f64 {
        let scaled = self.values.iter().zip(self.rounding.iter().flat_map(|r| [r, r]));
        scaled.fold(0.0, |m, (v, rounding)| (v.abs() / rounding).max(m))
    }
}

/// ln of the density of specular vertices that obey the constraints, relative to their delta
/// functions: ln |det ∂C/∂x|. `None` at a fold of the caustic.
pub(super) fn ln_chain_density(
    scene: &Scene,
    b: &SurfacePoint,
    points: &[SurfacePoint],
    components: &[Component],
    c: &Vertex,
) -> Option<f64> {
    let determinant =
        Constraints::new(scene, b, points, components, c).jacobian.determinant().abs();
    let ln = determinant.ln();
    ln.is_finite().then_some(ln)
}
