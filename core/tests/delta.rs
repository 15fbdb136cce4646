//! Densities of delta events: the ratio of a density from the light to one from the sensor across a
//! refraction or reflection against Jacobians by finite differences, where shading normals vary
//! over the surface.

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};
use pathspace_core::bsdf::{Component, Event, TransportMode};
use pathspace_core::description::*;
use pathspace_core::math::Ray;
use pathspace_core::scene::SurfacePoint;
use pathspace_core::{Rgb, Scene};

const CORNERS: [DVec2; 3] = [DVec2::new(-3.0, -2.0), DVec2::new(3.0, -2.0), DVec2::new(0.0, 4.0)];
/// Shading normals at the corners, before normalisation.
const NORMALS: [DVec3; 3] =
    [DVec3::new(-0.3, 0.1, 1.0), DVec3::new(0.2, -0.25, 1.0), DVec3::new(0.1, 0.35, 1.0)];
const IOR: f64 = 1.7;

/// A triangle at z = 0 with those normals.
pub fn scene(kind: MaterialKind) -> Scene {
    let mesh = MeshData {
        positions: CORNERS.iter().map(|c| c.extend(0.0).as_vec3().to_array()).collect(),
        normals: NORMALS.iter().map(|n| n.normalize().as_vec3().to_array()).collect(),
        triangles: vec![[0, 1, 2]],
        ..MeshData::default()
    };
    let shape = ShapeDescription {
        name: "boundary".into(),
        geometry: ShapeGeometry::Mesh(Arc::new(mesh)),
        to_world: glam::DAffine3::IDENTITY,
        flip_normals: false,
        material: 0,
        emission: None,
    };
    let materials = vec![MaterialDescription { name: "delta".into(), kind }];
    Scene::new(&SceneDescription { shapes: vec![shape], materials, ..SceneDescription::default() })
        .unwrap()
}

/// n_s at a point of the plane.
fn normal(x: DVec2) -> DVec3 {
    let [a, b, c] = CORNERS;
    let area = (b - a).perp_dot(c - a);
    let (w1, w2) = ((x - a).perp_dot(c - a) / area, (b - a).perp_dot(x - a) / area);
    let n = NORMALS.map(DVec3::normalize);
    (n[0] * (1.0 - w1 - w2) + n[1] * w1 + n[2] * w2).normalize()
}

/// Where a ray from `x` over the point `at` of the plane meets the plane at height `z`.
fn follow(x: DVec3, at: DVec2, z: f64, transmit: bool) -> DVec2 {
    let x1 = at.extend(0.0);
    let (w, n) = ((x - x1).normalize(), normal(at));
    let out = if transmit {
        let (n, eta) = if w.dot(n) > 0.0 { (n, 1.0 / IOR) } else { (-n, IOR) };
        let cos = w.dot(n);
        let cos_t = (1.0 - eta * eta * (1.0 - cos * cos)).sqrt();
        n * (eta * cos - cos_t) - w * eta
    } else {
        n * (2.0 * w.dot(n)) - w
    };
    (x1 + out * ((z - x1.z) / out.z)).truncate()
}

/// |∂(point at height z)/∂(point of the boundary)| for a ray from `x`.
fn jacobian(x: DVec3, at: DVec2, z: f64, transmit: bool) -> f64 {
    let h = 1e-5;
    let column =
        |d: DVec2| (follow(x, at + d, z, transmit) - follow(x, at - d, z, transmit)) / (2.0 * h);
    column(DVec2::X * h).perp_dot(column(DVec2::Y * h)).abs()
}

/// D cos θ/d² |∂x/∂x₁| of the event that takes `from` to `to`, where D is the density that the
/// scene gives it: the share of the common delta function, times its mass.
fn share(
    scene: &Scene,
    point: &SurfacePoint,
    from: DVec3,
    to: DVec3,
    at: DVec2,
    mode: TransportMode,
) -> f64 {
    let x1 = at.extend(0.0);
    let (wo, wi) = ((from - x1).normalize().as_vec3(), (to - x1).normalize().as_vec3());
    let (density, _) =
        scene.scatter_event(point, wo, wi, mode, event(wo, wi)).expect("the specular event");
    let d = to - x1;
    let cos = d.normalize().z.abs();
    density.value() * cos / d.length_squared() * jacobian(from, at, to.z, from.z * to.z < 0.0)
}

/// Reflection or refraction at the plane.
fn event(wo: Vec3, wi: Vec3) -> Event {
    let same = wo.z * wi.z > 0.0;
    Event::Specular(if same { Component::REFLECTION } else { Component::TRANSMISSION })
}

fn check(kind: MaterialKind, transmit: bool, from_below: bool) {
    let scene = scene(kind);
    let n = scene.normalisation();
    let side = if from_below { -1.0 } else { 1.0 };
    for (i, at) in
        [DVec2::new(0.5, -1.2), DVec2::new(0.9, 0.2), DVec2::new(-0.7, 0.4)].iter().enumerate()
    {
        let x0 = DVec3::new(at.x - 0.3, at.y + 0.2, 1.1 * side);
        let height = if transmit { -0.9 * side } else { 0.9 * side };
        let x2 = follow(x0, *at, height, transmit).extend(height);
        let above = ((at.extend(0.5) - n.center) * n.scale).as_vec3();
        let point = scene.intersect(&Ray::new(above, -Vec3::Z)).expect("the boundary");
        let shading = point.frame.n.as_dvec3();
        assert!(shading.distance(normal(*at)) < 1e-5 && shading.z < 0.9995, "{shading}");
        let forward = share(&scene, &point, x0, x2, *at, TransportMode::Importance);
        let backward = share(&scene, &point, x2, x0, *at, TransportMode::Radiance);
        let ratio = forward / backward;
        assert!((ratio - 1.0).abs() < 1e-4, "{transmit} {from_below} {i}: {ratio}");
    }
}

fn glass() -> MaterialKind {
    MaterialKind::Dielectric {
        int_ior: IOR as f32,
        ext_ior: 1.0,
        specular_reflectance: Rgb::WHITE,
        specular_transmittance: Rgb::WHITE,
    }
}

#[test]
fn refraction_into_and_out_of_glass() {
    check(glass(), true, false);
    check(glass(), true, true);
}

#[test]
fn reflection_by_glass() {
    check(glass(), false, false);
}

#[test]
fn reflection_by_a_conductor() {
    let (eta, k) = (Rgb::grey(0.4), Rgb::grey(2.9));
    check(MaterialKind::Conductor { eta, k, specular_reflectance: Rgb::WHITE }, false, false);
}

#[test]
fn value_and_density_make_the_weight_of_both_walks() {
    // f̄ |ω·n_g|/p of the whole-path functions is the weight that the walks multiply with, in both
    // modes.
    let scene = scene(glass());
    let point = scene.intersect(&Ray::new(Vec3::new(0.05, 0.0, 0.3), -Vec3::Z)).unwrap();
    for mode in [TransportMode::Radiance, TransportMode::Importance] {
        for (i, side) in [1.0_f32, -1.0].into_iter().enumerate() {
            for lobe in [0.001, 0.999] {
                let from = Vec3::new(0.3, 0.2 - 0.1 * i as f32, side).normalize();
                let s = scene.sample_scatter(&point, from, mode, lobe, [0.5, 0.5]).unwrap();
                let (density, survival) =
                    scene.scatter_event(&point, from, s.direction, mode, s.event).unwrap();
                let (light, sensor) = match mode {
                    TransportMode::Radiance => (s.direction, from),
                    TransportMode::Importance => (from, s.direction),
                };
                let value = scene.scatter_value(&point, light, sensor, s.event);
                let cos = point.n_g.dot(s.direction).abs() as f64;
                let weight = value.g as f64 * cos / density.value();
                assert!((weight / s.weight.g as f64 - 1.0).abs() < 1e-4, "{mode:?} {side} {lobe}");
                assert!((density.value() / s.pdf.value() - 1.0).abs() < 1e-4);
                assert!((survival.value() - s.survival.value()).abs() < 1e-4);
            }
        }
    }
}
